"""Calls of every function of docs/api.md under each of its names, in Lua and in Python, and their return values."""

import logging
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from api_examples import ANY, Example

from drone_sim.scene.distances import Distances
from drone_sim.scripting import load
from drone_sim.scripting.api import ignored
from drone_sim.scripting.api.calls import Api, flat_name
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros, make_sim_vision
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))
import make_api  # noqa: E402

EXAMPLES = make_api.EXAMPLES
COLORS = np.array([[[3, 4, 5]], [[0, 1, 2]]], np.uint8)  # the top row first
DISTANCES = np.array([[2.0, 4.0]], np.float32)
PICTURES = {
    "FrontVision": lambda kind="color", only=None: COLORS if kind == "color" else DISTANCES,
    "TrackCam": lambda kind="depth", only=None: DISTANCES if kind == "depth" else COLORS,
}
OBJECTS = {
    "DRONE": "/Quadcopter",
    "BASE": "/Quadcopter/base",
    "TARGET": "/target",
    "FLOOR": "/Floor",
    "JOINT": "/Quadcopter/propeller[0]/joint",
    "CAMERA": "/FrontVision",
    "DEPTH": "/TrackCam",
    "RANGE": "/height",
    "HINGE": "/Hinge",
    "BALL": "/Ball",
    "LINE": "/Line",
    "FEELER": "/Feeler",
    "GAUGE": "/Gauge",
}
SCENE = {
    "objects": [
        {"name": "Hinge", "kind": "joint", "type": "revolute", "limits": [-1, 2], "max_force": 3},
        {"name": "Ball", "kind": "joint", "type": "spherical"},
        {"name": "Line", "kind": "path", "points": [[0, 0, 0], [2, 0, 0]]},
        {"name": "Feeler", "kind": "proximity_sensor", "type": "ray", "range": 1.0, "position": [50, 0, 1]},
        {"name": "Gauge", "kind": "force_sensor"},
    ]
}
LUA = """
function sysCall_init()
local function check(number, ...) out.take(number, {...}) end
sim.setInt32Signal('there', 1)
local NOERROR, MESSAGE, FIRST = {noError = true}, {data = 'x'}, 1
local IDENTITY = sim.buildIdentityMatrix()
local function INVERTED()
  local m = {0,-1,0,1, 1,0,0,2, 0,0,1,3}
  sim.invertMatrix(m)
  return m
end
local function REFUSED(f, ...)
  local _, why = pcall(f, ...)
  return (string.match(why, '[^:]+$'):sub(2))
end
local function SECOND(_, value) return value end
local DRAWN = sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 1)
local SPACE = simOMPL.createStateSpace('p', simOMPL.StateSpaceType.position2d, sim.getObject('/target'), {-2,-2}, {2,2})
local TASK = simOMPL.createTask('t')
simOMPL.setStateSpace(TASK, {SPACE})
simOMPL.setAlgorithm(TASK, simOMPL.Algorithm.RRTConnect)
simOMPL.setStartState(TASK, {0, 0})
simOMPL.setGoalState(TASK, {1, 0})
"""
PYTHON = """
def check(number, result): out.take(number, list(result) if isinstance(result, tuple) else [result])
sim.setInt32Signal('there', 1)
NOERROR, MESSAGE, FIRST = {"noError": True}, {"data": "x"}, 0
PARAMETERS = {"pos": [0], "targetPos": [1]}
IDENTITY = sim.buildIdentityMatrix()
def INVERTED():
    m = [0,-1,0,1, 1,0,0,2, 0,0,1,3]
    sim.invertMatrix(m)
    return m
DRAWN = sim.addDrawingObject(sim.drawing_points, 1, 0, -1, 1)
SPACE = simOMPL.createStateSpace('p', simOMPL.StateSpaceType.position2d, sim.getObject('/target'), [-2,-2], [2,2])
TASK = simOMPL.createTask('t')
simOMPL.setStateSpace(TASK, [SPACE])
simOMPL.setAlgorithm(TASK, simOMPL.Algorithm.RRTConnect)
simOMPL.setStartState(TASK, [0, 0])
simOMPL.setGoalState(TASK, [1, 0])
def SECOND(values): return values[1]
def REFUSED(f, *values):
    try:
        f(*values)
    except ValueError as error:
        return str(error).rpartition(': ')[2]
"""


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    mount = {"position": [0.0, 0.0, 0.0], "rpy": [0.0, 1.57, 0.0]}
    height = {"kind": "range", "rate": 20.0, "min_range": 0.1, "max_range": 4.0, "mount": mount}
    own = {"script_parameters": {"gain": 1.0}, "sensors": {"height": height}, "scene": SCENE}
    return new_shared_simulation({"gravity": 0.0, **own}, python="def sysCall_init(): pass\n", drawings=Drawings())


@pytest.fixture(name="modules")
def _modules(simulation):
    own, drone, shared = simulation.child_scripts["drone"], simulation.drone.propulsion, simulation.context
    shared.gravity = -9.81  # the gravity that scripts read
    for one in (shared.control, shared.data, shared.tubes, shared.collections):
        one.clear()
    weights = {"masses": drone.masses, "inertias": drone.inertias, "nearest": Distances(shared).nearest}
    around = SceneServices(PICTURES, planes={"TrackCam": (1.0, 5.0)}, operations=simulation.operations, **weights)
    before = set(shared.objects)
    yield {
        "sim": make_sim(own, around),
        "simROS": make_sim_ros(MessageBus("drone"), simulation.clock),
        "simVision": make_sim_vision(own, around),
        **make_plugins(own, around),
    }
    simulation.operations.remove(set(shared.objects) - before)


def names_of(modules):
    """Return the names of each function that is not ignored, by module and by the name that its example has."""
    found = {}
    for module, examples in EXAMPLES.items():
        for declaration, function in make_api.declared(modules[module]):
            if not make_api.is_ignored(function):
                names = list(declaration.names)
                found[module, next((name for name in names if name in examples), names[0])] = names
    return found


def calls(modules, flat):
    """Return every call of the examples with its return values, with module names or flat names as in V-REP 3.x."""
    found = []
    all_names = names_of(modules)
    for module, known in ((module, known) for module, examples in EXAMPLES.items() for known in examples):
        names = all_names[module, known]
        for name in [known, *(one for one in names if one != known)]:
            full = flat_name(module, name) if flat else f"{module}.{name}"
            for example in EXAMPLES[module][known]:
                found.append(
                    (example.call.replace("NAME", full), example.returns, example.python.replace("NAME", full))
                )
    return found


def in_python(call, python):
    text = (python or call.replace("{", "[").replace("}", "]")).replace("sim.yield", "getattr(sim, 'yield')")
    return re.sub(r"\b(true|false)\b", lambda match: match.group().capitalize(), text)


def run(path, text, modules):
    """Run a script and return the values that it passed to `check`, by number."""
    results = {}
    modules = {**modules, "out": Api("out", {"take": lambda number, values: results.update({number: values})}, {})}
    path.write_text(text, encoding="utf-8")
    script = load.load(str(path), modules, TimeLimit(0.0))
    script.call("init")
    script.close()
    return results


def plain(value):
    if isinstance(value, bytes):
        return value.decode("latin-1")
    return [plain(one) for one in value] if isinstance(value, (list, tuple)) else value


def matches(value, expected):
    if expected is ANY:
        return True
    if isinstance(expected, list) and isinstance(value, list):
        return len(value) == len(expected) and all(map(matches, value, expected))
    return value == expected


def assert_all(results, expected):
    assert len(results) == len(expected)
    mismatches = []
    for number, (call, returns, _) in enumerate(expected):
        value = plain(results[number])
        while value and value[-1] is None:
            value.pop()
        if not matches(value, returns):
            mismatches.append(f"{call}: {value}, not {returns}")
    assert not mismatches


def test_every_function_has_an_example(modules):
    missing = [f"{module}.{name}" for module, name in names_of(modules) if name not in EXAMPLES[module]]
    assert not missing, "see api_examples.py"


@pytest.mark.parametrize("flat", [False, True], ids=["sim.", "sim"])
def test_every_example_returns_its_values_in_lua(tmp_path, modules, flat):
    expected = calls(modules, flat)
    finding = [f"local {name} = sim.getObject('{path}')\n" for name, path in OBJECTS.items()]
    body = [f"check({number}, {call})\n" for number, (call, _, _) in enumerate(expected)]
    results = run(tmp_path / "all.lua", LUA + "".join([*finding, *body, "end"]), modules)
    assert_all(results, expected)


def test_every_example_returns_its_values_in_python(tmp_path, modules):
    expected = calls(modules, flat=False)
    finding = [f"{name} = sim.getObject('{path}')\n" for name, path in OBJECTS.items()]
    body = [f"check({i}, {in_python(call, python)})\n" for i, (call, _, python) in enumerate(expected)]
    results = run(tmp_path / "all.py", PYTHON + "".join(finding) + "".join(body), modules)
    assert_all(results, expected)


@pytest.mark.parametrize("suffix", [".lua", ".py"])
def test_an_ignored_function_is_logged_once(tmp_path, modules, caplog, suffix):
    does_nothing = [
        (f"{module}.{name}", gives)
        for module, groups in ignored.MODULES.items()
        for group in groups
        for name, (_, gives) in group.functions.items()
    ]
    check, end = (LUA, "end") if suffix == ".lua" else (PYTHON, "")
    body = [f"check({number}, {name}(1, 'x'))\n" for number, (name, _) in enumerate([*does_nothing, *does_nothing])]
    with caplog.at_level(logging.INFO):
        results = run(tmp_path / f"ignored{suffix}", check + "".join(body) + end, modules)
    for number, (name, gives) in enumerate(does_nothing):
        values = plain(results[number])
        expected = [gives] if not isinstance(gives, tuple) else plain(gives)
        if gives is ignored.HANDLE:
            assert values[0] > 0, name
        else:
            assert values == expected or (gives is None and not values), name
        log_lines = [one for one in caplog.messages if one.startswith(f"{name}: ")]
        assert len(log_lines) == 1 and log_lines[0].endswith("accepted and ignored (in the script of Drone)"), name


# Functions that return several values in CoppeliaSim 4.9's Python synopses, and how many.
DOCUMENTED = {
    **dict.fromkeys(("checkCollision", "executeScriptString", "getJointInterval", "getJointMode"), 2),
    **dict.fromkeys(("getObjectVelocity", "getPathLengths", "getRotationAxis", "getShapeBB", "getShapeColor"), 2),
    **dict.fromkeys(("getShapeInertia", "getVelocity", "getVisionSensorDepth", "getVisionSensorImg"), 2),
    **dict.fromkeys(("checkDistance", "getShapeGeomInfo", "readForceSensor", "ruckigStep", "getSimulatorMessage"), 3),
    **dict.fromkeys(("readVisionSensor", "handleVisionSensor", "checkVisionSensor"), 3),
    **dict.fromkeys(("yawPitchRollToAlphaBetaGamma", "alphaBetaGammaToYawPitchRoll"), 3),
    **dict.fromkeys(("readProximitySensor", "handleProximitySensor"), 5),
    **dict.fromkeys(("checkProximitySensor", "checkProximitySensorEx"), 5),
}


def test_python_unpacks_every_call_as_coppeliasim_documents_it(modules, tmp_path):
    finding = "".join(f"{name} = sim.getObject('{path}')\n" for name, path in OBJECTS.items())
    mismatches = []
    for name, count in DOCUMENTED.items():
        examples = EXAMPLES["sim"].get(name) or [Example("NAME()", [])]
        for example in (one for one in examples if one.call.startswith("NAME(")):
            is_other_call = example.python.startswith("NAME(") and example.python.endswith(")")
            call = in_python(example.call, example.python if is_other_call else "").replace("NAME", f"sim.{name}")
            values = ", ".join(f"value{number}" for number in range(count))
            try:
                run(tmp_path / "unpack.py", f"{PYTHON}{finding}{values} = {call}\n", modules)
            except ScriptError as error:
                mismatches.append(f"{call}: {error.reason}")
    assert not mismatches


def test_a_missing_packet_of_a_vision_sensor_is_omitted_in_lua(modules, tmp_path):
    camera = f"sim.getObject('{OBJECTS['DEPTH']}')"
    text = f"function sysCall_init() out.take(1, {{select('#', sim.readVisionSensor({camera}))}}) end"
    assert plain(run(tmp_path / "packets.lua", text, modules)[1]) == [2]


@pytest.mark.parametrize(
    ("graph", "draw"), [("simHandleGraph", "simAddDrawingObject"), ("sim.handleGraph", "sim.addDrawingObject")]
)
def test_ignored_functions_are_logged_by_their_name_and_drawings_at_debug_level(new_simulation, caplog, graph, draw):
    with caplog.at_level(logging.DEBUG), caplog.at_level(logging.DEBUG, "drone_sim.script"):
        new_simulation(lua=f"function sysCall_init()\n{graph}(1, 2)\n{draw}(0, 1)\n{draw}(0, 1)\nend")
    log_entries = [
        (one.getMessage().partition(":")[0], one.levelno) for one in caplog.records if "accepted and" in one.message
    ]
    assert log_entries == [(graph, logging.INFO), (draw, logging.DEBUG)]


def test_the_page_of_the_api_is_up_to_date():
    assert make_api.PAGE.read_text(encoding="utf-8") == make_api.text(), "PYTHONPATH=src python docs/make_api.py"
