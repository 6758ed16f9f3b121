"""The mouse on the scene of the cockpit: arrows of the drone, and of an object, which go where they are dragged."""

import math

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import wait_until
from std_srvs.srv import Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback, MarkerArray

SCENE = """
objects:
  - {name: Crate, shape: box, size: [0.3, 0.3, 0.3], position: [1.5, -0.5, 0.8], color: [1, 0, 0, 1], mass: 1}
  - {name: Shelf, shape: box, size: [0.4, 0.4, 0.1], position: [1.5, -0.5, 0.59]}
"""
EYE, AIM = np.array((-1.6, 0.0, 0.7)), np.array((0.4, 0.0, 0.0))  # from the drone, which looks along x: `sight`
HALF_ANGLE = math.radians(75 / 2)  # viser's, upwards
ARROW, ARROW_PIXELS = 0.25, 90  # its length: m, the drone's; the object's


class Screen:
    """Where a point of the world is among the pixels of the page, seen from behind a drone that hovers."""

    def __init__(self, page, drone):
        box = page.frame_locator("#scene").locator("canvas[data-engine]").bounding_box()
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


@pytest.fixture(name="mouse")
def _mouse(opened):
    yield opened.mouse
    opened.mouse.up()
    load("")  # as it was


def load(scene):
    rospy.set_param("/drone_sim/scene_file", str(scene))
    assert rospy.ServiceProxy("/drone_sim/load_scene", Trigger)().success


def take(page, point, feedback):
    """Press the button on a handle, which may not be there yet, until the simulation hears of it."""

    def is_taken():
        page.mouse.up()
        page.mouse.move(*point)
        page.mouse.down()
        page.wait_for_timeout(1000)
        return any(one.event_type == one.MOUSE_DOWN for one in feedback)

    wait_until(page, is_taken, seconds=60)


def listen(topic, kind):
    heard = []
    rospy.Subscriber(topic, kind, heard.append)
    return heard


def test_the_drone_goes_where_its_arrow_is_dragged(cockpit, opened, mouse):
    drone, feedback = cockpit.drone, listen("/drone/markers/feedback", InteractiveMarkerFeedback)
    before = np.array(drone.place)
    screen = Screen(opened, drone)
    tip, aside = np.array((0, 0.8 * ARROW, 0)), np.array((0, 0.3, 0))
    take(opened, screen.of(before + tip), feedback)
    mouse.move(*screen.of(before + tip + aside), steps=5)
    wait_until(opened, lambda: np.allclose(drone.place, before + aside, atol=0.06))


def test_an_object_that_is_clicked_on_has_arrows_and_falls_when_it_is_let_go(cockpit, opened, mouse, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    load(scene)
    shown, feedback = (
        listen("/drone/scene", MarkerArray),
        listen("/drone/objects/feedback", InteractiveMarkerFeedback),
    )

    def crate():
        found = [one.pose.position for one in shown[-1].markers if one.ns == "Crate"] if shown else []
        return np.array([(at.x, at.y, at.z) for at in found]).reshape(-1, 3)

    wait_until(opened, lambda: len(crate()) and math.dist(cockpit.drone.place, (0, 0, 0.8)) < 0.02)
    screen, before, aside = Screen(opened, cockpit.drone), crate()[0], np.array((0, 0.5, 0))
    middle = screen.of(before)
    panel = opened.frame_locator("#scene")
    panel.get_by_role("tab", name="View").click()

    def is_chosen():
        opened.mouse.click(*middle)  # which takes it, or lets it go
        opened.wait_for_timeout(1000)
        return panel.get_by_label("Drag").input_value() == "Crate"

    wait_until(opened, is_chosen)
    left = screen.of(before + aside) - middle
    grip = middle + 0.8 * ARROW_PIXELS * left / np.linalg.norm(left)
    take(opened, grip, feedback)
    mouse.move(*(grip + left), steps=5)
    wait_until(opened, lambda: np.allclose(crate(), before + aside, atol=0.1))
    opened.wait_for_timeout(1500)
    assert abs(crate()[0, 2] - before[2]) < 0.1, "it is held"
    mouse.up()
    wait_until(opened, lambda: crate()[0, 2] < 0.2)
