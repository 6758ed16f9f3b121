"""What a key press changes: the command in force, or what was sent a moment ago."""

from drone_sim.ros.tools.commands import RIGHT, UNKNOWN, UP, Command, CommandInForce


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def press(in_force, key):
    command = in_force.next.after(key)
    in_force.send(command)
    return command


def test_keys_add_up_and_space_stops():
    command = Command()
    for key in (UP, UP, UP, RIGHT, "u", "r", "e", "e"):
        command = command.after(key)
    assert command == Command(0.3, -0.1, 0.1, 0.2)
    assert command.after(" ") == Command()
    assert command.after("x") is None
    assert command.after(UNKNOWN) is None


def test_quick_presses_add_up_before_the_simulator_has_answered():
    clock = Clock()
    in_force = CommandInForce(clock)
    in_force.hear(Command())
    press(in_force, UP)
    in_force.hear(Command())  # was on its way
    press(in_force, UP)
    in_force.hear(Command(vx=0.1))
    assert press(in_force, UP) == Command(vx=0.3)
    assert in_force.heard == Command(vx=0.1)
    in_force.hear(Command(vx=0.2))
    in_force.hear(Command(vx=0.3))
    in_force.hear(Command())  # stopped, by somebody else
    assert press(in_force, UP) == Command(vx=0.1)


def test_a_command_that_never_comes_into_force_is_forgotten():
    clock = Clock()
    in_force = CommandInForce(clock)
    in_force.hear(Command(vy=1.0))
    press(in_force, UP)
    clock.now += 10.0  # the simulator is slow, and this was sent before
    in_force.hear(Command(vy=1.0))
    assert in_force.next == Command(0.1, 1.0)
    in_force.hear(Command(vy=1.0))
    assert in_force.next == Command(vy=1.0)


def test_without_an_answer_the_last_one_sent_counts():
    in_force = CommandInForce(Clock())
    press(in_force, UP)
    assert press(in_force, UP) == Command(vx=0.2)
    in_force.forget()
    assert press(in_force, UP) == Command(vx=0.1)
