#!/usr/bin/env python3
"""At real time: one stamp for everything that a step publishes, one step per 50 ms of stamps."""

import sys
import unittest

import rospy
import rostest
from listening import Listener
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, JointState
from tf2_msgs.msg import TFMessage

STEPS = 60


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
        listeners["front"].wait_for(lambda _: len(listeners["front"].messages) >= STEPS)
        stamps = {name: [m.header.stamp for m in one.messages] for name, one in listeners.items()}
        for child in ("base_link", "Track_base"):
            stamps[child] = [
                t.header.stamp for m in transforms.messages for t in m.transforms if t.child_frame_id == child
            ]
        first = max(times[0] for times in stamps.values())
        last = min(times[-1] for times in stamps.values())
        steps = {t for t in stamps["odom"] if first <= t <= last}
        self.assertGreater(len(steps), STEPS / 2)
        for name, times in stamps.items():
            # A busy machine may drop a message of a step; it cannot bring one that is of no step.
            common = {t for t in times if first <= t <= last}
            self.assertLessEqual(common, steps, name)
            self.assertGreater(len(common), len(steps) / 2, name)

    def test_static_frames_come_together(self):
        static = Listener("/tf_static", TFMessage).wait_for(after=0)
        children = {t.child_frame_id: t.header.frame_id for t in static.transforms}
        self.assertEqual(children["front_optical"], "base_link")
        self.assertEqual(children["propeller_front_left"], "base_link")


if __name__ == "__main__":
    rospy.init_node("test_real_time")
    sys.exit(rostest.rosrun("drone_sim", "real_time", RealTime))
