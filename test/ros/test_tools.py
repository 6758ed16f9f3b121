#!/usr/bin/env python3
"""`rosrun drone_sim joy_teleop` from the topic `joy`, and from a device, which a FIFO stands in for; and `record`."""

import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rosbag
import rospy
import rostest
from geometry_msgs.msg import Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image, Joy
from std_msgs.msg import Empty
from std_srvs.srv import SetBool, SetBoolResponse

PATIENCE = 90.0  # s; nothing here takes nearly as long unless it hangs
LB, Y = 4, 3
BUTTON, AXIS = 1, 2


def stands(*buttons, forward=0.0):
    return Joy(axes=[0, 0, 0, 0, forward, 0], buttons=[number in buttons for number in range(8)])


def goes(speed):
    return lambda message: message.linear.x == speed


def event(kind, number, value):
    return struct.pack("=IhBB", 0, value, kind, number)


def started(*command):
    return subprocess.Popen(
        ["rosrun", "drone_sim", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


class Tools(unittest.TestCase):
    """A joy node, a gamepad's driver, and a simulator to record, are this process."""

    def listener(self, topic, kind):
        made = Listener(topic, kind)
        self.addCleanup(made.close)
        return made

    def folder(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        return Path(made.name)

    def test_the_topic_joy_commands_while_the_button_is_held(self):
        sent = self.listener("/drone/cmd_vel", Twist)
        takeoffs = self.listener("/drone/takeoff", Empty)
        connected(takeoffs._subscriber)
        joy = connected(rospy.Publisher("/joy", Joy, queue_size=10))
        joy.publish(stands(forward=1.0))
        joy.publish(stands(LB, forward=1.0))
        sent.wait_for(goes(1.0))
        told = len(sent.messages)
        sent.wait_for(goes(1.0), after=told + 2)  # again and again
        joy.publish(stands(LB, Y, forward=0.55))
        takeoffs.wait_for(after=0)
        sent.wait_for(lambda message: abs(message.linear.x - 0.5) < 1e-6)
        joy.publish(stands(Y, forward=0.55))
        sent.wait_for(goes(0.0), after=told)
        self.assertEqual(len(takeoffs.messages), 1)

    def test_silence_on_the_topic_joy_stops_until_the_button_is_pressed_anew(self):
        sent = self.listener("/impatient/cmd_vel", Twist)
        joy = connected(rospy.Publisher("/impatient/joy", Joy, queue_size=10))
        connected(sent._subscriber)
        joy.publish(stands(forward=1.0))
        joy.publish(stands(LB, forward=1.0))
        sent.wait_for(goes(1.0), after=0)
        sent.wait_for(goes(0.0), after=0)  # nothing was published meanwhile
        told = len(sent.messages)
        joy.publish(stands(LB, forward=1.0))  # has not been released
        joy.publish(stands())
        joy.publish(stands(LB, forward=0.55))
        sent.wait_for(lambda message: message.linear.x > 0, after=told)
        self.assertFalse(any(map(goes(1.0), sent.messages[told:])))

    def test_a_gamepad_that_vanishes_and_a_node_that_ends_leave_a_drone_that_stands(self):
        device = str(self.folder() / "js0")
        os.mkfifo(device)
        driver = os.open(device, os.O_RDWR)
        sent = self.listener("/drone2/cmd_vel", Twist)
        node = started("joy_teleop", "_drone:=drone2", f"_device:={device}")
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        os.write(driver, event(AXIS, 4, -32767) + event(BUTTON, LB, 1))
        sent.wait_for(goes(1.0))
        told = len(sent.messages)
        os.close(driver)
        sent.wait_for(goes(0.0), after=told)
        node.send_signal(signal.SIGTERM)
        said, _ = node.communicate(timeout=PATIENCE)
        self.assertEqual(node.returncode, 0, said)
        self.assertIn("js0: No such device: the drone is stopped", said)
        self.assertIn("stop sent on /drone2/cmd_vel", said)
        self.assertNotIn("Traceback", said)

    def test_what_is_there_once_the_simulator_runs_is_recorded_but_for_pictures(self):
        odometry = rospy.Publisher("/pretended/odom", Odometry, queue_size=10)
        pictures = rospy.Publisher("/pretended/front", Image, queue_size=10)
        folder = self.folder()
        record = started("record", "--simulator", "pretended", "--folder", str(folder))
        self.addCleanup(record.wait)
        self.addCleanup(record.kill)
        rospy.Service("/pretended/pause", SetBool, lambda _: SetBoolResponse())
        connected(odometry)
        message = Odometry(child_frame_id="base_link")
        message.header.frame_id = "a long name " * 10_000  # the recorder writes into its file once it has much to write
        end = time.monotonic() + PATIENCE
        while not any(path.stat().st_size > 500_000 for path in folder.iterdir()):
            self.assertLess(time.monotonic(), end, "nothing is recorded")
            odometry.publish(message)
            pictures.publish(Image())
            time.sleep(0.05)
        record.send_signal(signal.SIGINT)
        said, _ = record.communicate(timeout=PATIENCE)
        self.assertEqual(record.returncode, 0, said)
        (path,) = folder.iterdir()
        self.assertIn(f"into {path}", said)
        with rosbag.Bag(str(path)) as bag:
            found = {(topic, message.child_frame_id) for topic, message, _ in bag.read_messages(["/pretended/odom"])}
            self.assertEqual(found, {("/pretended/odom", "base_link")})
            self.assertNotIn("/pretended/front", bag.get_type_and_topic_info().topics)


if __name__ == "__main__":
    rospy.init_node("test_tools")
    sys.exit(rostest.rosrun("drone_sim", "tools", Tools))
