#!/usr/bin/env python3
"""Plans graded over ROS topics: a flying node, a script, interference, and plans that cannot be graded."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rosnode
import rospy
import rostest
from nav_msgs.msg import Odometry

from drone_sim.files.resources import package_path
from drone_sim.grading import flight
from drone_sim.grading import plan as plans
from drone_sim.ros.grading.grade_live import grade
from drone_sim.ros.grading.simulator import Mismatch

PLAN = """
duration: 4.5
spread: {position: [0.2, 0.2, 0], yaw: 0.2}
timeline:
  - {at: 1, twist: {linear: [1, 0, 0], angular: [0, 0, 0.5]}}
  - {at: 2, push: {force: [0, 0, 1], duration: 0.2}}
  - {at: 2.5, weather: {wind: [0, 1, 0], gusts: {deviation: [0.1, 0, 0]}}}
  - {at: 3, faults: {propellers: [0.9, 1, 1, 1]}}
  - {at: 4, land: {}}
criteria:
  - {kind: rise_time, of: vx, after: 1, from: 0, to: 1, at_most: 1}
  - {kind: stays, of: z, until: 4, at_least: 0.9}
  - {kind: steady_error, of: vy, to: 0, at_most: 1}
  - {kind: attitude, at_most: 1}
"""
OBJECT_PLAN = """
duration: 2
scene: room.yaml
spread: {objects: {Ball: [1, 1, 0]}}
timeline:
  - {at: 1, object: {name: Ball, position: [2, 1, 1.5]}}
criteria:
  - {kind: signal, name: first, signal: x, equals: 3, until: 0.9}
  - {kind: signal, name: then, signal: x, equals: 2}
  - {kind: signal, signal: steps, equals: 40, tolerance: 2}
"""
SIGNAL_SCRIPT = """
def sysCall_init():
    self.ball, self.steps = sim.getObjectHandle("Ball"), 0

def sysCall_sensing():
    self.steps += 1
    sim.setInt32Signal("steps", self.steps)
    sim.setFloatSignal("x", sim.getObjectPosition(self.ball, -1)[0])
"""
ROOM = "objects: [{name: Ball, shape: sphere, size: [0.1], position: [3, 3, 1]}]\n"
SHORT_PLAN = "duration: 8\ncriteria: [{kind: stays, of: z, at_least: 0.3}"
STEP = 0.05  # s
PATIENCE = 90  # s
HERE = Path(__file__).parent


class GradeLive(unittest.TestCase):
    """Grading with the simulator of the example, at five times real time."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def read(self, text):
        path = Path(self.folder.name) / "plan.yaml"
        path.write_text(text)
        return plans.read(path)

    def test_1_a_node_flies_the_course_of_the_documentation(self):
        score, flown = grade(plans.read(package_path() / "docs/grading/course.yaml"), 0, "flyer", "drone_sim", PATIENCE)
        self.assertTrue(score.passed, score)
        self.assertEqual((score.script, score.error, len(score.outcomes)), ("flyer", None, 3))
        self.assertGreater(np.abs(flown.columns["command_vx"]).max(), 0.4)
        rosnode.kill_nodes(["/flyer"])

    def test_2_the_results_are_those_of_a_flight_without_ros(self):
        plan = self.read(PLAN)
        offline = Path(self.folder.name) / "offline.csv"
        expected = flight.grade(plan, "", 3, None, offline)
        listener = rospy.Subscriber("/drone/odom", Odometry)
        while not (connections := list(listener.impl.connections)):
            rospy.rostime.wallsleep(0.05)
        self.addCleanup(listener.unregister)
        score, flown = grade(plan, 3, "", "drone_sim", PATIENCE)
        self.assertEqual((score.error, round(score.flown, 6)), (None, 4.5))
        self.assertEqual(listener.impl.connections, connections, "a seed that begins elsewhere hides the first steps")
        self.assertEqual([one.passed for one in score.outcomes], [one.passed for one in expected.outcomes])
        self.assertEqual({one.passed for one in score.outcomes}, {True, False})
        for one, other in zip(score.outcomes, expected.outcomes):
            self.assertAlmostEqual(one.value, other.value, delta=0.15, msg=one.name)
        rows = np.loadtxt(offline, delimiter=",", skiprows=1)
        self.assertGreater(np.abs(rows[60, 1:4] - rows[0, 1:4]).max(), 1)
        # On a busy machine a message may arrive some steps late.
        expected_x = np.interp(flown.times, rows[:, 0], rows[:, 1])
        self.assertLess(np.abs(expected_x - flown.rows[:, 1]).max(), 5 * STEP * 1.3)

    def test_3_seed_and_timeline_move_objects_and_signals_are_received(self):
        (Path(self.folder.name) / "room.yaml").write_text(ROOM)
        script = Path(self.folder.name) / "saying.py"
        script.write_text(SIGNAL_SCRIPT)
        plan = self.read(OBJECT_PLAN)
        expected = flight.grade(plan, str(script), 5)
        before = rospy.get_param("/drone_sim/script")
        rospy.set_param("/drone_sim/script", str(script))
        try:
            score, _ = grade(plan, 5, "", "drone_sim", PATIENCE)
        finally:
            rospy.set_param("/drone_sim/script", before)
        self.assertIsNone(score.error)
        first, then, steps = score.outcomes
        self.assertAlmostEqual(first.value, expected.outcomes[0].value, places=6)
        self.assertNotAlmostEqual(first.value, 3, places=3)
        self.assertEqual((then.value, then.passed, steps.passed), (2, True, True), score)

    def test_4_a_flight_fails_if_a_node_moves_the_drone(self):
        pose = "{pose: {position: {x: 1.5, z: 2}, orientation: {w: 1}}}"
        command = ["rostopic", "pub", "-r", "5", "/drone/set_pose", "geometry_msgs/PoseStamped", pose]
        plan = self.read("duration: 3\ncriteria: [{kind: reach, places: [[1.5, 0, 2]], within: 0.3}]\n")
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as cheat:
            try:
                while "/drone/set_pose" not in dict(rospy.get_published_topics()):  # rostopic takes a while to start
                    rospy.rostime.wallsleep(0.05)
                score, flown = grade(plan, 0, "", "drone_sim", PATIENCE)
            finally:
                cheat.terminate()
        self.assertFalse(score.passed or score.points)
        self.assertRegex(score.error, r"somebody moved the vehicle (at|before) \d.\d\d s; the plan does not allow that")
        self.assertRegex(score.tried[0], r"^tried to move drone at .* \(/drone/set_pose, by /rostopic_")
        if flown is not None:  # the drone was moved after the first step
            self.assertLess(np.abs(flown.rows[:, 1:4] - flown.rows[0, 1:4]).max(), 0.5)

    def test_5_plans_that_cannot_be_graded_live_raise_a_mismatch(self):
        for change, why in (
            ("config: {control: {Kzref: 3}}", r"control/Kzref = 5.0, the plan's is 3.0; see its config:="),
            ("push", r"entry at 2 s: push.duration = 0.5: a push by topic lasts push/duration = 0.2 s"),
            ("no_contact", r"criterion no_contact: needs the sensor `contacts`"),
            ("signal", r"criterion signal: needs seen: only signals that are numbers"),
        ):
            text = {
                "push": PLAN.replace("duration: 0.2", "duration: 0.5"),
                "no_contact": f"{PLAN}  - {{kind: no_contact}}\n",
                "signal": f"{PLAN}  - {{kind: signal, signal: seen, equals: done}}\n",
            }.get(change, f"{PLAN}{change}\n")
            with self.subTest(change), self.assertRaisesRegex(Mismatch, why):
                grade(self.read(text), 1, "", "drone_sim", PATIENCE)

    def test_5_a_missing_node_raises_a_mismatch_after_the_timeout(self):
        with self.assertRaisesRegex(Mismatch, r"no node student \(waited for 2 s\)"):
            grade(self.read(PLAN), 0, "student", "drone_sim", 2)

    def test_6_interference_by_other_clients_is_reported_and_flying_is_allowed(self):
        edit = r"change the scene at \d\.\d\d s \(/drone_sim/edit_scene, by /edit\)"
        for action, allowed, attempt in (
            ("fly", "", ""),
            ("push", "", r"push Drone at \d\.\d\d s \(sim.addForceAndTorque, by a client of the remote API\)"),
            ("push", "push", ""),
            ("edit", "move, push", edit),
            ("tune", "", r"change drone at \d\.\d\d s \(/drone/set_parameters, by /tune\)"),
            ("fly", "", r"change drone at 0\.\d\d s \(Kzref, tuned before\)"),
        ):
            with subprocess.Popen([sys.executable, HERE / "interfering.py", action]) as other:
                try:
                    flown = ", {kind: signal, signal: flown, equals: 1}" if action == "fly" else ""
                    plan = self.read(f"{SHORT_PLAN}{flown}]\nallowed: [{allowed}]\n")
                    score, _ = grade(plan, 0, action, "drone_sim", PATIENCE)
                finally:
                    other.terminate()
            self.assertEqual((score.error, score.passed), (None, not attempt), (action, score))
            self.assertTrue(all(one.passed for one in score.outcomes), (action, score))
            self.assertEqual(len(score.tried), bool(attempt), (action, score))
            self.assertRegex(score.tried[0] if attempt else "", f"^tried to {attempt}$" if attempt else "^$", action)


if __name__ == "__main__":
    rospy.init_node("test_grade_live")
    sys.exit(rostest.rosrun("drone_sim", "grade_live", GradeLive))
