#!/usr/bin/env python3
"""`rosrun drone_sim view` without a display: a file with the images of topics, and one line for each mistake."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
import rospy
import rostest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from drone_sim.ros.core.image_messages import image

HANGS = 90.0  # s; nothing here takes nearly as long unless it hangs
RED = np.full((48, 64, 3), (0, 0, 255), np.uint8)


def publisher(topic, kind, message):
    latched_publisher = rospy.Publisher(topic, kind, queue_size=1, latch=True)
    latched_publisher.publish(message)
    return latched_publisher


class View(unittest.TestCase):
    """Image topics that this process publishes, in the program `view`."""

    @classmethod
    def setUpClass(cls):
        depth = image(np.full((48, 64), 3.0, np.float32), "32FC1")
        jpeg = CompressedImage(format="jpeg", data=cv2.imencode(".jpg", RED)[1].tobytes())
        cls.publishers = [
            publisher("/drone/front", Image, image(RED, "bgr8")),
            publisher("/drone/front/compressed", CompressedImage, jpeg),
            publisher("/drone/depth/image", Image, depth),
            publisher("/drone/name", String, "Quadricopter"),
            rospy.Publisher("/drone/floor/image", Image, queue_size=1),
        ]

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def view(self, *arguments, status=0):
        environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
        command = ["rosrun", "drone_sim", "view", *arguments]
        process = subprocess.run(
            command, env=environment, cwd=self.folder, timeout=HANGS, capture_output=True, text=True, check=False
        )
        self.assertEqual(process.returncode, status, process.stderr)
        self.assertNotIn("Traceback", process.stderr)
        return process.stdout + process.stderr

    def test_the_front_camera_without_any_argument(self):
        self.assertIn("wrote view.png", self.view())
        picture = cv2.imread(str(self.folder / "view.png"))
        self.assertTrue(np.array_equal(picture[-48:], RED))

    def test_several_topics_in_one_picture(self):
        self.view("/drone/front/compressed", "drone/depth/image", "/drone/floor/image", "--png", "all.png")
        picture = cv2.imread(str(self.folder / "all.png"))
        height, width = picture.shape[0] // 2, picture.shape[1] // 2
        self.assertTrue((abs(picture[height // 2, width // 2].astype(int) - (0, 0, 255)) < 5).all())
        self.assertEqual(picture[height // 2, width + width // 2].tolist(), [127, 127, 127])

    def test_mistakes_are_reported_in_one_line(self):
        for topic, line in (
            ("/drone/frnt", "/drone/frnt: no node publishes it; near names are /drone/front"),
            ("/drone/name", "/drone/name: is a std_msgs/String, not an image"),
            ("/drone/floor/image", "/drone/floor/image: is published, but no picture came within 3 s"),
        ):
            with self.subTest(topic):
                self.assertIn(line, self.view(topic, "--png", "none.png", status=1))
        self.assertIn("/no/such/folder.png", self.view("--png", "/no/such/folder.png", status=1))
        self.assertEqual(list(self.folder.iterdir()), [])


if __name__ == "__main__":
    rospy.init_node("test_view")
    sys.exit(rostest.rosrun("drone_sim", "view", View))
