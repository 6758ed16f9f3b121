#!/usr/bin/env python3
"""Weather and faults by topic: wind that blows, a link that is slow, a camera that fails, and what is refused."""

import sys
import threading
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import Twist, TwistStamped, Vector3Stamped
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image

from drone_sim.ros.node.node import Node
from drone_sim.ros.vehicle.conditions import read_changes
from drone_sim.run import parameters
from drone_sim.vehicles.checks import Refused

SMALL = {name: {"width": 64, "height": 48} for name in ("front", "depth", "track", "floor")}
WIND = {"wind": {"kind": "wind", "rate": 20}}


class Conditions(unittest.TestCase):
    """A node that runs in this process."""

    @classmethod
    def setUpClass(cls):
        cls.over = threading.Event()
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        cls.odometry, cls.log = Listener("/drone/odom", Odometry), Listener("/rosout", Log)
        cls.odometry.wait_for()
        cls.weather, cls.faults = (
            connected(rospy.Publisher(f"/drone/{topic}", KeyValue, queue_size=10)) for topic in ("weather", "faults")
        )

    @classmethod
    def tearDownClass(cls):
        cls.over.set()
        cls.thread.join()

    @classmethod
    def run_node(cls):
        """Make and run it in one thread."""
        cls.node = Node(parameters.load({"sensors": WIND, "cameras": SMALL, "real_time_factor": 5.0}))
        cls.node.run(cls.over.is_set)
        cls.node.close()

    def test_wind(self):
        wind = Listener("/drone/wind", Vector3Stamped)
        self.assertEqual(wind.wait_for().vector.x, 0)
        message = Vector3Stamped()
        message.vector.x = 2.0
        publisher = connected(rospy.Publisher("/drone/set_wind", Vector3Stamped, queue_size=1))
        publisher.publish(message)
        felt = wind.wait_for(lambda said: said.vector.x == 2)
        self.assertEqual(felt.header.frame_id, "world")
        self.odometry.wait_for(lambda said: said.twist.twist.linear.x > 0.05)
        self.weather.publish("gusts/deviation", "[0, 1.5, 0]")
        wind.wait_for(lambda said: said.vector.x == 2 and abs(said.vector.y) > 0.1)
        message.vector.x = 1000.0
        publisher.publish(message)
        self.log.wait_for(lambda said: "set_wind refused: wind/0 = 1000.0" in said.msg, after=0)
        self.weather.publish("gust", "1")
        self.log.wait_for(lambda said: "weather refused: gust: unknown key; known are gusts" in said.msg, after=0)
        self.assertEqual(wind.wait_for().vector.x, 2)

    def test_a_slow_link(self):
        command = Listener("/drone/command", TwistStamped)
        self.faults.publish("commands/latency", "1.0")
        image, info = Listener("/drone/front", Image), Listener("/drone/camera_info", CameraInfo)
        self.faults.publish("images", "{latency: 0.5}")
        now = self.odometry.wait_for
        image.wait_for(lambda said: 0.45 < (now(after=-1).header.stamp - said.header.stamp).to_sec() < 1.5)
        stamps = {said.header.stamp for said in image.messages[-3:]}
        info.wait_for(lambda said: said.header.stamp in stamps, after=0)
        twist = Twist()
        twist.linear.y = 0.25
        publisher = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        sent = self.odometry.messages[-1].header.stamp
        publisher.publish(twist)
        obeyed = command.wait_for(lambda said: said.twist.linear.y == 0.25)
        self.assertGreaterEqual((obeyed.header.stamp - sent).to_sec(), 1.0)

    def test_a_fault_that_there_is_not(self):
        self.faults.publish("sensors/frnt", "ok")
        said = "faults refused: faults/sensors/'frnt': no such sensor or camera; near names are front"
        self.log.wait_for(lambda line: line.msg == said, after=0)

    def test_what_is_refused_says_why(self):
        for key, value, said in (
            ("propellers", "[1, 1]", "propellers = [1, 1]: must be 4 numbers"),
            ("images/loss", "{", "value '{'"),
            ("", "5", "key '': names none of propellers, commands, images"),
            ("a/" * 1000, "5", "too long"),
            ("commands", "[" * 500, "value"),
            ("commands/loss", ".nan", "commands/loss = nan: input should be a finite number"),
        ):
            with self.assertRaises(Refused) as refused:
                read_changes(KeyValue(key, value), self.node.simulation.drone.parameters.faults)
            self.assertIn(said, str(refused.exception))
            self.assertNotIn("\n", str(refused.exception))


if __name__ == "__main__":
    rospy.init_node("test_conditions", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "conditions", Conditions))
