#!/usr/bin/env python3
"""Topics of three drones: separate commands, one tree of frames, and vehicles added and removed in flight."""

import contextlib
import os
import sys
import unittest
from pathlib import Path
from xmlrpc.client import ServerProxy

import rosgraph
import rosparam
import rospy
import rostest
from geometry_msgs.msg import Twist
from listening import Listener, connected
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

THREE = ("drone1", "drone2", "drone3")
GUEST = {"drone4": {"position": [-2, 0, 1]}}


def forward(speed):
    message = Twist()
    message.linear.x = speed
    return message


class Fleet(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.odometry = {name: Listener(f"{name}/odom", Odometry) for name in THREE}
        cls.commands = {name: connected(rospy.Publisher(f"{name}/cmd_vel", Twist, queue_size=1)) for name in THREE}

    def set_vehicles(self, vehicles=None):
        if vehicles is not None:
            rospy.set_param("/drone_sim/vehicles", vehicles)
        rospy.wait_for_service("/drone_sim/set_vehicles", 20)
        return rospy.ServiceProxy("/drone_sim/set_vehicles", Trigger)()

    def place(self, name):
        return self.odometry[name].wait_for().pose.pose.position

    def test_each_vehicle_obeys_its_own_commands(self):
        before = {name: self.place(name) for name in THREE}
        self.commands["drone2"].publish(forward(0.5))
        reached = self.odometry["drone2"].wait_for(lambda o: o.pose.pose.position.x > before["drone2"].x + 1)
        self.commands["drone2"].publish(forward(0.0))
        self.assertEqual((reached.header.frame_id, reached.child_frame_id), ("world", "drone2/base_link"))
        for name in ("drone1", "drone3"):
            after = self.place(name)
            for axis in "xyz":
                self.assertAlmostEqual(getattr(after, axis), getattr(before[name], axis), delta=0.01)

    def test_the_frames_are_one_tree(self):
        parents = {}
        for topic in ("/tf", "/tf_static"):
            listener = Listener(topic, TFMessage)
            listener.wait_for(after=0)
            if topic == "/tf":
                listener.wait_for(lambda m: "blades" in m.transforms[0].child_frame_id, after=0)
            for message in list(listener.messages):
                for one in message.transforms:
                    parents.setdefault(one.child_frame_id, set()).add(one.header.frame_id)
                    self.assertLess(one.header.stamp.to_sec(), 1e6, "simulated time, on /tf_static, too")
            listener.close()
        self.assertTrue(all(len(above) == 1 for above in parents.values()), "no frame has two parents")
        self.assertEqual(parents["drone_sim/first"], {"drone1/Track_base"})
        for name in THREE:
            for frame in ("base_link", "Track_base", "front_optical", "track_optical", "blades_front_left"):
                self.assertEqual(self.root_of(f"{name}/{frame}", parents), "world")

    def root_of(self, frame, parents):
        while frame in parents:
            (frame,) = parents[frame]
        return frame

    def test_rviz_markers_of_each_body_are_in_its_own_frame(self):
        bodies = Listener("/drone_sim/view/bodies", MarkerArray)
        shown = bodies.wait_for(after=0)
        for name in THREE:
            self.assertIn(f"{name}/base_link", {one.header.frame_id for one in shown.markers if one.ns == name})
        bodies.close()

    def epoll_count(self):
        """Return the number of epoll descriptors of the simulator: rospy has one for each topic."""
        node = rosgraph.Master(rospy.get_name()).lookupNode("/drone_sim")
        folder = Path(f"/proc/{ServerProxy(node).getPid(rospy.get_name())[2]}/fd")
        count = 0
        for one in folder.iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed in the meantime
                count += "eventpoll" in os.readlink(one)
        return count

    def test_vehicles_are_added_and_removed_in_flight(self):
        epoll_count = self.epoll_count()
        # rosparam drops empty entries, and merges the others into the existing parameters.
        rosparam.set_param_raw("/drone_sim/vehicles", {**{name: {} for name in THREE}, **GUEST})
        answer = self.set_vehicles()
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.message, "drone4 added")
        guest, front = Listener("/drone4/odom", Odometry), Listener("/drone4/front", Image)
        self.assertAlmostEqual(guest.wait_for(after=0).pose.pose.position.x, -2, delta=0.1)
        self.assertEqual(front.wait_for(after=0).header.frame_id, "drone4/front_optical")
        guest.close()
        front.close()
        connected(rospy.Publisher("/drone4/cmd_vel", Twist, queue_size=1)).unregister()
        rospy.delete_param("/drone_sim/vehicles/drone4")
        self.assertEqual(self.set_vehicles().message, "drone4 removed")
        self.assertLess(self.epoll_count() - epoll_count, 8, "a vehicle has some 37")
        self.assertEqual([name for name, _ in rospy.get_published_topics("/drone4")], [])
        self.assertIn("position", self.set_vehicles({"drone1": {"position": [0]}}).message)
        for name in THREE:
            self.odometry[name].wait_for()  # the others still fly
        self.assertEqual(self.set_vehicles(3).message, "no vehicle was added or removed")


if __name__ == "__main__":
    rospy.init_node("test_fleet")
    sys.exit(rostest.rosrun("drone_sim", "fleet", Fleet))
