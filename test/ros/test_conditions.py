#!/usr/bin/env python3
"""Changes in flight: wind, a slow link, tuned gains, and refused values."""

import math
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import rospy
import rostest
import yaml
from diagnostic_msgs.msg import KeyValue
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.msg import Config
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped, Vector3Stamped
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image

from drone_sim.ros.core.validation import read_changes
from drone_sim.ros.node.node import Node
from drone_sim.run import parameters
from drone_sim.vehicles.checks import Refused

SMALL = {name: {"width": 64, "height": 48} for name in ("front", "depth", "track", "floor")}
WIND = {"wind": {"kind": "wind", "rate": 20}}


class Conditions(unittest.TestCase):
    """A node that runs in this process."""

    @classmethod
    def setUpClass(cls):
        cls.end_event = threading.Event()
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        cls.odometry, cls.log = Listener("/drone/odom", Odometry), Listener("/rosout", Log)
        cls.odometry.wait_for()
        cls.weather, cls.faults = (
            connected(rospy.Publisher(f"/drone/{topic}", KeyValue, queue_size=10)) for topic in ("weather", "faults")
        )

    @classmethod
    def tearDownClass(cls):
        cls.end_event.set()
        cls.thread.join()

    @classmethod
    def run_node(cls):
        cls.node = Node(parameters.load({"sensors": WIND, "cameras": SMALL, "real_time_factor": 5.0}))
        cls.node.run(cls.end_event.is_set)
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
        self.log.wait_for(lambda said: "weather refused: gust: unknown key; near names are gusts" in said.msg, after=0)
        self.assertEqual(wind.wait_for().vector.x, 2)

    def test_a_slow_link_delays_images_and_commands(self):
        command = Listener("/drone/command", TwistStamped)
        self.faults.publish("commands/latency", "1.0")
        image, info = Listener("/drone/front", Image), Listener("/drone/camera_info", CameraInfo)
        self.faults.publish("images", "{latency: 0.5}")
        now = self.odometry.wait_for
        image.wait_for(lambda said: 0.45 < (now(after=-1).header.stamp - said.header.stamp).to_sec() < 1.5)
        info.wait_for(lambda said: any(said.header.stamp == one.header.stamp for one in [*image.messages]), after=0)
        twist = Twist()
        twist.linear.y = 0.25
        publisher = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        sent = self.odometry.messages[-1].header.stamp
        publisher.publish(twist)
        obeyed = command.wait_for(lambda said: said.twist.linear.y == 0.25)
        self.assertGreaterEqual((obeyed.header.stamp - sent).to_sec(), 1.0)

    def test_tuning(self):
        """Do what `dynparam set`, `get` and `dump` do, with the library that they use."""
        client, feed = Client("/drone", timeout=60), Listener("/drone/parameter_updates", Config)
        self.assertEqual(client.get_configuration(timeout=60)["Kzref"], 5.0)
        self.assertEqual(client.update_configuration({"Kzref": 0.0})["Kzref"], 0.0)
        higher = PoseStamped()
        higher.pose.position.z, higher.pose.orientation.w = 1.5, 1.0
        connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1)).publish(higher)
        arrival_time = self.odometry.wait_for(lambda said: said.pose.pose.position.z > 1.45).header.stamp
        later = self.odometry.wait_for(lambda said: (said.header.stamp - arrival_time).to_sec() > 2)
        self.assertAlmostEqual(later.pose.pose.position.z, 1.5, delta=0.1, msg="nothing holds its height")
        info = Listener("/drone/camera_info", CameraInfo)
        changes = {"Kzref": 4.0, "cameras/front/horizontal_fov": 0.5, "thrust_limits/highest": 9.0}
        self.assertEqual({name: client.update_configuration(changes)[name] for name in changes}, changes)
        self.odometry.wait_for(lambda said: said.pose.pose.position.z < 0.9)
        info.wait_for(lambda said: abs(said.K[0] - 32 / math.tan(0.25)) < 1e-6)
        for wrong, said in (
            ({"Kzref": 1e6}, "Kzref = 1000000.0: input should be less than or equal to 10000"),
            ({"Kzref": math.nan}, "Kzref = nan: input should be a finite number"),
            ({"Kzref": 3.0, "thrust_limits/lowest": 9.5}, "thrust_limits = [9.5, 9.0]: must be [lowest, highest]"),
        ):
            result = client.update_configuration(wrong)
            self.assertEqual((result["Kzref"], result["thrust_limits/lowest"]), (4.0, 3.0))
            line = self.log.wait_for(lambda line, said=said: said in line.msg, after=0).msg
            self.assertTrue(line.startswith("/drone refused"), line)
        self.faults.publish("propellers", "[1, 0.99, 1, 1]")
        feed.wait_for(lambda m: any(one.name.endswith("back_left") and one.value == 0.99 for one in m.doubles), after=0)
        with tempfile.TemporaryDirectory() as folder:
            sensors, dump = Path(folder) / "sensors.yaml", Path(folder) / "dump.yaml"
            sensors.write_text(yaml.dump({"sensors": WIND}), encoding="utf-8")
            dump.write_text(yaml.dump(client.get_configuration()), encoding="utf-8")
            dumped = parameters.load({"config": f"{sensors},{dump}"})
        self.assertEqual((dumped.control.Kzref, dumped.faults.propellers[1]), (4.0, 0.99))
        self.assertEqual(dumped.cameras["front"].horizontal_fov, 0.5)
        client.close()

    def test_a_fault_of_an_unknown_sensor_is_refused(self):
        self.faults.publish("sensors/frnt", "ok")
        said = "faults refused: faults/sensors/frnt: no such sensor or camera; near names are front"
        self.log.wait_for(lambda line: line.msg == said, after=0)

    def test_values_out_of_range_are_refused_with_a_reason(self):
        for key, value, said in (
            ("propellers", "[1, 2]", "propellers/1 = 2: input should be less than or equal to 1"),
            ("images/loss", "{", "value '{'"),
            ("", "5", "key '': must be one of propellers"),
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
