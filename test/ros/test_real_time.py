#!/usr/bin/env python3
"""At real time: one stamp for everything that a step publishes, one step per 50 ms of stamps.

Beside it two more simulators fly under the same master, in namespaces of their own.
"""

import subprocess
import sys
import unittest

import rospy
import rostest
from listening import Listener
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage

STEPS = 60
SIMULATORS = {"/tf": ("", "a/", "b/hawk/"), "/tf_static": ("drone_sim/", "a/drone_sim/", "b/sim/")}


class RealTime(unittest.TestCase):
    """Three seconds of everything."""

    def test_a_step_has_one_stamp(self):
        listeners = {
            "front": Listener("/drone/front", Image),
            "camera_info": Listener("/drone/camera_info", CameraInfo),
            "odom": Listener("/drone/odom", Odometry),
            "joint_states": Listener("/drone/joint_states", JointState),
        }
        transforms = Listener("/tf", TFMessage)
        for listener in listeners.values():
            listener.wait_for(lambda _, heard=listener.messages: len(heard) >= STEPS, after=0)
        stamps = {name: [m.header.stamp for m in one.messages] for name, one in listeners.items()}
        for child in ("base_link", "Track_base"):
            stamps[child] = [
                t.header.stamp for m in transforms.messages for t in m.transforms if t.child_frame_id == child
            ]
        first = max(times[0] for times in stamps.values())
        last = min(times[-1] for times in stamps.values())
        steps = {t for t in stamps["odom"] if first <= t <= last}
        self.assertGreater(len(steps), STEPS / 4)
        for name, times in stamps.items():
            # A busy machine may drop a message of a step; it cannot bring one that is of no step.
            common = {t for t in times if first <= t <= last}
            self.assertLessEqual(common, steps, name)
            self.assertTrue(common, name)

    def test_static_frames_come_together(self):
        listener = Listener("/tf_static", TFMessage)
        static = listener.wait_for(lambda m: m._connection_header["callerid"] == "/drone_sim", after=0)
        children = {t.child_frame_id: t.header.frame_id for t in static.transforms}
        self.assertEqual(children["front_optical"], "base_link")
        self.assertEqual(children["propeller_front_left"], "base_link")

    def test_simulators_in_namespaces_of_their_own_make_one_tree(self):
        parents, senders = {}, {}
        for topic, some in (("/tf", ("blades_front_left", "base_link")), ("/tf_static", ("first",))):
            listener = Listener(topic, TFMessage)
            for frame in (f"{prefix}{one}" for prefix in SIMULATORS[topic] for one in some):  # each of another node
                listener.wait_for(lambda m, one=frame: one in [t.child_frame_id for t in m.transforms], after=0)
            for message in list(listener.messages):
                for one in message.transforms:
                    parents.setdefault(one.child_frame_id, set()).add(one.header.frame_id)
                    senders.setdefault(one.child_frame_id, set()).add(message._connection_header["callerid"])
            listener.close()
        self.assertEqual({frame for frame in parents if len(parents[frame]) + len(senders[frame]) != 2}, set())
        self.assertEqual(set().union(*parents.values()) - set(parents), {"world"})
        for prefix, node in (("", "/drone_sim"), ("a/", "/a/drone_sim"), ("b/hawk/", "/b/sim")):
            self.assertEqual(senders[f"{prefix}base_link"], {node})
            self.assertEqual(parents[f"{prefix}front_optical"], {f"{prefix}base_link"})
        odometry = Listener("/b/hawk/odom", Odometry).wait_for(after=0)
        self.assertEqual((odometry.header.frame_id, odometry.child_frame_id), ("world", "b/hawk/base_link"))

    def test_a_second_simulator_of_the_same_vehicle_is_refused(self):
        other = subprocess.run(
            ["rosrun", "drone_sim", "simulator", "__name:=other"], capture_output=True, text=True, timeout=90
        )
        said = other.stdout + other.stderr
        self.assertEqual(other.returncode, 1, said)
        self.assertIn("already flies in /drone_sim: give one of the two a namespace", said)
        self.assertNotIn("Traceback", said)


if __name__ == "__main__":
    rospy.init_node("test_real_time")
    sys.exit(rostest.rosrun("drone_sim", "real_time", RealTime))
