"""Several drones in one scene: which objects the names in each drone's script refer to."""

from typing import ClassVar

import numpy as np
import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.scripting import load
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import SceneServices, ScriptContext
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_sim, make_sim_ros
from drone_sim.scripting.api.registry import CHILD
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.time_limit import TimeLimit

PARTS = ("Drone", "Quadricopter_base", "Quadricopter_propeller1", "Quadricopter_propeller_respondable1")


class Scene(ScriptContext):
    def __init__(self, shown=True):
        clock, objects = Clock(0.05), ObjectTree()
        measured = {"objects": objects, "velocities": VelocityMeter(objects, clock)}
        super().__init__(clock=clock, gravity=-9.81, drawings=Drawings(shown), windows=Windows(), **measured)
        self.objects.add("Floor", also=("ResizableFloor_5_25",))


class Drone:
    """A test double for `Host`."""

    sensors: ClassVar[dict] = {}
    script_type = CHILD

    def __init__(self, scene, suffix="", own=None, also=()):
        self.context = scene
        self.own_script, base, propeller, respondable, *others = (f"{name}{suffix}" for name in (*PARTS, *also))
        add = scene.objects.add
        self.handles = [
            add(self.own_script, alias="Quadcopter", also=(f"Quadricopter{suffix}",)),
            add(base, self.own_script, frames.from_rpy((0, 0, -0.01), (0, 0, 0)), alias="base"),
            add(propeller, self.own_script, alias="propeller"),
            add(respondable, propeller, alias="respondable"),
            *(add(name, self.own_script) for name in others),
        ]
        scene.objects[self.handles[0]].is_model = True
        self.script_parameters = {self.own_script: {"gain": 2.0, **(own or {})}, respondable: {"particleVelocity": 0.0}}
        for name, parameters in self.script_parameters.items():
            scene.scripts.add(name, parameters, is_law=name != self.own_script)
        self.forces = []
        self.bus = MessageBus(self.own_script)

    @property
    def parameters(self):
        return self.script_parameters[self.own_script]

    @property
    def velocity(self):
        return list(self.script_parameters.values())[1]["particleVelocity"]

    def add_force(self, shape, force, torque, offset):
        if shape not in self.script_parameters:
            raise ValueError(f"'{shape}' is not a dynamic shape")
        self.forces.append((shape, force))

    def turn_joint(self, joint, angle):
        return 0.0

    def sim(self):
        return make_sim(self, SceneServices())

    def load(self, path):
        return load.load(
            str(path), {"sim": self.sim(), "simROS": make_sim_ros(self.bus, self.context.clock)}, TimeLimit(20)
        )


LUA = """
function sysCall_init()
    base = sim.getObjectHandle('Quadricopter_base')
    propeller = sim.getScriptHandle('Quadricopter_propeller_respondable1')
    simSetFloatSignal('height' .. simGetNameSuffix(nil), 1.5)
end
function sysCall_actuation()
    local suffix, name = simGetNameSuffix(sim.getObjectName(base))
    sim.setScriptSimulationParameter(propeller, 'particleVelocity', 5 + suffix)
    sim.setScriptSimulationParameter(sim.handle_self, 'base', name .. '/' .. sim.getObjectName(base))
end
"""
PYTHON = """
def sysCall_init():
    self.base = sim.getObjectHandle("Quadricopter_base")
    self.propeller = sim.getScriptHandle("Quadricopter_propeller_respondable1")
    sim.setFloatSignal(f"height{sim.getNameSuffix()}", 1.5)

def sysCall_actuation():
    suffix, name = sim.getNameSuffix(sim.getObjectName(self.base))
    sim.setScriptSimulationParameter(self.propeller, "particleVelocity", 5 + suffix)
    sim.setScriptSimulationParameter(sim.handle_self, "base", f"{name}/{sim.getObjectName(self.base)}")
"""
SCRIPTS = {"lua": LUA, "py": PYTHON}


@pytest.fixture(name="drones")
def _drones():
    scene = Scene()
    return [Drone(scene, also=("FrontVision",)), Drone(scene, "#0"), Drone(scene, "#1", also=("FloorVision",))]


def name_of(drone, path):
    sim = drone.sim()
    return sim.getObjectName(sim.getObject(path))


@pytest.mark.parametrize(
    "path, found",
    [
        ("Drone", ["Drone", "Drone#0", "Drone#1"]),
        ("Quadricopter_base", ["Quadricopter_base", "Quadricopter_base#0", "Quadricopter_base#1"]),
        ("Quadricopter", ["Drone", "Drone#0", "Drone#1"]),
        ("Quadricopter_base#", ["Quadricopter_base"] * 3),
        ("Quadricopter_base#0", ["Quadricopter_base#0"] * 3),
        ("Floor", ["Floor"] * 3),
        ("Floor#", ["Floor"] * 3),
        ("Floor#0", ["Floor"] * 3),
        ("FrontVision#", ["FrontVision"] * 3),
        ("./base", ["Quadricopter_base", "Quadricopter_base#0", "Quadricopter_base#1"]),
        ("../propeller[0]", ["Quadricopter_propeller1", "Quadricopter_propeller1#0", "Quadricopter_propeller1#1"]),
        (":/Quadricopter_base", ["Quadricopter_base", "Quadricopter_base#0", "Quadricopter_base#1"]),
        ("/Quadcopter", ["Drone"] * 3),
        ("/Quadcopter[1]/base", ["Quadricopter_base#0"] * 3),
        ("/Drone[2]/base", ["Quadricopter_base#1"] * 3),
        ("/Drone#1", ["Drone#1"] * 3),
        ("/Floor", ["Floor"] * 3),
    ],
)
def test_names_and_paths_resolve_relative_to_each_drone(drones, path, found):
    assert [name_of(drone, path) for drone in drones] == found


@pytest.mark.parametrize(
    "index, path, said",
    [
        (0, "Quadricopter_base#2", "no object named 'Quadricopter_base#2'; near names are Quadricopter_base"),
        (1, "Quadricopter_bas", "no object named 'Quadricopter_bas'; near names are Quadricopter_base"),
        (1, "FrontVision", "no object named 'FrontVision#0'; near names are FrontVision"),
        (0, "FloorVision", "no object named 'FloorVision'; near names are FloorVision#1"),
        (1, "/Quadcopter[3]/base", "no object '/Quadcopter\\[3\\]/base'; near names are /Quadcopter\\[2\\]/base"),
    ],
)
def test_name_missing_in_the_own_model_does_not_resolve_to_another_drone(drones, index, path, said):
    with pytest.raises(ValueError, match=said):
        drones[index].sim().getObject(path)


def test_single_drone_accepts_any_name_suffix():
    drone = Drone(Scene())
    assert name_of(drone, "Quadricopter_base#0") == name_of(drone, "Quadricopter_base#7") == "Quadricopter_base"
    assert drone.sim().getNameSuffix() == -1


def test_object_names_aliases_and_suffixes(drones):
    sim = drones[1].sim()
    base = sim.getObject("./base")
    assert (sim.getObjectName(base), sim.getObjectAlias(base)) == ("Quadricopter_base#0", "base")
    assert sim.getObjectAlias(base, 1) == "/Quadcopter[1]/base"
    assert [drone.sim().getNameSuffix() for drone in drones] == [-1, 0, 1]


@pytest.mark.parametrize("ending", SCRIPTS)
def test_same_script_controls_each_drone(drones, tmp_path, ending):
    path = tmp_path / f"script.{ending}"
    path.write_text(SCRIPTS[ending], encoding="utf-8")
    scripts = [drone.load(path) for drone in drones]
    for phase in ("init", "actuation"):
        for script in scripts:
            script.call(phase)
    assert [drone.velocity for drone in drones] == [4, 5, 6]
    assert [drone.parameters["base"].partition("/")[2] for drone in drones] == [
        "Quadricopter_base",
        "Quadricopter_base#0",
        "Quadricopter_base#1",
    ]
    assert {drone.parameters["base"].partition("/")[0] for drone in drones} == {"Quadricopter_base"}
    first_sim = drones[0].sim()
    assert [first_sim.getFloatSignal(f"height{suffix}") for suffix in (-1, 0, 1, 2)] == [1.5, 1.5, 1.5, None]
    for script in scripts:
        script.close()


def test_script_handles_refer_to_the_own_drone(drones):
    sim = drones[1].sim()
    propeller = sim.getScriptHandle("./propeller/respondable")
    assert propeller == sim.getScriptHandle("Quadricopter_propeller_respondable1#0")
    assert sim.getObjectName(sim.getObjectAssociatedWithScript(propeller)) == "Quadricopter_propeller_respondable1#0"
    assert sim.getObjectName(sim.getObjectAssociatedWithScript(sim.handle_self)) == "Drone#0"
    other = sim.getScriptHandle("Quadricopter_propeller_respondable1#")
    assert sim.getObjectName(sim.getObjectAssociatedWithScript(other)) == "Quadricopter_propeller_respondable1"
    with pytest.raises(ValueError, match="no script is attached to 'Floor'; known are Drone"):
        sim.getScriptHandle("Floor")


def test_forces_act_on_the_own_drone(drones):
    sim = drones[1].sim()
    sim.addForceAndTorque(sim.getObject("."), [1, 0, 0])
    assert drones[1].forces == [("Drone#0", (1, 0, 0))]
    with pytest.raises(ValueError, match="'Drone' is not a dynamic shape"):
        sim.addForceAndTorque(sim.getObject("Drone#"), [1, 0, 0])


def test_script_can_read_the_position_of_another_drone(drones):
    leader, follower = drones[0].sim(), drones[1].sim()
    leader.setObjectPosition(leader.getObject("Drone"), -1, [1, 2, 3])
    assert follower.getObjectPosition(follower.getObject("Drone#")) == [1, 2, 3]
    assert follower.getObjectPosition(follower.getObject("Drone")) == [0, 0, 0]


@pytest.mark.parametrize("shown", [True, False])
def test_drawings_of_two_drones_have_distinct_handles(shown):
    scene = Scene(shown)
    first, second = Drone(scene).sim(), Drone(scene, "#0").sim()
    restore = scene.drawings.save_state()

    def draw():
        return [
            *(sim.addDrawingObject(sim.drawing_points, 1) for sim in (first, second)),
            *(sim.addParticleObject(sim.particle_points1, 1) for sim in (second, first)),
        ]

    assert draw() == [1, 2, 3, 4]
    restore()
    assert draw() == [1, 2, 3, 4]
    assert list(scene.drawings.objects) == ([1, 2] if shown else [])
    scene.drawings.clear()
    assert draw() == [1, 2, 3, 4]


def test_script_may_select_another_name_suffix(drones):
    sim = drones[1].sim()
    own = sim.getNameSuffix()
    sim.setNameSuffix(1)
    assert sim.getObjectName(sim.getObject("Quadricopter_base")) == "Quadricopter_base#1"
    sim.setNameSuffix(-1)
    assert sim.getObjectName(sim.getObject("Quadricopter_base")) == "Quadricopter_base"
    sim.setNameSuffix(5)
    with pytest.raises(ValueError, match="no object named 'Quadricopter_base#5'"):
        sim.getObject("Quadricopter_base")
    sim.setNameSuffix(own)
    assert sim.getObjectName(sim.getObject("Quadricopter_base")) == "Quadricopter_base#0"
    with pytest.raises(TypeError, match="a number is expected"):
        sim.setNameSuffix("one")


SUFFIX_SCRIPTS = {
    "lua": "function sysCall_actuation()\n"
    "  local base = sim.getObjectName(sim.getObject('Quadricopter_base'))\n"
    "  sim.setScriptSimulationParameter(sim.handle_self, 'base', base)\n"
    "  sim.setNameSuffix(-1)\nend",
    "py": "def sysCall_actuation():\n"
    "  base = sim.getObjectName(sim.getObject('Quadricopter_base'))\n"
    "  sim.setScriptSimulationParameter(sim.handle_self, 'base', base)\n"
    "  sim.setNameSuffix(-1)\n",
}


@pytest.mark.parametrize("ending", SUFFIX_SCRIPTS)
def test_snapshot_includes_the_name_suffix(drones, tmp_path, ending):
    path = tmp_path / f"script.{ending}"
    path.write_text(SUFFIX_SCRIPTS[ending], encoding="utf-8")
    script = drones[1].load(path)
    restore = script.save_state()
    found = []
    for _ in range(2):
        script.call("actuation")
        found.append(drones[1].parameters["base"])
    restore()
    script.call("actuation")
    found.append(drones[1].parameters["base"])
    assert found == ["Quadricopter_base#0", "Quadricopter_base", "Quadricopter_base#0"]
    script.close()


def test_removing_a_drone_does_not_change_the_names_of_the_others(drones):
    first, second, third = drones
    sim = second.sim()
    base = sim.getObject("./base")
    first.context.objects.remove(third.handles)
    first.context.objects.remove(first.handles)
    assert sim.getObject("Quadricopter_base") == base and sim.getObjectName(base) == "Quadricopter_base#0"
    assert name_of(second, "Floor") == "Floor"
    with pytest.raises(ValueError, match="no object named 'Quadricopter_base#1'"):
        sim.getObject("Quadricopter_base#1")


# ---- a script's own parameters


OWN = {"MyGain": 0.25, "steps": 3, "isBold": True, "mode": "slow", "route": (1.0, 2.0, 3.5), "limits": [4, 5]}

LUA_SETS = """
local function get(name) return sim.getScriptSimulationParameter(sim.handle_self, name) end
local function set(name, value) simSetScriptSimulationParameter(sim_handle_self, name, value) end
function sysCall_init()
    assert(get('MyGain') == 0.25 and get('steps') == 3 and get('isBold') == true and get('mode') == 'slow')
    local route, limits = get('route'), get('limits')
    assert(#route == 3 and route[1] == 1 and route[3] == 3.5 and #limits == 2 and limits[2] == 5)
    route[1] = 100
    assert(get('route')[1] == 1)
    assert(sim.getUserParameter(sim.getObject('.'), 'MyGain') == 0.25)
    assert(not pcall(get, 'MyGian'))
    set('MyGain', 0.5) set('steps', '4') set('isBold', 'false') set('mode', 'fast') set('route', {9, 8})
    sim.setUserParameter(sim.handle_self, 'limits', {7})
end
"""
PYTHON_SETS = """
def get(name): return sim.getScriptSimulationParameter(sim.handle_self, name)
def put(name, value): sim.setScriptSimulationParameter(sim.handle_self, name, value)
def sysCall_init():
    assert [get(name) for name in ("MyGain", "steps", "isBold", "mode")] == [0.25, 3, True, "slow"]
    route = get("route")
    assert route == [1, 2, 3.5] and get("limits") == [4, 5]
    route[0] = 100
    assert get("route")[0] == 1
    assert sim.getUserParameter(sim.getObject("."), "MyGain") == 0.25
    mine = [9, 8]
    put("MyGain", 0.5); put("steps", "4"); put("isBold", "false"); put("mode", "fast"); put("route", mine)
    mine.append(7)
    sim.setUserParameter(sim.handle_self, "limits", [7])
"""


@pytest.mark.parametrize("ending, source", [("lua", LUA_SETS), ("py", PYTHON_SETS)])
def test_script_reads_and_sets_its_own_parameters(tmp_path, caplog, ending, source):
    path = tmp_path / f"script.{ending}"
    path.write_text(source, encoding="utf-8")
    drone = Drone(Scene(), own=OWN)
    script = drone.load(path)
    script.call("init")
    script.close()
    assert {name: drone.parameters[name] for name in OWN} == {
        "MyGain": 0.5,
        "steps": 4.0,
        "isBold": False,
        "mode": "fast",
        "route": [9, 8],
        "limits": [7],
    }
    assert not caplog.records


def test_invalid_script_parameters_are_refused(caplog):
    sim = Drone(Scene(), own=OWN).sim()
    with pytest.raises(ValueError, match="no script parameter 'MyGian'; near names are MyGain"):
        sim.getScriptSimulationParameter(sim.handle_self, "MyGian")
    with pytest.raises(TypeError, match="expected a number"):
        sim.setScriptSimulationParameter(sim.handle_self, "MyGain", "much")
    with pytest.raises(ValueError, match="no script is attached to 'Floor'"):
        sim.getUserParameter(sim.getObject("/Floor"), "MyGain")
    assert not caplog.records


def test_setting_a_parameter_of_all_scripts_includes_the_own_script(caplog):
    drone = Drone(Scene(), own=OWN)
    sim = drone.sim()
    sim.setScriptSimulationParameter(sim.handle_tree, "MyGain", 2)
    assert [one["MyGain"] for one in drone.script_parameters.values()] == [2, 2]
    assert not caplog.records
    sim.setScriptSimulationParameter(sim.handle_tree, "nobodys", 2)
    assert "nothing reads 'nobodys'" in caplog.text


def test_numpy_number_is_accepted_as_a_number():
    sim = Drone(Scene(), own=OWN).sim()
    sim.setScriptSimulationParameter(sim.handle_self, "MyGain", np.float64(2.5))
    assert type(sim.getScriptSimulationParameter(sim.handle_self, "MyGain")) is float
    with pytest.raises(TypeError, match="expected a finite number"):
        sim.setScriptSimulationParameter(sim.handle_self, "MyGain", np.float64("nan"))
