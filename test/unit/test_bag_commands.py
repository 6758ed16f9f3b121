"""The commands of a bag, as a timeline, repeat its flight bit by bit, although the recorder received them late."""

import pytest

pytest.importorskip("rosbag", reason="needs ROS")

import numpy as np
import rosbag
import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import PoseStamped, Vector3Stamped, WrenchStamped
from geometry_msgs.msg import Twist as TwistMessage
from std_msgs.msg import Empty, String

from drone_sim.mechanics.state import Pose, State, Twist, Vector3
from drone_sim.offline import timeline
from drone_sim.ros.core import message_conversion as messages
from drone_sim.ros.tools import bag_commands
from drone_sim.ros.tools.bags import BagSteps, RecordedMessage
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

STEPS = 300
SETTINGS = {"start": "landed"}
STILL = State((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def goto(x, z, frame="world"):
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.z, message.pose.orientation.w = x, z, 1.0
    return message


def wind(x):
    message = Vector3Stamped()
    message.vector.x = x
    return message


def twist(vx, wz=0.0):
    message = TwistMessage()
    message.linear.x, message.angular.z = vx, wz
    return message


COMMANDS = {  # by step: topic, message, and the delay of the recorder in steps
    4: ("takeoff", Empty(), 1),
    70: ("cmd_vel", twist(0.5), 4),
    90: ("cmd_vel", twist(float("nan")), 0),
    95: ("cmd_vel", twist(0.1, 0.3), 0),
    120: ("set_wind", wind(0.5), 0),
    130: ("goto", goto(1.0, 1.2), 0),
    131: ("goto", goto(5.0, 5.0, "map"), 0),
    170: ("push", WrenchStamped(), 0),
    180: ("cmd_vel", twist(0.1, 0.3), 0),  # the same twist again ends the goto
    190: ("faults", KeyValue("propellers", "[1, 0.97, 1, 1]"), 0),
    200: ("weather", KeyValue("a/" * 10_000, "1"), 0),
    220: ("land", Empty(), -1),
}


def apply_command(simulation, topic, message):
    drone = simulation.drone
    if topic == "cmd_vel" and message.linear.x == message.linear.x:
        drone.commands.receive(Twist(Vector3(message.linear.x, 0, 0), Vector3(0, 0, message.angular.z)))
    elif topic == "goto" and message.header.frame_id == "world":
        drone.ask(topic, Pose((message.pose.position.x, 0, message.pose.position.z)))
    elif topic == "set_wind":
        drone.context.change_weather({"wind": [message.vector.x, 0, 0]})
    elif topic == "faults":
        drone.change_faults({"propellers": [1, 0.97, 1, 1]})
    elif topic in ("takeoff", "land"):
        drone.ask(topic)


def record(path, began):
    """Fly, write the messages that a recorder would receive, and return the states."""
    simulation, states, state = Simulation(parameters.load(SETTINGS)), [], ""
    with rosbag.Bag(str(path), "w") as bag:
        for step in range(STEPS):
            if step in COMMANDS:
                topic, message, late = COMMANDS[step]
                bag.write(f"/drone/{topic}", message, rospy.Time.from_sec(began + 0.05 * (step + late) + 0.01))
                apply_command(simulation, topic, message)
            simulation.step()
            at = rospy.Time.from_sec(began + simulation.time)
            drone = simulation.drone
            bag.write("/drone/odom", messages.odometry(at, drone.body.state, "base_link"), at)
            bag.write("/drone/command", messages.command(at, drone.commands.now, "Track_base"), at)
            if state != str(drone.flight_state):
                state = str(drone.flight_state)
                bag.write("/drone/state", String(state), at)
            states.append(drone.body.state)
    simulation.close()
    return states


def test_twists_are_applied_in_order_although_they_were_recorded_late():
    """The recorder was 4 steps late, more than half the time between two commands; one step has two commands."""
    commands = np.zeros((60, 4))
    for row in range(10, 46, 6):
        commands[row : row + 3, 0] = 1.0
    commands[40:, 1] = 0.5
    steps = BagSteps(np.arange(1, 61) * 0.05, commands)
    twists = [(row, (float(row % 6 == 4), 0.0)) for row in range(10, 40, 3)]
    twists += [(40, (1.0, 0.2)), (40, (1.0, 0.5)), (43, (0.0, 0.5))]
    recorded_messages = [
        RecordedMessage((row + 4) * 0.05 + 0.01 + 1e-4 * index, twist(x)) for index, (row, (x, _)) in enumerate(twists)
    ]
    for one, (_, (_, y)) in zip(recorded_messages, twists):
        one.message.linear.y = y
    found = list(bag_commands._twists(iter(recorded_messages), steps))
    truth = [round(row * 0.05, 9) for row, _ in twists]
    assert [one["at"] for one, (_, (_, y)) in zip(found, twists) if y != 0.2] == [
        at for at, (_, (_, y)) in zip(truth, twists) if y != 0.2
    ]


@pytest.mark.parametrize("began", [0.0, 1.7e9])
def test_the_timeline_of_a_bag_repeats_the_flight_bit_by_bit(tmp_path, capsys, began, new_simulation):
    states = record(tmp_path / "flight.bag", began)
    out = tmp_path / "flight.yaml"
    assert bag_commands.main([str(tmp_path / "flight.bag"), str(out)]) == 0
    assert "9 commands: fly" in capsys.readouterr().out
    assert out.read_text().startswith("# fly --commands --set start=landed\n- {at: 0.2, takeoff: {}}\n")
    simulation = new_simulation(SETTINGS)
    found = timeline.read(str(out), simulation.parameters)
    for step, state in enumerate(states):
        found.apply(step, simulation.vehicles)
        simulation.step()
        assert simulation.drone.body.state == state, f"step {step}"


def one_line(capsys, *arguments):
    assert bag_commands.main([str(one) for one in arguments]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_mistakes_get_a_line(tmp_path, capsys):
    path, out = tmp_path / "flight.bag", tmp_path / "out.yaml"
    with rosbag.Bag(str(path), "w") as bag:
        for at, stamp in ((5, 5), (6, 6)):
            message = messages.odometry(rospy.Time(stamp), STILL, "base_link")
            bag.write("/drone/odom", message, rospy.Time(at))
    assert "it has no commands on /drone/cmd_vel" in one_line(capsys, path, out)
    assert "must end in .yaml" in one_line(capsys, path, tmp_path / "out.txt")
    assert "near names are /drone/odom" in one_line(capsys, path, out, "--vehicle", "dron")
    with rosbag.Bag(str(path), "a") as bag:
        bag.write("/drone/odom", messages.odometry(rospy.Time(1), STILL, "base_link"), rospy.Time(7))
    assert "time jumps back" in one_line(capsys, path, out)
