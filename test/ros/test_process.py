#!/usr/bin/env python3
"""The node as a process: wrong parameters, signals, and repeatable flights."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import rosnode
import rospy
import rostest
from listening import Listener
from nav_msgs.msg import Odometry

HANGS = 30.0  # s; nothing here takes nearly as long unless it hangs


def simulator(*arguments):
    command = ["rosrun", "drone_sim", "simulator", *arguments]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


class Process(unittest.TestCase):
    """What a user sees of a node that cannot start, and of one that is told to end."""

    def test_wrong_parameters_end_it_with_one_line(self):
        for argument, expected in (
            ("_time_step:=0.012", "parameter time_step = 0.012: must be a whole multiple of sub_step = 0.005"),
            ("_drone:={urdf: /no/such.urdf}", "parameter drone/urdf = '/no/such.urdf': no such file"),
            ("_cameras:={front: {width: 0}}", "parameter cameras/front/width = 0"),
            ("_real_time_facter:=2", "parameter real_time_facter: unknown key; known are real_time_factor"),
        ):
            with self.subTest(argument):
                for name in ("time_step", "drone", "cameras", "real_time_facter"):
                    if rospy.has_param(f"/drone_sim/{name}"):
                        rospy.delete_param(f"/drone_sim/{name}")
                node = simulator(argument)
                output, _ = node.communicate(timeout=HANGS)
                self.assertEqual(node.returncode, 1, output)
                self.assertIn(expected, output)
                self.assertNotIn("Traceback", output)
                self.assertEqual(len([line for line in output.splitlines() if "FATAL" in line]), 1, output)
        rospy.delete_param("/drone_sim")

    def assert_ends_cleanly(self, end):
        """Let it fly as fast as it can, with somebody listening, and end it by `end(process)`."""
        node = simulator("_real_time_factor:=0")
        watchdog = threading.Timer(HANGS, node.kill)
        watchdog.start()
        odometry, lines = Listener("/drone/odom", Odometry), []
        for line in node.stdout:
            lines.append(line)
            if "flying" in line:
                odometry.wait_for()
                end(node)
        self.assertEqual(node.wait(), 0, "".join(lines))
        watchdog.cancel()
        odometry.close()
        self.assertNotIn("Traceback", "".join(lines))
        self.assertNotIn("/drone_sim", rosnode.get_node_names())

    def test_signals_end_it_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number):
                self.assert_ends_cleanly(lambda node, number=number: node.send_signal(number))

    def test_rosnode_kill_ends_it_cleanly(self):
        self.assert_ends_cleanly(lambda _: rosnode.kill_nodes(["/drone_sim"]))

    def test_two_processes_fly_alike_to_the_last_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            commands = Path(folder) / "commands.yaml"
            commands.write_text(
                "- {at: 0.5, twist: {linear: [1, -0.5, 0.2], angular: [0, 0, 0.7]}}\n"
                "- {at: 3.0, pose: {position: [1, 1, 3], rpy: [0.4, -0.3, 1]}}\n"
                "- {at: 6.0, twist: {linear: [0, 0, 0]}}\n"
            )
            flights = [Path(folder) / name for name in ("one.csv", "two.csv")]
            for csv in flights:
                command = ["rosrun", "drone_sim", "fly", "--commands", str(commands), "--csv", str(csv)]
                subprocess.run(command, check=True, timeout=HANGS, stdout=subprocess.DEVNULL)
            one, two = (csv.read_text() for csv in flights)
            self.assertGreater(len(one.splitlines()), 100)
            self.assertEqual(one, two)


if __name__ == "__main__":
    rospy.init_node("test_process")
    sys.exit(rostest.rosrun("drone_sim", "process", Process))
