"""Gamepad input: events read through a FIFO instead of a device, the resulting commands, and values of joy.yaml."""

import os
import struct

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.ros.tools import gamepad
from drone_sim.ros.tools.commands import Command
from drone_sim.ros.tools.gamepad import Gamepad, JoyCommands, JoyState, load_joy

BUTTON, AXIS, INITIAL = 1, 2, 0x80
LB, A, Y, BACK = 4, 0, 3, 6


def event(kind, number, value):
    return struct.pack("=IhBB", 0, value, kind, number)


@pytest.fixture(name="device")
def _device(tmp_path):
    path = str(tmp_path / "js0")
    os.mkfifo(path)
    return path


@pytest.fixture(name="pad")
def _pad(device):
    pad = Gamepad(device)
    yield pad
    pad.close()


def test_events_give_the_state_with_the_signs_of_the_joy_node(device, pad):
    with open(device, "wb", buffering=0) as kernel:
        assert list(pad.read()) == []
        kernel.write(event(BUTTON | INITIAL, 1, 0) + event(AXIS | INITIAL, 2, 0))
        assert list(pad.read()) == [JoyState((), (False, False)), JoyState((0.0, 0.0, 0.0), (False, False))]
        kernel.write(event(AXIS, 0, -32767) + event(AXIS, 2, 32767) + event(AXIS, 1, -32768))
        assert list(pad.read())[-1].axes == (1.0, 1.0, -1.0)
        pressed = event(BUTTON, 1, 1)
        kernel.write(pressed[:3])
        assert list(pad.read()) == []
        kernel.write(pressed[3:] + event(9, 0, 7))  # an event of an unknown kind
        assert [one.buttons for one in pad.read()] == [(False, True)] * 2


def test_reading_an_unplugged_gamepad_raises_oserror(device, pad):
    with open(device, "wb", buffering=0) as kernel:
        kernel.write(event(BUTTON, 0, 1))
        assert len(list(pad.read())) == 1
    with pytest.raises(OSError, match=r"No such device.*js0"):
        list(pad.read())


def test_gamepads_are_listed_in_the_order_of_their_numbers(monkeypatch):
    paths = ["/dev/input/js10", "/dev/input/js2", "/dev/input/js-keys"]
    monkeypatch.setattr(gamepad.glob, "glob", lambda _: paths)
    assert gamepad.list_devices() == ["/dev/input/js2", "/dev/input/js10"]


# ---- commands


@pytest.fixture(name="pilot")
def _pilot():
    return JoyCommands(load_joy({"axes": {"vy": {"scale": -2.0}}}))


def joy_state(*buttons, **axes):
    numbers = {"vx": 4, "vy": 3, "vz": 1, "wz": 0}
    values = {numbers[name]: value for name, value in axes.items()}
    return JoyState(tuple(values.get(number, 0.0) for number in range(6)), tuple(one in buttons for one in range(8)))


def test_sticks_give_commands_only_while_the_dead_man_button_is_held(pilot):
    assert pilot.command is None
    assert pilot.update(joy_state(vx=1.0)) == []
    assert pilot.command is None
    pilot.update(joy_state(LB, vx=1.0, vy=0.55, vz=-0.55, wz=0.05))
    assert pilot.command == pytest.approx(Command(1.0, -1.0, -0.5, 0.0))
    pilot.update(joy_state(LB))
    assert pilot.command == Command()
    pilot.update(joy_state(vx=1.0))
    assert pilot.command is None


def test_a_reconnected_gamepad_with_pressed_button_gives_no_command(pilot):
    pilot.update(joy_state(LB, vx=1.0))
    pilot.disconnect()
    assert pilot.command is None
    assert pilot.update(joy_state(LB, A, vx=1.0)) == []
    assert pilot.command is None
    pilot.update(joy_state(vx=1.0))
    pilot.update(joy_state(LB, vx=1.0))
    assert pilot.command == Command(vx=1.0)


def test_a_pressed_button_requests_once_and_takeoff_needs_the_dead_man_button(pilot):
    assert pilot.update(joy_state(Y)) == []  # the button may have been pressed before the start
    assert pilot.update(joy_state()) == []
    assert pilot.update(joy_state(Y)) == []
    assert pilot.update(joy_state(LB)) == []
    assert pilot.update(joy_state(LB, Y)) == ["takeoff"]
    assert pilot.update(joy_state(LB, Y)) == []
    assert pilot.update(joy_state(A, BACK)) == ["land", "reset"]


def test_missing_axes_are_zero_and_missing_buttons_are_not_pressed(pilot):
    pilot.update(JoyState((1.0,), (False,) * 4 + (True,)))
    assert pilot.command == Command(wz=1.0)
    assert pilot.update(JoyState()) == []
    assert pilot.command is None
    limited = JoyCommands(load_joy({"axes": {"wz": {"axis": -1}}, "buttons": {"land": -1}}))
    limited.update(joy_state())
    assert limited.update(joy_state(LB, *range(8), wz=1.0)) == ["reset", "takeoff"]
    assert limited.command == Command()


# ---- joy.yaml


def test_a_config_file_and_then_parameters_override_joy_yaml(tmp_path):
    (tmp_path / "my.yaml").write_text("dead_man: 5\naxes: {vx: {scale: 3.0}}\n")
    parameters = load_joy({"config": str(tmp_path / "my.yaml"), "axes": {"vx": {"axis": 1}}})
    assert (parameters.dead_man, parameters.axes.vx.axis, parameters.axes.vx.scale) == (5, 1, 3.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"deadman": 5}, "parameter deadman: unknown key; near names are dead_man"),
        ({"dead_man": -1}, "parameter dead_man = -1: "),
        ({"axes": {"vx": 4}}, "parameter axes/vx = 4: must hold `key: value` lines with axis, scale"),
        ({"axes": {"vx": {"axis": 1.5}}}, "parameter axes/vx/axis = 1.5: "),
        ({"axes": {"vx": {"scale": "fast"}}}, "parameter axes/vx/scale = 'fast': "),
        ({"rate": 0}, "parameter rate = 0: "),
        ({"config": "nowhere.yaml"}, "parameter config = 'nowhere.yaml': no such file: nowhere.yaml"),
        ({"config": 3}, "parameter config = 3: must be the name of a file"),
    ],
)
def test_the_error_for_a_wrong_value_names_the_parameter(given, said):
    with pytest.raises(ParameterError) as error:
        load_joy(given)
    assert str(error.value).startswith(said)


def test_the_error_for_a_wrong_value_in_a_file_names_its_line(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text("dead_man: 5\nbuttons: {land: 999}\n")
    with pytest.raises(ParameterError, match=r"my\.yaml: line 2: parameter buttons/land = 999"):
        load_joy({"config": str(path)})
