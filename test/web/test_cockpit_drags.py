"""The mouse on the scene of the cockpit: arrows of the drone, and of an object, which go where they are dragged."""

import math

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_page import PROJECT, TIP, let_fly, wait_until
from std_srvs.srv import Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback, MarkerArray

SCENE = """
objects:
  - {name: Crate, shape: box, size: [0.3, 0.3, 0.3], position: [1.5, -0.5, 0.8], color: [1, 0, 0, 1], mass: 1}
  - {name: Shelf, shape: box, size: [0.4, 0.4, 0.1], position: [1.5, -0.5, 0.59]}
"""
ARROW, RING = (0.0, 0.0, 0.95), (0.0, 0.72, 0.0)  # in parts; the ring's is to the left
# How far the lower edge of the drone's label is above the tip of the handles, in half pictures.
LABEL_OVER_HANDLES = """() => {
    const label = [...scene.tree.markers.values()].find((one) => one.userData.said.layer === "view/state");
    const heightOf = (point) => point.project(scene.camera).y;
    const tip = scene.gizmo.parts[2].localToWorld(scene.camera.position.clone().set(0, 0, 1.05));
    const place = scene.camera.position.clone().setFromMatrixPosition(label.matrixWorld);
    const plate = label.scale.y * scene.camera.projectionMatrix.elements[5];
    return heightOf(place) - label.center.y * plate - heightOf(tip);
}"""


class Mouse:
    """The mouse on a page, whose eyes stand still while something is dragged."""

    def __init__(self, page):
        self.page, self.on = page, (0.0, 0.0, 0.0)

    def over(self, point):
        """Go to a point of the world; there is another picture when the page has seen it."""
        self.on = list(map(float, point))
        self.page.mouse.move(*self.page.evaluate(PROJECT, self.on))
        self.page.evaluate("new Promise(done => scene.canvas.then(done))")

    def take(self, part, place=ARROW):
        """Press the button on a part of the handle; return where that is in the world."""
        self.wait("scene.gizmo.isShown", True)
        tip = np.array(self.page.evaluate(TIP, [part, place]))
        self.over(tip)
        self.page.mouse.down()
        return tip

    def wait(self, seen, expected):
        """Stay on the point until the page shows what is expected.

        What comes under a mouse that rests is not seen: it moves a little. In a scene that has just been loaded, the
        eyes may still follow the drone: where the point is, is asked anew.
        """

        def is_seen():
            x, y = self.page.evaluate(PROJECT, self.on)
            self.page.mouse.move(x + 1, y)
            self.page.mouse.move(x, y)
            return self.page.evaluate(seen) == expected

        wait_until(self.page, is_seen)

    def drag(self, point):
        self.page.mouse.move(*self.page.evaluate(PROJECT, list(map(float, point))), steps=5)

    def drop(self):
        self.page.mouse.up()


@pytest.fixture(name="mouse")
def _mouse(opened):
    mouse = Mouse(opened)
    yield mouse
    mouse.drop()
    load("")  # as it was


def load(scene):
    rospy.set_param("/drone_sim/scene_file", str(scene))
    assert rospy.ServiceProxy("/drone_sim/load_scene", Trigger)().success


def listen(topic, kind):
    heard = []
    rospy.Subscriber(topic, kind, heard.append)
    return heard


def hover(cockpit, page):
    wait_until(page, lambda: cockpit.drone.place[2] > 0.75 and abs(cockpit.drone.velocity.z) < 0.05)
    wait_until(page, lambda: page.evaluate("Boolean(scene.bodies?.has('drone') && scene.handleOf('drone'))"))


def test_a_drone_has_handles_and_thrust_arrows_while_the_mouse_is_on_it(cockpit, opened, mouse):
    hover(cockpit, opened)
    seen = """[scene.gizmo.isShown, scene.outline.scene.children.length > 0, [...scene.tree.markers.values()]
        .some((one) => one.userData.said.layer === 'view/forces' && one.visible)]"""
    wait_until(opened, lambda: opened.evaluate(seen) == [False, False, False])
    mouse.over(cockpit.drone.place)
    mouse.wait(seen, [True, True, True])
    wait_until(opened, lambda: opened.evaluate(LABEL_OVER_HANDLES) > 0)
    mouse.over(np.add(cockpit.drone.place, (0.5, 0.6, -0.6)))
    mouse.wait(seen, [False, False, False])
    opened.evaluate("scene.select('drone')")
    mouse.wait("scene.gizmo.isShown", True)
    cockpit.call("restart")
    mouse.wait("[scene.gizmo.isShown, scene.selected]", [False, ""])


def test_the_drone_goes_where_its_arrow_is_dragged(cockpit, opened, mouse):
    hover(cockpit, opened)
    drone, before, aside = cockpit.drone, np.array(cockpit.drone.place), np.array((0, 0.3, 0))
    feedback = listen("/drone/markers/feedback", InteractiveMarkerFeedback)
    mouse.over(before)
    tip = mouse.take(1)
    eye = opened.evaluate("scene.camera.position.toArray()")
    mouse.drag(tip + aside)
    wait_until(opened, lambda: np.allclose(drone.place, before + aside, atol=0.06))
    assert np.allclose(opened.evaluate("scene.camera.position.toArray()"), eye, atol=0.02), "the eyes stay"
    mouse.drop()
    wait_until(opened, lambda: feedback[-1].event_type == InteractiveMarkerFeedback.MOUSE_UP)
    assert feedback[0].event_type == InteractiveMarkerFeedback.MOUSE_DOWN
    assert {one.client_id for one in feedback} == {feedback[0].client_id}


def test_the_drone_turns_with_its_ring(cockpit, opened, mouse):
    hover(cockpit, opened)
    before, place = cockpit.drone.pose.orientation, np.array(cockpit.drone.place)
    assert abs(before.z) < 0.05
    mouse.over(place)
    grip = mouse.take(6, RING) - place
    (x, y), sine, cosine = grip[:2], math.sin(0.6), math.cos(0.6)
    mouse.drag(np.add(place, (x * cosine - y * sine, x * sine + y * cosine, 0.0)))
    wait_until(opened, lambda: abs(2 * math.asin(cockpit.drone.pose.orientation.z) - 0.6) < 0.1)


def test_an_object_that_is_clicked_on_has_arrows_and_falls_when_it_is_let_go(cockpit, opened, mouse, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(SCENE)
    load(scene)
    shown = listen("/drone/scene", MarkerArray)

    def crate():
        found = [one.pose.position for one in shown[-1].markers if one.ns == "Crate"] if shown else []
        return np.array([(at.x, at.y, at.z) for at in found]).reshape(-1, 3)

    wait_until(opened, lambda: len(crate()) and math.dist(cockpit.drone.place, (0, 0, 0.8)) < 0.02)
    before, aside = crate()[0], np.array((0, 0.5, 0))
    wait_until(opened, lambda: opened.evaluate("Boolean(scene.handleOf('Crate'))"))
    opened.evaluate("scene.frame('Crate')")
    opened.mouse.move(200, 400)
    for _ in range(4):  # away from it: it is to be dragged for half a metre
        opened.mouse.wheel(0, 300)
    wait_until(opened, lambda: opened.evaluate("scene.view.distance") > 4.2)
    opened.evaluate("new Promise(done => scene.canvas.then(done))")
    mouse.over(before)
    opened.mouse.down()
    opened.mouse.up()
    assert opened.evaluate("scene.selected") == "Crate"
    tip = mouse.take(1)
    mouse.drag(tip + aside)
    wait_until(opened, lambda: np.allclose(crate(), before + aside, atol=0.1))
    let_fly(opened, cockpit.drone, 30)
    assert abs(crate()[0, 2] - before[2]) < 0.1, "it is held"
    mouse.drop()
    wait_until(opened, lambda: crate()[0, 2] < 0.2)
    opened.keyboard.press("Escape")
    assert opened.evaluate("scene.selected") == ""
