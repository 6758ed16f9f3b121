#!/usr/bin/env python3
"""At real time: all messages of a step have the same stamp, and several simulators share one tree of frames.

Two more simulators fly under the same master, each in its own namespace.
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
    """Messages of at least 60 steps (3 s), frames, and a refused second simulator."""

    def test_all_messages_of_a_step_have_the_same_stamp(self):
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
            # A busy machine may drop a message of a step, but it cannot add one that belongs to no step.
            common = {t for t in times if first <= t <= last}
            self.assertLessEqual(common, steps, name)
            self.assertTrue(common, name)

    def test_static_frames_are_published_in_one_message(self):
        listener = Listener("/tf_static", TFMessage)
        static = listener.wait_for(lambda m: m._connection_header["callerid"] == "/drone_sim", after=0)
        children = {t.child_frame_id: t.header.frame_id for t in static.transforms}
        self.assertEqual(children["front_optical"], "base_link")
        self.assertEqual(children["propeller_front_left"], "base_link")

    def test_simulators_in_separate_namespaces_make_one_tf_tree(self):
        parents, senders = {}, {}
        for topic, frames in (("/tf", ("blades_front_left", "base_link")), ("/tf_static", ("first",))):
            listener = Listener(topic, TFMessage)
            for frame in (f"{prefix}{one}" for prefix in SIMULATORS[topic] for one in frames):  # one for each node
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
        output = other.stdout + other.stderr
        self.assertEqual(other.returncode, 1, output)
        self.assertIn("already flies in /drone_sim: give one of the two a namespace", output)
        self.assertNotIn("Traceback", output)


if __name__ == "__main__":
    rospy.init_node("test_real_time")
    sys.exit(rostest.rosrun("drone_sim", "real_time", RealTime))
