#!/usr/bin/env python3
"""The drone's topics: commands, poses, refused messages and camera images. Times are message stamps."""

import math
import sys
import unittest

import numpy as np
import rosgraph
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped, Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32MultiArray

from drone_sim.run import parameters
from drone_sim.sensors.validation import RESERVED_TOPICS

CUBE = {"size": 0.4, "position": (2.5, 0.25, 1.1), "yaw": 0.6}  # as in cube.yaml


def twist(vx=0.0, vy=0.0, vz=0.0, wz=0.0):
    message = Twist()
    message.linear.x, message.linear.y, message.linear.z, message.angular.z = vx, vy, vz, wz
    return message


def pose_at(x, y, z, yaw=0.0):
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = x, y, z
    pose.orientation.z, pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return pose


def speed(odometry):
    v = odometry.twist.twist.linear
    return math.hypot(v.x, v.y, v.z)


class Flight(unittest.TestCase):
    """Several flights in one running simulation."""

    @classmethod
    def setUpClass(cls):
        cls.odometry = Listener("/drone/odom", Odometry)
        cls.commands = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        cls.poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1))
        cls.log = Listener("/rosout", Log)

    def setUp(self):
        self.commands.publish(twist())
        self.move(pose_at(0, 0, 0.8))

    def test_the_drones_own_topics_are_reserved(self):
        """No camera may use them."""
        publishers, subscribers, _ = rosgraph.Master("/test_flight").getSystemState()
        named = {topic[len("/drone/") :] for topic, _ in publishers + subscribers if topic.startswith("/drone/")}
        cameras = parameters.load().cameras.values()
        folders = {camera.topic.rpartition("/")[0] for camera in cameras}
        infos = {f"{folder}/camera_info".lstrip("/") for folder in folders}
        own = {
            topic
            for topic in named - infos
            if not any(topic == camera.topic or topic.startswith(f"{camera.topic}/") for camera in cameras)
        }
        self.assertLessEqual({"odom", "cmd_vel"}, own)
        self.assertLessEqual(own, set(RESERVED_TOPICS))

    def move(self, pose):
        message = PoseStamped(pose=pose)
        message.header.frame_id = "world"
        self.poses.publish(message)
        place = pose.position
        self.odometry.wait_for(lambda o: abs(o.pose.pose.position.x - place.x) < 0.02 and speed(o) < 1.0)

    def wait(self, seconds):
        """Return the odometry `seconds` of simulated time from now."""
        start = self.odometry.wait_for().header.stamp
        return self.odometry.wait_for(lambda o: (o.header.stamp - start).to_sec() >= seconds - 0.01)

    def fly(self, command, seconds):
        self.commands.publish(command)
        return self.wait(seconds)

    def test_hover(self):
        self.fly(twist(vz=0.2), 0.5)
        held = self.fly(twist(), 6.0).pose.pose.position.z
        heights = [o.pose.pose.position.z for o in self.odometry.messages[-1:]]
        self.wait(3.0)
        heights += [o.pose.pose.position.z for o in self.odometry.messages[-60:]]
        self.assertLess(max(abs(z - held) for z in heights), 1e-3)

    def test_velocity_responses_and_stop(self):
        for command, component, expected in (
            (twist(vx=1), lambda o: o.twist.twist.linear.x / math.cos(pitch(o)), 0.911),
            (twist(wz=1), lambda o: o.twist.twist.angular.z, 1.0),
        ):
            self.assertAlmostEqual(component(self.fly(command, 5.0)), expected, delta=0.02 * expected + 0.01)
            self.assertLess(speed(self.fly(twist(), 6.5)), 0.05)

    def test_one_command_stays_in_force(self):
        """As demo_teleop's key_teleop sends it: one message per key press, then silence."""
        self.commands.publish(twist(vz=0.1))
        early = self.wait(4.0).pose.pose.position.z
        self.assertAlmostEqual(self.wait(5.0).pose.pose.position.z - early, 0.5, delta=0.05)

    def test_an_invalid_twist_is_refused_and_the_previous_twist_stays(self):
        self.fly(twist(vz=0.3), 2.0)
        for invalid in (math.nan, math.inf, 1e6):
            self.commands.publish(twist(vz=invalid))
        moving = self.wait(1.0)
        self.assertAlmostEqual(moving.twist.twist.linear.z, 0.3, delta=0.05)
        self.log.wait_for(lambda m: "cmd_vel refused" in m.msg, after=0)
        warned = [m.msg for m in self.log.messages if "cmd_vel refused" in m.msg]
        self.assertEqual(len(warned), 1, warned)
        self.assertRegex(warned[0], r"linear.z = (nan|inf|1000000.0): must lie within \+-20.0 m/s")

    def test_an_invalid_pose_is_refused(self):
        before = self.wait(0.5).pose.pose.position
        for pose in (pose_at(math.nan, 0, 1), pose_at(0, 0, -5), Pose()):
            self.poses.publish(PoseStamped(pose=pose))
        after = self.wait(0.5).pose.pose.position
        self.assertAlmostEqual(after.z, before.z, delta=0.02)
        self.log.wait_for(lambda m: "set_pose refused" in m.msg, after=0)

    def test_2d_pose_estimate_keeps_the_height(self):
        estimates = connected(rospy.Publisher("/drone/initialpose", PoseWithCovarianceStamped, queue_size=1))
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.pose.pose = "world", pose_at(1.0, -1.0, 0.0, yaw=1.0)
        estimates.publish(message)
        moved = self.odometry.wait_for(lambda o: abs(o.pose.pose.position.y + 1.0) < 0.01)
        self.assertAlmostEqual(moved.pose.pose.position.z, 0.8, delta=0.05)
        self.assertAlmostEqual(2 * math.atan2(moved.pose.pose.orientation.z, moved.pose.pose.orientation.w), 1.0, 2)

    def test_propellers_show_what_the_script_commands(self):
        hovering = Listener("/drone/propellers", Float32MultiArray).wait_for(
            lambda m: all(abs(velocity - 5.33) < 0.05 for velocity in m.data)
        )
        self.assertEqual(hovering.layout.dim[0].label, "front_left back_left back_right front_right")
        self.assertEqual(len(hovering.data), 4)

    def test_the_cube_is_on_the_predicted_pixels(self):
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        infos, images = Listener("/drone/camera_info", CameraInfo), Listener("/drone/front", Image)
        image = images.wait_for(
            lambda m: (
                any(info.header.stamp == m.header.stamp for info in infos.messages)
                and buffer.can_transform(m.header.frame_id, "world", m.header.stamp)
            )
        )
        info = infos.wait_for(lambda m: m.header.stamp == image.header.stamp, after=0)
        camera = buffer.lookup_transform(image.header.frame_id, "world", image.header.stamp).transform
        expected = project(cube_corners(), camera, np.reshape(info.P, (3, 4)))
        pixels = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3).astype(int)
        red = (pixels[:, :, 0] > 2 * pixels[:, :, 1]) & (pixels[:, :, 0] > 2 * pixels[:, :, 2])
        rows, columns = np.nonzero(red)
        # A pixel's centre has whole coordinates: the cube's edge lies half a pixel outside the outermost one.
        found = np.array([columns.min() - 0.5, columns.max() + 0.5, rows.min() - 0.5, rows.max() + 0.5])
        box = np.array([expected[0].min(), expected[0].max(), expected[1].min(), expected[1].max()])
        self.assertLess(np.abs(found - box).max(), 1.5, f"found {found}, expected {box}")


def pitch(odometry):
    q = odometry.pose.pose.orientation
    return math.asin(2 * (q.w * q.y - q.x * q.z))


def cube_corners():
    half = CUBE["size"] / 2
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    c, s = math.cos(CUBE["yaw"]), math.sin(CUBE["yaw"])
    return corners @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + CUBE["position"]


def project(points, transform, projection):
    q, t = transform.rotation, transform.translation
    x, y, z, w = q.x, q.y, q.z, q.w
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    in_camera = points @ turn.T + [t.x, t.y, t.z]
    u, v, depth = projection @ np.vstack([in_camera.T, np.ones(len(points))])
    return np.array([u / depth, v / depth])


if __name__ == "__main__":
    rospy.init_node("test_flight")
    sys.exit(rostest.rosrun("drone_sim", "flight", Flight))
