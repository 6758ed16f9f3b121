#!/usr/bin/env python3
"""Driver profiles: commands and published topics, with each driver's names and meanings."""

import contextlib
import math
import subprocess
import sys
import tempfile
import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import Pose, PoseStamped, TransformStamped, Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, Image, Imu, Range
from std_msgs.msg import Empty, Float32, String
from std_srvs.srv import Empty as EmptyService
from std_srvs.srv import SetBool

from drone_sim.files.resources import package_path
from drone_sim.mechanics.frames import from_quaternion, to_rpy
from drone_sim.ros.core.message_conversion import xyz, xyzw

FACTOR = 2.0  # times real time
EXAMPLE = package_path() / "docs" / "drivers"


class Sender(threading.Thread):
    """A thread that publishes one message every 20 ms, like the loop of a node."""

    def __init__(self, publisher, message):
        super().__init__(daemon=True)
        self._publisher, self._message, self._done = publisher, message, threading.Event()

    def run(self):
        while not self._done.wait(0.02):
            self._publisher.publish(self._message)

    def __enter__(self):
        self.start()

    def __exit__(self, *_error):
        self._done.set()
        self.join()


def pitch_of(odometry):
    return to_rpy(from_quaternion((0, 0, 0), xyzw(odometry.pose.pose.orientation)))[1]


def is_near(odometry, ball):
    """Return whether the drone is at rest at the ball's height, with its camera 1.5 m from the ball."""
    place, speed = xyz(odometry.pose.pose.position), math.hypot(*xyz(odometry.twist.twist.linear))
    distance = math.dist(place[:2], ball[:2])
    return abs(distance - 1.66) < 0.2 and abs(place[2] - ball[2]) < 0.2 and speed < 0.15


def command(**fields):
    """Return a Twist; `linear_x=1` sets its linear.x."""
    twist = Twist()
    for name, value in fields.items():
        setattr(getattr(twist, name[:-2]), name[-1], value)
    return twist


class Profiles(unittest.TestCase):
    """Each test starts a simulator with one profile, which uses the driver's topic names."""

    def setUp(self):
        self.listeners = []

    def tearDown(self):
        for listener in self.listeners:
            listener.close()

    @contextlib.contextmanager
    def simulator(self, profile, *others):
        script = str(package_path() / "scripts" / "simulator")
        arguments = (f"_profile:={profile}", f"_real_time_factor:={FACTOR}", *others)
        with tempfile.TemporaryFile("w+") as output:
            process = subprocess.Popen(
                [sys.executable, script, *arguments], stdout=output, stderr=subprocess.STDOUT, text=True
            )
            try:
                yield lambda: output.seek(0) or output.read()
            finally:
                process.terminate()
                process.wait(60)

    def listen(self, topic, kind):
        self.listeners.append(Listener(topic, kind))
        return self.listeners[-1]

    def publisher(self, topic, kind):
        return connected(rospy.Publisher(topic, kind, queue_size=10))

    def fly(self, name):
        """Take off in namespace `name`, wait until the state is `flying`, and return the state's listener."""
        state = self.listen(f"/{name}/state", String)
        takeoff = self.publisher(f"/{name}/takeoff", Empty)
        state.wait_for(lambda message: message.data == "landed", after=0)
        takeoff.publish()
        state.wait_for(lambda message: message.data == "flying")
        return state

    def test_bebop(self):
        early_takeoff = rospy.Publisher("/bebop/takeoff", Empty, queue_size=1, latch=True)
        early_takeoff.publish()  # before the simulator runs
        state, odometry = self.listen("/bebop/state", String), self.listen("/bebop/odom", Odometry)
        with self.simulator("bebop") as output:
            state.wait_for(lambda message: message.data == "flying")
            commands = self.publisher("/bebop/cmd_vel", Twist)
            with Sender(commands, command(linear_x=0.5)):
                tilted = odometry.wait_for(
                    lambda o: abs(pitch_of(o) - 0.5 * 0.349) < 0.02 and o.twist.twist.linear.x > 0.3
                )
            self.assertEqual(tilted.twist.twist.angular.y, 0.0)
            odometry.wait_for(lambda o: abs(o.twist.twist.linear.x) < 0.05)  # the command time-out stops the drone
            self.assertAlmostEqual(self.rate(odometry), 5.0, delta=0.5)
            picture = self.listen("/bebop/image_raw", Image).wait_for()
            info = self.listen("/bebop/camera_info", CameraInfo).wait_for()
            self.assertEqual((picture.width, picture.height), (640, 368))
            self.assertAlmostEqual(info.K[0], 396.2, delta=0.5)
            self.publisher("/bebop/reset", Empty).publish()  # emergency: the drone falls
            state.wait_for(lambda message: message.data == "landed")
            self.publisher("/bebop/flattrim", Empty)
            self.assertIn("the package bebop_msgs is not in your workspace", output())
            self.assertIn("/bebop/states/ardrone3/PilotingState/FlyingStateChanged", output())

    def rate(self, odometry):
        stamps = [message.header.stamp.to_sec() for message in odometry.messages]
        return (len(stamps) - 1) / (stamps[-1] - stamps[0])

    def test_ardrone(self):
        with self.simulator("ardrone") as output:
            state = self.fly("ardrone")
            odometry, imu = self.listen("/ardrone/odometry", Odometry), self.listen("/ardrone/imu", Imu)
            with Sender(self.publisher("/cmd_vel", Twist), command(angular_z=1.0)):
                imu.wait_for(lambda message: abs(message.angular_velocity.z - 1.75) < 0.1)
            with Sender(self.publisher("/cmd_vel", Twist), command(linear_y=7.0)):  # the driver clips it to 1
                odometry.wait_for(lambda o: o.twist.twist.linear.y > 0.5)
            rospy.ServiceProxy("/ardrone/flattrim", EmptyService)()
            for topic in ("/ardrone/front/image_raw", "/ardrone/bottom/image_raw", "/ardrone/image_raw"):
                self.assertEqual(self.listen(topic, Image).wait_for().height, 360)
            self.publisher("/ardrone/land", Empty).publish()
            state.wait_for(lambda message: message.data == "landed")
            self.assertIn("the package ardrone_autonomy is not in your workspace", output())

    def test_tello(self):
        with self.simulator("tello"):
            state = self.fly("tello")
            odometry = self.listen("/tello/odom", Odometry)
            with Sender(self.publisher("/tello/cmd_vel", Twist), command(linear_y=1.0)):  # the stick forward
                odometry.wait_for(lambda o: abs(o.twist.twist.linear.x - 2.0) < 0.1)
            with Sender(self.publisher("/tello/cmd_vel", Twist), command(angular_z=1.0)):  # clockwise
                odometry.wait_for(lambda o: abs(o.twist.twist.angular.z + 0.87) < 0.1)
            self.assertEqual(self.listen("/tello/camera/image_raw", Image).wait_for().width, 960)
            self.publisher("/tello/palm_land", Empty).publish()
            state.wait_for(lambda message: message.data == "landed")

    def test_sjtu(self):
        with self.simulator("sjtu"):
            state = self.fly("drone")
            pose, velocity = self.listen("/drone/gt_pose", Pose), self.listen("/drone/gt_vel", Twist)
            with Sender(self.publisher("/cmd_vel", Twist), command(linear_x=5.0)):  # m/s, clipped to 2
                velocity.wait_for(lambda twist: abs(twist.linear.x - 2.0) < 0.1)
            self.assertGreater(pose.wait_for().position.x, 0.5)
            self.assertLess(max(twist.linear.x for twist in velocity.messages), 2.6)
            sonar = self.listen("/drone/sonar", Range).wait_for()
            self.assertAlmostEqual(sonar.range, pose.messages[-1].position.z, delta=0.2)
            self.listen("/drone/down_camera/image_raw", Image).wait_for()
            self.publisher("/drone/land", Empty).publish()
            state.wait_for(lambda message: message.data == "landed")

    def test_hector(self):
        with self.simulator("hector") as output:
            truth = self.listen("/ground_truth/state", Odometry)
            truth.wait_for(lambda o: o.pose.pose.position.z < 0.2)
            with Sender(self.publisher("/cmd_vel", Twist), command(linear_z=0.5)):
                truth.wait_for(lambda o: o.pose.pose.position.z > 1.0 and abs(o.twist.twist.linear.z - 0.5) < 0.1)
            with Sender(self.publisher("/cmd_vel", Twist), command(linear_x=1.0)):
                truth.wait_for(lambda o: abs(o.twist.twist.linear.x - 1.0) < 0.1)
            pose = self.listen("/ground_truth_to_tf/pose", PoseStamped).wait_for()
            self.assertEqual(pose.header.frame_id, "world")
            self.assertAlmostEqual(self.listen("/raw_imu", Imu).wait_for().linear_acceleration.z, 9.8, delta=2.0)
            self.listen("/sonar_height", Range).wait_for()
            self.assertEqual(self.listen("/front_cam/camera/image", Image).wait_for().width, 320)
            self.assertIn("the package hector_uav_msgs is not in your workspace", output())

    def test_the_example_follows_the_ball(self):
        odometry = self.listen("/bebop/odom", Odometry)
        with self.simulator("bebop", f"_scene_file:={EXAMPLE}/ball.yaml"):
            node = subprocess.Popen([sys.executable, f"{EXAMPLE}/follow_ball.py"])
            try:
                odometry.wait_for(lambda o: is_near(o, (3.0, 0.6, 1.2)))
                move = TransformStamped(child_frame_id="Ball")
                place = move.transform.translation
                place.x, place.y, place.z, move.transform.rotation.w = 3.0, 2.5, 1.6, 1.0
                self.publisher("/drone_sim/set_object_pose", TransformStamped).publish(move)
                odometry.wait_for(lambda o: is_near(o, (3.0, 2.5, 1.6)))
            finally:
                node.kill()
                node.wait(60)

    def test_profile_from_a_user_file(self):
        """A user's profile: own topic names, a service for the motors, and a scaled number."""
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as profile_file:
            profile_file.write(USER_PROFILE)
            profile_file.flush()
            with self.simulator(profile_file.name) as _:
                heading = self.listen("/heading", Float32)
                self.publisher("/go", Empty)
                with Sender(self.publisher("/turn", Twist), command(linear_x=0.5)):
                    heading.wait_for(lambda message: message.data > 10)
                self.assertTrue(rospy.ServiceProxy("/motors", SetBool)(False).success)
                self.listen("/mine/state", String).wait_for(lambda message: message.data == "landed", after=0)


USER_PROFILE = """
drone: {name: mine}
cmd_vel_meaning: {turn: {field: linear.x}, forward: {field: angular.z}}
topics:
  go: {topic: /go, takes: takeoff}
  turn: {topic: /turn, takes: cmd_vel}
  motors: {topic: /motors, takes: motors, service: true, type: std_srvs/SetBool}
  heading: {topic: /heading, type: std_msgs/Float32, fields: {data: [yaw, 57.29578]}}
"""


if __name__ == "__main__":
    rospy.init_node("test_profiles", disable_rostime=True)
    rostest.rosrun("drone_sim", "profiles", Profiles)
