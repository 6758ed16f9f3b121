#!/usr/bin/env python3
"""The cameras' topics, step by step: the test steps the node itself, so that it knows what each step renders."""

import math
import sys
import threading
import unittest
from unittest import mock

import cv2
import numpy as np
import rospy
import rostest
from dynamic_reconfigure.client import Client
from listening import Listener
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from tf2_msgs.msg import TFMessage

from drone_sim.ros.node.node import Node
from drone_sim.ros.vehicle import cameras
from drone_sim.run import parameters

CAMERAS = {
    "front": ("/drone/front", "/drone/camera_info", "front_optical", "rgb8"),
    "depth": ("/drone/depth/image", "/drone/depth/camera_info", "front_optical", "32FC1"),
    "track": ("/drone/track/image", "/drone/track/camera_info", "track_optical", "rgb8"),
    "floor": ("/drone/floor/image", "/drone/floor/camera_info", "floor_optical", "rgb8"),
}


class Cameras(unittest.TestCase):
    """One node in this process; every test connects its own subscribers."""

    @classmethod
    def setUpClass(cls):
        cls.parameters = parameters.load({"cameras": {"floor": {"every": 3, "truth": True}}})
        cls.node = Node(cls.parameters)
        cls.node.player.start()
        vision = cls.node.simulation.vision
        picture, cls.pictures = vision.picture, []

        def counted(kind, intrinsics, pose):
            cls.pictures.append(kind)
            return picture(kind, intrinsics, pose)

        vision.picture = counted

    @classmethod
    def tearDownClass(cls):
        cls.node.close()

    def setUp(self):
        self.listeners = []

    def tearDown(self):
        for listener in self.listeners:
            listener.close()
        self.step_until(lambda: not self.rendered_in_a_step())

    def listen(self, topic, kind):
        self.listeners.append(Listener(topic, kind))
        return self.listeners[-1]

    def step_until(self, condition):
        for _ in range(400):
            self.node.step()
            if condition():
                return
            rospy.rostime.wallsleep(0.01)  # the connections are made in other threads
        self.fail("nothing such in 400 steps")

    def step_to_the_next_picture(self, every, odometry, *listeners):
        """Run `every` steps, each after the odometry of the previous one: ROS drops messages that are sent too fast.

        Return when each of `listeners` has received a message of these steps.
        """
        before = [len(one.messages) for one in listeners]
        for _ in range(every):
            heard = len(odometry.messages)
            self.node.step()
            wait_until(lambda heard=heard: len(odometry.messages) > heard)
        wait_until(lambda: all(len(one.messages) > count for one, count in zip(listeners, before)))

    def rendered_in_a_step(self):
        self.pictures.clear()
        self.node.step()
        return list(self.pictures)

    def test_nothing_is_rendered_without_a_subscriber(self):
        self.assertEqual([self.rendered_in_a_step() for _ in range(5)], [[]] * 5)
        image = self.listen("/drone/front", Image)
        self.step_until(lambda: image.messages)
        self.assertEqual(self.rendered_in_a_step(), ["color"])

    def test_camera_info_alone_renders_nothing(self):
        info = self.listen("/drone/camera_info", CameraInfo)
        self.step_until(lambda: info.messages)
        self.assertEqual(self.rendered_in_a_step(), [])

    def test_each_camera_publishes_image_and_camera_info_with_the_stamp_of_odometry(self):
        odometry = self.listen("/drone/odom", Odometry)
        for name, (topic, info_topic, frame, encoding) in CAMERAS.items():
            with self.subTest(name):
                image, info = self.listen(topic, Image), self.listen(info_topic, CameraInfo)
                self.step_until(lambda several=(image, info, odometry): all(one.messages for one in several))
                before = len(image.messages) + 1  # from here on, all listeners are connected
                for _ in range(5):
                    self.step_to_the_next_picture(self.parameters.cameras[name].every, odometry, image, info)
                expected = self.parameters.cameras[name]
                picture, model = image.messages[-1], info.messages[-1]
                self.assertEqual((picture.encoding, picture.header.frame_id), (encoding, frame))
                self.assertEqual((picture.width, picture.height), (expected.width, expected.height))
                self.assertEqual((model.width, model.height), (expected.width, expected.height))
                self.assertEqual(model.header.frame_id, frame)
                focal = expected.width / 2 / math.tan(expected.horizontal_fov / 2)
                for matrix, row in ((model.K, 3), (model.P, 4)):
                    np.testing.assert_allclose([matrix[0], matrix[row + 1]], focal, atol=1e-9)
                    np.testing.assert_allclose(matrix[2], (expected.width - 1) / 2, atol=1e-9)
                    np.testing.assert_allclose(matrix[row + 2], (expected.height - 1) / 2, atol=1e-9)
                stamps = {m.header.stamp for m in image.messages[before : before + 3]}
                self.assertEqual(len(stamps), 3)
                wait_until(lambda info=info, stamps=stamps: stamps <= stamps_of(info) & stamps_of(odometry))

    def test_every_third_step_renders_a_camera_with_every_3(self):
        image = self.listen("/drone/floor/image", Image)
        self.step_until(lambda: image.messages)
        self.assertEqual(sum(len(self.rendered_in_a_step()) for _ in range(9)), 3)

    def test_the_overlay_combines_image_and_mask_of_its_stamp_if_subscribed(self):
        topics = ("", "/truth/categories", "/truth/overlay")
        with mock.patch.object(cameras, "draw_mask", wraps=cameras.draw_mask) as draw_mask:
            listeners = [self.listen(f"/drone/floor/image{one}", Image) for one in topics[:2]]
            self.step_until(lambda: all(len(one.messages) > 2 for one in listeners))
            draw_mask.assert_not_called()
            listeners.append(self.listen(f"/drone/floor/image{topics[2]}", Image))
            self.step_until(lambda: set.intersection(*map(stamps_of, listeners)))
        stamp = min(set.intersection(*map(stamps_of, listeners)))
        picture, mask, overlay = (next(one for one in each.messages if one.header.stamp == stamp) for each in listeners)
        self.assertEqual((overlay.encoding, overlay.header.frame_id), ("rgb8", picture.header.frame_id))
        size = picture.height, picture.width
        colors, over = (np.frombuffer(one.data, np.uint8).reshape(*size, 3) for one in (picture, overlay))
        numbers = np.frombuffer(mask.data, np.uint16).reshape(size)
        self.assertTrue(numbers.any())
        np.testing.assert_array_equal(over, draw_mask(colors, numbers))

    def test_depth_of_the_floor(self):
        depth = self.listen("/drone/depth/image", Image)
        self.step_until(lambda: depth.messages)
        message = depth.messages[-1]
        metres = np.frombuffer(message.data, np.float32).reshape(message.height, message.width)
        self.assertTrue(np.isnan(metres[0]).all())  # the sky
        camera = self.node.simulation.drone.cameras["front"]
        height = camera.pose()[11]
        rows = np.arange(440, 480)
        expected = height * camera.intrinsics.fy / (rows - camera.intrinsics.cy)
        np.testing.assert_allclose(metres[440:480, 320], expected, rtol=0.01)

    def test_jpeg_and_png(self):
        compressed, raw = self.listen("/drone/front/compressed", CompressedImage), self.listen("/drone/front", Image)
        self.step_until(lambda: compressed.messages and raw.messages)
        client = Client("/drone/front/compressed", timeout=60)
        self.assertEqual(client.get_configuration(timeout=60)["jpeg_quality"], 80)
        self.assert_like_raw(compressed, raw, "rgb8; jpeg compressed bgr8", tolerance=25)
        client.update_configuration({"format": "png", "png_level": 1})
        self.assert_like_raw(compressed, raw, "rgb8; png compressed bgr8", tolerance=0)
        client.update_configuration({"format": "jpeg", "jpeg_quality": 5})
        self.assert_like_raw(compressed, raw, "rgb8; jpeg compressed bgr8", tolerance=120)
        client.close()

    def test_a_slow_encoder_delays_no_step(self):
        """The encoder is blocked within an image. The steps go on, and only the last of their images is sent."""
        compressed = self.listen("/drone/front/compressed", CompressedImage)
        self.step_until(lambda: compressed.messages)
        stopped, go_on, encode = threading.Event(), threading.Event(), cv2.imencode

        def slow(*arguments):
            stopped.set()
            assert go_on.wait(60)
            return encode(*arguments)

        with mock.patch.object(cv2, "imencode", slow):
            self.step_until(stopped.is_set)
            for second in (1, 2, 3, 4, 5):
                with mock.patch.object(rospy.Time, "now", return_value=rospy.Time(second)):
                    self.node.step()
            go_on.set()
            compressed.wait_for(lambda m: m.header.stamp == rospy.Time(5), after=0)
        self.assertFalse({rospy.Time(second) for second in (1, 2, 3, 4)} & stamps_of(compressed))

    def assert_like_raw(self, compressed, raw, encoding, tolerance):
        # An image that is being encoded while the format changes still has the old format.
        self.step_until(lambda: compressed.messages[-1].format == encoding)
        for listener in (compressed, raw):
            listener.messages.clear()
        self.step_until(lambda: common_stamp(compressed, raw))
        stamp = common_stamp(compressed, raw)
        packed = next(m for m in compressed.messages if m.header.stamp == stamp)
        plain = next(m for m in raw.messages if m.header.stamp == stamp)
        self.assertEqual((packed.format, packed.header.frame_id), (encoding, "front_optical"))
        decoded = cv2.cvtColor(cv2.imdecode(np.frombuffer(packed.data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        expected = np.frombuffer(plain.data, np.uint8).reshape(plain.height, plain.width, 3)
        self.assertLessEqual(np.abs(decoded.astype(int) - expected).max(), tolerance)

    def test_mounted_cameras_have_their_transform(self):
        transforms = self.listen("/tf", TFMessage)
        self.step_until(lambda: transforms.messages)
        children = {t.child_frame_id for t in transforms.messages[0].transforms}
        self.assertEqual(children, {"base_link", "Track_base", "track_optical", "floor_optical"})


def wait_until(condition, seconds=60.0):
    for _ in range(round(seconds / 0.005)):
        if condition():
            return
        rospy.rostime.wallsleep(0.005)
    raise AssertionError(f"nothing such in {seconds} s")


def stamps_of(listener):
    return {m.header.stamp for m in list(listener.messages)}


def common_stamp(one, other):
    return max(stamps_of(one) & stamps_of(other), default=None)


if __name__ == "__main__":
    rospy.init_node("test_cameras")
    sys.exit(rostest.rosrun("drone_sim", "cameras", Cameras))
