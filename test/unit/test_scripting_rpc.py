"""Scripts in another process: bit-identical flights, and validation of the messages from that process."""

import contextlib
import json
import marshal
import math
import os
import random
import signal
import socket
import struct
from pathlib import Path

import numpy as np
import pytest

from drone_sim.grading import flight, tasks
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import Flight, script_seed
from drone_sim.mechanics.state import Pose, Twist
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import contents
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.rpc import api_stubs, connection, effects, script_process, script_proxy, values
from drone_sim.scripting.rpc.connection import ScriptConnection
from drone_sim.vehicles.commands import Empty, request

ROOT = Path(__file__).resolve().parents[2]
PLAN = """
duration: 2.0
config: {sensors: {imu: {kind: imu, rate: 20}}, script_time_limit: 30.0}
timeline:
  - {at: 0.25, twist: {linear: [1, 0, 0]}}
  - {at: 0.5, twist: {linear: [0, 0.5, 0.2], angular: [0, 0, 0.5]}}
  - {at: 0.75, object: {name: Ball, position: [1, 0, 2]}}
  - {at: 0.9, twist: {}}
scene: scene.yaml
criteria:
  - {kind: signal, signal: said, equals: 1}
"""
SCENE = "objects: [{name: Ball, shape: sphere, size: [0.2], position: [2, 0, 1]}]\n"
SCRIPTS = sorted(
    [
        *(ROOT / "docs" / "tutorial").glob("[1-7]_*.py"),
        *(ROOT / "docs" / "tutorial" / "solutions").glob("*.py"),
        ROOT / "src" / "drone_sim" / "child_scripts" / "tutorial_v4.lua",
    ]
)
TASKS = [item.name for item in sorted(tasks.folder().iterdir()) if (item / "solution.py").exists()]
# API calls beyond those of the tutorial; each must give the same flight as in this process.
PYTHON = """
import math, random
import tutorial

def sysCall_init():
    tutorial.sysCall_init()
    self.mark = sim.getObjectHandle("Track_base")
    self.ball = sim.getObjectHandle("Ball")
    self.heard = 0
    BEGIN

def sysCall_actuation():
    tutorial.sysCall_actuation()
    ACT

def sysCall_sensing():
    tutorial.sysCall_sensing()
    SENSE

def say(value):
    sim.setStringSignal("said", repr(value))
"""
ACTIONS = {
    "reads what it has put": "for one in (1, 2): sim.setObjectPosition(self.mark, -1, [one, 2, 3]);"
    " say([sim.getObjectPosition(self.mark, -1), sim.getObjectPose(self.d, self.mark), sim.getVelocity(self.mark)])",
    "turns what it has put": "sim.setObjectOrientation(self.mark, self.d, [0.1, 0.2, 0.3]);"
    " say([sim.getObjectQuaternion(self.mark, -1), sim.getObjectVelocity(self.mark), sim.getObjectMatrix(self.mark)])",
    "reads signals that it sets": "sim.setFloatSignal('a', sim.getSimulationTime());"
    " sim.setFloatSignal('b', 2 * sim.getFloatSignal('a')); say([sim.getFloatSignal('b'), sim.getStringSignal('c')])",
    "reads in another way every time": "t = sim.getSimulationTime();"
    " say([sim.getObjectPosition(one, -1) for one in ((self.d,), (self.ball, self.d), ())[int(20 * t) % 3]])",
    "changes what it reads": "p = sim.getObjectPosition(self.d, -1); p[0] = 7; say(sim.getObjectPosition(self.d, -1))",
    "draws lots": "say([random.random(), sim.getRandom()])",
    "asks wrongly": "say(tried(lambda: sim.getObjectPosition(99, -1)) + tried(lambda: sim.getObjectPosition('x'))"
    " + tried(lambda: sim.setFloatSignal('a', 'b')) + tried(lambda: sim.setObjectPosition(self.mark, -1, [1, 2]))"
    " + tried(sim.getObjectPosition) + tried(lambda: sim.setObjectPosition(self.mark, -1, [1, 2, math.nan])))",
    "calls itself": "say(sim.callScriptFunction('twice', sim.handle_self, 3, [1, 'b', b'\\xff', None, {2: 3}]))",
    "calls by attributes": "say(sim.getScriptFunctions(sim.getScriptHandle()).twice(4))",
    "names its arguments": "say(sim.getObjectPosition(self.d, relativeTo=self.mark))",
    "reads more poses than it may announce": "sim.getSimulationTime() < 0.2 and say(sum("
    "tried(lambda: sim.getObjectPosition(1000 + number, -1)) != [] for number in range(300)))",
    "turns a joint": "j = sim.getObjectHandle('Quadricopter_propeller_joint1');"
    " sim.setJointPosition(j, sim.getSimulationTime()); self.tip = getattr(self, 'tip', None) or sim.createDummy(0.1);"
    " sim.setObjectParent(self.tip, j, False); say([sim.getObjectPose(j, -1), sim.getObjectPose(self.tip, -1),"
    " sim.getObjectPosition(self.d, j), sim.getJointPosition(j)])",
    "moves what is on a mark": "m = sim.getObjectChild(self.mark, 0); v = sim.getObjectVelocity(m);"
    " sim.setObjectPosition(self.mark, self.d, [sim.getSimulationTime(), 0, 0]);"
    " say([v, sim.getObjectVelocity(m), sim.getObjectPosition(m, -1), sim.getObjectPosition(m, self.mark)])",
    "moves one mark by another": "self.other = getattr(self, 'other', None) or sim.createDummy(0.1);"
    " sim.setObjectPose(self.other, self.mark, [1, 2, 3, 0, 0, 0, 1]); sim.setObjectPosition(self.mark, self.other,"
    " [0.5, 0, 0]); say([sim.getObjectPose(self.mark, -1), sim.getObjectPose(self.other, -1)]);"
    " sim.setObjectParent(self.other, self.mark, True)",
    "reads sensors": "say(sim.readSensor(sim.getObjectHandle('imu')))",
    "packs": "say(sim.unpackTable(sim.packTable({'a': [1, 2.5, 'c', True]})))",
}
HELPERS = """
on_twist = tutorial.on_twist

def twice(value, *others):
    return 2 * value, *others

def tried(call):
    try:
        return [call()]
    except Exception as error:
        return [type(error).__name__, str(error)]

def heard(message):
    self.heard += 1
    say([self.heard, str(message), message.linear.x])
"""
LUA = """
function sysCall_init()
    d = sim.getObjectHandle('Quadricopter_base')
    mark = sim.getObjectHandle('Track_base')
    simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'heard')
    simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', function(message) x = message.linear.x end)
    n, x = 0, 0
end
function heard(message) n = n + message.linear.x end
function sysCall_thread()
    while true do
        sim.wait(0.3)
        n = n + 1
        sim.setObjectPosition(mark, -1, {n, x, 0})
        sim.switchThread()
    end
end
function sysCall_sensing()
    local p, v = sim.getObjectPosition(d, mark), sim.getObjectVelocity(d)
    local ok, why = pcall(sim.getObjectPosition, 99, -1)
    sim.setStringSignal('said', string.format('%.17g %.17g %d %s', p[1], v[3], n, tostring(why)))
end
"""


@contextlib.contextmanager
def forked_process(serve):
    """Fork a process that calls `serve` with one end of a connection, and yield the other end."""
    here, there = socket.socketpair()
    process = os.fork()
    if not process:
        try:
            here.close()
            serve(there)
        finally:
            os._exit(0)
    there.close()
    try:
        yield here
    finally:
        here.close()
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


def fly_remotely(plan, script, seed=0, serve=None):
    """Return the result of a flight whose script runs in another process, and why its connection was closed."""

    def serve_script(end):
        random.seed(script_seed(seed))
        np.random.seed(script_seed(seed) % 2**32)
        script_process.serve(script_process.ScriptWorker(), end, script)

    with forked_process(serve or serve_script) as end:
        script_connection = ScriptConnection(end)
        result = Flight(plan, script, seed, {}, script_connection).grade()
        return result, script_connection.why_closed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("rpc")
    (directory / "scene.yaml").write_text(SCENE)
    (directory / "plan.yaml").write_text(PLAN)
    (directory / "quick.yaml").write_text(PLAN.replace("limit: 30.0", "limit: 0.2"))
    return directory


@pytest.fixture(scope="module")
def plan(folder):
    return plans.read(folder / "plan.yaml")


@pytest.fixture
def quick(folder):
    return plans.read(folder / "quick.yaml")


def assert_same_flight(plan, script, seed=0):
    """Return the result of a flight, after checking that it is the same with the script in another process."""
    remote_result, why_closed = fly_remotely(plan, str(script), seed)
    assert remote_result == flight.grade(plan, str(script), seed) and not why_closed
    return remote_result


# ---- the same flight


@pytest.mark.parametrize("script", ["pilot", *SCRIPTS], ids=lambda item: "/".join(Path(item).parts[-2:]))
def test_script_flies_the_same_in_another_process(plan, script):
    assert_same_flight(plan, script)


@pytest.mark.parametrize("task", TASKS)
def test_task_solution_flies_the_same_in_another_process(task):
    task_plan = plans.read(tasks.find(task))
    shorter = task_plan.model_copy(update={"duration": min(2.0, task_plan.duration)})
    result = assert_same_flight(shorter, tasks.folder() / task / "solution.py", seed=1)
    assert result.error is None


@pytest.mark.parametrize("where", ["BEGIN", "ACT", "SENSE"])
@pytest.mark.parametrize("what", ACTIONS)
def test_api_calls_give_the_same_results_in_another_process(plan, tmp_path, what, where):
    text = PYTHON.replace(where, ACTIONS[what])
    for other in ("BEGIN", "ACT", "SENSE"):
        text = text.replace(other, "pass")
    path = tmp_path / "does.py"
    path.write_text(text + HELPERS)
    result = assert_same_flight(plan.model_copy(update={"duration": 1.0}), path)
    assert result.error is None and result.flown == 1.0


def test_callback_receives_the_same_messages_in_another_process(plan, tmp_path):
    for given in ("heard", "'heard'"):
        path = tmp_path / "hears.py"
        begin = f"simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', {given})"
        path.write_text(PYTHON.replace("BEGIN", begin).replace("ACT", "pass").replace("SENSE", "pass") + HELPERS)
        assert "Twist(linear=" in assert_same_flight(plan, path).outcomes[0].said


def test_script_thread_waits_the_same_in_another_process(plan, tmp_path):
    path = tmp_path / "waits.py"
    thread = """
def sysCall_thread():
    while True:
        late = sim.wait(0.12)
        say([late, sim.getSimulationTime(), sim.getObjectPosition(self.d, -1)])
        sim.setThreadSwitchTiming(3)
        sim.switchThread()
"""
    path.write_text(PYTHON.replace("BEGIN", "pass").replace("ACT", "pass").replace("SENSE", "pass") + HELPERS + thread)
    assert assert_same_flight(plan, path).error is None


def test_script_thread_and_phases_alternate_in_another_process(plan, tmp_path):
    path = tmp_path / "turns.py"
    act = "self.order = getattr(self, 'order', '') + 'a'; say(self.order)"
    thread = """
def sysCall_thread():
    while True:
        self.order = getattr(self, "order", "") + "t"
        sim.switchThread()
"""
    path.write_text(PYTHON.replace("BEGIN", "pass").replace("ACT", act).replace("SENSE", "pass") + HELPERS + thread)
    assert "tatata" in assert_same_flight(plan, path).outcomes[0].said


def test_lua_script_flies_the_same_in_another_process(plan, tmp_path):
    path = tmp_path / "flies.lua"
    path.write_text(LUA)
    assert "no object with the handle 99" in assert_same_flight(plan, path).outcomes[0].said


@pytest.mark.parametrize(
    "body",
    [
        "sim.getObjectPosition(99, -1)",
        "1 / 0",
        "sim.nothing()",
        "sim.getObjectPosition()",
        "while True: pass",
        "sim.wait(1)",
    ],
)
def test_error_message_is_the_same_in_another_process(quick, tmp_path, body):
    path = tmp_path / "fails.py"
    path.write_text(f"def sysCall_actuation():\n    {body}\n")
    assert assert_same_flight(quick, path).error.startswith(f"[actuation] {path}:2: ")


def test_controller_needs_no_more_than_two_messages_per_step(plan, monkeypatch):
    received = []
    receive = connection.Channel.receive
    monkeypatch.setattr(connection.Channel, "receive", lambda self: received.append(receive(self)) or received[-1])
    longer = plan.model_copy(update={"timeline": [], "duration": 10.0})
    fly_remotely(longer, "pilot")
    assert len([item for item in received if item]) < 2.1 * 200 + 100  # two in each of 200 steps, and the start


# ---- values


@pytest.mark.parametrize(
    "value",
    [
        *(
            None,
            True,
            3,
            2.5,
            math.inf,
            "é\ud800",
            b"\xff\0",
            [],
            [1, [2.5, None]],
            (1, (2, "x")),
            {},
            {"a": 1, 2: (3,)},
        ),
        *([{"t": [1]}], Twist(), Empty(), request(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)))),
    ],
    ids=repr,
)
def test_values_survive_the_round_trip_between_processes(value):
    there = values.incoming(marshal.loads(marshal.dumps(values.outgoing(value))), int, int)
    assert repr(there) == repr(value)
    if not hasattr(value, "_fields"):
        here = values.unmarked(values.read(values.written([["set", values.marked(value, id)]]))[0][1], int)
        assert repr(here) == repr(value)


def test_effect_tables_name_only_existing_functions():
    apis = listing.apis()
    known = {f"{name}.{key}" for name, api in apis.items() for key in contents(api)[1]}
    named = {*effects.READS, *effects.POSE_READS, *effects.CHANGES}
    own = {f"sim.{item}" for names in effects.OWN.values() for item in names.split()}
    assert named | own <= known
    modules = api_stubs.ApiStubs(None, None, Turns()).modules
    assert modules.keys() == apis.keys()
    assert modules["sim"].packInt32Table([1]) == b"\x01\0\0\0"  # runs in this process: there is no connection


# ---- messages from a compromised process

INVALID_MESSAGES = {
    "no JSON": (b"\x80\x04N.", "invalid message: not JSON"),
    "a text": (b'"x"', "list of items"),
    "items that are none": (b'[1, "x", []]', "list of items"),
    "no end of it": (b"[" * 100_000, "invalid message: not JSON"),
    "numbers without end": (b"[" + b"9" * 100_000 + b"]", "invalid message: not JSON"),
    "a function that is none": (
        json.dumps([["call", "os.system", [], "id"]]).encode(),
        "unknown function of the API",
    ),
    "a function by a list": (json.dumps([["call", ["x"], []]]).encode(), "unknown function of the API"),
    "an attribute": (json.dumps([["call", "sim.__class__", []]]).encode(), "unknown function of the API"),
    "an order": (json.dumps([["quit"]]).encode(), "unknown reply 'quit'"),
    "a call without all": (json.dumps([["call"]]).encode(), "malformed call"),
    "a question not waited for": (json.dumps([["set", "sim.stopSimulation"]]).encode(), "needs a reply"),
    "reads that are calls": (json.dumps([["reads", [["sim.stopSimulation"]]]]).encode(), "a read"),
    "too many reads": (json.dumps([["reads", [["sim.getSimulationTime"]] * 201]]).encode(), "too many"),
    "no list of reads": (json.dumps([["reads", 1]]).encode(), "malformed list of reads"),
    "a pose of a text": (json.dumps([["reads", [["pose", "x"]]]]).encode(), "not a read"),
    "a result of load that is none": (json.dumps([["end", False, [1, 2]]]).encode(), "malformed result of load"),
    "no result of load": (json.dumps([["end", False, None]]).encode(), "malformed result of load"),
    "an end with more": (json.dumps([["end", 1, 2, 3, 4]]).encode(), "malformed end of a call"),
    "a failure of numbers": (json.dumps([["failed", 1, 2, 3, 4, 5]]).encode(), "malformed failure"),
    "a mark that is none": (json.dumps([["end", True, {"x": 1}]]).encode(), "unknown mark"),
    "fields of its own": (json.dumps([["end", True, {"o": [["__class__", 1]]}]]).encode(), "unknown field"),
    "a mapping of lists": (json.dumps([["end", True, {"d": [[[1], 1]]}]]).encode(), "not a valid key"),
}


@pytest.mark.parametrize("what", INVALID_MESSAGES)
def test_invalid_message_ends_the_flight_with_one_line(plan, what):
    message, said = INVALID_MESSAGES[what]

    def serve(end):
        end.sendall(struct.pack("<I", len(message)) + message)
        end.recv(2**20)

    result, why_closed = fly_remotely(plan, "pilot", serve=serve)
    assert not result.passed and result.points == 0
    assert said in result.error and said in why_closed and "\n" not in result.error


def test_announced_length_that_never_arrives_ends_the_flight(plan):
    result, _ = fly_remotely(plan, "pilot", serve=lambda end: end.sendall(struct.pack("<I", 2**32 - 1)))
    assert result.error.endswith("its process has ended")


def test_silent_script_process_times_out(quick, monkeypatch):
    monkeypatch.setattr(script_proxy, "GRACE", 0.2)
    result, _ = fly_remotely(quick, "pilot", serve=lambda end: end.recv(1) and end.recv(2**20) and end.recv(1))
    assert "did not return after 0.2 s (script_time_limit)" in result.error


def test_script_process_that_floods_messages_times_out(quick, monkeypatch):
    monkeypatch.setattr(script_proxy, "GRACE", 0.2)
    message = json.dumps([["set", "sim.setInt32Signal", "said", 1]]).encode()

    def serve(end):
        while True:
            end.sendall(struct.pack("<I", len(message)) + message)

    result, _ = fly_remotely(quick, "pilot", serve=serve)
    assert "did not return after 0.2 s (script_time_limit)" in result.error
