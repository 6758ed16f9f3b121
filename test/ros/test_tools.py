#!/usr/bin/env python3
"""`rosrun drone_sim joy_teleop` with the topic `joy` and with a FIFO as its device; `rosrun drone_sim record`."""

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


def joy_message(*buttons, forward=0.0):
    return Joy(axes=[0, 0, 0, 0, forward, 0], buttons=[number in buttons for number in range(8)])


def has_speed(speed):
    return lambda message: message.linear.x == speed


def event(kind, number, value):
    return struct.pack("=IhBB", 0, value, kind, number)


def spawn(*command):
    return subprocess.Popen(
        ["rosrun", "drone_sim", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


class Tools(unittest.TestCase):
    """This process acts as the joy node, the gamepad driver, and the simulator that is recorded."""

    def listener(self, topic, kind):
        resource = Listener(topic, kind)
        self.addCleanup(resource.close)
        return resource

    def folder(self):
        resource = tempfile.TemporaryDirectory()
        self.addCleanup(resource.cleanup)
        return Path(resource.name)

    def test_the_joy_topic_commands_the_drone_while_the_button_is_held(self):
        sent = self.listener("/drone/cmd_vel", Twist)
        takeoffs = self.listener("/drone/takeoff", Empty)
        connected(takeoffs._subscriber)
        joy = connected(rospy.Publisher("/joy", Joy, queue_size=10))
        joy.publish(joy_message(forward=1.0))
        joy.publish(joy_message(LB, forward=1.0))
        sent.wait_for(has_speed(1.0))
        count = len(sent.messages)
        sent.wait_for(has_speed(1.0), after=count + 2)  # it is repeated
        joy.publish(joy_message(LB, Y, forward=0.55))
        takeoffs.wait_for(after=0)
        sent.wait_for(lambda message: abs(message.linear.x - 0.5) < 1e-6)
        joy.publish(joy_message(Y, forward=0.55))
        sent.wait_for(has_speed(0.0), after=count)
        self.assertEqual(len(takeoffs.messages), 1)

    def test_silence_on_the_joy_topic_stops_until_the_button_is_pressed_again(self):
        sent = self.listener("/impatient/cmd_vel", Twist)
        joy = connected(rospy.Publisher("/impatient/joy", Joy, queue_size=10))
        connected(sent._subscriber)
        joy.publish(joy_message(forward=1.0))
        joy.publish(joy_message(LB, forward=1.0))
        sent.wait_for(has_speed(1.0), after=0)
        sent.wait_for(has_speed(0.0), after=0)  # no joy message was published in between
        count = len(sent.messages)
        joy.publish(joy_message(LB, forward=1.0))  # ignored: the button was not released
        joy.publish(joy_message())
        joy.publish(joy_message(LB, forward=0.55))
        sent.wait_for(lambda message: message.linear.x > 0, after=count)
        self.assertFalse(any(map(has_speed(1.0), sent.messages[count:])))

    def test_a_removed_gamepad_and_an_ended_node_stop_the_drone(self):
        device = str(self.folder() / "js0")
        os.mkfifo(device)
        driver = os.open(device, os.O_RDWR)
        sent = self.listener("/drone2/cmd_vel", Twist)
        node = spawn("joy_teleop", "_drone:=drone2", f"_device:={device}")
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        os.write(driver, event(AXIS, 4, -32767) + event(BUTTON, LB, 1))
        sent.wait_for(has_speed(1.0))
        count = len(sent.messages)
        os.close(driver)
        sent.wait_for(has_speed(0.0), after=count)
        node.send_signal(signal.SIGTERM)
        output, _ = node.communicate(timeout=PATIENCE)
        self.assertEqual(node.returncode, 0, output)
        self.assertIn("js0: No such device: the drone is stopped", output)
        self.assertIn("stop sent on /drone2/cmd_vel", output)
        self.assertNotIn("Traceback", output)

    def test_topics_without_images_are_recorded_once_the_simulator_runs(self):
        odometry = rospy.Publisher("/pretended/odom", Odometry, queue_size=10)
        pictures = rospy.Publisher("/pretended/front", Image, queue_size=10)
        folder = self.folder()
        record = spawn("record", "--simulator", "pretended", "--folder", str(folder))
        self.addCleanup(record.wait)
        self.addCleanup(record.kill)
        rospy.Service("/pretended/pause", SetBool, lambda _: SetBoolResponse())
        connected(odometry)
        message = Odometry(child_frame_id="base_link")
        message.header.frame_id = "a long name " * 10_000  # the recorder buffers small amounts of data
        end = time.monotonic() + PATIENCE
        while not any(path.stat().st_size > 500_000 for path in folder.iterdir()):
            self.assertLess(time.monotonic(), end, "nothing is recorded")
            odometry.publish(message)
            pictures.publish(Image())
            time.sleep(0.05)
        record.send_signal(signal.SIGINT)
        output, _ = record.communicate(timeout=PATIENCE)
        self.assertEqual(record.returncode, 0, output)
        (path,) = folder.iterdir()
        self.assertIn(f"into {path}", output)
        with rosbag.Bag(str(path)) as bag:
            found = {(topic, message.child_frame_id) for topic, message, _ in bag.read_messages(["/pretended/odom"])}
            self.assertEqual(found, {("/pretended/odom", "base_link")})
            self.assertNotIn("/pretended/front", bag.get_type_and_topic_info().topics)


if __name__ == "__main__":
    rospy.init_node("test_tools")
    sys.exit(rostest.rosrun("drone_sim", "tools", Tools))
