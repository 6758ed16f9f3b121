#!/usr/bin/env python3
"""Steps that wait for nodes: the same flight every time, whatever becomes of the nodes."""

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path
from unittest import mock

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from ending import HANGS, end
from listening import Listener
from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool, Trigger

from drone_sim.files.resources import package_path
from drone_sim.grading import plan as plans
from drone_sim.ros.grading.grade_live import grade
from drone_sim.ros.grading.simulator import GradedSimulator, Mismatch

NODES = package_path() / "docs/lockstep"
OTHER = Path(__file__).with_name("lockstep_node.py")
SMALL = "cameras: {front: {width: 64, height: 48, every: 4}}\n"
SCENE = "package://drone_sim/config/scenes/gates.yaml"
PLAN = """
duration: 4
lockstep: true
spread: {position: [0.2, 0.2, 0], yaw: 0.2}
timeline:
  - {at: 1, push: {force: [0, 0, 1], duration: 0.2}}
  - {at: 2, weather: {wind: [0, 1, 0], gusts: {deviation: [0.1, 0, 0]}}}
criteria: [{kind: attitude, at_most: 1, points: 1}]
"""
EPISODES = """
import numpy as np
from gym_ros_env import FlyTo
environment = FlyTo()
for _ in range(2):
    observation, _ = environment.reset(seed=7)
    ends, steps = False, 0
    while not ends:
        observation, _, is_there, is_late, _ = environment.step(np.clip(0.4 * observation[:3], -0.5, 0.5))
        ends, steps = is_there or is_late, steps + 1
    print(steps, is_there, *map(repr, observation))
"""
SENSING = """
def sysCall_init():
    global publisher
    publisher = simROS.advertise("seen", "std_msgs/Float64")

def sysCall_sensing():
    simROS.publish(publisher, {"data": simROS.getTime()})
"""
FIRST = 5 * 10**7  # ns, the first stamp
SECONDS = 4.0  # s of simulated time
FREE = "_real_time_factor:=0"
COMMANDS, STAMPED = "_lockstep/wait_for:=cmd_vel", "_lockstep/wait_for:=cmd_vel_stamped"


def state(message):
    pose, twist = message.pose.pose, message.twist.twist
    parts = pose.position, pose.orientation, twist.linear, twist.angular
    return message.header.stamp.to_nsec(), *(getattr(one, axis) for one in parts for axis in one.__slots__)


class Flight:
    """The odometry of one vehicle, as it comes."""

    def __init__(self, drone="drone"):
        self.rows, self._is_stopped, self._came = [], False, threading.Condition()
        self._subscriber = rospy.Subscriber(f"/{drone}/odom", Odometry, self._take)

    def _take(self, message):
        with self._came:
            stamp = message.header.stamp.to_nsec()
            self._is_stopped = stamp == 0
            if stamp > FIRST:
                self.rows.append(state(message))
            self._came.notify_all()

    def until(self, seconds, timeout=HANGS):
        """Return the rows until a time (s), once they have come."""
        with self._came:
            last = round(seconds * 1e9)
            assert self._came.wait_for(lambda: self.rows and self.rows[-1][0] >= last, timeout), self.rows[-1:]
            return [row for row in self.rows if row[0] <= last]

    def forget(self):
        """Wait until the flight has been stopped, and forget it."""
        with self._came:
            assert self._came.wait_for(lambda: self._is_stopped, HANGS), self.rows[-1:]
            self.rows.clear()

    def close(self):
        self._subscriber.unregister()


class Simulator:
    """A simulator as a process, with its lines of output."""

    def __init__(self, *arguments):
        program = package_path() / "scripts/simulator"  # rosrun would look for it for seconds on a busy machine
        command = [sys.executable, program, FREE, f"_scene_file:={SCENE}", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        self.process = subprocess.Popen(command, start_new_session=True, **pipes)
        self.lines, self._came = [], threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            with self._came:
                self.lines.append(line)
                self._came.notify_all()

    def wait_for(self, text, timeout=HANGS):
        with self._came:
            assert self._came.wait_for(lambda: any(text in line for line in self.lines), timeout), "".join(self.lines)

    def close(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(HANGS)
        finally:
            self.process.stdout.close()


def start_twice(simulator, *arguments, start=GradedSimulator.start):
    """Start as GradedSimulator does; then another client restarts, before the first step is answered."""
    start(simulator, *arguments)
    assert simulator.call("restart")[0]


def started(*command):
    return subprocess.Popen([sys.executable, *map(str, command)])


class Lockstep(unittest.TestCase):
    """Each flight has its own simulator and its own nodes."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.config = Path(cls.folder.name) / "small.yaml"
        cls.config.write_text(SMALL)
        rospy.set_param("/use_sim_time", True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        if rospy.has_param("/drone_sim"):
            rospy.delete_param("/drone_sim")

    @contextlib.contextmanager
    def flying(self, *arguments, nodes=(), drone="drone"):
        """Yield simulator, flight and nodes."""
        flight, simulator, processes = Flight(drone), Simulator(f"_config:={self.config}", *arguments), []
        try:
            processes += [started(*node) for node in nodes]
            yield simulator, flight, processes
        except AssertionError as error:
            raise AssertionError(f"{error}\n{''.join(simulator.lines)}") from error
        finally:
            flight.close()
            end(*processes, number=signal.SIGKILL)
            simulator.close()

    def flown(self, *arguments, nodes, drone="drone"):
        with self.flying(*arguments, nodes=nodes, drone=drone) as (_, flight, _):
            return flight.until(SECONDS)

    def test_1_a_flight_is_the_same_every_time(self):
        arguments = COMMANDS, "_lockstep/trigger:=odom", "_real_time_factor:=5"
        first, second = (self.flown(*arguments, nodes=[(NODES / "reacting.py",)]) for _ in range(2))
        self.assertEqual(first[0][0], 10**8, "the messages of the second step are the first")
        self.assertEqual(len(first), SECONDS * 20 - 1)
        self.assertEqual(first, second)
        self.assertNotEqual(first[0][3], first[-1][3], "the commands have an effect")

    def test_2_in_every_run_of_a_simulator_too_whatever_wakes_the_node(self):
        flights = {}
        for node, *arguments in (
            ("reacting.py", COMMANDS),
            ("sleeping.py", COMMANDS),
            ("seeing.py", STAMPED, "_lockstep/trigger:=front"),
        ):
            with self.subTest(node), self.flying(*arguments, nodes=[(NODES / node, "0.1")]) as (_, flight, _):
                flights[node] = flight.until(SECONDS)
                self.assertTrue(rospy.ServiceProxy("/drone_sim/stop", Trigger)().success)
                flight.forget()
                self.assertTrue(rospy.ServiceProxy("/drone_sim/start", Trigger)().success)
                self.assertEqual(flight.until(SECONDS), flights[node])
            self.setUp()
        self.assertEqual(flights["reacting.py"], flights["sleeping.py"])
        self.assertNotEqual(flights["reacting.py"], flights["seeing.py"])

    def test_3_of_stamped_answers_doubled_and_late_ones_are_told_apart(self):
        once = self.flown(STAMPED, nodes=[(OTHER, "stamped", "1", "drone")])
        self.assertEqual(self.flown(STAMPED, nodes=[(OTHER, "stamped", "3", "drone")]), once)

    def test_4_two_vehicles_with_a_node_each(self):
        two = [(OTHER, "plain", "1", f"drone{number}", f"__name:=of{number}") for number in (1, 2)]
        first, second = (self.flown(COMMANDS, "_vehicles:=2", nodes=two, drone="drone2") for _ in range(2))
        self.assertEqual(first, second)

    def test_5_a_node_that_stands_is_waited_for_and_one_that_dies_can_be_started_again(self):
        wanted = self.flown(COMMANDS, "_lockstep/timeout:=1", nodes=[(OTHER, "plain", "1", "drone")])
        node = (OTHER, "plain", "1", "drone")
        with self.flying(COMMANDS, "_lockstep/timeout:=1", "_real_time_factor:=4", nodes=[node]) as (
            simulator,
            flight,
            (process,),
        ):
            found = Listener("/diagnostics", DiagnosticArray)
            flight.until(0.5)
            process.send_signal(signal.SIGSTOP)
            simulator.wait_for("/drone/cmd_vel: /controller has not answered within 1 s")
            late = found.wait_for(lambda m: any("has not answered the stamp" in one.message for one in m.status))
            self.assertIn("/drone/cmd_vel: /controller", str(late))
            process.send_signal(signal.SIGCONT)
            self.assertEqual(flight.until(SECONDS), wanted)
            process.kill()
            simulator.wait_for("/controller has gone")
            process.wait(HANGS)
            stands = flight.rows[-1]
            again = started(*node)
            try:
                flight.until(stands[0] * 1e-9 + 1)
            finally:
                end(again, number=signal.SIGKILL)
            found.close()

    def test_6_policies(self):
        node = (OTHER, "plain", "1", "drone")
        with self.flying(COMMANDS, "_lockstep/on_timeout:=end", nodes=[node]) as (simulator, flight, (process,)):
            flight.until(0.5)
            process.kill()
            simulator.wait_for("/controller has gone")
            self.assertEqual(simulator.process.wait(HANGS), 1)
        self.setUp()
        with self.flying(COMMANDS, "_lockstep/on_timeout:=go on", "_real_time_factor:=5", nodes=[node]) as (
            _,
            flight,
            (process,),
        ):
            flight.until(0.5)
            process.kill()
            flight.until(flight.rows[-1][0] * 1e-9 + 2)

    def test_7_it_ends_while_it_waits(self):
        for nodes in ([], [(OTHER, "plain", "1", "drone")]):
            with self.subTest(nodes), self.flying(COMMANDS, nodes=nodes) as (simulator, flight, processes):
                if processes:
                    flight.until(0.5)
                    processes[0].send_signal(signal.SIGSTOP)
                simulator.wait_for("time stands at 0.05 s until there is" if not nodes else "waiting on")
                os.killpg(simulator.process.pid, signal.SIGINT)
                self.assertEqual(simulator.process.wait(HANGS), 0)  # the watchdog would have killed it

    def test_8_two_instances_are_told(self):
        node = (OTHER, "plain", "1", "drone", "--anonymous")
        with self.flying(COMMANDS, "_real_time_factor:=1", nodes=[node, node]):
            found = Listener("/diagnostics", DiagnosticArray)
            found.wait_for(lambda m: any("the first counts" in one.message for one in m.status), after=0)
            found.close()

    def test_9_what_is_wrong_is_told_in_one_line(self):
        for argument, said in (
            ("_lockstep/wait_for:=cmd_vell", "nothing listens to /drone/cmd_vell; near names are cmd_vel"),
            ("_lockstep:={wait_for: [cmd_vel], trigger: fronnt}", "no such trigger; near names are front"),
            ("_lockstep:={wait_for: [cmd_vel], on_timeout: stop}", "input should be 'hold', 'go on' or 'end'"),
        ):
            with self.subTest(argument), self.flying(argument) as (simulator, _, _):
                simulator.wait_for(said)
                self.assertEqual(simulator.process.wait(HANGS), 1)
                self.assertNotIn("Traceback", "".join(simulator.lines))
            self.setUp()

    def test_a_config_turns_simulated_time_on_until_the_end(self):
        rospy.delete_param("/use_sim_time")
        try:
            with self.flying(COMMANDS) as (simulator, _, _):
                simulator.wait_for("/use_sim_time is now true")
                simulator.wait_for("time stands at 0.05 s until there is")
                self.assertIs(rospy.get_param("/use_sim_time"), True)
            self.assertFalse(rospy.has_param("/use_sim_time"))
        finally:
            rospy.set_param("/use_sim_time", True)

    def test_a_script_that_publishes_in_sensing_does_not_stop_a_flight(self):
        script = Path(self.folder.name) / "sensing.py"
        script.write_text(SENSING)
        flights = [
            self.flown(COMMANDS, f"_script:={script}", nodes=[(NODES / node,)])
            for node in ("reacting.py", "sleeping.py")
        ]
        self.assertEqual(flights[0], flights[1])

    def test_a_graded_flight_with_a_timeline_has_the_same_digest_every_time(self):
        file = Path(self.folder.name) / "plan.yaml"
        file.write_text(PLAN + f"scene: {SCENE}\nconfig: {{{SMALL.strip()}}}\n")
        plan, other = plans.read(file), Path(self.folder.name) / "other.yaml"
        other.write_text("- {at: 1, land: {}}\n")
        results = []
        for _ in range(2):
            with self.flying(COMMANDS, nodes=[(NODES / "reacting.py",)]) as (simulator, _, _):
                simulator.wait_for("in step with")
                results.append(grade(plan, 1, "reacting", "drone_sim", HANGS)[0])
                with mock.patch("drone_sim.ros.grading.grade_live.timeline_file", lambda _plan: str(other)):
                    replaced, _ = grade(plan, 1, "reacting", "drone_sim", HANGS)
                with mock.patch.object(GradedSimulator, "start", start_twice):
                    restarted, _ = grade(plan, 1, "reacting", "drone_sim", HANGS)
            self.assertIn("/drone_sim executes another timeline than the plan's", replaced.error)
            self.assertEqual("another client has restarted the simulation", restarted.error)
            self.setUp()
        self.assertIsNone(results[0].error)
        self.assertEqual(results[0].digest, results[1].digest)
        self.assertEqual(results[0], results[1])
        with self.flying() as (simulator, _, _):
            simulator.wait_for("flying")
            with self.assertRaisesRegex(Mismatch, "start the simulator with lockstep:=cmd_vel"):
                grade(plan, 1, "", "drone_sim", HANGS)

    def test_steps_by_hand_in_step_with_a_node(self):
        with self.flying(COMMANDS, nodes=[(NODES / "reacting.py",)]) as (simulator, flight, _):
            simulator.wait_for("in step with")
            flown = flight.until(SECONDS)
            call = {name: rospy.ServiceProxy(f"/drone_sim/{name}", Trigger) for name in ("restart", "step")}
            pause = rospy.ServiceProxy("/drone_sim/pause", SetBool)
            paused = pause(True)
            self.assertTrue(paused.success)
            # Odometry up to the pause may still be under way.
            before = float(paused.message.removeprefix("paused at t = ").removesuffix(" s"))
            rospy.set_param("/drone_sim/step_count", 0)
            self.assertIn("step_count = 0: must be a whole number from 1 to 1000000", call["step"]().message)
            rospy.set_param("/drone_sim/step_count", 20)
            for number in (1, 2):
                self.assertEqual(call["step"]().message, f"t = {before + number:.2f} s")
                flight.until(before + number)
            stepped = flight.until(before + 2)
            self.assertEqual(len({row[0] for row in stepped}), round(1e9 * before / FIRST) - 1 + 40)
            self.assertEqual(stepped[: len(flown)], flown)

    @unittest.skipUnless(importlib.util.find_spec("gymnasium"), "needs gymnasium, of requirements-dev.txt")
    def test_a_gymnasium_environment_over_ros_is_repeatable(self):
        with self.flying(STAMPED) as (simulator, _, _):
            simulator.wait_for("flying")
            command = [sys.executable, "-c", EPISODES]
            said = [subprocess.run(command, cwd=NODES, capture_output=True, text=True, timeout=HANGS) for _ in range(2)]
        self.assertEqual([one.returncode for one in said], [0, 0], said)
        episodes = "".join(one.stdout for one in said).splitlines()
        self.assertEqual((len(episodes), len(set(episodes))), (4, 1), episodes)
        self.assertIn("True", episodes[0])


if __name__ == "__main__":
    rospy.init_node("test_lockstep", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "lockstep", Lockstep))
