#!/usr/bin/env python3
"""key_teleop in a pseudo-terminal: keys during the start, split escape sequences, the display, and the exit."""

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import unittest

import pyte
import rospy
import rostest
from geometry_msgs.msg import Twist, TwistStamped
from listening import Listener, connected
from std_msgs.msg import String
from std_srvs.srv import Trigger

from drone_sim.files.resources import package_path

PATIENCE = 90.0  # s; nothing here takes nearly as long unless it hangs
UP, LEFT = b"\x1b[A", b"\x1bOD"


class Terminal:
    """A key_teleop process in a pseudo-terminal; a thread feeds its output to an emulated screen."""

    def __init__(self):
        self._terminal, other = pty.openpty()
        self._screen = pyte.Screen(100, 24)
        self._stream = pyte.ByteStream(self._screen)
        environment = {**os.environ, "TERM": "xterm"}
        command = [sys.executable, str(package_path() / "scripts/key_teleop")]
        self.process = subprocess.Popen(
            command, env=environment, stdin=other, stdout=other, stderr=other, start_new_session=True
        )
        os.close(other)
        self._arrival = threading.Condition()
        self._closed = False
        self.resize(24, 100)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while not self._closed:
            if not select.select([self._terminal], [], [], 0.05)[0]:
                continue
            try:
                data = os.read(self._terminal, 4096)
            except OSError:  # the other end is closed
                return
            with self._arrival:
                self._stream.feed(data)
                self._arrival.notify_all()

    def type(self, keys):
        os.write(self._terminal, keys)

    def pause(self):
        """Wait for the next output, at most 30 ms."""
        with self._arrival:
            self._arrival.wait(0.03)

    def resize(self, rows, columns):
        with self._arrival:
            self._screen.resize(rows, columns)
        fcntl.ioctl(self._terminal, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    @property
    def shown(self):
        with self._arrival:
            return "\n".join(line.rstrip() for line in self._screen.display if line.strip())

    def wait_for(self, *texts):
        with self._arrival:
            is_shown = self._arrival.wait_for(lambda: all(text in self.shown for text in texts), PATIENCE)
        assert is_shown, f"{texts} is not on the screen: {self.shown}"

    def close(self):
        self._closed = True
        self._reader.join()
        os.close(self._terminal)

    def wait_for_exit(self):
        """Wait until the process ends; return its exit status and the text of the screen."""
        status = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return status, self.shown


class KeyTeleop(unittest.TestCase):
    """Keys typed into key_teleop, which commands the simulator of the launch file."""

    @classmethod
    def setUpClass(cls):
        # Not cmd_vel: key_teleop shows "ready" once cmd_vel has a subscriber, which must be the simulator.
        cls.in_force = Listener("/drone/command", TwistStamped)
        cls.states = Listener("/drone_sim/state", String)
        rospy.wait_for_service("/drone_sim/restart", PATIENCE)

    def setUp(self):
        rospy.ServiceProxy("/drone_sim/restart", Trigger)()
        self.states.wait_for(lambda m: m.data == "flying", after=0)
        self.terminal = Terminal()
        self.addCleanup(self.terminal.process.wait)
        self.addCleanup(self.terminal.process.kill)

    def ready(self):
        self.terminal.wait_for("ready", "state    flying", "command  vx +0.00", "height 0.")

    def wait_for_command(self, vx, vy=0.0):
        """Wait until a command is in force, and on the screen while key_teleop runs: the next key changes that."""
        self.in_force.wait_for(lambda m: (m.twist.linear.x, m.twist.linear.y) == (vx, vy), after=-1)
        if self.terminal.process.poll() is None:
            self.terminal.wait_for(f"command  vx {vx:+.2f}  vy {vy:+.2f}")

    def assert_stop_is_sent_on_exit(self):
        status, shown = self.terminal.wait_for_exit()
        self.assertEqual(status, 0, shown)
        self.assertIn("key_teleop: stop sent on /drone/cmd_vel", shown)
        self.assertNotIn("Traceback", shown)
        self.wait_for_command(0.0)

    def test_keys_while_key_teleop_starts_do_not_end_it(self):
        typed, before = 0, len(self.in_force.messages)

        def counted():
            """Return the number of keys, all of them forward or left, in the commands so far."""
            heard = [message.twist.linear for message in self.in_force.messages[before:]]
            return max((round(10 * (one.x + one.y)) for one in heard), default=0)

        while not counted():
            for piece in (UP, b"\x1b[", b"A"):
                self.terminal.type(piece)
                self.terminal.pause()
            self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
            typed += 2
        self.terminal.type(b"\x1b")
        self.assert_stop_is_sent_on_exit()
        self.assertLess(counted(), typed, "what was typed before it read keys is forgotten")

    def test_keys_command_the_drone_and_escape_quits(self):
        self.ready()
        self.terminal.type(UP)
        self.wait_for_command(0.1)
        self.terminal.type(LEFT)
        self.wait_for_command(0.1, 0.1)
        self.terminal.type(b"w")
        self.wait_for_command(0.2, 0.1)
        self.terminal.type(b"d")
        self.wait_for_command(0.2, 0.0)
        self.terminal.type(b"z")
        self.terminal.wait_for("no such key: the drone is stopped")
        self.wait_for_command(0.0)
        self.terminal.type(b"\x1b")
        self.assert_stop_is_sent_on_exit()

    def test_keys_start_from_the_command_in_force(self):
        self.ready()
        self.terminal.type(UP)
        self.wait_for_command(0.1)
        other = Twist()
        other.linear.y = 0.5
        connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1)).publish(other)
        self.wait_for_command(0.0, 0.5)
        self.terminal.wait_for("command  vx +0.00  vy +0.50")
        self.terminal.type(UP)
        self.wait_for_command(0.1, 0.5)
        self.terminal.type(b"\r")
        self.terminal.wait_for("state    stopped", "command  vx +0.00  vy +0.00", "stop: stopped")
        self.terminal.type(b"\r")
        self.terminal.wait_for("state    flying", "start: started")
        self.terminal.type(b"p")
        self.terminal.wait_for("state    paused", "pause: paused at t")
        self.terminal.type(b"\x7f")
        self.terminal.wait_for("state    flying", "restart: started")
        self.assertEqual([m.data for m in self.states.messages[-3:]], ["paused", "stopped", "flying"])
        self.terminal.type(UP)
        self.wait_for_command(0.1)
        self.terminal.process.send_signal(signal.SIGTERM)
        self.assert_stop_is_sent_on_exit()

    def test_any_terminal_size_works_and_a_closed_terminal_stops_the_drone(self):
        self.ready()
        self.terminal.type(UP)
        self.wait_for_command(0.1)
        for rows, columns in ((3, 10), (1, 1), (80, 300), (2, 200), (24, 80)):
            self.terminal.resize(rows, columns)
            self.terminal.type(UP)
            self.in_force.wait_for(lambda m: m.twist.linear.x > 0)
            self.terminal.type(b" ")
            self.in_force.wait_for(lambda m: m.twist.linear.x == 0)
            self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
        self.terminal.type(UP)
        self.in_force.wait_for(lambda m: m.twist.linear.x > 0)
        self.terminal.close()
        self.assertIsNotNone(self.terminal.process.wait(PATIENCE))
        self.wait_for_command(0.0)


if __name__ == "__main__":
    rospy.init_node("test_key_teleop")
    sys.exit(rostest.rosrun("drone_sim", "key_teleop", KeyTeleop))
