#!/usr/bin/env python3
"""A pilot that knows the topics of real drones flies from take-off to landing, whatever time it goes by."""

import subprocess
import sys
import unittest
from pathlib import Path

import rospy
import rostest
from geometry_msgs.msg import PoseStamped, Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from std_msgs.msg import Empty, Float32MultiArray, String

from drone_sim.files.resources import package_path

FACTOR = 5
PILOT = Path(__file__).with_name("safe_pilot.py")
LEGS = {"real": 0.4, "simulated": 2.0}  # s of the pilot's time: as far as each flies, at FACTOR


class States(unittest.TestCase):
    """Two simulators with a drone each; /use_sim_time counts when a node begins."""

    @classmethod
    def setUpClass(cls):
        cls.processes, cls.odometry, cls.states, cls.pilots = [], {}, {}, {}
        cls.log = Listener("/rosout", Log)
        handing_over = Twist()
        handing_over.angular.z = 0.6
        cls.publishers = []
        for name, leg in LEGS.items():
            rospy.set_param("/use_sim_time", name == "simulated")
            cls.odometry[name] = Listener(f"/{name}/odom", Odometry)
            cls.states[name] = Listener(f"/{name}/state", String)
            cls.publishers.append(rospy.Publisher(f"/{name}/cmd_vel_in", Twist, queue_size=1, latch=True))
            cls.publishers[-1].publish(handing_over)
            settings = (f"_drone/name:={name}", f"_real_time_factor:={FACTOR}", "_start:=landed")
            cls.begin(str(package_path() / "scripts/simulator"), f"__name:=sim_{name}", *settings)
            cls.pilots[name] = cls.begin(str(PILOT), f"__name:=pilot_{name}", f"__ns:=/{name}", str(leg))
            cls.odometry[name].wait_for(after=0)
            connected(cls.publishers[-1])

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

    def test_1_take_off_square_landing(self):
        for name, pilot in self.pilots.items():
            with self.subTest(name):
                self.assertEqual(pilot.wait(30), 0)
                self.states[name].wait_for(lambda m, one=name: len(self.states[one].messages) == 5, after=0)
                said = [message.data for message in self.states[name].messages]
                self.assertEqual(said, ["landed", "taking off", "flying", "landing", "landed"])
                flown = [message.pose.pose.position for message in self.odometry[name].messages]
                for axis in "xy":
                    places = [getattr(one, axis) for one in flown]
                    self.assertGreater(max(places) - min(places), 0.4)
                self.assertAlmostEqual(max(one.z for one in flown), 0.81, delta=0.1)
                turning = max(message.twist.twist.angular.z for message in self.odometry[name].messages)
                self.assertAlmostEqual(turning, 0.6, delta=0.2)
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


if __name__ == "__main__":
    rospy.init_node("test_states", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "states", States))
