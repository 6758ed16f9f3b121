#!/usr/bin/env python3
"""Topics of every sensor: types, rates, stamps, frames, values, and no message twice."""

import itertools
import math
import sys
import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import PointStamped, PoseStamped, WrenchStamped
from listening import Listener, connected
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, MagneticField, NavSatFix, Range
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from drone_sim.files.resources import package_path
from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

SMALL = {name: {"width": 64, "height": 48} for name in ("front", "depth", "track", "floor")}
TOPICS = {  # type, Hz, frame
    "imu/data": (Imu, 200, "imu_link"),
    "imu/data_raw": (Imu, 200, "imu_link"),
    "magnetic_field": (MagneticField, 50, "imu_link"),
    "pressure": (FluidPressure, 50, "imu_link"),
    "pressure/height": (PointStamped, 50, "world"),
    "range": (Range, 20, "range_link"),
    "fix": (NavSatFix, 5, "gps_link"),
    "contacts/wrench": (WrenchStamped, 20, "base_link"),
    "battery": (BatteryState, 10, "base_link"),
}


class Sensors(unittest.TestCase):
    """A node that runs in this process."""

    @classmethod
    def setUpClass(cls):
        cls.end_event = threading.Event()
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        cls.fixed = Listener("/tf_static", TFMessage)
        cls.listeners = {topic: Listener(f"/drone/{topic}", kind) for topic, (kind, _, _) in TOPICS.items()}
        cls.contacts, cls.odometry = Listener("/drone/contacts", MarkerArray), Listener("/drone/odom", Odometry)
        for listener in (cls.fixed, cls.contacts, cls.odometry, *cls.listeners.values()):
            listener.wait_for()
        cls.poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1))

    @classmethod
    def tearDownClass(cls):
        cls.end_event.set()
        cls.thread.join()

    @classmethod
    def run_node(cls):
        file = str(package_path() / "config" / "sensors.yaml")
        cls.node = Node(parameters.load({"config": file, "cameras": SMALL, "real_time_factor": 5.0}))
        cls.node.run(cls.end_event.is_set)
        cls.node.close()

    def setUp(self):
        count = len(self.odometry.messages)
        self.assertTrue(rospy.ServiceProxy("~restart", Trigger)().success)
        self.odometry.wait_for(lambda o: 0 < o.header.stamp.to_sec() < 1, after=count)

    def pause(self, on):
        self.assertTrue(rospy.ServiceProxy("~pause", SetBool)(on).success)

    def test_rates_and_frames(self):
        for topic, (_, rate, frame) in TOPICS.items():
            listener = self.listeners[topic]
            start = len(listener.messages)
            listener.wait_for(lambda m, start=start, listener=listener: len(listener.messages) > start + 10)
            headers = [message.header for message in listener.messages[start : start + 10]]
            gaps = {round((b.stamp - a.stamp).to_sec() * rate, 6) for a, b in itertools.pairwise(headers)}
            self.assertEqual(gaps, {1.0}, topic)
            self.assertEqual({header.frame_id for header in headers}, {frame}, topic)

    def test_sensor_frames_are_published_on_tf_static(self):
        tf_static = self.fixed.wait_for(after=0)
        sensors = {one.child_frame_id: one for one in tf_static.transforms if one.child_frame_id.endswith("_link")}
        self.assertLessEqual({"imu_link", "range_link", "gps_link"}, set(sensors))
        self.assertEqual(
            {sensors[name].header.frame_id for name in ("imu_link", "range_link", "gps_link")}, {"base_link"}
        )
        turn = sensors["range_link"].transform.rotation
        self.assertAlmostEqual(turn.y, math.sqrt(0.5))  # x points down

    def test_sensor_values_are_plausible(self):
        data, raw = (self.listeners[f"imu/{name}"].wait_for() for name in ("data", "data_raw"))
        self.assertEqual(raw.orientation_covariance[0], -1)
        self.assertGreater(data.orientation_covariance[0], 0)
        self.assertLess(abs(data.linear_acceleration.z - 9.81), 3)
        self.assertLess(abs(self.listeners["fix"].wait_for().latitude - 47.397742), 1e-4)
        self.assertLess(abs(self.listeners["range"].wait_for().range - 0.8), 0.1)
        self.assertLess(abs(self.listeners["pressure"].wait_for().fluid_pressure - 95589), 300)
        self.assertLess(self.listeners["battery"].wait_for().current, -1)
        self.assertLess(self.listeners["magnetic_field"].wait_for().magnetic_field.z, -4e-5)

    def test_contacts_of_a_drone_on_the_floor(self):
        message = PoseStamped()
        message.header.frame_id = "world"
        message.pose.position.z, message.pose.orientation.w = 0.0, 1.0
        self.poses.publish(message)
        touched = self.contacts.wait_for(lambda array: array.markers)
        self.assertEqual({marker.ns for marker in touched.markers}, {"Floor"})
        self.assertEqual({marker.header.frame_id for marker in touched.markers}, {"world"})

    def test_single_steps_while_paused_publish_no_message_twice(self):
        raw = self.listeners["imu/data_raw"]
        self.pause(True)
        start = len(raw.messages)
        for _ in range(4):
            rospy.ServiceProxy("~step", Trigger)()
        raw.wait_for(lambda m: len(raw.messages) >= start + 40, after=0)
        self.pause(False)
        stamps = [message.header.stamp.to_nsec() for message in raw.messages[start:]]
        self.assertEqual({after - before for before, after in itertools.pairwise(stamps)}, {5_000_000})


if __name__ == "__main__":
    rospy.init_node("test_sensors", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "sensors", Sensors))
