#!/usr/bin/env python3
"""Lockstep with nodes: every flight is identical, even if a node stops, dies or answers twice."""

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
CONTROLLER = Path(__file__).with_name("lockstep_node.py")
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
FIRST_STAMP = 5 * 10**7  # ns, the first stamp
SECONDS = 4.0  # s of simulated time
UNPACED = "_real_time_factor:=0"
COMMANDS, STAMPED = "_lockstep/wait_for:=cmd_vel", "_lockstep/wait_for:=cmd_vel_stamped"


def state(message):
    pose, twist = message.pose.pose, message.twist.twist
    parts = pose.position, pose.orientation, twist.linear, twist.angular
    return message.header.stamp.to_nsec(), *(getattr(one, axis) for one in parts for axis in one.__slots__)


class Flight:
    """Recorder of the odometry of one vehicle."""

    def __init__(self, drone="drone"):
        self.rows, self._is_stopped, self._event = [], False, threading.Condition()
        self._subscriber = rospy.Subscriber(f"/{drone}/odom", Odometry, self._take)

    def _take(self, message):
        with self._event:
            stamp = message.header.stamp.to_nsec()
            self._is_stopped = stamp == 0
            if stamp > FIRST_STAMP:
                self.rows.append(state(message))
            self._event.notify_all()

    def rows_until(self, seconds, timeout=HANGS):
        """Wait for the rows up to a time (s), and return them."""
        with self._event:
            last = round(seconds * 1e9)
            assert self._event.wait_for(lambda: self.rows and self.rows[-1][0] >= last, timeout), self.rows[-1:]
            return [row for row in self.rows if row[0] <= last]

    def discard(self):
        """Wait until the flight is stopped, then discard its rows."""
        with self._event:
            assert self._event.wait_for(lambda: self._is_stopped, HANGS), self.rows[-1:]
            self.rows.clear()

    def close(self):
        self._subscriber.unregister()


class Simulator:
    """A simulator process and its lines of output."""

    def __init__(self, *arguments):
        program = package_path() / "scripts/simulator"  # rosrun needs seconds to find it on a busy machine
        command = [sys.executable, program, UNPACED, f"_scene_file:={SCENE}", *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        self.process = subprocess.Popen(command, start_new_session=True, **pipes)
        self.lines, self._event = [], threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            with self._event:
                self.lines.append(line)
                self._event.notify_all()

    def wait_for(self, text, timeout=HANGS):
        with self._event:
            assert self._event.wait_for(lambda: any(text in line for line in self.lines), timeout), "".join(self.lines)

    def close(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(HANGS)
        finally:
            self.process.stdout.close()


def start_twice(simulator, *arguments, start=GradedSimulator.start):
    """Start like GradedSimulator; another client then restarts, before the first step is answered."""
    start(simulator, *arguments)
    assert simulator.call("restart")[0]


def spawn(*command):
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
        """Yield the simulator, the recorder of its flight, and the processes of the nodes."""
        flight, simulator, processes = Flight(drone), Simulator(f"_config:={self.config}", *arguments), []
        try:
            processes += [spawn(*node) for node in nodes]
            yield simulator, flight, processes
        except AssertionError as error:
            raise AssertionError(f"{error}\n{''.join(simulator.lines)}") from error
        finally:
            flight.close()
            end(*processes, number=signal.SIGKILL)
            simulator.close()

    def flown_rows(self, *arguments, nodes, drone="drone"):
        with self.flying(*arguments, nodes=nodes, drone=drone) as (_, flight, _):
            return flight.rows_until(SECONDS)

    def test_1_a_flight_is_the_same_every_time(self):
        arguments = COMMANDS, "_lockstep/trigger:=odom", "_real_time_factor:=5"
        first, second = (self.flown_rows(*arguments, nodes=[(NODES / "reacting.py",)]) for _ in range(2))
        self.assertEqual(first[0][0], 10**8, "the messages of the second step are the first")
        self.assertEqual(len(first), SECONDS * 20 - 1)
        self.assertEqual(first, second)
        self.assertNotEqual(first[0][3], first[-1][3], "the commands have an effect")

    def test_2_a_restarted_flight_is_identical_for_every_kind_of_node(self):
        flights = {}
        for node, *arguments in (
            ("reacting.py", COMMANDS),
            ("sleeping.py", COMMANDS),
            ("seeing.py", STAMPED, "_lockstep/trigger:=front"),
        ):
            with self.subTest(node), self.flying(*arguments, nodes=[(NODES / node, "0.1")]) as (_, flight, _):
                flights[node] = flight.rows_until(SECONDS)
                self.assertTrue(rospy.ServiceProxy("/drone_sim/stop", Trigger)().success)
                flight.discard()
                self.assertTrue(rospy.ServiceProxy("/drone_sim/start", Trigger)().success)
                self.assertEqual(flight.rows_until(SECONDS), flights[node])
            self.setUp()
        self.assertEqual(flights["reacting.py"], flights["sleeping.py"])
        self.assertNotEqual(flights["reacting.py"], flights["seeing.py"])

    def test_3_repeated_answers_with_the_same_stamp_change_nothing(self):
        once = self.flown_rows(STAMPED, nodes=[(CONTROLLER, "stamped", "1", "drone")])
        self.assertEqual(self.flown_rows(STAMPED, nodes=[(CONTROLLER, "stamped", "3", "drone")]), once)

    def test_4_two_vehicles_with_a_node_each(self):
        two = [(CONTROLLER, "plain", "1", f"drone{number}", f"__name:=of{number}") for number in (1, 2)]
        first, second = (self.flown_rows(COMMANDS, "_vehicles:=2", nodes=two, drone="drone2") for _ in range(2))
        self.assertEqual(first, second)

    def test_5_a_stopped_node_is_waited_for_and_a_dead_node_can_be_restarted(self):
        expected = self.flown_rows(COMMANDS, "_lockstep/timeout:=1", nodes=[(CONTROLLER, "plain", "1", "drone")])
        node = (CONTROLLER, "plain", "1", "drone")
        with self.flying(COMMANDS, "_lockstep/timeout:=1", "_real_time_factor:=4", nodes=[node]) as (
            simulator,
            flight,
            (process,),
        ):
            diagnostics = Listener("/diagnostics", DiagnosticArray)
            flight.rows_until(0.5)
            process.send_signal(signal.SIGSTOP)
            simulator.wait_for("/drone/cmd_vel: /controller has not answered within 1 s")
            late = diagnostics.wait_for(lambda m: any("has not answered the stamp" in one.message for one in m.status))
            self.assertIn("/drone/cmd_vel: /controller", str(late))
            process.send_signal(signal.SIGCONT)
            self.assertEqual(flight.rows_until(SECONDS), expected)
            process.kill()
            simulator.wait_for("/controller has gone")
            process.wait(HANGS)
            last_row = flight.rows[-1]
            new_process = spawn(*node)
            try:
                flight.rows_until(last_row[0] * 1e-9 + 1)
            finally:
                end(new_process, number=signal.SIGKILL)
            diagnostics.close()

    def test_6_timeout_policies_end_and_go_on(self):
        node = (CONTROLLER, "plain", "1", "drone")
        with self.flying(COMMANDS, "_lockstep/on_timeout:=end", nodes=[node]) as (simulator, flight, (process,)):
            flight.rows_until(0.5)
            process.kill()
            simulator.wait_for("/controller has gone")
            self.assertEqual(simulator.process.wait(HANGS), 1)
        self.setUp()
        with self.flying(COMMANDS, "_lockstep/on_timeout:=go on", "_real_time_factor:=5", nodes=[node]) as (
            _,
            flight,
            (process,),
        ):
            flight.rows_until(0.5)
            process.kill()
            flight.rows_until(flight.rows[-1][0] * 1e-9 + 2)

    def test_7_the_simulator_ends_on_sigint_while_it_waits(self):
        for nodes in ([], [(CONTROLLER, "plain", "1", "drone")]):
            with self.subTest(nodes), self.flying(COMMANDS, nodes=nodes) as (simulator, flight, processes):
                if processes:
                    flight.rows_until(0.5)
                    processes[0].send_signal(signal.SIGSTOP)
                simulator.wait_for("time stands at 0.05 s until there is" if not nodes else "waiting on")
                os.killpg(simulator.process.pid, signal.SIGINT)
                self.assertEqual(simulator.process.wait(HANGS), 0)  # not killed by the watchdog

    def test_8_two_instances_of_a_node_are_reported(self):
        node = (CONTROLLER, "plain", "1", "drone", "--anonymous")
        with self.flying(COMMANDS, "_real_time_factor:=1", nodes=[node, node]):
            diagnostics = Listener("/diagnostics", DiagnosticArray)
            diagnostics.wait_for(lambda m: any("the first counts" in one.message for one in m.status), after=0)
            diagnostics.close()

    def test_9_wrong_lockstep_parameters_are_reported_in_one_line(self):
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

    def test_a_config_sets_use_sim_time_until_the_simulator_ends(self):
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
            self.flown_rows(COMMANDS, f"_script:={script}", nodes=[(NODES / node,)])
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

    def test_single_steps_in_lockstep_with_a_node(self):
        with self.flying(COMMANDS, nodes=[(NODES / "reacting.py",)]) as (simulator, flight, _):
            simulator.wait_for("in step with")
            flown_rows = flight.rows_until(SECONDS)
            call = {name: rospy.ServiceProxy(f"/drone_sim/{name}", Trigger) for name in ("restart", "step")}
            pause = rospy.ServiceProxy("/drone_sim/pause", SetBool)
            paused = pause(True)
            self.assertTrue(paused.success)
            # Odometry from before the pause may arrive late.
            before = float(paused.message.removeprefix("paused at t = ").removesuffix(" s"))
            rospy.set_param("/drone_sim/step_count", 0)
            self.assertIn("step_count = 0: must be a whole number from 1 to 1000000", call["step"]().message)
            rospy.set_param("/drone_sim/step_count", 20)
            for number in (1, 2):
                self.assertEqual(call["step"]().message, f"t = {before + number:.2f} s")
                flight.rows_until(before + number)
            stepped = flight.rows_until(before + 2)
            self.assertEqual(len({row[0] for row in stepped}), round(1e9 * before / FIRST_STAMP) - 1 + 40)
            self.assertEqual(stepped[: len(flown_rows)], flown_rows)

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
