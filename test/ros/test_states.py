#!/usr/bin/env python3
"""A pilot node for real drones flies from take-off to landing, in wall time and in simulated time."""

import itertools
import math
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path
from typing import NamedTuple

import rospy
import rostest
from ending import end
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from std_msgs.msg import Empty, Float32MultiArray, String
from std_srvs.srv import Trigger

from drone_sim.files.resources import package_path

PILOT = Path(__file__).with_name("safe_pilot.py")


class Flight(NamedTuple):
    """Real-time factor, whether the pilot uses simulated time, and the duration of a leg of its square (s)."""

    factor: float
    simulated: bool
    leg: float


FLIGHTS = {
    "slow": Flight(1, False, 0.8),
    "real": Flight(5, False, 0.4),
    "simulated": Flight(5, True, 4.0),  # longer: a busy machine merges commands of its bag that are close in time
}
QUICK = ("real", "simulated")
RECORDED = "simulated"
TURN = 0.6  # rad/s, of the outside controller
SPEED, STEP = 0.5, 0.05  # m/s, s


def clock(name):
    """Return the remapping that gives a simulator and its clients their own /clock topic."""
    return f"/clock:=/{name}/clock"


def path(messages):
    """Return {step: (x, y)} since the first change of the command, and the steps of all changes."""
    odometry, commands = messages
    twists_by_step = {}
    for message in commands:
        linear, angular = message.twist.linear, message.twist.angular
        twists_by_step[round(message.header.stamp.to_sec() / STEP)] = (linear.x, linear.y, angular.z)
    steps = sorted(twists_by_step)
    changes = [now for before, now in itertools.pairwise(steps) if twists_by_step[now] != twists_by_step[before]]
    places = {round(m.header.stamp.to_sec() / STEP): m.pose.pose.position for m in odometry}
    flown = {step - changes[0]: (place.x, place.y) for step, place in places.items() if step >= changes[0]}
    return flown, [step - changes[0] for step in changes]


class States(unittest.TestCase):
    """Three simulators with one drone each, in parallel; a node reads /use_sim_time when it starts."""

    @classmethod
    def setUpClass(cls):
        cls.processes, cls.odometry, cls.states, cls.pilots = [], {}, {}, {}
        cls.log = Listener("/rosout", Log)
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.end_processes)  # also if this fails: ctest waits for all processes that hold its output
        for simulated in (False, True):
            rospy.set_param("/use_sim_time", simulated)
            names = [name for name, flight in FLIGHTS.items() if flight.simulated == simulated]
            for name in names:
                cls.start_simulator(name)
            for name in names:
                cls.odometry[name].wait_for(after=0)
            if RECORDED in names:
                cls.start_recorder()
            controls = [cls.start_pilot(name) for name in names]
            for publisher in controls:
                connected(publisher)

    @classmethod
    def start_simulator(cls, name):
        cls.odometry[name] = Listener(f"/{name}/odom", Odometry)
        cls.states[name] = Listener(f"/{name}/state", String)
        settings = (f"_drone/name:={name}", f"_real_time_factor:={FLIGHTS[name].factor}", "_start:=landed")
        cls.spawn(str(package_path() / "scripts/simulator"), f"__name:=sim_{name}", clock(name), *settings)

    @classmethod
    def start_recorder(cls):
        """Start to record a bag, and wait until its file exists."""
        cls.commands = Listener(f"/{RECORDED}/command", TwistStamped)
        arguments = ("--simulator", f"sim_{RECORDED}", "--folder", cls.folder.name, clock(RECORDED))
        cls.recorder = cls.spawn(str(package_path() / "scripts/record"), *arguments)
        while not any(Path(cls.folder.name).iterdir()):
            threading.Event().wait(0.02)

    @classmethod
    def start_pilot(cls, name):
        """Start a pilot and an outside controller of its drone; return the controller's publisher.

        The controller answers every odometry message; the pilot decides whether it forwards the command.
        """
        turning = Twist()
        turning.angular.z = TURN
        publisher = rospy.Publisher(f"/{name}/cmd_vel_in", Twist, queue_size=1)
        rospy.Subscriber(f"/{name}/odom", Odometry, lambda _message: publisher.publish(turning))
        leg = str(FLIGHTS[name].leg)
        cls.pilots[name] = cls.spawn(str(PILOT), f"__name:=pilot_{name}", f"__ns:=/{name}", clock(name), leg)
        return publisher

    @classmethod
    def spawn(cls, *command):
        cls.processes.append(subprocess.Popen([sys.executable, *command]))
        return cls.processes[-1]

    @classmethod
    def end_processes(cls):
        try:
            end(*cls.processes)
        finally:
            cls.folder.cleanup()

    def test_1_quick_flights(self):
        for name in QUICK:
            with self.subTest(name):
                self.check_flight(name)

    def check_flight(self, name):
        """Check that a pilot took off, flew a square, handed over, and landed."""
        self.assertEqual(self.pilots[name].wait(90), 0)
        self.states[name].wait_for(lambda m: len(self.states[name].messages) == 5, after=0)
        state_names = [message.data for message in self.states[name].messages]
        self.assertEqual(state_names, ["landed", "taking off", "flying", "landing", "landed"])
        flown = [message.pose.pose.position for message in self.odometry[name].messages]
        for axis in "xy":
            places = [getattr(one, axis) for one in flown]
            self.assertGreater(max(places) - min(places), 0.15)
        self.assertAlmostEqual(max(one.z for one in flown), 0.81, delta=0.1)
        turning = [message.twist.twist.angular.z for message in self.odometry[name].messages]
        self.assertAlmostEqual(max(turning), TURN, delta=0.2)
        self.odometry[name].wait_for(lambda m: m.pose.pose.position.z < 0.02)
        rest = Listener(f"/{name}/propellers", Float32MultiArray).wait_for(after=0)
        self.assertEqual(list(rest.data), [0, 0, 0, 0])

    def test_2_a_twist_on_the_ground_logs_why_it_is_refused(self):
        twists = connected(rospy.Publisher("/real/cmd_vel", Twist, queue_size=1))
        twist = Twist()
        twist.linear.x = 0.5
        twists.publish(twist)
        self.log.wait_for(lambda m: m.level == Log.WARN and "it is landed" in m.msg, after=0)

    def test_3_goto_home_and_reset(self):
        topics = (("takeoff", Empty), ("goto", PoseStamped), ("home", Empty), ("reset", Empty))
        publishers = {topic: connected(rospy.Publisher(f"/real/{topic}", kind, queue_size=1)) for topic, kind in topics}
        publishers["reset"].publish()
        publishers["takeoff"].publish()
        self.states["real"].wait_for(lambda m: m.data == "flying")
        goal = PoseStamped()
        goal.header.frame_id, goal.pose.position.x, goal.pose.position.z = "base_link", 1.0, 1.0
        goal.pose.orientation.w = 1.0
        publishers["goto"].publish(goal)
        self.log.wait_for(lambda m: "goto refused: frame_id 'base_link': must be 'world'" in m.msg, after=0)
        goal.header.frame_id = "world"
        publishers["goto"].publish(goal)
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.x > 0.9)
        publishers["home"].publish()
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.x < 0.5)
        publishers["reset"].publish()
        self.states["real"].wait_for(lambda m: m.data == "landed", after=-1)
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.z < 0.02)

    def test_4_a_bag_played_into_a_restarted_simulation_repeats_the_flight(self):
        end(self.recorder, number=signal.SIGINT)
        (bag,) = Path(self.folder.name).iterdir()
        heard = (self.odometry[RECORDED], self.commands)
        flown, changes = path([one.messages[:] for one in heard])
        count = len(self.odometry[RECORDED].messages)
        self.assertTrue(rospy.ServiceProxy(f"/sim_{RECORDED}/restart", Trigger)().success)
        self.odometry[RECORDED].wait_for(lambda m: m.header.stamp.to_sec() < 1, after=count)
        before = [len(one.messages) for one in heard]
        topics = (f"/{RECORDED}/{topic}" for topic in ("takeoff", "cmd_vel", "land"))
        pace = str(FLIGHTS[RECORDED].factor)
        subprocess.run(
            ["rosbag", "play", "--quiet", "-r", pace, str(bag), "--topics", *topics], check=True, timeout=120
        )
        self.states[RECORDED].wait_for(lambda m: m.data == "landed", after=-1)
        again, changes_again = path([one.messages[count:] for one, count in zip(heard, before)])
        self.assertEqual(len(changes_again), len(changes))
        late = max(abs(one - other) for one, other in zip(changes, changes_again))
        commanded = {step for step in flown if step <= changes[-1]}
        common = flown.keys() & again.keys()
        self.assertGreater(len(commanded), 100)
        self.assertGreater(len(common & commanded), 0.9 * len(commanded), "a busy machine loses few messages")
        for step in common:
            # Each command lasts a little longer or shorter. A message that a busy machine drops looks one step late.
            self.assertLess(math.dist(flown[step], again[step]), SPEED * STEP * (late + 1) * len(changes))

    def test_5_slow_flights(self):
        for name in FLIGHTS.keys() - set(QUICK):
            with self.subTest(name):
                self.check_flight(name)


if __name__ == "__main__":
    rospy.init_node("test_states", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "states", States))
