#!/usr/bin/env python3
"""`rosrun drone_sim joy_teleop`: from the topic `joy`, and from a device, which a FIFO stands in for."""

import os
import signal
import struct
import subprocess
import sys
import tempfile
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist
from listening import Listener, connected
from sensor_msgs.msg import Joy
from std_msgs.msg import Empty

PATIENCE = 20.0  # s; nothing here takes nearly as long unless it hangs
LB, Y = 4, 3
BUTTON, AXIS = 1, 2


def stands(*buttons, forward=0.0):
    return Joy(axes=[0, 0, 0, 0, forward, 0], buttons=[number in buttons for number in range(8)])


def goes(speed):
    return lambda message: message.linear.x == speed


def event(kind, number, value):
    return struct.pack("=IhBB", 0, value, kind, number)


class JoyTeleop(unittest.TestCase):
    """A joy node, and then a gamepad's driver, are this process."""

    def listener(self, topic, kind):
        made = Listener(topic, kind)
        self.addCleanup(made.close)
        return made

    def test_it_commands_while_the_button_is_held_and_stops_when_all_falls_silent(self):
        sent = self.listener("/drone/cmd_vel", Twist)
        takeoffs = self.listener("/drone/takeoff", Empty)
        joy = connected(rospy.Publisher("/joy", Joy, queue_size=10))
        joy.publish(stands(forward=1.0))
        joy.publish(stands(LB, forward=1.0))
        sent.wait_for(goes(1.0))
        told = len(sent.messages)
        sent.wait_for(goes(1.0), after=told + 2)  # again and again
        joy.publish(stands(LB, Y, forward=0.55))
        takeoffs.wait_for()
        sent.wait_for(lambda message: abs(message.linear.x - 0.5) < 1e-6)
        joy.publish(stands(Y, forward=0.55))
        sent.wait_for(goes(0.0), after=told)
        told = len(sent.messages)
        joy.publish(stands(LB, forward=1.0))
        sent.wait_for(goes(1.0), after=told)
        sent.wait_for(goes(0.0), after=told)  # nothing was published meanwhile
        told = len(sent.messages)
        joy.publish(stands(LB, forward=1.0))  # has not been released
        joy.publish(stands())
        joy.publish(stands(LB, forward=0.55))
        sent.wait_for(lambda message: message.linear.x > 0, after=told)
        self.assertFalse(any(map(goes(1.0), sent.messages[told:])))
        self.assertEqual(len(takeoffs.messages), 1)

    def test_a_gamepad_that_vanishes_and_a_node_that_ends_leave_a_drone_that_stands(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        device = os.path.join(folder.name, "js0")
        os.mkfifo(device)
        driver = os.open(device, os.O_RDWR)
        sent = self.listener("/drone2/cmd_vel", Twist)
        node = subprocess.Popen(
            ["rosrun", "drone_sim", "joy_teleop", "_drone:=drone2", f"_device:={device}"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
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


if __name__ == "__main__":
    rospy.init_node("test_joy_teleop")
    sys.exit(rostest.rosrun("drone_sim", "joy_teleop", JoyTeleop))
