#!/usr/bin/env python3
"""A plan graded behind topics: a node that flies, a script as without ROS, and what cannot be graded there."""

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
SEEN = """
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
SAYING = """
def sysCall_init():
    self.ball, self.steps = sim.getObjectHandle("Ball"), 0

def sysCall_sensing():
    self.steps += 1
    sim.setInt32Signal("steps", self.steps)
    sim.setFloatSignal("x", sim.getObjectPosition(self.ball, -1)[0])
"""
ROOM = "objects: [{name: Ball, shape: sphere, size: [0.1], position: [3, 3, 1]}]\n"
SHORT = "duration: 8\ncriteria: [{kind: stays, of: z, at_least: 0.3}"
STEP = 0.05  # s
PATIENCE = 90  # s
HERE = Path(__file__).parent


class GradeLive(unittest.TestCase):
    """On the simulator of the example, at five times real time."""

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
        found, flown = grade(plans.read(package_path() / "docs/grading/course.yaml"), 0, "flyer", "drone_sim", PATIENCE)
        self.assertTrue(found.passed, found)
        self.assertEqual((found.script, found.error, len(found.outcomes)), ("flyer", None, 3))
        self.assertGreater(np.abs(flown.columns["command_vx"]).max(), 0.4)
        rosnode.kill_nodes(["/flyer"])

    def test_2_the_same_comes_out_as_without_ros(self):
        plan = self.read(PLAN)
        offline = Path(self.folder.name) / "offline.csv"
        wanted = flight.grade(plan, "", 3, None, offline)
        listener = rospy.Subscriber("/drone/odom", Odometry)
        while not (connections := list(listener.impl.connections)):
            rospy.rostime.wallsleep(0.05)
        self.addCleanup(listener.unregister)
        found, flown = grade(plan, 3, "", "drone_sim", PATIENCE)
        self.assertEqual((found.error, round(found.flown, 6)), (None, 4.5))
        self.assertEqual(listener.impl.connections, connections, "a seed that begins elsewhere hides the first steps")
        self.assertEqual([one.passed for one in found.outcomes], [one.passed for one in wanted.outcomes])
        self.assertEqual({one.passed for one in found.outcomes}, {True, False})
        for one, other in zip(found.outcomes, wanted.outcomes):
            self.assertAlmostEqual(one.value, other.value, delta=0.15, msg=one.name)
        rows = np.loadtxt(offline, delimiter=",", skiprows=1)
        self.assertGreater(np.abs(rows[60, 1:4] - rows[0, 1:4]).max(), 1)
        # A message may come some steps late where the machine is busy.
        there = np.interp(flown.times, rows[:, 0], rows[:, 1])
        self.assertLess(np.abs(there - flown.rows[:, 1]).max(), 5 * STEP * 1.3)

    def test_3_a_seed_moves_objects_a_timeline_too_and_signals_are_heard(self):
        (Path(self.folder.name) / "room.yaml").write_text(ROOM)
        script = Path(self.folder.name) / "saying.py"
        script.write_text(SAYING)
        plan = self.read(SEEN)
        wanted = flight.grade(plan, str(script), 5)
        before = rospy.get_param("/drone_sim/script")
        rospy.set_param("/drone_sim/script", str(script))
        try:
            found, _ = grade(plan, 5, "", "drone_sim", PATIENCE)
        finally:
            rospy.set_param("/drone_sim/script", before)
        self.assertIsNone(found.error)
        first, then, steps = found.outcomes
        self.assertAlmostEqual(first.value, wanted.outcomes[0].value, places=6)
        self.assertNotAlmostEqual(first.value, 3, places=3)
        self.assertEqual((then.value, then.passed, steps.passed), (2, True, True), found)

    def test_4_who_moves_the_drone_gains_nothing_by_it(self):
        pose = "{pose: {position: {x: 1.5, z: 2}, orientation: {w: 1}}}"
        command = ["rostopic", "pub", "-r", "5", "/drone/set_pose", "geometry_msgs/PoseStamped", pose]
        plan = self.read("duration: 3\ncriteria: [{kind: reach, places: [[1.5, 0, 2]], within: 0.3}]\n")
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as cheat:
            try:
                while "/drone/set_pose" not in dict(rospy.get_published_topics()):  # its start takes a while
                    rospy.rostime.wallsleep(0.05)
                found, flown = grade(plan, 0, "", "drone_sim", PATIENCE)
            finally:
                cheat.terminate()
        self.assertFalse(found.passed or found.points)
        self.assertRegex(found.error, r"somebody moved the vehicle (at|before) \d.\d\d s; the plan does not allow that")
        self.assertRegex(found.tried[0], r"^tried to move drone at .* \(/drone/set_pose, by /rostopic_")
        if flown is not None:  # it was moved in flight, not in its first step
            self.assertLess(np.abs(flown.rows[:, 1:4] - flown.rows[0, 1:4]).max(), 0.5)

    def test_5_what_cannot_be_graded_here_says_why(self):
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

    def test_5_a_node_that_never_comes_is_not_waited_for_for_ever(self):
        with self.assertRaisesRegex(Mismatch, r"no node student \(waited for 2 s\)"):
            grade(self.read(PLAN), 0, "student", "drone_sim", 2)

    def test_6_what_others_do_to_the_world_is_named_and_flying_is_none_of_it(self):
        edit = r"change the scene at \d\.\d\d s \(/drone_sim/edit_scene, by /edit\)"
        for does, allowed, said in (
            ("fly", "", ""),
            ("push", "", r"push Drone at \d\.\d\d s \(sim.addForceAndTorque, by a client of the remote API\)"),
            ("push", "push", ""),
            ("edit", "move, push", edit),
            ("tune", "", r"change drone at \d\.\d\d s \(/drone/set_parameters, by /tune\)"),
            ("fly", "", r"change drone at 0\.\d\d s \(Kzref, tuned before\)"),
        ):
            with subprocess.Popen([sys.executable, HERE / "interfering.py", does]) as other:
                try:
                    flown = ", {kind: signal, signal: flown, equals: 1}" if does == "fly" else ""
                    plan = self.read(f"{SHORT}{flown}]\nallowed: [{allowed}]\n")
                    found, _ = grade(plan, 0, does, "drone_sim", PATIENCE)
                finally:
                    other.terminate()
            self.assertEqual((found.error, found.passed), (None, not said), (does, found))
            self.assertTrue(all(one.passed for one in found.outcomes), (does, found))
            self.assertEqual(len(found.tried), bool(said), (does, found))
            self.assertRegex(found.tried[0] if said else "", f"^tried to {said}$" if said else "^$", does)


if __name__ == "__main__":
    rospy.init_node("test_grade_live")
    sys.exit(rostest.rosrun("drone_sim", "grade_live", GradeLive))
