#!/usr/bin/env python3
"""Paused in simulated time: single steps and moves of the drone are published although the clock stands still."""

import sys
import tempfile
import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import PoseStamped, Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

SMALL = {name: {"width": 64, "height": 48} for name in ("front", "depth", "track", "floor")}


SCRIPT = """
def sysCall_init():
    self.camera = sim.getObject('/FrontVision')
    self.image = simROS.imageTransportAdvertise('/script/image')

def sysCall_sensing():
    pixels, width, height = sim.getVisionSensorCharImage(self.camera)
    simROS.imageTransportPublish(self.image, pixels, width, height, 'front_optical')
"""


class Standing(unittest.TestCase):
    """A node that runs in this process, which subscribes to /clock like to any other topic."""

    @classmethod
    def setUpClass(cls):
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        cls.clock, cls.odometry = Listener("/clock", Clock), Listener("/drone/odom", Odometry)
        cls.front, cls.transforms = Listener("/drone/front", Image), Listener("/tf", TFMessage)
        cls.scripts = Listener("/script/image", Image)
        for listener in (cls.odometry, cls.front, cls.transforms, cls.scripts):
            listener.wait_for()
        cls.poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1))
        cls.commands = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1000))

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.thread.join()

    @classmethod
    def run_node(cls):
        """Create and run the node in one thread, since an OpenGL context belongs to a thread."""
        with tempfile.NamedTemporaryFile("w", suffix=".py") as script:
            script.write(SCRIPT)
            script.flush()
            settings = {"cameras": SMALL, "real_time_factor": 10.0, "script": script.name}
            cls.node = Node(parameters.load(settings))
            cls.node.run()
            cls.node.close()

    def setUp(self):
        odometry_count = len(self.odometry.messages)
        self.call("start")
        self.odometry.wait_for(lambda o: 0 < o.header.stamp.to_sec() < 1, after=odometry_count)
        self.scripts.wait_for()  # the script has advertised its topic again
        self.assertTrue(rospy.ServiceProxy("~pause", SetBool)(True).success)

    def call(self, name):
        answer = rospy.ServiceProxy(f"~{name}", Trigger)()
        self.assertTrue(answer.success, answer.message)

    def move_to(self, height):
        pose = PoseStamped()
        pose.pose.position.z, pose.pose.orientation.w = height, 1.0
        self.poses.publish(pose)
        return self.odometry.wait_for(lambda o: abs(o.pose.pose.position.z - height) < 1e-6, after=0)

    def stamp(self, steps):
        return rospy.Time.from_sec((self.node.simulation.steps + steps) * 0.05)

    def test_every_single_step_is_published(self):
        expected = [self.stamp(number) for number in (1, 2, 3, 4, 5)]
        listeners = (self.clock, self.odometry, self.transforms, self.front, self.scripts)
        before = {listener: len(listener.messages) for listener in listeners}
        threads = [threading.Thread(target=self.call, args=("step",)) for _ in expected]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for listener in (self.odometry, self.front, self.scripts):
            listener.wait_for(lambda m: m.header.stamp == expected[-1], after=before[listener])
        self.clock.wait_for(lambda c: c.clock == expected[-1], after=before[self.clock])
        self.transforms.wait_for(lambda m: m.transforms[0].header.stamp == expected[-1], after=before[self.transforms])
        since = {listener: listener.messages[count:] for listener, count in before.items()}
        self.assertEqual([c.clock for c in since[self.clock] if c.clock >= expected[0]], expected)
        self.assertEqual([o.header.stamp for o in since[self.odometry] if o.header.stamp >= expected[0]], expected)
        pictures = {m.header.stamp: m.data for m in since[self.front]}
        for image in since[self.scripts]:
            if image.header.stamp in pictures:
                self.assertEqual(image.data, pictures[image.header.stamp])
        first = [m.transforms[0] for m in since[self.transforms]]
        sent = [one.header.stamp for one in first if one.child_frame_id == "base_link"]  # blades have separate messages
        self.assertEqual([stamp for stamp in sent if stamp >= expected[0]], expected)

    def test_moving_the_drone_publishes_it_with_the_current_stamp(self):
        now = self.stamp(0)
        self.move_to(0.3)
        low = self.front.messages[-1]
        before, sent = len(self.front.messages), len(self.transforms.messages)
        moved = self.move_to(1.5)
        self.assertEqual(moved.header.stamp, now)
        picture = self.front.wait_for(lambda m: m.data != low.data, after=before)
        self.assertEqual(picture.header.stamp, now)
        self.assertEqual(len(self.transforms.messages), sent, "tf2 takes but one transform of a stamp")

    def test_commands_while_paused_cause_no_messages(self):
        self.move_to(7.0)
        before = len(self.odometry.messages)
        for _ in range(500):
            self.commands.publish(Twist())
        self.move_to(8.0)
        heights = [o.pose.pose.position.z for o in self.odometry.messages[before:]]
        self.assertTrue(all(abs(height - 8.0) < 1e-6 for height in heights), heights)

    def test_subscribers_while_the_clock_stands_get_the_latest_messages(self):
        now = self.stamp(0)
        for name, topic, kind in (("clock", "/clock", Clock), ("transforms", "/tf", TFMessage)):
            getattr(self, name).close()
            setattr(type(self), name, Listener(topic, kind))
        self.assertEqual(self.clock.wait_for(after=0).clock, now)
        latest_transforms = self.transforms.wait_for(after=0).transforms
        self.assertEqual({one.header.stamp for one in latest_transforms}, {now})
        self.assertIn("base_link", [one.child_frame_id for one in latest_transforms])
        pictures = Listener("/drone/track/image", Image)
        self.addCleanup(pictures.close)
        self.assertEqual(pictures.wait_for(after=0).header.stamp, now)


if __name__ == "__main__":
    rospy.init_node("test_standing", disable_rostime=True)
    sys.exit(rostest.rosrun("drone_sim", "standing", Standing))
