"""A key press changes the command in force, or the command that was sent just before."""

import re
from pathlib import Path

import pytest

from drone_sim.ros.tools.commands import DOWN, KEY_MAPS, LEFT, RIGHT, UNKNOWN, UP, Command, CommandInForce

COCKPIT, COURSE = KEY_MAPS["cockpit"], KEY_MAPS["course"]
ARROWS = {"ArrowUp": UP, "ArrowDown": DOWN, "ArrowLeft": LEFT, "ArrowRight": RIGHT}
PAGE = Path(__file__).parents[2] / "web" / "src" / "teleop.js"


def press(in_force, key):
    command = in_force.next.after(key, COCKPIT)
    in_force.on_sent(command)
    return command


def test_key_presses_add_up_and_the_space_key_stops():
    command = Command()
    for key in (UP, "w", UP, RIGHT, "r", "e", "q", "q"):
        command = command.after(key, COCKPIT)
    assert command == Command(0.3, -0.1, 0.1, 0.2)
    assert command.after("W", COCKPIT) == Command(0.55, -0.1, 0.1, 0.2)
    assert command.after(" ", COCKPIT) == Command()
    assert command.after("x", COCKPIT) is None
    assert command.after(UNKNOWN, COCKPIT) is None


@pytest.mark.parametrize(
    ("key", "change"),
    [
        (UP, Command(vx=0.1)),
        (DOWN, Command(vx=-0.1)),
        (LEFT, Command(vy=0.1)),
        (RIGHT, Command(vy=-0.1)),
        ("e", Command(wz=0.2)),
        ("r", Command(wz=-0.2)),
    ],
)
def test_the_keys_of_the_course_work_as_in_its_own_node(key, change):
    assert Command().after(key, COURSE) == change
    assert Command().after("w", COURSE) is None, "a key without a meaning returns no command"


def test_the_keys_equal_those_of_the_page():
    page = re.findall(r"""(Key[A-Z]|Arrow\w+): \["(\w+)", (-?1)\]""", PAGE.read_text(encoding="utf-8"))
    signs = {ARROWS.get(code, code[-1].lower()): (axis, int(sign)) for code, axis, sign in page}
    assert signs.keys() == COCKPIT.keys()
    for key, (axis, sign) in signs.items():
        assert {name: change * sign > 0 for name, change in COCKPIT[key]._asdict().items() if change} == {axis: True}


def test_quick_presses_add_up_before_the_simulator_has_answered(clock):
    in_force = CommandInForce(clock)
    in_force.on_published(Command())
    press(in_force, UP)
    in_force.on_published(Command())  # published before the key press arrived
    press(in_force, UP)
    in_force.on_published(Command(vx=0.1))
    assert press(in_force, UP) == Command(vx=0.3)
    assert in_force.published == Command(vx=0.1)
    in_force.on_published(Command(vx=0.2))
    in_force.on_published(Command(vx=0.3))
    in_force.on_published(Command())  # stopped by another client
    assert press(in_force, UP) == Command(vx=0.1)


def test_a_sent_command_that_never_comes_into_force_is_dropped(clock):
    in_force = CommandInForce(clock)
    in_force.on_published(Command(vy=1.0))
    press(in_force, UP)
    clock.now += 10.0  # the simulator is slow, and this was sent before
    in_force.on_published(Command(vy=1.0))
    assert in_force.next == Command(0.1, 1.0)
    in_force.on_published(Command(vy=1.0))
    assert in_force.next == Command(vy=1.0)


def test_without_a_published_command_the_last_sent_command_counts(clock):
    in_force = CommandInForce(clock)
    press(in_force, UP)
    assert press(in_force, UP) == Command(vx=0.2)
    in_force.reset()
    assert press(in_force, UP) == Command(vx=0.1)
