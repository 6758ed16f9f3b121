#!/usr/bin/env python3
"""key_teleop in a terminal of its own: keys too early, sequences in pieces, the read-out, and how it leaves."""

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
    """A key_teleop whose terminal this is; a thread keeps the screen as a person sees it."""

    def __init__(self):
        self._own, other = pty.openpty()
        self._screen = pyte.Screen(100, 24)
        self._stream = pyte.ByteStream(self._screen)
        environment = {**os.environ, "TERM": "xterm"}
        command = [sys.executable, str(package_path() / "scripts/key_teleop")]
        self.process = subprocess.Popen(
            command, env=environment, stdin=other, stdout=other, stderr=other, start_new_session=True
        )
        os.close(other)
        self._came = threading.Condition()
        self._closed = False
        self.resize(24, 100)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while not self._closed:
            if not select.select([self._own], [], [], 0.05)[0]:
                continue
            try:
                data = os.read(self._own, 4096)
            except OSError:  # nobody is left at the other end
                return
            with self._came:
                self._stream.feed(data)
                self._came.notify_all()

    def type(self, keys):
        os.write(self._own, keys)

    def pause(self):
        """Wait for what is shown next, but only for a moment."""
        with self._came:
            self._came.wait(0.03)

    def resize(self, rows, columns):
        with self._came:
            self._screen.resize(rows, columns)
        fcntl.ioctl(self._own, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    @property
    def shown(self):
        with self._came:
            return "\n".join(line.rstrip() for line in self._screen.display if line.strip())

    def wait_for(self, *texts):
        with self._came:
            there = self._came.wait_for(lambda: all(text in self.shown for text in texts), PATIENCE)
        assert there, f"{texts} is not shown, but {self.shown}"

    def close(self):
        self._closed = True
        self._reader.join()
        os.close(self._own)

    def left(self):
        """Wait for its end, and return the exit status and all that it has shown."""
        status = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return status, self.shown


class KeyTeleop(unittest.TestCase):
    """A person at the keys of the simulator that runs beside."""

    @classmethod
    def setUpClass(cls):
        # Not of cmd_vel: key_teleop says "ready" once its commands have a subscriber, which is to be the simulator.
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
        """Wait until a command is in force; and shown, where the terminal is open: the next key changes it then."""
        self.in_force.wait_for(lambda m: (m.twist.linear.x, m.twist.linear.y) == (vx, vy), after=-1)
        if self.terminal.process.poll() is None:
            self.terminal.wait_for(f"command  vx {vx:+.2f}  vy {vy:+.2f}")

    def assert_it_says_stop(self):
        status, shown = self.terminal.left()
        self.assertEqual(status, 0, shown)
        self.assertIn("key_teleop: stop sent on /drone/cmd_vel", shown)
        self.assertNotIn("Traceback", shown)
        self.wait_for_command(0.0)

    def test_keys_while_it_starts_do_not_end_it(self):
        typed, before = 0, len(self.in_force.messages)

        def counted():
            """Return how many of the keys, which all mean forward or left, are in the commands."""
            heard = [message.twist.linear for message in self.in_force.messages[before:]]
            return max((round(10 * (one.x + one.y)) for one in heard), default=0)

        while not counted():
            for piece in (UP, b"\x1b[", b"A"):
                self.terminal.type(piece)
                self.terminal.pause()
            self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
            typed += 2
        self.terminal.type(b"\x1b")
        self.assert_it_says_stop()
        self.assertLess(counted(), typed, "what was typed before it read keys is forgotten")

    def test_keys_command_and_escape_leaves(self):
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
        self.assert_it_says_stop()

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
        self.assert_it_says_stop()

    def test_a_terminal_of_any_size_and_its_end(self):
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
