"""The mouse on the scene of the cockpit: arrows of the drone, and of an object, which go where they are dragged."""

import math

import numpy as np
import pytest

rospy = pytest.importorskip("rospy", reason="needs ROS")

from std_srvs.srv import Trigger
from test_cockpit_page import _cockpit, _opened, wait_until  # noqa: F401 fixtures
from visualization_msgs.msg import InteractiveMarkerInit, MarkerArray

SCENE = """
objects:
  - {name: Crate, shape: box, size: [0.3, 0.3, 0.3], position: [1.5, -0.5, 0.8], color: [1, 0, 0, 1], mass: 1}
  - {name: Shelf, shape: box, size: [0.4, 0.4, 0.1], position: [1.5, -0.5, 0.59]}
"""
EYE, AIM = np.array((-1.6, 0.0, 0.7)), np.array((0.4, 0.0, 0.0))  # from the drone, which looks along x: `sight`
HALF_ANGLE = math.radians(75 / 2)  # viser's, upwards
ARROW = 0.25  # m, its length


class Screen:
    """Where a point of the world is among the pixels of the page, seen from behind a drone that hovers."""

    def __init__(self, page, drone):
        box = page.frame_locator("#scene").locator("canvas").first.bounding_box()
        self.middle = np.array((box["x"] + box["width"] / 2, box["y"] + box["height"] / 2))
        self.pixels = box["height"] / 2 / math.tan(HALF_ANGLE)
        self.eye = np.array(drone.place) + EYE
        ahead = AIM - EYE
        self.ahead = ahead / np.linalg.norm(ahead)
        self.right = np.cross(self.ahead, (0, 0, 1))
        self.right /= np.linalg.norm(self.right)

    def of(self, point):
        ray = np.asarray(point) - self.eye
        down = np.cross(self.ahead, self.right)
        return self.middle + self.pixels * np.array((ray @ self.right, ray @ down)) / (ray @ self.ahead)


def drag(page, start, end):
    page.mouse.move(*start)
    page.wait_for_timeout(500)
    page.mouse.down()
    for share in np.linspace(0.1, 1.0, 10):
        page.mouse.move(*(start + share * (end - start)))
        page.wait_for_timeout(50)
    page.wait_for_timeout(500)


def test_the_drone_goes_where_its_arrow_is_dragged(cockpit, opened):
    drone = cockpit.drone
    opened.wait_for_timeout(5000)
    before = np.array(drone.place)
    screen = Screen(opened, drone)
    tip, goal = before + (0, 0.8 * ARROW, 0), before + (0, 0.8 * ARROW + 0.3, 0)
    drag(opened, screen.of(tip), screen.of(goal))
    opened.mouse.up()
    print("place", drone.place)
    opened.screenshot(path="/tmp/objects/drag1.png")
