"""Child scripts on any object: each has its own state and API, and they are called in the order of the tree."""

import math
import re
import struct
from pathlib import Path

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.scripting.errors import ScriptError

SCRIPTS = Path(__file__).parent / "scripts"
DOCS = Path(__file__).parents[2] / "docs" / "scripts.md"
PROPELLERS = [f"Quadricopter_propeller_respondable{number}" for number in (1, 2, 3, 4)]
TELL_LUA = """
local function tell(phase)
    local order = sim.getStringSignal('order') or ''
    sim.setStringSignal('order', order .. sim.getObjectName(sim.getObject('.')) .. ':' .. phase .. ' ')
end
for _, phase in ipairs{'init', 'actuation', 'sensing', 'cleanup'} do
    _G['sysCall_' .. phase] = function() tell(phase) end
end
"""
TELL_PYTHON = """
def tell(phase):
    name = sim.getObjectName(sim.getObjectAssociatedWithScript(sim.handle_self))
    sim.setStringSignal("order", (sim.getStringSignal("order") or "") + f"{name}:{phase} ")

def sysCall_init(): tell("init")
def sysCall_actuation(): tell("actuation")
def sysCall_sensing(): tell("sensing")
"""


@pytest.fixture(name="build")
def _build(tmp_path, new_simulation):
    """Return a function that builds a simulation with scripts, given as a text for each object's name."""

    def build(scripts, own="", values=None, **overrides):
        entries = []
        for name, text in scripts.items():
            path = text if isinstance(text, Path) else tmp_path / f"{len(entries)}.{'py' if 'def ' in text else 'lua'}"
            if not isinstance(text, Path):
                path.write_text(text, encoding="utf-8")
            entries.append({"object": name, "script": str(path), "parameters": (values or {}).get(name, {})})
        script = tmp_path / "own.lua"
        if own:
            script.write_text(own, encoding="utf-8")
        settings = {**overrides, "scene": {**overrides.get("scene", {}), "scripts": entries}}
        return new_simulation(settings, script=str(script) if own else "")

    return build


@pytest.fixture
def fails_in_one_line(build):
    def check(call, answers, words):
        """Let the drone's script call a script that is attached to the target; the call must fail."""
        own = f"function ask() end function sysCall_actuation() {call} end"
        limit = 0.5 if words.startswith("stopped after") else 60.0
        scripts = {"Floor": "function sysCall_init() end", "DronePosition": answers}
        simulation = build(scripts, own, script_time_limit=limit)
        with pytest.raises(ScriptError, match=words) as caught:
            simulation.step()
        assert "\n" not in str(caught.value)

    return check


def order(simulation):
    found = simulation.context.signals.get(str, "order").split()
    simulation.context.signals.forget(str, "order")
    return found


# ---- order, state and errors


def test_attached_scripts_are_called_from_the_root_to_the_leaves(build):
    target, first, last = "DronePosition", PROPELLERS[0], "Box"
    scripts = {last: TELL_PYTHON, target: TELL_LUA, first: TELL_LUA}
    box = {"shape": "box", "size": [1, 1, 1], "position": [3, 0, 0.5], "name": "Box"}
    simulation = build(scripts, TELL_LUA, scene={"objects": [box]})
    expected = ["Drone", target, first, last]
    assert order(simulation) == [f"{name}:init" for name in expected]
    simulation.step()
    assert order(simulation) == [f"{name}:{phase}" for phase in ("actuation", "sensing") for name in expected]
    objects = simulation.context.objects
    objects.set_parent(objects.handle(target), objects.handle("Floor"), True)
    simulation.step()
    assert order(simulation)[:4] == [f"{name}:actuation" for name in (target, "Drone", first, last)]


def test_each_script_has_its_own_parameters_names_and_state(build):
    text = """
    count = 0
    function sysCall_actuation()
        count = count + sim.getScriptSimulationParameter(sim.handle_self, 'step')
        sim.setFloatSignal(sim.getScriptName(sim.handle_self), count)
        assert(sim.getObjectName(sim.getObjectHandle('Quadricopter_base')) == 'Quadricopter_base#0')
        assert(sim.getScriptExecutionCount() == count / 2)
    end
    """.replace("count + sim", "sim.getScriptExecutionCount() * 2 + 0 * sim")
    simulation = build(
        {"DronePosition#0": text},
        values={"DronePosition#0": {"step": 2.0}},
        vehicles={"a": {}, "b": {"position": [0, 2, 1]}},
    )
    for _ in range(3):
        simulation.step()
    assert simulation.context.signals.get(float, "DronePosition#0") == 4
    handle = next(one for one in simulation.context.scripts if one.name == "DronePosition#0")
    assert handle.parameters == {"step": 2.0}


def test_a_script_can_load_modules_from_its_folder(build, tmp_path):
    (tmp_path / "gains.lua").write_text("return {kp = 3}", encoding="utf-8")
    (tmp_path / "more.py").write_text("kd = 4", encoding="utf-8")
    lua = "sim = require'sim' function sysCall_init() sim.setFloatSignal('kp', require('gains').kp) end"
    simulation = build(
        {"Floor": lua, "DronePosition": "import more\ndef sysCall_init(): sim.setFloatSignal('kd', more.kd)"}
    )
    assert [simulation.context.signals.get(float, name) for name in ("kp", "kd")] == [3, 4]


def test_a_failed_script_is_logged_once_with_its_line_and_the_others_continue(build, tmp_path, caplog):
    count = "n = 0 function sysCall_actuation() n = n + 1 sim.setFloatSignal('n', n) end"
    fails = "function sysCall_sensing()\n  sim.getObject('/Nobody')\nend function f() end"
    simulation = build({"Floor": fails, "DronePosition": count})
    before = simulation.snapshot()
    for _ in range(2):
        for _ in range(3):
            simulation.step()
        assert simulation.context.signals.get(float, "n") == 3
        assert list(simulation.failed_scripts) == ["Floor"]
        (said,) = [one.getMessage() for one in caplog.records if one.levelname == "ERROR"]
        assert said.startswith(f"[sensing] {tmp_path}/0.lua:2: sim.getObject: there is no object '/Nobody'")
        assert said.endswith("; this script is no longer called")
        caplog.clear()
        simulation.restore(before)


@pytest.mark.parametrize("source", ["error('x')", "function sysCall_init() error('x') end"])
def test_a_script_that_fails_while_it_is_loaded_does_not_end_the_flight(build, caplog, source):
    simulation = build({"Floor": source})
    simulation.step()
    simulation.close()
    assert [one.levelname for one in caplog.records].count("ERROR") == 1


def test_calling_a_failed_script_raises_an_error(build):
    fails = "function f() end function sysCall_init() error('x') end"
    own = "function ask() end function sysCall_actuation() sim.callScriptFunction('f@Floor', 1) end"
    with pytest.raises(ScriptError, match="the script has failed"):
        build({"Floor": fails}, own).step()


@pytest.mark.parametrize(
    "name, words",
    [
        ("Quadricopter", "'Quadricopter' already has a script"),
        ("DronePositon", "no object named 'DronePositon'; near names are DronePosition"),
    ],
)
def test_an_invalid_object_of_a_script_gets_one_line(build, name, words):
    with pytest.raises(ParameterError, match=f"^scene: scripts/0/object: {words}"):
        build({name: TELL_LUA})


def test_an_object_has_at_most_one_child_script(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text("scripts:\n- {object: Floor, script: a.lua}\n- {object: Floor, script: b.lua}\n")
    with pytest.raises(
        ParameterError, match=r"scene.yaml: line 3: parameter scripts/1/object = 'Floor': is used twice"
    ):
        parameters.load({"scene_file": str(scene)})


# ---- start, snapshots, changes of the fleet, files


def test_attached_scripts_are_restarted_restored_and_saved_with_the_simulation(build, tmp_path):
    own = "n = 0 function sysCall_actuation() n = n + 1 sim.setFloatSignal('n', n) end"
    simulation = build(
        {
            "Floor": own,
            "DronePosition": "x = 0\ndef sysCall_sensing():\n    global x\n    x += 1\n    sim.setFloatSignal('x', x)",
        }
    )

    def signals():
        return [simulation.context.signals.get(float, name) for name in "nx"]

    simulation.step()
    snapshot = simulation.snapshot()
    simulation.step()
    assert signals() == [2, 2]
    simulation.restore(snapshot)
    simulation.step()
    assert signals() == [2, 2]
    simulation.start()
    simulation.step()
    assert signals() == [1, 1]
    simulation.save_scene(tmp_path / "saved.yaml")
    attached = parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).scene.scripts
    assert [(one.object, Path(one.script).name) for one in attached] == [("Floor", "0.lua"), ("DronePosition", "1.py")]


def test_the_scripts_of_a_vehicle_are_added_and_removed_with_it(build):
    simulation = build({"DronePosition#0": TELL_LUA}, vehicles={"a": {}})
    simulation.step()
    two_vehicles = {"a": {}, "b": {"position": [0, 2, 1]}}
    simulation.set_vehicles(two_vehicles)
    simulation.step()
    assert order(simulation) == [f"DronePosition#0:{phase}" for phase in ("init", "actuation", "sensing")]
    simulation.set_vehicles({"a": {}})
    simulation.step()
    assert order(simulation) == ["DronePosition#0:cleanup"]
    simulation.set_vehicles(two_vehicles)
    assert order(simulation) == ["DronePosition#0:init"]


def test_a_command_reaches_the_scripts_on_the_parts_of_a_vehicle(build):
    text = """
    function sysCall_init() simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'heard') end
    function heard(m) sim.setFloatSignal('x', m.linear.x) end
    """
    simulation = build({"Quadricopter_base": text})
    simulation.drone.commands.receive(Twist(Vector3(0.5)))
    simulation.step()
    assert simulation.context.signals.get(float, "x") == 0.5


# ---- calls between scripts


CALLED = """
function sysCall_init() seen = {} end
function add(a, b, list) seen[#seen + 1] = list.x return a + b, {sum = {a, b}}, 'x' end
function fails() error('no') end
function back() return sim.callScriptFunction('ask', sim.getScriptHandle('Drone')) end
function hangs() while true do end end
"""
ASKS = {
    "lua": """
    function sysCall_init() end
    function sysCall_actuation()
        local a, b, c = sim.callScriptFunction('add@DronePosition', sim.scripttype_childscript, 1, 2.5, {x = {1}})
        assert(a == 3.5 and b.sum[2] == 2.5 and c == 'x')
        local handle = sim.getScript(sim.scripttype_childscript, sim.getObject('/target'))
        assert(handle == sim.getScriptAssociatedWithObject(sim.getObject('/target')))
        assert(sim.callScriptFunction('add', handle, 1, 2, {}) == 3)
        assert(sim.getScriptFunctions(handle):add(1, 2, {}) == 3)
        sim.setFloatSignal('done', 1)
    end
    """,
    "py": """
def sysCall_actuation():
    a, b, c = sim.callScriptFunction("add@DronePosition", sim.scripttype_childscript, 1, 2.5, {"x": [1]})
    assert a == 3.5 and b["sum"][1] == 2.5 and c == "x"
    handle = sim.getScript(sim.scripttype_childscript, "/target")
    assert sim.getScriptFunctions(handle).add(1, 2, {})[0] == 3
    sim.setFloatSignal("done", 1)
""",
}
ANSWERS = {
    "lua": CALLED,
    "py": """
def sysCall_init(): pass
def add(a, b, more): return a + b, {"sum": [a, b]}, "x"
""",
}


@pytest.mark.parametrize("answering", ["lua", "py"])
@pytest.mark.parametrize("asking", ["lua", "py"])
def test_scripts_call_each_other_by_value(build, asking, answering):
    simulation = build({"Floor": ASKS[asking], "DronePosition": ANSWERS[answering]})
    simulation.step()
    assert simulation.context.signals.get(float, "done") == 1


@pytest.mark.parametrize(
    "call, words",
    [
        ("'fails@DronePosition', 1", r"1.lua:4: no"),
        ("'nothing@DronePosition', 1", "no function 'nothing'"),
        ("'add@Drone_Position', 1", "no object named 'Drone_Position'; near names are DronePosition"),
        ("'f@Quadricopter_propeller_respondable1', 1", "which has no functions"),
        ("'back@DronePosition', 1", "cannot be called back"),
        ("'add', 99", "no script with the handle 99"),
        ("'hangs@DronePosition', 1", "stopped after 0.5 s"),
    ],
)
def test_a_call_that_fails_gets_one_line(fails_in_one_line, call, words):
    fails_in_one_line(f"sim.callScriptFunction({call})", CALLED, words)


OWN = {
    "lua": """
    function add(a, list) return a + list[1], list end
    function fails() error('no') end
    function deep(n) return n == 0 and 0 or 1 + sim.callScriptFunction('deep', sim.handle_self, n - 1) end
    local function try()
        local sum, list = sim.callScriptFunction('add@Floor', sim.scripttype_childscript, 1, {2.5})
        assert(sum == 3.5 and list[1] == 2.5)
        assert(sim.callScriptFunction('deep', sim.getScriptHandle(), 5) == 5)
        for _, call in ipairs{{'fails', sim.handle_self}, {'nothing', sim.handle_self}, {'deep', sim.handle_self, 50},
                              {'add@Floor', sim.scripttype_customizationscript}} do
            local ok, why = pcall(sim.callScriptFunction, call[1], call[2], call[3])
            sim.setStringSignal('told', (sim.getStringSignal('told') or '') .. why .. ';')
        end
    end
    function sysCall_thread() try() sim.step() end
    """,
    "py": """
def add(a, more): return a + more[0], more
def fails(): raise RuntimeError("no")
def deep(n): return 1 + sim.callScriptFunction("deep", sim.handle_self, n - 1) if n else 0
def sysCall_actuation():
    assert sim.callScriptFunction("add@Floor", sim.scripttype_childscript, 1, [2.5]) == (3.5, [2.5])
    assert sim.callScriptFunction("deep", sim.getScriptHandle(), 5) == 5
    calls = ("fails", sim.handle_self), ("nothing", sim.handle_self), ("deep", sim.handle_self, 50)
    for one in (*calls, ("add@Floor", sim.scripttype_customizationscript)):
        try:
            sim.callScriptFunction(*one)
        except Exception as error:
            sim.setStringSignal("told", (sim.getStringSignal("told") or "") + f"{error};")
""",
}


@pytest.mark.parametrize("language", OWN)
def test_a_script_calls_its_own_functions(build, language):
    simulation = build({"Floor": OWN[language]})
    simulation.step()
    *messages, _ = simulation.context.signals.get(str, "told").split(";")
    failed, nothing, deep, customization, *_ = messages
    assert failed.endswith("no")
    assert "no function 'nothing'" in nothing
    assert "more than 8 levels deep" in deep or deep.count("[deep]") > 1, "endless recursion is stopped"
    assert customization.endswith("no customization script is attached to 'Floor'")


LUA_RUNS = """
count = 1
function sysCall_init() end
function add(a, b) return a + b end
"""
PYTHON_RUNS = """
count = 1
def add(a, b): return a + b
def sysCall_init(): pass
"""
RUNS_IN_LUA = """
function sysCall_init() end
function sysCall_actuation()
    local other = sim.getScriptHandle('DronePosition')
    local function same(got, ...)
        for index, wanted in ipairs{...} do
            assert(got[index] == wanted, tostring(got[index]) .. ' is not ' .. tostring(wanted))
        end
    end
    same({sim.executeScriptString('add(count, 2)', other)}, 0, 3)
    same({sim.executeScriptString(other, 'count = count + 1; return count, "x"')}, 0, 2, 'x')
    same({sim.executeScriptString('count@DronePosition', sim.scripttype_childscript)}, 0, 2)
    same({simExecuteScriptString('return count@lua', other)}, 0, 2)
    same({sim.executeScriptString('mine = 7', sim.handle_self)}, 0)
    local result, nothing = sim.executeScriptString('count = 9', other)
    assert(result == 0 and #nothing == 0 and mine == 7)
    local ok, why = pcall(sim.executeScriptString, 'x = nothing.y', other)
    sim.setStringSignal('why', why)
end
"""
RUNS_IN_PYTHON = """
def sysCall_actuation():
    other = sim.getScriptHandle("DronePosition")
    assert sim.executeScriptString("add(count, 2)", other) == (0, 3)
    assert sim.executeScriptString(other, "count = count + 1") == (0, [])
    assert sim.executeScriptString("count@DronePosition", sim.scripttype_childscript) == (0, 2)
    sim.executeScriptString("mine = 7", sim.handle_self)
    assert mine == 7
    try:
        sim.executeScriptString("nothing.y", other)
    except ValueError as error:
        sim.setStringSignal("why", str(error))
"""


@pytest.mark.parametrize("asks, answers", [(RUNS_IN_LUA, LUA_RUNS), (RUNS_IN_PYTHON, PYTHON_RUNS)])
def test_a_string_is_executed_in_another_script(build, asks, answers):
    simulation = build({"Floor": asks, "DronePosition": answers})
    simulation.step()
    why = simulation.context.signals.get(str, "why")
    assert "[executeScriptString]" in why and "/1." in why and "nothing" in why, "the error is that of the other script"


@pytest.mark.parametrize(
    "text, answers, words",
    [
        ("'while true do end', sim.getScriptHandle('DronePosition')", LUA_RUNS, "stopped after 0.5 s"),
        ("'1', sim.getScriptHandle('DronePosition')", PYTHON_RUNS, "only Python scripts may"),
        ("'1@python', sim.getScriptHandle('DronePosition')", LUA_RUNS, "'DronePosition' is in Lua, not Python"),
        ("'1@', sim.scripttype_sandboxscript", LUA_RUNS, "every script belongs to an object"),
        ("'1@Floor', sim.scripttype_customizationscript", LUA_RUNS, "no customization script is attached to 'Floor'"),
        ("'return return', sim.getScriptHandle('DronePosition')", LUA_RUNS, "unexpected symbol"),
        ("'\\27Lua', sim.getScriptHandle('DronePosition')", LUA_RUNS, "precompiled code"),
        ("1, 2", LUA_RUNS, "expected a string and the handle of a script"),
    ],
)
def test_a_string_that_cannot_be_executed_gets_one_line(fails_in_one_line, text, answers, words):
    fails_in_one_line(f"sim.executeScriptString({text})", answers, words)


def test_a_call_of_an_own_function_counts_for_the_time_limit(build):
    own = """
    function hangs() while true do end end
    function sysCall_init() end
    function sysCall_actuation() while true do pcall(sim.callScriptFunction, 'hangs', sim.handle_self) end end
    """
    with pytest.raises(ScriptError, match=r"stopped after 0.2 s without returning"):
        build({}, own, script_time_limit=0.2).step()


def test_special_handles_address_several_scripts(build):
    own = """
    function sysCall_init()
        sim.setScriptSimulationParameter(sim.handle_all, 'everybody', 1)
        sim.setScriptSimulationParameter(sim.handle_tree, 'below', 2)
    end
    """
    mark = """
    function sysCall_init()
        sim.setScriptSimulationParameter(sim.handle_chain, 'above', 3)
        sim.setFloatSignal('found', sim.getScriptSimulationParameter(sim.handle_chain, 'below'))
        local _, why = pcall(sim.getScriptSimulationParameter, sim.handle_main_script, 'x')
        sim.setStringSignal('main', why)
    end
    """
    simulation = build({"DronePosition": mark, "Floor": "function sysCall_init() end"}, own)
    names = {"everybody", "below", "above"}
    said = {one.name: names & set(one.parameters) for one in simulation.context.scripts}
    assert said["Drone"] == {"everybody", "below", "above"}
    assert said["DronePosition"] == {"everybody", "below", "above"}
    assert said["Floor"] == {"everybody"} and said[PROPELLERS[0]] == {"everybody", "below"}
    assert simulation.context.signals.get(float, "found") == 2
    assert "is its own main script" in simulation.context.signals.get(str, "main")


# ---- propellers


def fly_path(simulation, steps=200):
    path = []
    for step in range(steps):
        if step == 5:
            simulation.drone.commands.receive(Twist(Vector3(1, -0.5, 0.2), Vector3(0, 0, 0.7)))
        simulation.step()
        path.append(simulation.drone.body.state.position)
    return path


def test_v_reps_propeller_script_flies_like_the_built_in_propeller_law(build):
    expected = fly_path(build({}))
    found = fly_path(build({name: SCRIPTS / "propeller_v3.lua" for name in PROPELLERS}))
    assert max(math.dist(one, other) for one, other in zip(expected, found)) < 1e-9


def test_a_script_on_a_propeller_replaces_the_built_in_propeller_law(build):
    idle_script = "function sysCall_actuation() end"
    simulation = build(dict.fromkeys(PROPELLERS, idle_script))
    for _ in range(10):
        simulation.step()
    assert simulation.drone.body.state.position[2] < 0.1
    assert min(simulation.drone.propulsion.particle_velocities) > 3, "the drone's script still commands the propellers"


def test_an_attached_script_that_changes_nothing_leaves_the_flight_bitwise_equal(build):
    assert struct.pack("600d", *sum(fly_path(build({})), ())) == struct.pack(
        "600d", *sum(fly_path(build({"Floor": TELL_LUA})), ())
    )


# ---- docs/scripts.md


def test_the_example_leads_the_drone_along_a_circle(tmp_path, new_simulation):
    page = DOCS.read_text(encoding="utf-8")
    scene, circle = (re.findall(rf"```{kind}\n(.*?)```", page, re.DOTALL)[-1] for kind in ("yaml", "lua"))
    (tmp_path / "scene.yaml").write_text(scene, encoding="utf-8")
    (tmp_path / "circle.lua").write_text(circle, encoding="utf-8")
    (tmp_path / "gate.py").write_text("def sysCall_init(): pass", encoding="utf-8")
    simulation = new_simulation({"scene_file": str(tmp_path / "scene.yaml")}, script="target")
    path = fly_path(simulation, 240)
    assert max(x for x, _, _ in path) > 0.4 and path[-1][1] > 0.5
