"""Dragging with the mouse in the cockpit's scene: the handles of the drone and of an object."""

import math

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import PROJECT, TIP, wait_for_steps, wait_until
from std_srvs.srv import Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback, MarkerArray

SCENE = """
objects:
  - {name: Crate, shape: box, size: [0.3, 0.3, 0.3], position: [1.5, -0.5, 0.8], color: [1, 0, 0, 1], mass: 1}
  - {name: Shelf, shape: box, size: [0.4, 0.4, 0.1], position: [1.5, -0.5, 0.59]}
"""
ARROW, RING = (0.0, 0.0, 0.95), (0.0, 0.72, 0.0)  # in the frames of the parts; on the left of the ring
# Return the height of the label's lower edge above the tip of the handles, in half picture heights.
LABEL_OVER_HANDLES = """() => {
    const label = [...scene.tree.markers.values()].find((one) => one.userData.said.layer === "view/state");
    const heightOf = (point) => point.project(scene.camera).y;
    const tip = scene.gizmo.parts[2].localToWorld(scene.camera.position.clone().set(0, 0, 1.05));
    const place = scene.camera.position.clone().setFromMatrixPosition(label.matrixWorld);
    const plate = label.scale.y * scene.camera.projectionMatrix.elements[5];
    return heightOf(place) - label.center.y * plate - heightOf(tip);
}"""


class Mouse:
    """The mouse on a page; the camera of the page stands still during a drag."""

    def __init__(self, page):
        self.page, self.target = page, (0.0, 0.0, 0.0)

    def move_to(self, point):
        """Move to a point of the world, and wait until the page has painted another picture."""
        self.target = list(map(float, point))
        self.page.mouse.move(*self.page.evaluate(PROJECT, self.target))
        self.page.evaluate("new Promise(done => scene.canvas.then(done))")

    def grab(self, part, place=ARROW):
        """Press the mouse button on a part of the handle; return the position of that point in the world."""
        self.wait("scene.gizmo.isShown", True)
        tip = np.array(self.page.evaluate(TIP, [part, place]))
        self.move_to(tip)
        self.page.mouse.down()
        return tip

    def wait(self, expression, expected):
        """Stay on the point until the value of `expression` in the page is as expected.

        The page does not notice an object that moves under a resting mouse, so the mouse moves a little. In a scene
        that has just been loaded, the camera may still follow the drone, so the point is projected each time.
        """

        def is_as_expected():
            x, y = self.page.evaluate(PROJECT, self.target)
            self.page.mouse.move(x + 1, y)
            self.page.mouse.move(x, y)
            return self.page.evaluate(expression) == expected

        wait_until(self.page, is_as_expected)

    def drag(self, point):
        self.page.mouse.move(*self.page.evaluate(PROJECT, list(map(float, point))), steps=5)

    def drop(self):
        self.page.mouse.up()


@pytest.fixture(name="mouse")
def _mouse(opened):
    mouse = Mouse(opened)
    yield mouse
    mouse.drop()
    load("")  # the scene of the launch


def load(scene):
    rospy.set_param("/drone_sim/scene_file", str(scene))
    assert rospy.ServiceProxy("/drone_sim/load_scene", Trigger)().success


def listen(topic, message_type):
    messages = []
    rospy.Subscriber(topic, message_type, messages.append)
    return messages


def hover(cockpit, page):
    wait_until(page, lambda: cockpit.drone.place[2] > 0.75 and abs(cockpit.drone.velocity.z) < 0.05)
    wait_until(page, lambda: page.evaluate("Boolean(scene.bodies?.has('drone') && scene.handleOf('drone'))"))


def test_a_drone_has_handles_and_thrust_arrows_while_the_mouse_is_on_it(cockpit, opened, mouse):
    hover(cockpit, opened)
    expression = """[scene.gizmo.isShown, scene.outline.scene.children.length > 0, [...scene.tree.markers.values()]
        .some((one) => one.userData.said.layer === 'view/forces' && one.visible)]"""
    wait_until(opened, lambda: opened.evaluate(expression) == [False, False, False])
    mouse.move_to(cockpit.drone.place)
    mouse.wait(expression, [True, True, True])
    wait_until(opened, lambda: opened.evaluate(LABEL_OVER_HANDLES) > 0)
    mouse.move_to(np.add(cockpit.drone.place, (0.5, 0.6, -0.6)))
    mouse.wait(expression, [False, False, False])
    opened.evaluate("scene.select('drone')")
    mouse.wait("scene.gizmo.isShown", True)
    cockpit.call("restart")
    mouse.wait("[scene.gizmo.isShown, scene.selected]", [False, ""])


def test_the_drone_follows_its_dragged_arrow(cockpit, opened, mouse):
    hover(cockpit, opened)
    drone, before, aside = cockpit.drone, np.array(cockpit.drone.place), np.array((0, 0.3, 0))
    feedback = listen("/drone/markers/feedback", InteractiveMarkerFeedback)
    mouse.move_to(before)
    tip = mouse.grab(1)
    eye = opened.evaluate("scene.camera.position.toArray()")
    mouse.drag(tip + aside)
    wait_until(opened, lambda: np.allclose(drone.place, before + aside, atol=0.06))
    assert np.allclose(opened.evaluate("scene.camera.position.toArray()"), eye, atol=0.02), "the camera stands still"
    mouse.drop()
    wait_until(opened, lambda: feedback[-1].event_type == InteractiveMarkerFeedback.MOUSE_UP)
    assert feedback[0].event_type == InteractiveMarkerFeedback.MOUSE_DOWN
    assert {one.client_id for one in feedback} == {feedback[0].client_id}


def test_the_drone_turns_with_its_ring(cockpit, opened, mouse):
    hover(cockpit, opened)
    before, place = cockpit.drone.pose.orientation, np.array(cockpit.drone.place)
    assert abs(before.z) < 0.05
    mouse.move_to(place)
    grip = mouse.grab(6, RING) - place
    (x, y), sine, cosine = grip[:2], math.sin(0.6), math.cos(0.6)
    mouse.drag(np.add(place, (x * cosine - y * sine, x * sine + y * cosine, 0.0)))
    wait_until(opened, lambda: abs(2 * math.asin(cockpit.drone.pose.orientation.z) - 0.6) < 0.1)


def test_a_clicked_object_can_be_dragged_and_falls_when_it_is_released(cockpit, opened, mouse, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    load(scene)
    scenes = listen("/drone/scene", MarkerArray)

    def crate():
        centers = [one.pose.position for one in scenes[-1].markers if one.ns == "Crate"] if scenes else []
        return np.array([(at.x, at.y, at.z) for at in centers]).reshape(-1, 3)

    wait_until(opened, lambda: len(crate()) and math.dist(cockpit.drone.place, (0, 0, 0.8)) < 0.02)
    before, aside = crate()[0], np.array((0, 0.5, 0))
    wait_until(opened, lambda: opened.evaluate("Boolean(scene.handleOf('Crate'))"))
    opened.evaluate("scene.frame('Crate')")
    opened.mouse.move(200, 400)
    for _ in range(4):  # zoom out, so that half a metre fits into the picture
        opened.mouse.wheel(0, 300)
    wait_until(opened, lambda: opened.evaluate("scene.view.distance") > 4.2)
    opened.evaluate("new Promise(done => scene.canvas.then(done))")
    mouse.move_to(before)
    opened.mouse.down()
    opened.mouse.up()
    assert opened.evaluate("scene.selected") == "Crate"
    tip = mouse.grab(1)
    mouse.drag(tip + aside)
    wait_until(opened, lambda: np.allclose(crate(), before + aside, atol=0.1))
    wait_for_steps(opened, cockpit.drone, 30)
    assert abs(crate()[0, 2] - before[2]) < 0.1, "the crate is held"
    mouse.drop()
    wait_until(opened, lambda: crate()[0, 2] < 0.2)
    opened.keyboard.press("Escape")
    assert opened.evaluate("scene.selected") == ""
