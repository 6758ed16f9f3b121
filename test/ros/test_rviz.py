#!/usr/bin/env python3
"""Markers for rviz: surroundings, objects, path, command, height, forces and state."""

import math
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import cv2
import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, Twist
from listening import Listener, connected
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

SCENE = """
floor: {size: 6, texture: tiles.png}
objects:
  - {shape: box, size: [1, 2, 3], position: [20, 0, 1.5], rpy: [0, 0, 0.5], texture: tiles.png, color: [1, 0.5, 1, 1]}
drone: {position: [0, 0, 5], yaw: 0.5}
"""


def mesh(marker):
    """Return the lines of a mesh and of its material file by their first word, and its texture."""
    path = Path(marker.mesh_resource[len("file://") :])
    lines = {}
    for line in (path.read_text() + path.with_suffix(".mtl").read_text()).splitlines():
        word, *values = line.split()
        lines.setdefault(word, []).append(values)
    return lines, cv2.imread(str(path.parent / lines["map_Kd"][0][0]))


def arrow_vector(marker, tilt):
    """Return the vector from the middle of an arrow's tail to its tip (world frame), given the drone's orientation."""
    left, right, *_, tip = (np.array([p.x, p.y, p.z]) for p in marker.points)
    q = marker.pose.orientation
    turn = frames.multiply_quaternions(tilt, (q.x, q.y, q.z, q.w))
    return np.array(frames.turned(turn, tip - (left + right) / 2))


def lines(message):
    """Return the lines of a path, at least one: points (n, 3)."""
    found = [np.array([[p.x, p.y, p.z] for p in marker.points]) for marker in message.markers[1:]]
    return found or [np.empty((0, 3))]


class Rviz(unittest.TestCase):
    """A node that runs in this process at five times real time."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.tiles = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
        cv2.imwrite(f"{cls.folder.name}/tiles.png", cls.tiles)
        scene = Path(cls.folder.name) / "scene.yaml"
        scene.write_text(SCENE)
        cls.node = Node(parameters.load({"scene_file": str(scene), "real_time_factor": 5.0}))
        cls.thread = threading.Thread(target=cls.node.run)
        cls.thread.start()
        cls.commands = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        cls.poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1))

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.thread.join()
        cls.node.close()
        cls.folder.cleanup()

    def setUp(self):
        self.commands.publish(Twist())
        self.call("start")
        self.listeners = []

    def tearDown(self):
        for listener in self.listeners:
            listener.close()

    def call(self, name):
        answer = rospy.ServiceProxy(f"~{name}", Trigger)()
        self.assertTrue(answer.success, answer.message)

    def listen(self, topic):
        self.listeners.append(Listener(f"/drone/{topic}", MarkerArray))
        return self.listeners[-1]

    def command(self, x=0.0, y=0.0, z=0.0, turn=0.0):
        message = Twist()
        message.linear.x, message.linear.y, message.linear.z, message.angular.z = x, y, z, turn
        self.commands.publish(message)

    def test_the_floor_is_a_mesh_with_the_texture_of_the_scene(self):
        message = self.listen("view/surroundings").wait_for(after=0)
        sky, ground, floor = message.markers
        self.assertEqual((sky.ns, ground.ns, floor.ns), ("sky", "ground", "floor"))
        self.assertTrue(all(point.z < 0 for point in ground.points))
        self.assertEqual((floor.type, floor.mesh_use_embedded_materials), (Marker.MESH_RESOURCE, True))
        lines, picture = mesh(floor)
        corners = np.array(lines["v"], dtype=float)
        np.testing.assert_allclose((corners.min(axis=0), corners.max(axis=0)), ((-3, -3, 0), (3, 3, 0)))
        np.testing.assert_allclose(np.ptp(np.array(lines["vt"], dtype=float), axis=0), (3, 3))  # a tile is 2 m wide
        np.testing.assert_array_equal(picture, self.tiles)

    def test_an_object_has_its_texture_and_its_colour(self):
        _, box = self.listen("scene").wait_for(after=0).markers
        self.assertEqual((box.type, box.pose.position.x), (Marker.MESH_RESOURCE, 20))
        self.assertAlmostEqual(box.pose.orientation.z, math.sin(0.25))
        lines, picture = mesh(box)
        corners = np.array(lines["v"], dtype=float)
        np.testing.assert_allclose(np.ptp(corners, axis=0), (1, 2, 3))
        np.testing.assert_allclose(np.ptp(np.array(lines["vt"], dtype=float), axis=0), (1, 1))  # once per face
        light = np.array(lines["Kd"][0], dtype=float) + np.array(lines["Ke"][0], dtype=float)
        np.testing.assert_allclose(light, (1, 0.5, 1))
        np.testing.assert_array_equal(picture, self.tiles)

    def test_the_same_scene_is_not_written_again(self):
        surroundings = self.listen("view/surroundings")
        first = surroundings.wait_for(after=0).markers[2].mesh_resource
        self.call("start")
        again = surroundings.wait_for(lambda m: len(surroundings.messages) > 1, after=0).markers[2].mesh_resource
        self.assertEqual(first, again)

    def test_the_path_ends_where_set_pose_moves_the_drone(self):
        path = self.listen("view/path")
        self.command(x=1.0)
        # A subscriber that disconnected has also ended a line.
        flown = lines(path.wait_for(lambda m: len(lines(m)[-1]) > 10))
        self.assertLess(np.linalg.norm(np.diff(flown[-1], axis=0), axis=1).max(), 0.5)
        pose = PoseStamped()
        pose.pose.position.x, pose.pose.position.z, pose.pose.orientation.w = 3.0, 9.0, 1.0
        self.poses.publish(pose)
        *_, before, after = lines(path.wait_for(lambda m: len(lines(m)) == len(flown) + 1 and len(lines(m)[-1]) > 5))
        self.assertLess(before[:, 2].max(), 6)
        self.assertGreater(after[0, 2], 8)

    def test_the_path_ends_at_stop_and_start(self):
        path = self.listen("view/path")
        for service in ("stop", "start"):
            self.call("start")
            self.command(x=1.0)
            path.wait_for(lambda m: sum(map(len, lines(m))) > 10)
            self.command()
            heard = len(path.messages)
            self.call(service)
            path.wait_for(lambda m: sum(map(len, lines(m))) < 5, after=heard)

    def test_the_arrow_shows_the_command(self):
        command = self.listen("view/command")
        self.command(x=0.6, y=-0.3, z=0.2)
        arrow = command.wait_for(lambda m: m.markers[0].action == Marker.ADD).markers[0]
        self.assertEqual((arrow.header.frame_id, arrow.frame_locked), ("base_link", True))
        c, s = math.cos(0.5), math.sin(0.5)  # the drone's yaw: the command counts in Track_base
        expected = (0.6 * c + 0.3 * s, 0.6 * s - 0.3 * c, 0.2)
        body = self.node.simulation.drone.body
        np.testing.assert_allclose(arrow_vector(arrow, body.state.orientation), expected, atol=0.05)
        self.command(turn=0.5)
        turning = command.wait_for(lambda m: m.markers[0].action == Marker.DELETE and m.markers[1].points).markers
        first, last = turning[1].points[0], turning[1].points[-1]
        swept = math.atan2(last.y, last.x) - math.atan2(first.y, first.x)
        self.assertAlmostEqual((swept + math.pi) % (2 * math.pi) - math.pi, 0.5, places=3)
        self.command()
        command.wait_for(lambda m: [marker.action for marker in m.markers] == [Marker.DELETE] * 2)

    def test_shadow_and_plumb_line_stand_below_the_drone(self):
        height = self.listen("view/height")
        self.command(x=1.0)
        shadow, line = height.wait_for(lambda m: m.markers[0].pose.position.x > 0.5).markers
        self.assertAlmostEqual(shadow.pose.position.z, 0, places=2)
        self.assertEqual((shadow.header.frame_id, line.header.frame_id), ("world", "base_link"))
        self.assertAlmostEqual(-line.points[1].z, 5, delta=0.2)
        self.assertEqual(line.points[0].z, 0)
        q = line.pose.orientation
        tilt = self.node.simulation.drone.body.state.orientation
        turn = frames.multiply_quaternions(tilt, (q.x, q.y, q.z, q.w))
        self.assertGreater(frames.turned(turn, (0, 0, 1))[2], 0.98)

    def test_forces_are_drawn_on_the_drone_for_subscribers(self):
        thrust, *others = self.listen("view/forces").wait_for(lambda m: m.markers[0].action == Marker.ADD).markers
        self.assertEqual((thrust.ns, thrust.header.frame_id, thrust.type), ("thrust", "base_link", Marker.LINE_LIST))
        self.assertEqual(len(thrust.points), 4 * 10)
        self.assertEqual([one.action for one in others], [Marker.DELETE] * 4)

    def test_the_text_shows_the_state_of_the_simulation(self):
        state = self.listen("view/state")
        text = state.wait_for(lambda m: "flying" in m.markers[0].text, after=0).markers[0].text
        self.assertRegex(text, r"flying +\d+\.\d s\nheight \d\.\d\d m +speed \d\.\d\d m/s")
        self.assertTrue(rospy.ServiceProxy("~pause", SetBool)(True).success)
        state.wait_for(lambda m: m.markers[0].text.startswith("paused"), after=0)
        self.call("stop")
        state.wait_for(lambda m: m.markers[0].text == "stopped", after=0)


if __name__ == "__main__":
    rospy.init_node("test_rviz")
    sys.exit(rostest.rosrun("drone_sim", "rviz", Rviz))
