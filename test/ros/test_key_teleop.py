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
import time
import unittest

import pyte
import rospy
import rostest
from geometry_msgs.msg import Twist, TwistStamped
from listening import Listener, connected
from std_msgs.msg import String
from std_srvs.srv import Trigger

PATIENCE = 90.0  # s; nothing here takes nearly as long unless it hangs
UP, LEFT = b"\x1b[A", b"\x1bOD"


class Terminal:
    """A key_teleop whose terminal this is; a thread keeps the screen as a person sees it."""

    def __init__(self):
        self._own, other = pty.openpty()
        self._screen = pyte.Screen(100, 24)
        self._stream = pyte.ByteStream(self._screen)
        environment = {**os.environ, "TERM": "xterm"}
        command = ["rosrun", "drone_sim", "key_teleop"]
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

    def type(self, *pieces, delay=0.1):
        for piece in pieces:
            os.write(self._own, piece)
            time.sleep(delay)

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
        cls.sent = Listener("/drone/cmd_vel", Twist)
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
        self.terminal.wait_for("state    flying", "command  vx +0.00", "height 0.")
        time.sleep(0.5)  # the input has been flushed by now

    def wait_for_command(self, vx, vy=0.0):
        self.in_force.wait_for(lambda m: (m.twist.linear.x, m.twist.linear.y) == (vx, vy))

    def assert_it_says_stop(self):
        status, shown = self.terminal.left()
        self.assertEqual(status, 0, shown)
        self.assertIn("key_teleop: stop sent on /drone/cmd_vel", shown)
        self.assertNotIn("Traceback", shown)
        self.wait_for_command(0.0)

    def test_keys_while_it_starts_do_not_end_it(self):
        typed, before = 0, len(self.sent.messages)
        while "stop the drone and leave" not in self.terminal.shown:
            self.terminal.type(UP, b"\x1b[", b"A", delay=0.03)
            self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
            typed += 2
        self.assertGreater(typed, 6)
        self.terminal.wait_for("state    flying", "command  vx")
        self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
        self.assertLess(len(self.sent.messages) - before, typed, "what was typed before it read keys is forgotten")
        for _ in range(round(PATIENCE)):  # so may be the first Escape, as any key until then
            self.terminal.type(b"\x1b", delay=1)
            if self.terminal.process.poll() is not None:
                break
        self.assert_it_says_stop()

    def test_keys_command_and_escape_leaves(self):
        self.ready()
        self.terminal.type(UP, LEFT, delay=0)
        self.wait_for_command(0.1, 0.1)
        self.terminal.type(b"\x1b", b"[", b"A", delay=0.3)
        self.wait_for_command(0.2, 0.1)
        self.terminal.type(b"w", b"d")
        self.wait_for_command(0.3, 0.0)
        self.terminal.type(b"z")
        self.terminal.wait_for("no such key: the drone is stopped", "command  vx +0.00  vy +0.00")
        self.wait_for_command(0.0)
        self.terminal.type(b"\x1b")
        self.assert_it_says_stop()

    def test_keys_start_from_the_command_in_force(self):
        self.ready()
        self.terminal.type(UP)
        self.wait_for_command(0.1)
        other = Twist()
        other.linear.y = 0.5
        # Two: the simulator, and this test itself.
        connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1), listeners=2).publish(other)
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
            time.sleep(0.3)  # it looks every 0.1 s
            self.assertIsNone(self.terminal.process.poll(), self.terminal.shown)
        self.terminal.type(UP)
        self.wait_for_command(0.2)
        self.terminal.close()
        self.assertIsNotNone(self.terminal.process.wait(PATIENCE))
        self.wait_for_command(0.0)


if __name__ == "__main__":
    rospy.init_node("test_key_teleop")
    sys.exit(rostest.rosrun("drone_sim", "key_teleop", KeyTeleop))
