#!/usr/bin/env python3
"""A pilot that knows the topics of real drones flies from take-off to landing, whatever time it goes by."""

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
    """How fast one simulator flies, by which time its pilot goes, and how long a leg of its square takes (s)."""

    factor: float
    simulated: bool
    leg: float


FLIGHTS = {
    "slow": Flight(1, False, 0.8),
    "real": Flight(5, False, 0.4),
    "simulated": Flight(5, True, 4.0),  # longer: its bag is played by the clock, and a busy machine joins what is close
}
QUICK = ("real", "simulated")
RECORDED = "simulated"
TURN = 0.6  # rad/s, of the outside controller
SPEED, STEP = 0.5, 0.05  # m/s, s


def clock(name):
    """Return the remapping that gives a simulator and all that goes by its time a /clock of their own."""
    return f"/clock:=/{name}/clock"


def path(messages):
    """Return where a drone was since it was first told to go, by steps, and the steps at which it was told anew."""
    odometry, commands = messages
    told = {}
    for message in commands:
        linear, angular = message.twist.linear, message.twist.angular
        told[round(message.header.stamp.to_sec() / STEP)] = (linear.x, linear.y, angular.z)
    steps = sorted(told)
    changes = [now for before, now in itertools.pairwise(steps) if told[now] != told[before]]
    places = {round(m.header.stamp.to_sec() / STEP): m.pose.pose.position for m in odometry}
    flown = {step - changes[0]: (place.x, place.y) for step, place in places.items() if step >= changes[0]}
    return flown, [step - changes[0] for step in changes]


class States(unittest.TestCase):
    """Three simulators with a drone each, at once; /use_sim_time counts when a node begins."""

    @classmethod
    def setUpClass(cls):
        cls.processes, cls.odometry, cls.states, cls.pilots = [], {}, {}, {}
        cls.log = Listener("/rosout", Log)
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.end_processes)  # where this fails, too: ctest waits for whoever holds its output
        for simulated in (False, True):
            rospy.set_param("/use_sim_time", simulated)
            names = [name for name, flight in FLIGHTS.items() if flight.simulated == simulated]
            for name in names:
                cls.begin_simulator(name)
            for name in names:
                cls.odometry[name].wait_for(after=0)
            if RECORDED in names:
                cls.begin_recorder()
            controls = [cls.begin_pilot(name) for name in names]
            for publisher in controls:
                connected(publisher)

    @classmethod
    def begin_simulator(cls, name):
        cls.odometry[name] = Listener(f"/{name}/odom", Odometry)
        cls.states[name] = Listener(f"/{name}/state", String)
        settings = (f"_drone/name:={name}", f"_real_time_factor:={FLIGHTS[name].factor}", "_start:=landed")
        cls.begin(str(package_path() / "scripts/simulator"), f"__name:=sim_{name}", clock(name), *settings)

    @classmethod
    def begin_recorder(cls):
        """Begin a bag, and wait until it has begun."""
        cls.commands = Listener(f"/{RECORDED}/command", TwistStamped)
        arguments = ("--simulator", f"sim_{RECORDED}", "--folder", cls.folder.name, clock(RECORDED))
        cls.recorder = cls.begin(str(package_path() / "scripts/record"), *arguments)
        while not any(Path(cls.folder.name).iterdir()):
            threading.Event().wait(0.02)

    @classmethod
    def begin_pilot(cls, name):
        """Begin a pilot, and what controls the drone from outside; return that's publisher.

        It answers every odometry with a command, whatever time goes by: the pilot decides whether it counts.
        """
        turning = Twist()
        turning.angular.z = TURN
        publisher = rospy.Publisher(f"/{name}/cmd_vel_in", Twist, queue_size=1)
        rospy.Subscriber(f"/{name}/odom", Odometry, lambda _message: publisher.publish(turning))
        leg = str(FLIGHTS[name].leg)
        cls.pilots[name] = cls.begin(str(PILOT), f"__name:=pilot_{name}", f"__ns:=/{name}", clock(name), leg)
        return publisher

    @classmethod
    def begin(cls, *command):
        cls.processes.append(subprocess.Popen([sys.executable, *command]))
        return cls.processes[-1]

    @classmethod
    def end_processes(cls):
        try:
            end(*cls.processes)
        finally:
            cls.folder.cleanup()

    def test_1_quick(self):
        for name in QUICK:
            with self.subTest(name):
                self.check_flight(name)

    def check_flight(self, name):
        """Check that a pilot took off, flew a square, handed over, and landed."""
        self.assertEqual(self.pilots[name].wait(90), 0)
        self.states[name].wait_for(lambda m: len(self.states[name].messages) == 5, after=0)
        said = [message.data for message in self.states[name].messages]
        self.assertEqual(said, ["landed", "taking off", "flying", "landing", "landed"])
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

    def test_2_a_twist_on_the_ground_says_why(self):
        twists = connected(rospy.Publisher("/real/cmd_vel", Twist, queue_size=1))
        twist = Twist()
        twist.linear.x = 0.5
        twists.publish(twist)
        self.log.wait_for(lambda m: m.level == Log.WARN and "it is landed" in m.msg, after=0)

    def test_3_goto_home_and_reset(self):
        topics = (("takeoff", Empty), ("goto", PoseStamped), ("home", Empty), ("reset", Empty))
        asks = {topic: connected(rospy.Publisher(f"/real/{topic}", kind, queue_size=1)) for topic, kind in topics}
        asks["reset"].publish()
        asks["takeoff"].publish()
        self.states["real"].wait_for(lambda m: m.data == "flying")
        goal = PoseStamped()
        goal.header.frame_id, goal.pose.position.x, goal.pose.position.z = "base_link", 1.0, 1.0
        goal.pose.orientation.w = 1.0
        asks["goto"].publish(goal)
        self.log.wait_for(lambda m: "goto refused: frame_id 'base_link': must be 'world'" in m.msg, after=0)
        goal.header.frame_id = "world"
        asks["goto"].publish(goal)
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.x > 0.9)
        asks["home"].publish()
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.x < 0.5)
        asks["reset"].publish()
        self.states["real"].wait_for(lambda m: m.data == "landed", after=-1)
        self.odometry["real"].wait_for(lambda m: m.pose.pose.position.z < 0.02)

    def test_4_a_bag_played_into_a_fresh_simulation(self):
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
            # Each command holds a little longer or shorter. What a busy machine has not heard looks one step later.
            self.assertLess(math.dist(flown[step], again[step]), SPEED * STEP * (late + 1) * len(changes))

    def test_5_slow(self):
        for name in FLIGHTS.keys() - set(QUICK):
            with self.subTest(name):
                self.check_flight(name)


if __name__ == "__main__":
    rospy.init_node("test_states", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "states", States))
