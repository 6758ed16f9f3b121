"""V-REP's legacy remote API (`simxStart`): requests of a client and the replies of the server."""

import logging
import socket
import struct
import time

import pytest
from legacy_client import (
    BLOCKING,
    DISCONTINUE,
    FAILED,
    ONESHOT,
    PACKET,
    SPLIT,
    STREAMING,
    Client,
    Reply,
    command,
    floats,
    ints,
    message,
    packets,
    text,
)

from drone_sim.remote.legacy import session
from drone_sim.remote.legacy.server import LegacyServer
from drone_sim.remote.legacy.wire import Packets
from drone_sim.remote.remote_api import start_server
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

SCRIPT = """
def sysCall_init():
    simRemoteApi.start(PORT)
    simRemoteApi.start(OTHER, 1300, False, True)

def turned(whole, real, texts, buffer):
    return whole[::-1], [2 * one for one in real], [one.upper() for one in texts], buffer

def wrong(whole, real, texts, buffer):
    return 'text'

def sysCall_actuation():
    sim.setInt32Signal('status', simRemoteApi.status(PORT))
    if sim.getInt32Signal('fail'):
        raise RuntimeError('as it was told')
    if sim.getInt32Signal('close'):
        simRemoteApi.stop(PORT)
"""
SYNCHRONOUS, FREE, TRIGGER, GOODBYE = 0x0001, 0x0002, 0x0003, 0x000A
HANDLE, POSITION, SET_POSITION = 0x3001, 0x200E, 0x101B
START, PAUSE, STOP = ((0x1007, ints(which)) for which in range(3))
SET_FLOAT, GET_FLOAT = 0x3013, 0x3010
SET_STRING, GET_STRING, APPEND, TAKE, READ_STREAM = 0x3015, 0x3012, 0x3016, 0x3017, 0x3018
WORLD = -1


class Stage:
    """A stopped simulation, its server and its clients."""

    def __init__(self, script):
        values = {
            "script": str(script),
            "vehicles": {"drone": {}, "other": {"position": [1, 1, 0.8]}},
            "cameras": {"floor": {"width": 6, "height": 4}},
            "scene": {
                "objects": [{"shape": "box", "name": "Crate", "size": [0.2] * 3, "position": [3, 0, 0.09]}],
                "scripts": [{"object": "Crate", "customization": str(script.with_name("custom.py"))}],
            },
            "remote_api": {"serve": True, "address": "127.0.0.1", "legacy_port": 0},
        }
        self.simulation = Simulation(parameters.load(values), started=False)
        self.player = Player(self.simulation, lambda _state: None, simulated_time=False)
        self.now = 0.0  # s
        self.server = LegacyServer(self.player, "127.0.0.1", 0, clock=lambda: self.now)
        self.clients = []

    def client(self, port=None):
        self.clients.append(Client(port or self.server.port, self.server.wait))
        return self.clients[-1]

    def run_steps(self, steps=1):
        """Run up to `steps` steps, as far as the clients permit; return the number of steps run."""
        before = self.simulation.steps
        for _ in range(steps):
            self.server.serve()
            if self.player.playing and not self.server.holds:
                self.player.step()
        return self.simulation.steps - before

    def wait_until(self, condition):
        end = time.monotonic() + 60
        while time.monotonic() < end:
            if condition():
                return True
            self.server.wait(0.001)
        return False


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as one:
        return one.getsockname()[1]


@pytest.fixture(name="theatre", scope="module")
def _theatre(tmp_path_factory):
    script, ports = tmp_path_factory.mktemp("legacy") / "script.py", [free_port(), free_port()]
    script.write_text(SCRIPT.replace("PORT", str(ports[0])).replace("OTHER", str(ports[1])))
    script.with_name("custom.py").write_text("def sysCall_init(): pass\ndef same(*values): return values\n")
    stage = Stage(script)
    stage.ports = ports
    yield stage
    stage.server.close()
    stage.simulation.close()


@pytest.fixture(name="stage")
def _stage(theatre):
    yield theatre
    for client in theatre.clients:
        client.vanish()
    theatre.clients.clear()
    assert theatre.wait_until(lambda: not theatre.server._guests)
    theatre.player.stop()
    theatre.server.serve()  # closes the ports of the script
    theatre.simulation.context.signals.clear()


# ---- messages


def test_an_empty_message_is_answered_with_its_number_and_the_state(stage):
    client = stage.client()
    first, second = client.ask(), client.ask()
    assert (first.number, second.number, first.sent, second.sent) == (0, 1, 1000, 1001)
    assert not first.answers and first.version == 11
    assert first.state & 3 == 0
    client.call(*START)
    assert client.ask().state & 3 == 1
    client.call(*PAUSE)
    assert client.ask().state & 3 == 3


def test_commands_of_a_message_are_answered_together_in_order(stage):
    client, name = stage.client(), text("Quadricopter")
    put = command(SET_FLOAT, text("a"), floats(1.5))
    reply = client.ask(put, command(GET_FLOAT | BLOCKING, text("a")), command(HANDLE, name))
    assert list(reply.answers) == [(SET_FLOAT, text("a")), (GET_FLOAT | BLOCKING, text("a")), (HANDLE, name)]
    assert reply.answers[GET_FLOAT | BLOCKING, text("a")] == floats(1.5)


def test_messages_and_replies_may_consist_of_many_packets(stage):
    client, long = stage.client(), bytes(range(256)) * 400
    client.send_bytes(packets(message(0, command(SET_STRING, text("long"), long)), piece=200))
    assert client.received().answers == {(SET_STRING, text("long")): b""}
    assert client.call(GET_STRING, text("long")) == long


def test_clients_of_v_rep_3_1_get_small_packets_with_check_sums():
    wire, content = Packets(), bytes(2) + b"123456789"
    assert wire.of(content)[PACKET.size :] == content
    wire.add(packets(b"\xc3\x31" + message(0)[2:]) + packets(message(1)))
    assert wire.take() and wire.take(), "a message whose check sum happens to be 0 is accepted, too"
    assert wire.of(content)[PACKET.size :] == b"\xc3\x31123456789", "the check value of CRC-16/XMODEM"
    sizes = struct.unpack_from("<hhh", wire.of(bytes(1000)))
    assert sizes == (1, 244, 4), "these clients have buffers of 250 bytes"


def test_a_split_command_is_executed_when_its_last_piece_arrives(stage):
    client, key = stage.client(), text("split")
    code = (SET_STRING | SPLIT, 100)
    assert not client.ask(command(code, key, b"abc", 0, 7)).answers
    assert not client.ask(command(code, key, b"de", 3, 7)).answers
    assert client.call(GET_STRING, key) == FAILED
    assert client.ask(command(code, key, b"fg", 5, 7)).answers == {(SET_STRING | SPLIT, key): b""}
    assert client.call(GET_STRING, key) == b"abcdefg"


def test_replies_carry_the_simulation_time_in_milliseconds(stage):
    client = stage.client()
    assert client.ask(command(HANDLE, text("Floor"))).times == [0]
    client.call(*START)
    stage.run_steps(3)
    assert client.ask(command(HANDLE, text("Floor"))).times == [150]


# ---- modes


def test_a_stream_sends_one_value_per_step(stage):
    client, key = stage.client(), ints(stage.client().handle("Quadricopter"), WORLD)
    streams = POSITION | STREAMING
    client.call(*START)
    assert client.ask(command(streams, key)).answers == {(streams, key): floats(0, 0, 0.8)}
    assert not client.ask().answers
    stage.run_steps()
    assert list(client.ask().answers) == [(streams, key)]
    assert not client.ask().answers


def test_a_stream_continues_at_intervals_while_the_simulation_is_stopped(stage):
    client, key = stage.client(), text("a")
    client.call(SET_FLOAT, key, floats(1))
    client.ask(command(GET_FLOAT | STREAMING, key))
    client.call(SET_FLOAT, key, floats(2))
    assert not client.ask().answers
    stage.now += 0.06
    assert client.ask().answers == {(GET_FLOAT | STREAMING, key): floats(2)}


def test_a_stream_with_a_delay_sends_once_per_delay(stage):
    client, key = stage.client(), text("a")
    client.call(SET_FLOAT, key, floats(1))
    assert client.ask(command((GET_FLOAT | STREAMING, 500), key)).answers
    stage.now += 0.4
    assert not client.ask().answers
    stage.now += 0.2
    assert client.ask().answers


def test_discontinue_ends_a_stream_and_is_acknowledged(stage):
    client, key = stage.client(), text("a")
    client.ask(command(GET_FLOAT | STREAMING, key))
    assert client.ask(command(GET_FLOAT | DISCONTINUE, key)).answers == {(GET_FLOAT | DISCONTINUE, key): b""}
    stage.now += 1
    assert not client.ask().answers


def test_a_setter_may_stream(stage):
    client, target = stage.client(), ints(stage.client().handle("Quadricopter_target"))
    client.ask(command(SET_POSITION | STREAMING, target, ints(WORLD) + floats(1, 0, 1)))
    client.call(SET_POSITION, target, ints(WORLD) + floats(0, 0, 0))
    stage.now += 1
    client.ask()
    assert client.numbers("3f", POSITION, target + ints(WORLD)) == (1, 0, 1)


def test_a_stream_of_a_removed_object_reports_an_error(stage):
    client = stage.client()
    client.call(*START)
    key = ints(*client.numbers("i", 0x0009, data=floats(0.1) + bytes(13)), WORLD)
    assert client.ask(command(POSITION | STREAMING, key)).answers[POSITION | STREAMING, key] == floats(0, 0, 0)
    assert client.call(0x1028, key[:4]) == b""
    stage.run_steps()
    assert client.ask().answers == {(POSITION | STREAMING, key): FAILED}
    assert client.errors() == [
        f"simxGetObjectPosition: there is no object with the handle {struct.unpack_from('<i', key)[0]}"
    ]


def test_a_client_has_at_most_1000_streams(stage):
    client = stage.client()
    for count in range(11):
        client.ask(*(command(GET_FLOAT | STREAMING, text(f"{100 * count + one}")) for one in range(100)))
    errors = client.errors()
    assert len(errors) == 50 and all("simxGetFloatSignal: at most 1000 commands" in error for error in errors)


# ---- steps


def test_a_synchronous_client_triggers_exactly_one_step_with_each_call(stage):
    client = stage.client()
    assert client.call(SYNCHRONOUS) == b"" and client.call(*START) == b""
    assert stage.run_steps(5) == 0
    for steps in range(1, 6):
        client.send(command(TRIGGER | BLOCKING))
        assert client.received(looks=20) is None
        assert stage.run_steps(3) == 1
        reply = client.received()
        assert reply.answers == {(TRIGGER | BLOCKING, b""): b""} and reply.times == [50 * steps]
    assert client.call(FREE) == b""
    assert stage.run_steps(5) == 5


def test_streamed_values_arrive_with_the_reply_to_the_trigger(stage):
    client, key = stage.client(), ints(stage.client().handle("Quadricopter"), WORLD)
    client.ask(command(SYNCHRONOUS), command(*START), command(POSITION | STREAMING, key))
    client.send(command(TRIGGER | BLOCKING))
    assert stage.wait_until(lambda: not stage.server.holds)
    stage.run_steps()
    assert list(client.received().answers) == [(TRIGGER | BLOCKING, b""), (POSITION | STREAMING, key)]


def test_the_simulation_waits_for_every_synchronous_client(stage):
    one, other, third = stage.client(), stage.client(), stage.client()
    for client in (one, other):
        client.call(SYNCHRONOUS)
    third.call(*START)
    one.send(command(TRIGGER | BLOCKING))
    assert one.received(looks=20) is None
    assert stage.run_steps(3) == 0
    other.send(command(TRIGGER | BLOCKING))
    assert other.received(looks=20) is None
    assert stage.run_steps(3) == 1
    assert one.received() and other.received()
    assert third.ask(command(HANDLE, text("Floor"))).times == [50]


def test_a_client_stays_synchronous_through_stop_and_start(stage):
    client = stage.client()
    client.ask(command(SYNCHRONOUS), command(*START))
    client.call(*STOP)
    client.call(*START)
    assert stage.run_steps(3) == 0


def test_a_trigger_while_stopped_or_paused_is_answered_at_once(stage):
    client = stage.client()
    client.call(SYNCHRONOUS)
    assert client.call(TRIGGER) == b""
    client.ask(command(*START), command(*PAUSE))
    assert client.call(TRIGGER) == b""


def test_a_pending_trigger_is_answered_when_another_client_stops_the_simulation(stage):
    client, other = stage.client(), stage.client()
    client.ask(command(SYNCHRONOUS), command(*START))
    client.send(command(TRIGGER | BLOCKING))
    assert client.received(looks=20) is None
    other.call(*STOP)
    assert client.received().answers == {(TRIGGER | BLOCKING, b""): b""}


@pytest.mark.parametrize("how", ["vanish", "goodbye", "silence", "amid a trigger"])
def test_a_disconnected_client_does_not_hold_the_simulation(stage, how):
    client = stage.client()
    client.ask(command(SYNCHRONOUS), command(*START))
    assert stage.server.holds
    if how == "goodbye":
        client.send(command(GOODBYE, ints(0)))
        assert client.is_let_go()
    elif how == "silence":
        stage.now += 601
    else:
        if how == "amid a trigger":
            client.send(command(TRIGGER | BLOCKING))
            assert client.received(looks=20) is None
        client.vanish()
    assert stage.wait_until(lambda: not stage.server._guests)
    assert stage.run_steps(3) == 3


# ---- functions


def test_objects(stage):
    client = stage.client()
    drone, base, crate = (client.handle(name) for name in ("Quadricopter", "Quadricopter_base", "/Crate"))
    assert client.numbers("i", 0x1012, ints(base)) == (drone,)
    assert client.numbers("i", 0x200B, ints(drone, 0)) == (base,)
    assert client.numbers("i", 0x200B, ints(crate, 0)) == (-1,)
    count, *handles = struct.unpack_from(f"<{1 + 3}i", client.call(0x102A, ints(-2)))
    assert count > 20 and handles == sorted(handles)
    assert client.numbers("3f", POSITION, ints(crate, WORLD)) == pytest.approx((3, 0, 0.09))
    assert client.numbers("3f", 0x1019, ints(crate), ints(WORLD)) == pytest.approx((3, 0, 0.09))  # of older clients
    assert client.call(0x101A, ints(crate), ints(WORLD) + floats(0, 0, 0.5)) == b""
    assert client.numbers("3f", 0x200D, ints(crate, WORLD)) == pytest.approx((0, 0, 0.5))
    assert client.call(0x1801, ints(crate), ints(WORLD) + floats(0, 0, 0, 1)) == b""
    assert client.numbers("4f", 0x2801, ints(crate, WORLD)) == (0, 0, 0, 1)
    assert client.numbers("6f", 0x1036, ints(crate)) == (0,) * 6
    assert client.numbers("f", 0x2007, ints(crate, 3005)) == (0,)  # sim_shapefloatparam_mass
    assert client.numbers("i", 0x2008, ints(crate, 3003)) == (1,)  # sim_shapeintparam_static
    assert client.call(0x200A, ints(crate, 10), ints(3)) == b""
    count, copy = client.numbers("2i", 0x102E, ints(0), ints(crate))
    assert count == 1 and copy != crate
    assert client.call(0x101C, ints(copy), ints(base) + b"\1") == b""
    assert client.numbers("i", 0x1012, ints(copy)) == (base,)
    assert client.call(0x1028, ints(copy)) == b""
    assert client.call(POSITION, ints(copy, WORLD)) == FAILED
    assert client.call(0x102F, ints(0), ints(drone, base)) == b""
    assert client.numbers("3i", 0x0006) == (2, drone, base)


def test_joints(stage):
    client = stage.client()
    joint = ints(client.handle("Quadricopter_propeller_joint1"))
    assert client.call(0x1002, joint, floats(0.5)) == b""
    assert client.numbers("f", 0x1001, joint) == (0.5,)
    for set_target in (0x1008, 0x100C, 0x100E):
        assert client.call(set_target, joint, floats(1)) == b""
    assert client.call(0x100D, ints(client.handle("Crate"))) == FAILED
    assert "is not a joint of the scene" in client.errors()[0]


def test_signals(stage):
    client, key = stage.client(), text("a")
    for put, get, clear, data in (
        (SET_FLOAT, GET_FLOAT, 0x300D, floats(2.5)),
        (0x3014, 0x3011, 0x300E, ints(-7)),
        (SET_STRING, GET_STRING, 0x300F, b"\xff\0\1"),
    ):
        assert client.call(get, key) == FAILED
        assert client.call(put, key, data) == b""
        assert client.call(get, key) == data
        assert client.call(clear, key) == b""
        assert client.call(get, key) == FAILED
    assert client.errors() == []  # reading an unset signal logs no error
    client.call(SET_STRING, key, b"abc")
    client.call(APPEND, key, b"\xff")
    assert client.call(TAKE, key) == b"abc\xff"
    assert client.call(TAKE, key) == FAILED


def test_a_stream_that_takes_a_signal_ends_after_the_first_value(stage):
    client, key = stage.client(), text("a")
    client.ask(command(TAKE | STREAMING, key))
    client.call(SET_STRING, key, b"first")
    stage.now += 1
    assert client.ask().answers == {(TAKE | STREAMING, key): b"first"}
    client.call(SET_STRING, key, b"second")
    stage.now += 1
    assert not client.ask().answers


def test_a_string_stream_sends_only_new_parts(stage):
    client, key = stage.client(), text("a")
    assert not client.ask(command(READ_STREAM | STREAMING, key)).answers
    for part in (b"one", b"two"):
        client.call(APPEND, key, part)
        stage.now += 1
        assert client.ask().answers == {(READ_STREAM | STREAMING, key): part}
        stage.now += 1
        assert not client.ask().answers


def test_vision_sensor_images(stage):
    client = stage.client()
    sensor = ints(client.handle("FloorVision"))
    colors, greys, depths = (client.call(code, sensor) for code in (0x1004, 0x1003, 0x1017))
    assert colors[:8] == greys[:8] == depths[:8] == ints(6, 4)
    assert (len(colors), len(greys), len(depths)) == (8 + 6 * 4 * 3, 8 + 6 * 4, 8 + 6 * 4 * 4)
    triggers, packets_found, values = struct.unpack_from("<Bii", client.call(0x1011, sensor))
    assert (triggers, packets_found, values) == (0, 1, 15)
    assert client.call(0x1006, sensor, bytes(72)) == b""


def test_distances_and_collisions(stage):
    client = stage.client()
    pair = ints(client.handle("Crate"), client.handle("Floor"))
    assert client.numbers("i", 0x200F, pair) == (1,)
    assert client.numbers("f", 0x2010, pair) == pytest.approx((0,), abs=1e-3)
    for code, key in ((0x300A, text("Collision")), (0x1026, ints(3)), (0x1027, ints(3)), (0x300B, text("Distance"))):
        assert client.call(code, key) == FAILED
    assert all("collision and distance objects are not supported" in one for one in client.errors())


@pytest.mark.parametrize(
    ("kind", "what", "counts"),
    [
        (109, 0, (0, 0, 1)),
        (0, 1, (1, 0, 0)),
        (0, 2, (1, 0, 0)),
        (4, 3, (0, 3, 0)),
        (0, 7, (0, 4, 0)),
        (0, 9, (0, 6, 0)),
        (0, 11, (0, 7, 0)),
        (109, 17, (0, 3, 0)),
        (0, 19, (0, 6, 0)),
    ],
)
def test_group_data_of_all_objects_of_a_kind(stage, kind, what, counts):
    answer = stage.client().call(0x200C, ints(kind, what))
    handles, *value_counts = struct.unpack_from("<4i", answer)
    assert handles and tuple(value_counts) == tuple(one * handles for one in counts)
    if what == 0:
        assert b"Quadricopter_base\0" in answer
    else:
        assert len(answer) == 16 + 4 * (handles + sum(value_counts))


def test_simulation_parameters_and_scene_files(stage):
    client = stage.client()
    assert client.numbers("f", 0x1023, ints(1)) == pytest.approx((0.05,))  # sim_floatparam_simulation_time_step
    assert client.numbers("i", 0x1021, ints(1)) == (40600,)  # simxGetPingTime reads this parameter
    assert client.numbers("3f", 0x101D, ints(0)) == pytest.approx((0, 0, -9.81))
    assert client.numbers("i", 0x101F, ints(16)) == (0,)  # sim_boolparam_display_enabled
    assert client.call(0x1020, ints(16), ints(1)) == client.call(0x1022, ints(8), ints(0)) == b""
    assert client.call(0x1025, ints(13)) == b"\0"
    assert client.call(0x1024, ints(1), floats(0.01)) == FAILED
    assert "the time step stays 0.05 s, not 0.01" in client.errors()[0]
    for code, key in ((0x3002, text("/nowhere/scene.ttt")), (0x3003, text("nothing.ttm")), (0x0005, b"")):
        assert client.call(code, key) == FAILED
    assert client.call(0x3004, text("tmp_1234"), b"content") == FAILED
    assert "files are not transferred" in client.errors()[-1]


def test_status_texts_consoles_dialogs_and_uis(stage, caplog):
    client = stage.client()
    assert client.call(0x3008, text("hello")) == b""
    looks = ints(50, 0, 98765, 0, 98765, 0) + floats(-10, 0, 0, -10, 0, 0)
    console = ints(*client.numbers("i", 0x3009, text("a console"), looks))
    for code, data in ((0x1015, text("a line\n")), (0x1015, b""), (0x1016, ints(0)), (0x1014, b"")):
        assert client.call(code, console, data) == b""
    dialog = text("how?") + ints(1) + text("") + floats(*[-10] * 12)
    handle, _ = client.numbers("2i", 0x300C, text("a dialog"), dialog)
    assert client.numbers("i", 0x102D, ints(handle)) == (1,)
    assert client.call(0x102C, ints(handle)) == b"\0"
    assert client.call(0x102B, ints(handle)) == b"" and client.call(0x102B, ints(handle)) == FAILED
    ui = ints(*client.numbers("i", 0x3007, text("UI")))
    assert client.numbers("4i", 0x2003, ui)[1:] == (-1, 0, 0)  # clients drop the first value
    assert client.call(0x2002, ui + ints(3), ints(500)) == b"" and client.call(0x3005, text("ui.ttb")) == FAILED
    assert all(f in caplog.text for f in ("hello", "a line", "a dialog: how?"))


def test_a_client_calls_functions_of_scripts(stage):
    client = stage.client()
    client.call(*START)
    inputs = ints(2, 1, 2, 3) + ints(1, 2) + floats(1.5) + text("ab") + text("c") + b"\xff\0x"
    key = ints(1) + text("Quadricopter") + text("turned")
    assert client.call(0x3401, key, inputs) == ints(2, 1, 2, 3, 2, 1) + floats(3) + text("AB") + text("C") + b"\xff\0x"
    assert client.call(0x3401, ints(6) + text("Crate") + text("same"), inputs) == inputs
    nothing = ints(0, 0, 0, 0)
    for wrong, data in (
        (ints(3) + text("Quadricopter") + text("turned"), nothing),
        (ints(6) + text("Quadricopter") + text("turned"), nothing),
        (ints(1) + text("Quadricopter") + text("wrong"), nothing),
        (ints(1) + text("Quadricopter") + text("absent"), nothing),
        (key, ints(1, 0, 0, 0)),
        (key, ints(-1, 0, 0, 0)),
        (key, b"abc"),
    ):
        assert client.call(0x3401, wrong, data) == FAILED
    error_lines = client.errors()
    assert "must be sim_scripttype_childscript" in error_lines[0] and "returned something else" in error_lines[2]
    assert "no customization script is attached to 'Drone'" in error_lines[1]
    assert len(error_lines) == 7 and not any("\n" in one for one in error_lines)


def test_an_error_fails_the_command_and_is_logged_once(stage, caplog):
    client = stage.client()
    for _ in range(3):
        assert client.call(HANDLE, text("Quadricoptr")) == FAILED
    lines = [one.getMessage() for one in caplog.records if "Quadricoptr" in one.getMessage()]
    assert len(lines) == 1 and lines[0].startswith("simxGetObjectHandle: no object named 'Quadricoptr'; near names are")
    assert client.call(0x1FFF, ints(1)) == FAILED
    assert client.call(SET_POSITION, ints(1), b"short") == FAILED
    assert client.errors()[3:] == [
        "command 0x1fff: there is no such command",
        "simxSetObjectPosition: has 5 bytes of data, must have 16",
    ]
    assert client.errors() == []


def test_a_failing_script_stops_the_simulation_and_clients_are_still_answered(stage):
    client = stage.client()
    client.ask(command(SYNCHRONOUS), command(*START), command(0x3014, text("fail"), ints(1)))
    client.send(command(TRIGGER | BLOCKING))
    assert client.received(looks=20) is None
    stage.run_steps()
    assert client.received() and client.ask().state & 1 == 0


def test_signals_set_before_the_start_last_until_the_stop(stage):
    client, key = stage.client(), text("speed")
    client.call(SET_FLOAT, key, floats(5))
    client.call(*START)
    stage.run_steps()
    assert client.numbers("f", GET_FLOAT, key) == (5,)
    client.call(*STOP)
    assert client.call(GET_FLOAT, key) == FAILED


def test_the_size_of_a_reply_is_limited(stage, monkeypatch):
    monkeypatch.setattr(session, "_MAX_REPLY_SIZE", 100_000)
    client = stage.client()
    client.call(SET_STRING, text("long"), bytes(60_000))
    client.ask(*[command(GET_STRING | BLOCKING, text("long"))] * 4)
    assert client.errors() == ["simxGetStringSignal: the reply has more than 100000 bytes"] * 2


# ---- ports of scripts


def test_a_script_opens_a_port_while_the_simulation_runs(stage):
    client = stage.client()
    with pytest.raises(ConnectionRefusedError):
        stage.client(stage.ports[0])
    client.call(*START)
    stage.server.serve()
    third = stage.client(stage.ports[0])
    assert third.handle("Floor") == client.handle("Floor")
    stage.run_steps(2)
    assert client.numbers("i", 0x3011, text("status")) == (1,)
    client.call(0x3014, text("close"), ints(1))
    stage.run_steps()
    assert third.is_let_go()
    assert stage.simulation.running
    client.call(*STOP)
    stage.server.serve()
    with pytest.raises(ConnectionRefusedError):
        stage.client(stage.ports[1])


def test_clients_of_a_port_may_start_synchronous(stage):
    stage.client().call(*START)
    assert stage.run_steps(2) == 2
    client = stage.client(stage.ports[1])
    client.ask()
    assert stage.run_steps(2) == 0
    client.send(command(TRIGGER | BLOCKING))
    assert client.received(looks=20) is None
    assert stage.run_steps(2) == 1


# ---- malformed messages and clients that misbehave


def packet(size, left=0, first=1, content=None):
    return PACKET.pack(first, size, left) + (bytes(size) if content is None else content)


HEAD = message(0)
MALFORMED = [
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1:19997\r\n\r\n",
    b"\x16\3\1\2\0\1\0\1\xfc\3\3" + bytes(512),
    packet(10, first=256),
    packet(0),
    packet(-5, content=b""),
    packet(5, left=-1),
    packet(5),  # shorter than a header
    packet(18, left=3) + packet(18, left=7),
    packets(HEAD + b"rubbish"),
    packets(HEAD + command(HANDLE, text("a"))[:-1] + bytes(7)),
    packets(HEAD + command(HANDLE, b"no end")),
    packets(HEAD + command(POSITION, ints(1))),
    packets(HEAD + command(POSITION, ints(1, 2, 3))),
    packets(HEAD + command(0x3401, ints(1) + text("one text"))),
    packets(HEAD + command(6 << 16, b"")),
    packets(HEAD + command(-1, b"")),
    packets(HEAD + struct.pack("<iiHiiHiBB", -26, 26, 0, 0, 1, 0, 0, 0, 0)),
    packets(HEAD + struct.pack("<iiHiiHiBB", 2**31 - 1, 26, 0, 0, 1, 0, 0, 0, 0)),
    packets(HEAD + struct.pack("<iiHiiHiBB", 26, 26, 60000, 0, 1, 0, 0, 0, 0)),
    packets(HEAD + struct.pack("<iiHiiHiBB", 26, 2**31 - 1, 0, 0, SPLIT | 1, 0, 0, 0, 0)),
    packets(HEAD + struct.pack("<iiHiiHiBB", 26, 26, 0, -1, SPLIT | 1, 0, 0, 0, 0)),
    packets(HEAD + command(HANDLE, text("a")) * 2001),
    packet(32767, left=32767) + b"".join(packet(32767, left=left) for left in range(32766, 32500, -1)),
]


@pytest.mark.parametrize("sent", MALFORMED, ids=range(len(MALFORMED)))
def test_a_client_that_sends_garbage_is_disconnected_and_the_simulation_continues(stage, sent, caplog):
    stage.now += 10
    other_client = stage.client()
    other_client.call(*START)
    caplog.clear()
    client = stage.client()
    try:
        client.send_bytes(sent)
        assert client.is_let_go()
    except OSError:  # it was disconnected before it had sent everything
        pass
    assert stage.wait_until(lambda: len(stage.server._guests) == 1)
    (line,) = [one.getMessage() for one in caplog.records if "is disconnected" in one.getMessage()]
    assert line.isprintable()
    assert stage.run_steps(3) == 3
    assert other_client.handle("Floor") >= 0


def test_an_incomplete_message_does_not_block_other_clients(stage):
    slow_client, other_client = stage.client(), stage.client()
    slow_client.send_bytes(packets(message(0, command(HANDLE, text("Floor"))))[:-3])
    assert slow_client.received(looks=20) is None
    assert other_client.handle("Floor") >= 0
    slow_client.send_bytes(packets(message(0, command(HANDLE, text("Floor"))))[-3:])
    assert slow_client.received() is not None


def test_a_client_that_never_reads_does_not_block_other_clients(stage):
    stalled_client, other_client = stage.client(), stage.client()
    other_client.call(SET_STRING, text("long"), bytes(4_000_000))
    ask = packets(message(0, command(GET_STRING | BLOCKING, text("long"))))
    for _ in range(10):
        stalled_client.peer.send(ask)
    other_client.call(*START)
    assert stage.run_steps(3) == 3
    (guest,) = [one for one in stage.server._guests.values() if one.connection.has_to_write]
    assert len(guest.connection._out) <= 4_100_000
    answers = [stalled_client.received() for _ in range(10)]
    assert all(isinstance(one, Reply) and len(one.answers) == 1 for one in answers)


def test_silent_connections_make_room_for_a_client_that_sends(stage, caplog):
    stage.now += 10
    for _ in range(200):
        stage.client()
    stage.server.serve()
    client = stage.client()
    assert client.handle("Floor") >= 0
    assert len(stage.server._guests) <= 100
    assert len([one for one in caplog.records if "clients are connected" in one.getMessage()]) == 1


def test_at_most_100_active_clients_are_served(stage):
    active_clients = [stage.client() for _ in range(100)]
    for one in active_clients:
        one.ask()
    assert stage.client().is_let_go()
    assert active_clients[0].handle("Floor") >= 0


def test_many_requests_are_spread_over_several_steps(stage):
    busy = [stage.client() for _ in range(20)]
    stage.player.start()
    start_time, stage.server._clock = stage.now, iter(range(10**9)).__next__  # a clock that is always late
    try:
        for one in busy:
            one.send(command(HANDLE, text("Floor")))
        assert stage.wait_until(lambda: stage.server.has_work)
        assert all(one.received() for one in busy)
    finally:
        stage.server._clock = lambda: stage.now
    assert start_time == stage.now


# ---- both servers


def test_both_remote_apis_are_served_at_once(stage):
    from remote_client import Client as OtherClient

    values = parameters.load({"remote_api": {"serve": True, "port": 0, "legacy_port": 0}})
    servers = start_server(values.remote_api, stage.player)
    try:
        assert servers.address.endswith(" (simxStart)")
        old, new = Client(servers.legacy.port, servers.wait), OtherClient(servers.zeromq)
        new._server = servers
        old.ask(command(SYNCHRONOUS), command(*START))
        assert servers.holds and new.sim("getSimulationState") == 17
        new.sim("setStepping", True)
        old.call(FREE)
        assert servers.holds
        assert old.call(*STOP) == b""  # ends stepping for all clients
        old.call(*START)
        assert not servers.holds
        old.vanish()
        new.vanish()
    finally:
        servers.close()


def test_the_error_names_an_address_that_cannot_be_opened(stage):
    settings = {"serve": True, "port": 0, "legacy_port": stage.server.port}
    with pytest.raises(OSError, match=f"remote_api: cannot listen on 127.0.0.1:{stage.server.port}: "):
        start_server(parameters.load({"remote_api": settings}).remote_api, stage.player)
    with pytest.raises(OSError, match=r"remote_api: cannot listen on nowhere\.invalid:0: "):
        LegacyServer(stage.player, "nowhere.invalid", 0)
    assert LegacyServer(stage.player, "*", 0).close() is None


def test_the_server_listens_on_localhost_by_default(stage):
    assert parameters.load().remote_api.address == "127.0.0.1"
    stage.server.serve()
    (listener,) = stage.server._listeners._listeners.values()
    assert listener.getsockname()[0] == "127.0.0.1"


def test_oneshot_and_blocking_commands_get_the_same_reply(stage):
    client, key = stage.client(), text("Floor")
    (one,) = client.ask(command(HANDLE | ONESHOT, key)).answers.values()
    assert one == client.call(HANDLE, key)


def test_an_internal_error_logs_a_traceback_at_debug_level(stage, monkeypatch, caplog):
    for name in ("server", "session"):
        caplog.set_level(logging.DEBUG, f"drone_sim.remote.legacy.{name}")
    client = stage.client()
    monkeypatch.setattr(stage.simulation.context.objects, "handle", lambda *_: 1 // 0)
    assert client.call(HANDLE, text("Crate")) == FAILED
    assert any("ZeroDivisionError" in (one.exc_text or "") for one in caplog.records)
