"""Several drones in one scene: what the names in each one's script mean."""

import pytest
from several_drones import Drone, Scene

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
def test_names(drones, path, found):
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
def test_a_name_that_the_own_model_does_not_have_is_no_other_drones(drones, index, path, said):
    with pytest.raises(ValueError, match=said):
        drones[index].sim().getObject(path)


def test_the_only_drone_hears_any_suffix():
    drone = Drone(Scene())
    assert name_of(drone, "Quadricopter_base#0") == name_of(drone, "Quadricopter_base#7") == "Quadricopter_base"
    assert drone.sim().getNameSuffix() == -1


def test_what_an_object_is_called(drones):
    sim = drones[1].sim()
    base = sim.getObject("./base")
    assert (sim.getObjectName(base), sim.getObjectAlias(base)) == ("Quadricopter_base#0", "base")
    assert sim.getObjectAlias(base, 1) == "/Quadcopter[1]/base"
    assert [drone.sim().getNameSuffix() for drone in drones] == [-1, 0, 1]


@pytest.mark.parametrize("ending", SCRIPTS)
def test_the_same_script_flies_each_of_them(drones, tmp_path, ending):
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
    heard = drones[0].sim()
    assert [heard.getFloatSignal(f"height{suffix}") for suffix in (-1, 0, 1, 2)] == [1.5, 1.5, 1.5, None]
    for script in scripts:
        script.close()


def test_scripts_are_the_own_drones(drones):
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


def test_one_drone_sees_another(drones):
    leader, follower = drones[0].sim(), drones[1].sim()
    leader.setObjectPosition(leader.getObject("Drone"), -1, [1, 2, 3])
    assert follower.getObjectPosition(follower.getObject("Drone#")) == [1, 2, 3]
    assert follower.getObjectPosition(follower.getObject("Drone")) == [0, 0, 0]


@pytest.mark.parametrize("shown", [True, False])
def test_no_two_things_drawn_have_one_handle(shown):
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


def test_a_script_may_speak_of_another_suffix(drones):
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


SPEAKS = {
    "lua": "function sysCall_actuation()\n"
    "  local base = sim.getObjectName(sim.getObject('Quadricopter_base'))\n"
    "  sim.setScriptSimulationParameter(sim.handle_self, 'base', base)\n"
    "  sim.setNameSuffix(-1)\nend",
    "py": "def sysCall_actuation():\n"
    "  base = sim.getObjectName(sim.getObject('Quadricopter_base'))\n"
    "  sim.setScriptSimulationParameter(sim.handle_self, 'base', base)\n"
    "  sim.setNameSuffix(-1)\n",
}


@pytest.mark.parametrize("ending", SPEAKS)
def test_a_snapshot_knows_the_suffix(drones, tmp_path, ending):
    path = tmp_path / f"script.{ending}"
    path.write_text(SPEAKS[ending], encoding="utf-8")
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


def test_when_a_drone_is_gone_the_others_stay_what_they_are(drones):
    first, second, third = drones
    sim = second.sim()
    base = sim.getObject("./base")
    first.context.objects.remove(third.handles)
    first.context.objects.remove(first.handles)
    assert sim.getObject("Quadricopter_base") == base and sim.getObjectName(base) == "Quadricopter_base#0"
    assert name_of(second, "Floor") == "Floor"
    with pytest.raises(ValueError, match="no object named 'Quadricopter_base#1'"):
        sim.getObject("Quadricopter_base#1")
