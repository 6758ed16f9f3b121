"""CoppeliaSim's ZeroMQ remote API: requests of a client and the replies of the server."""

import logging
import math
import socket
import struct
import threading
from types import SimpleNamespace

import cbor2
import numpy as np
import pytest
import zmq
from remote_client import Client, Refusal, official_client
from vrep_encoder import chunk, file, integers, mesh, numbers, scene_object, shape

from drone_sim.remote.conversation import RemoteApi
from drone_sim.remote.remote_api import start_server
from drone_sim.remote.server import RemoteApiServer
from drone_sim.remote.standalone import play
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.drawings import Drawings

SCRIPT = """
def turned(text, *numbers):
    return text[::-1], list(reversed(numbers))

def sysCall_actuation():
    if sim.getInt32Signal('fail'):
        raise RuntimeError('as it was told')
"""


class Radio:
    """A ROS backend whose messages and service requests come from the test."""

    def __init__(self):
        self.callbacks = {}

    def subscribe(self, topic, kind, take):
        self.callbacks[topic] = take
        return lambda: self.callbacks.pop(topic)

    def serve(self, name, kind, ask):
        self.callbacks[name] = ask
        return lambda: self.callbacks.pop(name)


class Stage:
    """A stopped simulation, its server and its clients."""

    def __init__(self, script):
        self.radio = Radio()
        self.drawings = Drawings()
        values = {"script": str(script), "vehicles": {"drone": {}, "other": {"position": [1, 1, 0.8]}}}
        self.simulation = Simulation(parameters.load(values), drawings=self.drawings, backend=self.radio, started=False)
        self.player = Player(self.simulation, lambda _state: None, simulated_time=False)
        self.now = 0.0  # s
        self.server = RemoteApiServer(self.player, "127.0.0.1", 0, self.radio, lambda: self.now)
        self.clients = []

    def client(self, *arguments, **fields):
        self.clients.append(Client(self.server, *arguments, **fields))
        return self.clients[-1]

    def run_steps(self, steps=1):
        """Run up to `steps` steps, as far as the clients permit."""
        for _ in range(steps):
            if self.player.playing and not self.server.holds:
                self.player.step()

    def send_and_wait(self, client, function, *arguments):
        """Send a request that is not answered at once, and serve until it waits."""
        before = len(self.server._waiting)
        client.send(function, *arguments)
        assert self.wait_until(lambda: len(self.server._waiting) > before)

    def wait_until(self, condition):
        """Serve until the condition holds; return whether it does."""
        for _ in range(5000):
            if condition():
                return True
            self.server.wait(0.001)
        return False


@pytest.fixture(name="theatre", scope="module")
def _theatre(tmp_path_factory):
    script = tmp_path_factory.mktemp("remote") / "script.py"
    script.write_text(SCRIPT)
    stage = Stage(script)
    yield stage
    stage.server.close()
    stage.simulation.close()


@pytest.fixture(name="stage")
def _stage(theatre):
    yield theatre
    for client in theatre.clients:
        client.vanish()
    theatre.clients.clear()
    assert theatre.wait_until(lambda: not theatre.server._clients)
    theatre.player.start()  # so that the stop also resets objects that were moved while stopped
    theatre.player.stop()


# ---- calls


def test_info_lists_functions_and_constants(stage):
    client = stage.client()
    assert client.call("zmqRemoteApi.require", "sim") is None
    known = client.call("zmqRemoteApi.info", "sim")
    assert known["getObjectPosition"] == known["step"] == {"func": {}}
    assert known["handle_world"] == {"const": -1} and known["simulation_stopped"] == {"const": 0}
    assert "publish" in client.call("zmqRemoteApi.info", "simROS")


def test_functions_return_nothing_one_or_several_values(stage):
    client = stage.client()
    drone = client.sim("getObject", "/Quadcopter")
    assert client.sim("getObjectPosition", drone, -1) == [0, 0, 0.8]
    assert client.sim("getObjectVelocity", drone) == ([0, 0, 0], [0, 0, 0])
    assert client.sim("setObjectPosition", drone, -1, [0, 0, 1]) is None
    assert client.sim("getObjectPosition", drone, None) == [0, 0, 1]


def test_relative_paths_of_a_client_begin_at_the_root(stage):
    client = stage.client()
    floor, other = client.sim("getObject", "/Floor"), client.sim("getObject", "Quadricopter#0")
    assert client.sim("getObject", ":/Floor") == client.sim("getObject", "./Floor") == floor
    assert client.sim("getObject", ":/Quadcopter[1]") == other
    assert client.sim("getObject", "./base/target", {"index": 1}) == client.sim("getObject", "DronePosition#0")
    assert client.sim("getObject", "./base", {"proxy": other}) == client.sim("getObject", "/Quadcopter[1]/base")


def test_a_script_is_an_object_below_its_vehicle(stage):
    client = stage.client()
    stage.player.start()
    script = client.sim("getObject", "/Quadcopter/Script")
    assert client.sim("callScriptFunction", "turned", script, "abc", 1, 2) == ("cba", [2, 1])
    assert client.sim("getObjectParent", script) == client.sim("getObject", "/Quadcopter")


def test_collections(stage):
    client = stage.client()
    drone, whole, tree = client.sim("getObject", "/Quadcopter"), client.sim("createCollection", 0), -6
    client.sim("addItemToCollection", whole, tree, drone, 0)
    assert drone in client.sim("getCollectionObjects", whole)
    other = client.sim("getObject", "/Quadcopter[1]")
    assert client.sim("checkDistance", whole, other)[2] == [drone, other]
    client.sim("destroyCollection", whole)


def test_the_objects_of_every_vehicle_are_accessible(stage):
    client = stage.client()
    other = client.sim("getObject", "Quadricopter#0")
    assert client.sim("getObjectPosition", other) == pytest.approx([1, 1, 0.8])
    client.sim("setJointPosition", client.sim("getObject", "Quadricopter_propeller_joint1#0"), 1.5)
    assert 1.5 in stage.simulation.vehicles["other"].propulsion.blades.angles.values()


@pytest.mark.parametrize(
    ("function", "arguments", "said"),
    [
        ("sim.getObject", ["/Quadcoptr"], "sim.getObject: there is no object '/Quadcoptr'; near names are"),
        ("sim.getObjectPosition", [], "sim.getObjectPosition: wrong number of values"),
        ("sim.setObjectPosition", [1, -1, [math.nan, 0, 0]], "finite numbers are expected"),
        ("sim.setObjectPosition", [1, -1, [10**400, 0, 0]], "finite numbers are expected"),
        ("sim.setObjectPose", [1, -1, [0, 0, 1, 0, 0, 0, math.nan]], "finite numbers are expected"),
        ("sim.setObjectPose", [1, -1, [math.inf, 0, 1, 0, 0, 0, 1]], "finite numbers are expected"),
        ("sim.setObjectPose", [1, -1, [0, 0, 1, 0, 0, 0, 0]], "expected a quaternion that is not zero"),
        ("sim.setObjectMatrix", [1, -1, [math.nan] * 12], "finite numbers are expected"),
        ("sim.addForceAndTorque", [1, [0, 0, math.inf], [0, 0, 0]], "finite numbers are expected"),
        ("sim.addDrawingObject", [0, math.nan, 0, -1, 10], "finite numbers are expected"),
        ("sim.createDummy", [math.nan], "finite numbers are expected"),
        ("sim.getObjct", ["/Floor"], "sim has no 'getObjct'; near names are getObject"),
        ("sim.handle_world", [], "handle_world is not a function"),
        ("os.system", ["ls"], "no function 'os.system'"),
        ("__import__", ["os"], "no function '__import__'"),
        ("zmqRemoteApi.require", ["simIK"], "there is no plugin simIK here: inverse kinematics is not supported"),
        ("zmqRemoteApi.info", [[1]], "expected (module: Name)"),
        ("sim.getObjectPosition", [10**400], "no object with the handle"),
        ("sim.wait", ["long"], "sim.wait: a number is expected"),
        ("sim.testCB", [1, 2, 3], "expected a function of the client"),
        ("_*executed*_", [1], "no call of this client waits"),
    ],
)
def test_an_error_is_returned_in_one_line(stage, function, arguments, said):
    reply = stage.client().ask(function, *arguments)
    assert said in reply["err"] and "\n" not in reply["err"]
    assert reply["success"] is False and reply["error"] == reply["err"]


def test_an_internal_error_logs_a_traceback_at_debug_level(stage, monkeypatch, caplog):
    caplog.set_level(logging.DEBUG, "drone_sim.remote.server")
    client = stage.client()
    monkeypatch.setattr(stage.simulation.context.objects, "path", lambda *_: 1 // 0)
    assert client.ask("sim.getObjectAlias", 1, 2)["success"] is False
    assert any("ZeroDivisionError" in (one.exc_text or "") for one in caplog.records)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"GET / HTTP/1.1",
        b'{"func": "sim.getSimulationTime", "args": []}',
        b"\x81" * 100_000,
        b"\x9b\x0f" + b"\xff" * 7,
        cbor2.dumps([1, 2]),
        cbor2.dumps({"args": []}),
        cbor2.dumps({"func": 3}),
        cbor2.dumps({"func": "x" * 1000}),
        cbor2.dumps({"func": "sim.getObject", "args": "/Floor"}),
        cbor2.dumps({"func": "sim.getObject", "args": 7}),
        cbor2.dumps({"func": "sim.getObject", "args": [], "uuid": ["x"]}),
        cbor2.dumps({"func": "sim.getObject", "args": [cbor2.CBORTag(4, [10**9, 1])]}),
        cbor2.dumps({"func": "sim.getObject", "args": [cbor2.CBORTag(86, b"123")]}),
        cbor2.dumps({"func": "sim.getObject", "args": [cbor2.CBORTag(28, [cbor2.CBORTag(29, 0)])]}),
        cbor2.dumps({"func": "sim.getObject", "args": [{(1, 2): 3}]}),
    ],
)
def test_an_invalid_request_gets_an_error_reply_and_changes_nothing(stage, payload):
    client = stage.client()
    client.send_bytes(payload)
    assert "\n" not in client.reply()["err"]
    assert client.sim("getSimulationState") == 0


def test_a_huge_message_and_one_without_return_path_do_no_harm(stage):
    stage.client(zmq.DEALER).send_bytes(b"\x00" * (9 * 1024 * 1024))
    stage.client(zmq.PUSH).send_bytes(b"?")
    assert stage.client().sim("getSimulationTime") == 0.0


START = cbor2.dumps({"func": "sim.startSimulation", "args": []})
UNVERSIONED = b"\1\0" + b"\1\0" + bytes([1 + len(START), 0]) + START  # ZMTP 1.0: no identity, no return path, a request
SIGNATURE = b"\xff" + bytes(8) + b"\x7f"
GREETING = SIGNATURE + b"\3\1NULL" + bytes(16 + 1 + 31)
READY = b"\4\x26\5READY\x0bSocket-Type\0\0\0\3REQ\x08Identity\0\0\0\0"
CONVERSATION = GREETING + READY + b"\1\0" + bytes([0, len(START)]) + START
BROWSER = b"Host: 127.0.0.1:23000\r\nUser-Agent: Mozilla/5.0 (X11; Linux x86_64; rv:128.0) Firefox/128.0\r\n"


def is_closed(peer):
    """Return whether the server has ended a connection."""
    try:
        return peer.recv(4096) == b""
    except BlockingIOError:
        return False
    except ConnectionResetError:
        return True


@pytest.mark.parametrize(
    "sent",
    [
        b"\1\0\2\0x",
        b"GET / HTTP/1.1\r\n" + BROWSER + b"Accept: */*\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + BROWSER + b"Connection: Upgrade\r\nUpgrade: websocket\r\n\r\n" + CONVERSATION,
        2 * (b"POST / HTTP/1.1\r\n" + BROWSER + b"Content-Length: %d\r\n\r\n" % len(CONVERSATION) + CONVERSATION),
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + UNVERSIONED,
        b"\x16\3\1\2\0\1\0\1\xfc\3\3" + bytes(512),  # TLS
        UNVERSIONED,
        b"\xff" + bytes(7) + b"\1\0" + UNVERSIONED[2:],  # the same in frames of the long form
        SIGNATURE + b"\0\5\0\0" + UNVERSIONED,
        SIGNATURE + b"\1\5\0\0" + b"\1\0" + bytes([0, len(START)]) + START,  # ZMTP 2.0
        GREETING[:12] + b"PLAIN" + bytes(15 + 1 + 31),
    ],
)
def test_a_peer_that_does_not_speak_zmtp_3_is_disconnected(stage, sent):
    with socket.create_connection(("127.0.0.1", stage.server.port), timeout=60) as peer:
        peer.sendall(sent)
        peer.setblocking(False)
        assert stage.wait_until(lambda: is_closed(peer))
    assert not stage.server._clients
    assert stage.client().sim("getSimulationState") == 0


def test_the_message_format_of_version_1_is_supported(stage):
    client = stage.client()
    client.fields = {}
    assert client.ask("sim.getSimulationTime") == {"success": True, "ret": [0.0]}
    assert client.ask("sim.nothing")["error"].startswith("sim has no 'nothing'")


def test_numbers_and_buffers_keep_their_types(stage):
    client = stage.client()
    floats = struct.pack("<2f", 1.0, 2.5)
    client.sim("setStringSignal", "buffer", floats)
    assert client.sim("getStringSignal", "buffer") == floats
    client.sim("setStringSignal", "buffer", "text")
    assert client.sim("getStringSignal", "buffer") == b"text"
    place = cbor2.CBORTag(86, np.array([1.0, 2.0, 3.0]).tobytes())  # RFC 8746
    drone = client.sim("getObject", "/Quadcopter")
    client.sim("setObjectPosition", drone, -1, place)
    assert client.sim("getObjectPosition", drone) == [1, 2, 3]


def test_an_image_is_returned_as_bytes_with_its_size(stage):
    client = stage.client()
    image, size = client.sim("getVisionSensorImg", client.sim("getObject", "FloorVision#0"))
    assert size == [256, 256] and isinstance(image, bytes) and len(image) == 256 * 256 * 3


# ---- start, stop, and objects moved before the start


def test_start_pause_and_stop(stage):
    client = stage.client()
    states = [client.sim("getSimulationState")]
    for function in ("startSimulation", "pauseSimulation", "startSimulation", "startSimulation", "stopSimulation"):
        client.sim(function)
        states.append(client.sim("getSimulationState"))
    assert states == [0, 17, 8, 17, 17, 0]


def test_objects_moved_while_stopped_start_at_their_new_positions(stage):
    client = stage.client()
    drone, target = client.sim("getObject", "/Quadcopter"), client.sim("getObject", "/target")
    client.sim("setObjectPosition", drone, -1, [0.5, 0, 2])
    client.sim("setObjectPosition", target, -1, [1, 2, 3])
    client.sim("startSimulation")
    assert client.sim("getObjectPosition", drone) == pytest.approx([0.5, 0, 2])
    assert client.sim("getObjectPosition", target) == pytest.approx([1, 2, 3])
    other = client.sim("getObject", "Quadricopter#0")
    assert client.sim("getObjectPosition", other) == pytest.approx([1, 1, 0.8])
    client.sim("stopSimulation")
    assert client.sim("getObjectPosition", drone) == pytest.approx([0, 0, 0.8])


def test_the_step_call_of_a_client_raises_the_error_of_a_script(stage):
    client = stage.client()
    client.sim("setStepping", True)
    client.sim("startSimulation")
    client.sim("setInt32Signal", "fail", 1)
    stage.send_and_wait(client, "sim.step")
    stage.run_steps()
    reply = client.reply()
    assert reply["err"].startswith("[actuation]") and reply["err"].endswith("as it was told")
    assert client.sim("getSimulationState") == 0
    assert client.sim("step") is None  # stopped: there is nothing to wait for


def test_start_simulation_raises_an_error_if_the_scene_cannot_be_started(stage, monkeypatch):
    def fail(*_):
        raise ParameterError("scene/objects: it is not there")

    monkeypatch.setattr(stage.simulation, "start", fail)
    with pytest.raises(Refusal, match="it is not there"):
        stage.client().sim("startSimulation")


# ---- steps


def test_every_step_waits_for_the_stepping_client(stage):
    client = stage.client()
    assert client.sim("setStepping", True) == 0
    client.sim("startSimulation")
    stage.run_steps(3)
    assert client.sim("getSimulationTime") == 0
    for count in (1, 2, 3):
        stage.send_and_wait(client, "sim.step", True)
        stage.run_steps(5)
        assert client.reply()["ret"] == []
        assert client.sim("getSimulationTime") == pytest.approx(0.05 * count)


def test_a_step_waits_for_all_stepping_clients(stage):
    first, second, reader = stage.client(), stage.client(), stage.client()
    first.sim("setStepping", True)
    second.sim("setStepping", True)
    first.sim("startSimulation")
    stage.send_and_wait(first, "sim.step")
    stage.run_steps()
    assert reader.sim("getSimulationTime") == 0
    stage.send_and_wait(second, "sim.step")
    stage.run_steps()
    assert first.reply()["ret"] == second.reply()["ret"] == []
    assert reader.sim("getSimulationTime") == pytest.approx(0.05)
    second.sim("setStepping", False)
    stage.send_and_wait(first, "sim.step")
    stage.run_steps()
    assert first.answered()


def test_stepping_levels_are_counted_and_a_stop_ends_stepping_for_all_clients(stage):
    client, other = stage.client(), stage.client()
    client.sim("setStepping", True)
    assert client.sim("setStepping", True) == 1
    assert client.sim("setStepping", False) == 2
    other.sim("acquireLock")
    client.sim("startSimulation")
    assert stage.server.holds
    other.sim("stopSimulation")
    assert not stage.server.holds and client.sim("setStepping", False) == 0


def test_a_lock_holds_the_simulation(stage):
    client = stage.client()
    client.sim("startSimulation")
    client.sim("acquireLock")
    stage.run_steps()
    assert client.sim("getSimulationTime") == 0
    client.sim("releaseLock")
    stage.run_steps()
    assert client.sim("getSimulationTime") == pytest.approx(0.05)


def test_waiting_for_simulation_time_runs_the_steps(stage):
    client = stage.client()
    client.sim("setStepping", True)
    client.sim("startSimulation")
    stage.send_and_wait(client, "sim.wait", 0.1)
    stage.run_steps(4)
    assert client.reply()["ret"] == [0.1]
    assert client.sim("getSimulationTime") == pytest.approx(0.1)
    stage.send_and_wait(client, "sim.wait", 5, False)  # seconds of real time
    stage.now += 5.0
    assert client.reply()["ret"] == [5]


def test_waiting_for_a_signal(stage):
    client, other = stage.client(), stage.client()
    client.send("sim.waitForSignal", "go")
    assert not client.answered(looks=3)
    other.sim("setFloatSignal", "go", 1.5)
    assert client.reply()["ret"] == [1.5]
    assert client.sim("getSystemTime") == stage.now


@pytest.mark.parametrize("how", ["vanish", "goodbye", "silence"])
def test_a_disconnected_client_does_not_hold_the_simulation(stage, how):
    client = stage.client(timeout=60.0)
    client.sim("setStepping", True)
    client.sim("startSimulation")
    assert stage.server.holds
    if how == "vanish":
        client.vanish()
        stage.clients.remove(client)
    elif how == "goodbye":
        assert client.ask("_*end*_") == {"success": True, "ret": []}
    else:
        stage.now += 61.0
    assert stage.wait_until(lambda: not stage.server.holds)
    stage.run_steps(2)
    assert stage.simulation.steps == 2


# ---- callbacks of the client


def test_a_callback_of_the_client_may_make_requests(stage):
    client = stage.client()
    callback_request = client.ask("sim.testCB", "a", "mine@func", "b", 1)
    assert callback_request == {"func": "mine", "args": ["a", "b"]}
    assert client.sim("getSimulationTime") == 0.0  # during the callback
    assert client.ask("_*executed*_", 1) == callback_request
    assert client.ask("_*executed*_", 1, 2)["ret"] == [1, 2]


def test_a_motion_calls_the_callback_of_the_client_in_every_step(stage):
    client = stage.client()
    client.sim("startSimulation")
    limits = {"maxVel": [1.0], "maxAccel": [2.0], "maxJerk": [10.0]}
    reply = client.ask("sim.moveToConfig", {"pos": [0.0], "targetPos": [1.0], **limits, "callback": "moved@func"})
    positions, waiting = [], stage.server._waiting
    while "func" in reply:
        assert reply["func"] == "moved"
        positions.append((stage.simulation.time, reply["args"][0]["pos"][0]))
        client.send("_*executed*_", False)
        assert stage.wait_until(lambda: waiting)
        stage.run_steps()
        reply = client.reply()
    assert [time for time, _ in positions] == pytest.approx([0.05 * step for step in range(34)])
    assert positions[-1][1] == reply["ret"][0]["pos"][0] == 1.0


def test_a_motion_while_stopped_is_executed_at_once(stage):
    client = stage.client()
    limits = [[1.0], [2.0], [10.0]]
    reply = client.ask("sim.moveToConfig", -1, [0.0], None, None, *limits, [1.0], None, "moved@func")
    calls = 0
    while "func" in reply:
        calls, (position, _, _, _) = calls + 1, reply["args"]
        reply = client.ask("_*executed*_")
    assert calls == 34
    assert reply["ret"][0] == position == [1.0]


def test_a_motion_of_too_many_steps_while_stopped_is_refused(stage):
    slow = {"pos": [0.0], "targetPos": [1.0], "maxVel": [1e-6], "maxAccel": [1.0], "maxJerk": [1.0]}
    reply = stage.client().ask("sim.moveToConfig", slow)
    assert "sim.moveToConfig: more than 10000 steps: start the simulation first" in reply["err"]


def test_a_failed_callback_leaves_the_client_usable(stage):
    client = stage.client()
    for _ in range(40):
        assert "func" in client.ask("sim.testCB", "a", "mine@func", "b")
    assert client.sim("getSimulationTime") == 0.0


def test_ros_messages_are_delivered_before_a_reply(stage):
    client = stage.client()
    client.sim("startSimulation")
    handle = client.call("simROS.subscribe", "/gate", "std_msgs/Float64", "on_gate@func", 2)
    for value in (1.0, 2.0, 3.0):
        stage.radio.callbacks["/gate"](SimpleNamespace(__slots__=["data"], data=value))
    assert client.ask("sim.getSimulationTime") == {"func": "on_gate", "args": [{"data": 2.0}]}
    assert client.ask("_*executed*_") == {"func": "on_gate", "args": [{"data": 3.0}]}
    assert client.ask("_*executed*_")["ret"] == [0.0]
    client.call("simROS.shutdownSubscriber", handle)
    assert "/gate" not in stage.radio.callbacks


def test_a_ros_service_of_a_client_is_answered_by_its_callback(stage):
    client, answers = stage.client(), []
    client.sim("startSimulation")
    client.call("simROS.advertiseService", "/gate", "std_srvs/Trigger", "on_gate@func")
    ask = stage.radio.callbacks["/gate"]
    thread = threading.Thread(target=lambda: answers.append(ask({"data": 1}, dict)))
    thread.start()
    while client.ask("sim.getSimulationTime") != {"func": "on_gate", "args": [{"data": 1}]}:
        thread.join(0.001)
    assert client.ask("_*executed*_", {"success": True})["ret"] == [0.0]
    thread.join(10)
    assert answers == [{"success": True}]


@pytest.mark.parametrize("how", ["stop", "vanish"])
def test_subscriptions_and_drawings_of_a_client_are_removed(stage, how):
    client, other = stage.client(), stage.client()
    other.sim("startSimulation")
    client.call("simROS.subscribe", "/gate", "std_msgs/Float64", "on_gate@func")
    client.sim("addDrawingObject", 0, 5, 0, -1, 10)
    remaining = other.sim("addDrawingObject", 0, 5, 0, -1, 10)
    if how == "vanish":
        client.vanish()
        stage.clients.remove(client)
        assert stage.wait_until(lambda: list(stage.drawings.objects) == [remaining])
    else:
        other.sim("stopSimulation")
        assert not stage.drawings.objects
        client.sim("getSimulationState")
    assert not stage.radio.callbacks


def test_a_client_calls_a_function_of_the_drones_script(stage):
    client = stage.client()
    client.sim("startSimulation")
    script = client.sim("getScript", 1, client.sim("getObject", "/Quadcopter"))
    assert client.sim("callScriptFunction", "turned", script, "abc", 1, 2) == ("cba", [2, 1])
    with pytest.raises(Refusal, match="near names are turned"):
        client.sim("callScriptFunction", "turnd", script)


# ---- parameters, and the official client


def test_no_server_is_started_by_default():
    assert type(start_server(parameters.load().remote_api, None)) is RemoteApi


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("serve", "yes", "remote_api/serve"),
        ("port", 70000, "remote_api/port = 70000"),
        ("address", "a b", "remote_api/address"),
        ("addres", "127.0.0.1", "address"),
    ],
)
def test_a_wrong_parameter_gives_a_one_line_error(key, value, said):
    with pytest.raises(ParameterError, match=said) as caught:
        parameters.load({"remote_api": {key: value}})
    assert "\n" not in str(caught.value)


def test_the_error_names_an_address_that_cannot_be_opened(stage):
    for address, port in (("127.0.0.1", stage.server.port), ("nowhere.invalid", 0)):
        with pytest.raises(OSError, match=f"remote_api: cannot listen on {address}:{port}: "):
            RemoteApiServer(stage.player, address, port)


def test_the_official_client_controls_a_flight():
    finished, listening, ports = threading.Event(), threading.Event(), []

    def serve():
        values = {"script": "target", "real_time_factor": 0, "remote_api": {"serve": True, "port": 0}}
        play(parameters.load(values), finished.is_set, lambda server: (ports.append(server.port), listening.set()))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        assert listening.wait(60)
        sim = official_client(ports[0]).require("sim")
        assert sim.getSimulationState() == sim.simulation_stopped
        sim.setStepping(True)
        sim.startSimulation()
        base, target = sim.getObject("/Quadcopter/base"), sim.getObject("/target")
        for count in range(1, 81):
            sim.setObjectPosition(target, [0.0, 0.0, 0.79 + min(0.01 * count, 0.5)])
            sim.step()
        assert sim.getSimulationTime() == pytest.approx(4.0)
        assert sim.getObjectPosition(base)[2] == pytest.approx(1.29, abs=0.05)
        assert sim.testCB("Paul", lambda a, b: (b, a), "Jeanine") == ["Jeanine", "Paul"]
        assert sim.unpackFloatTable(sim.packFloatTable([1.0, 2.5])) == [1.0, 2.5]
        with pytest.raises(Exception, match="near names are /Quadcopter"):
            sim.getObject("/Quadcoptr")
        created = sim.createPureShape(0, 8, [0.2, 0.2, 0.2], 1.0)
        sim.stopSimulation()
        assert sim.getSimulationState() == sim.simulation_stopped
        assert not sim.isHandle(created)
        box = sim.createPureShape(0, 8, [0.2, 0.2, 0.2], 1.0)
        sim.setObjectPosition(box, [4.0, 0.0, 3.0])
        sim.setShapeColor(box, "", sim.colorcomponent_ambient_diffuse, [1, 0, 0])
        sim.setStepping(True)
        sim.startSimulation()
        assert sim.getObjectPosition(box) == pytest.approx([4, 0, 3])
        (copy,) = sim.copyPasteObjects([box], 0)
        sim.stopSimulation()
        assert sim.isHandle(box) and not sim.isHandle(copy)
        sim.removeObjects([box])
        with pytest.raises(Exception, match="no object with the handle"):
            sim.removeObjects([box])
    finally:
        finished.set()
        thread.join()


# ---- CoppeliaSim's own scenes


def test_a_scene_of_coppeliasim_is_loaded_from_the_folder_of_scenes(tmp_path):
    """As in CoppeliaSim's example pController, whose scene has no vehicle."""
    (tmp_path / "messaging").mkdir()
    motor = integers("Jtt", 10) + numbers("_mp", "Dmp", 0, 100) + chunk("Va9", b"\x11") + integers("Jmd", 5)
    arm = shape(2, "Arm", mesh(size=(1, 0.1, 0.1)), parent=1, at=(0.5, 0, 0.2), dynamic=True)
    posts = (
        shape(number, name, mesh(), at=(0, 3.0 * number, 1), alias="Post") for number, name in ((0, "A"), (3, "B"))
    )
    scene = file(*posts, scene_object("JNT", 1, "joint", 0, own=motor), arm)
    (tmp_path / "messaging" / "arm.ttt").write_bytes(scene)
    loaded = parameters.load({"remote_api": {"scenes": str(tmp_path)}})
    simulation = Simulation(loaded, started=False)
    player = Player(simulation, lambda _state: None, simulated_time=False)
    server = RemoteApiServer(player, "127.0.0.1", 0)
    client = Client(server)
    try:
        constants = client.call("zmqRemoteApi.info", "sim")
        folder = client.sim("getStringParam", constants["stringparam_scenedefaultdir"]["const"])
        with pytest.raises(Refusal, match=r"'../arm.ttt': must be the name of a .yaml or .ttt file"):
            client.sim("loadScene", "../arm.ttt")
        assert client.sim("loadScene", f"{folder}/messaging/arm.ttt") == 1
        assert not simulation.vehicles
        joint = client.sim("getObject", "/Post[0]/joint")
        client.sim("setJointTargetVelocity", joint, 1.0)
        client.sim("setStepping", True)
        client.sim("startSimulation")
        for _ in range(20):
            player.step()
        assert client.sim("getJointPosition", joint) == pytest.approx(1.0, abs=0.1)
        client.sim("stopSimulation")
        assert client.sim("getJointPosition", joint) == 0
        with pytest.raises(Refusal, match="no script is attached to 'Drone'"):
            client.sim("getScriptHandle")
        assert client.sim("loadScene", "") == 1 and list(simulation.vehicles) == ["drone"]
    finally:
        client.vanish()
        server.close()
        simulation.close()


def test_objects_created_while_stopped_stay_through_start_and_stop(stage):
    client = stage.client()
    created = client.sim("createDummy", 0.01)
    client.sim("setObjectPosition", created, -1, [0.1, 0.2, 0.3])
    client.sim("startSimulation")
    stage.run_steps(2)
    client.sim("setObjectPosition", created, -1, [5, 5, 5])
    client.sim("stopSimulation")
    assert client.sim("getObjectPosition", created, -1) == pytest.approx([0.1, 0.2, 0.3])
    client.sim("removeObject", created)
