#!/usr/bin/env python3
"""A pilot that knows the topics of real drones flies from take-off to landing, whatever time it goes by."""

import subprocess
import sys
import unittest
from pathlib import Path
from typing import NamedTuple

import rospy
import rostest
from geometry_msgs.msg import PoseStamped, Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from std_msgs.msg import Empty, Float32MultiArray, String

from drone_sim.files.resources import package_path

PILOT = Path(__file__).with_name("safe_pilot.py")


class Flight(NamedTuple):
    """How fast one simulator flies, by which time its pilot goes, and how long a leg of its square takes (s)."""

    factor: float
    simulated: bool
    leg: float


FLIGHTS = {
    "slow_real": Flight(1, False, 0.8),
    "slow_simulated": Flight(1, True, 0.8),
    "real": Flight(5, False, 0.4),
    "simulated": Flight(5, True, 2.0),
}
QUICK = ("real", "simulated")
TURN = 0.6  # rad/s, of the outside controller


class States(unittest.TestCase):
    """Four simulators with a drone each, at once; /use_sim_time counts when a node begins."""

    @classmethod
    def setUpClass(cls):
        cls.processes, cls.odometry, cls.states, cls.pilots = [], {}, {}, {}
        cls.log = Listener("/rosout", Log)
        for name, flight in FLIGHTS.items():
            rospy.set_param("/use_sim_time", flight.simulated)
            cls.odometry[name] = Listener(f"/{name}/odom", Odometry)
            cls.states[name] = Listener(f"/{name}/state", String)
            cls.control_from_outside(name)
            clock = f"/clock:=/{name}/clock"  # each has its own
            settings = (f"_drone/name:={name}", f"_real_time_factor:={flight.factor}", "_start:=landed")
            cls.begin(str(package_path() / "scripts/simulator"), f"__name:=sim_{name}", clock, *settings)
            cls.pilots[name] = cls.begin(str(PILOT), f"__name:=pilot_{name}", f"__ns:=/{name}", clock, str(flight.leg))
        for name in FLIGHTS:
            cls.odometry[name].wait_for(after=0)

    @staticmethod
    def control_from_outside(name):
        """Answer every odometry with a command, whatever time goes by: the pilot decides whether it counts."""
        turning = Twist()
        turning.angular.z = TURN
        publisher = rospy.Publisher(f"/{name}/cmd_vel_in", Twist, queue_size=1)
        rospy.Subscriber(f"/{name}/odom", Odometry, lambda _message: publisher.publish(turning))

    @classmethod
    def begin(cls, *command):
        cls.processes.append(subprocess.Popen([sys.executable, *command]))
        return cls.processes[-1]

    @classmethod
    def tearDownClass(cls):
        for process in cls.processes:
            process.terminate()
        for process in cls.processes:
            process.wait()

    def test_1_quick(self):
        for name in QUICK:
            with self.subTest(name):
                self.check_flight(name)

    def check_flight(self, name):
        """Check that a pilot took off, flew a square, handed over, and landed."""
        self.assertEqual(self.pilots[name].wait(30), 0)
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
        self.log.wait_for(lambda m: m.level == Log.WARN and "it is landed; `takeoff` first" in m.msg, after=0)

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

    def test_4_slow(self):
        for name in FLIGHTS.keys() - set(QUICK):
            with self.subTest(name):
                self.check_flight(name)


if __name__ == "__main__":
    rospy.init_node("test_states", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "states", States))
