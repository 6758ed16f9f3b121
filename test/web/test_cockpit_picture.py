"""The cockpit's picture: the drone is seen where odometry says, flies as it does without ROS, and is pushed."""

import io

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
import trimesh
from cockpit_page import wait_until
from geometry_msgs.msg import WrenchStamped
from PIL import Image
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

# Nothing but sky is behind the drone then.
EYE, AIM, FOV = np.array((1.5, -4.0, 0.1)), np.array((1.5, 0.0, 1.0)), 0.8  # m, m, rad
STEP = 0.05  # s
SEARCHED = 12  # px each way


POINTS = {  # of the drone's parts, all of which are convex; others bring their own
    Marker.SPHERE: trimesh.creation.icosphere(3, 0.5).vertices,
    Marker.CYLINDER: trimesh.creation.cylinder(0.5, 1.0).vertices,
}


def size(marker):
    return marker.scale.x, marker.scale.y, marker.scale.z


def moved(points, pose):
    """Return points of a frame that has that pose, in the frame above."""
    at, turn = pose.position, pose.orientation
    matrix = np.reshape(frames.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)), (3, 4))
    return points @ matrix[:, :3].T + matrix[:, 3]


class Picture:
    """The scene seen by a camera that is known."""

    def __init__(self, panel):
        self.page = panel.page
        self.page.click("#toggle")  # without the editor, the scene is wide
        panel.show("View")
        panel.choose("Look", "free")
        panel.scene.get_by_role("checkbox", name="Handles").click()
        words = {"Position": EYE, "LookAt": AIM, "Up": (0, 0, 1), "Fov": (FOV,)}
        query = "&".join(f"initialCamera{name}={','.join(map(str, value))}" for name, value in words.items())
        self.page.evaluate("at => { document.getElementById('scene').src = at }", f"/scene/?{query}&fixedDpr=1")
        self.canvas = panel.scene.locator("canvas").first
        self.canvas.wait_for()
        self.bodies = rospy.wait_for_message("/drone/view/bodies", MarkerArray, 30).markers

    def project(self, points):
        """Return where points of the world are seen, px from the top left of the canvas."""
        box = self.canvas.bounding_box()
        ahead = (AIM - EYE) / np.linalg.norm(AIM - EYE)
        right = np.cross(ahead, (0, 0, 1)) / np.linalg.norm(np.cross(ahead, (0, 0, 1)))
        seen = (np.asarray(points) - EYE) @ np.array((right, np.cross(ahead, right), ahead)).T
        focal = box["height"] / 2 / np.tan(FOV / 2)
        return focal * seen[:, :2] / seen[:, 2:] + (box["width"] / 2, box["height"] / 2)

    def expected(self, pose):
        """Return the pixels of the drone's body (its blades turn) at a pose of odometry."""
        mask = np.zeros(self.look().shape[:2], np.uint8)
        for marker in (one for one in self.bodies if one.header.frame_id == "base_link"):
            points = POINTS.get(marker.type, np.array([(one.x, one.y, one.z) for one in marker.points]))
            corners = self.project(moved(moved(points * size(marker), marker.pose), pose))
            cv2.fillConvexPoly(mask, cv2.convexHull(np.floor(corners).astype(np.int32)), 1)
        return mask.astype(bool)

    def look(self):
        return np.asarray(Image.open(io.BytesIO(self.canvas.screenshot())).convert("RGB")).astype(int)

    def seen(self):
        """Return the pixels that are neither sky, whose colour is its row's, nor the green of thrusts."""
        picture = self.look()
        sky = np.median(picture[:, -40:], axis=1, keepdims=True)
        green = picture[..., 1] > picture[..., [0, 2]].max(axis=2) + 40
        return (np.abs(picture - sky).max(axis=2) > 25) & ~green

    def misplaced(self, pose):
        """Return how far the drone is seen from where it should be, px each way; nan where it is not seen."""
        expected, seen = self.expected(pose), self.seen()
        assert expected.sum() > 100, "the drone is out of sight"
        scores = {
            (right, down): (np.roll(expected, (down, right), (0, 1)) & seen).sum() / expected.sum()
            for right in range(-SEARCHED, SEARCHED + 1)
            for down in range(-SEARCHED, SEARCHED + 1)
        }
        best = max(scores.values())
        if best < 0.85 or min(scores.values()) > 0.6:
            return np.array((np.nan, np.nan))
        return np.mean([shift for shift, score in scores.items() if score == best], axis=0)


@pytest.fixture(name="picture", scope="module")
def _picture(cockpit, panel):
    yield Picture(panel)
    panel.show("View")
    panel.choose("Look", "behind the drone")
    panel.scene.get_by_role("checkbox", name="Handles").click()
    cockpit.start_afresh()


def is_where_odometry_says(cockpit, picture):
    """Tell whether the paused drone is; the picture may come after what odometry says."""
    return np.abs(picture.misplaced(cockpit.drone.pose)).max() < 2  # px


def flown(drone):
    """Return the commands and places of the steps that moved the drone, in their order."""
    steps = [drone.flown[stamp] for stamp in sorted(drone.flown)]
    whole = [(one["command"], one["place"]) for one in steps if len(one) == 2]
    return [step for before, step in zip([None, *whole], whole) if before is None or before[1] != step[1]]


def fly_alike(steps):
    """Fly the same commands without ROS, from where that comes by the first place; return the places."""
    simulation = Simulation(parameters.load())
    try:
        for _ in range(int(60 / STEP)):
            if np.allclose(simulation.drone.body.state.position, steps[0][1], rtol=0, atol=1e-12):
                break
            simulation.step()
        places = [simulation.drone.body.state.position]
        for (vx, vy, vz, wz), _ in steps[1:]:
            simulation.drone.commands.receive(Twist(Vector3(vx, vy, vz), Vector3(0, 0, wz)))
            simulation.step()
            places.append(simulation.drone.body.state.position)
        return np.array(places)
    finally:
        simulation.close()


def test_a_key_held_for_2_s_flies_as_the_same_commands_without_ros_and_the_page_shows_it(cockpit, panel, picture):
    page, drone = panel.page, cockpit.drone
    wait_until(page, lambda: abs(drone.velocity.z) < 0.01 and drone.place[2] > 0.5)
    cockpit.call("pause", True)
    wait_until(page, lambda: is_where_odometry_says(cockpit, picture))
    before = drone.place
    cockpit.call("stop")
    drone.flown.clear()  # of a flight that has stood still since long: no step of it is still on its way
    cockpit.call("start")
    wait_until(page, lambda: flown(drone))  # the key may be heard in the first step: a flight to compare has one before
    assert flown(drone)[0][0] == (0.0, 0.0, 0.0, 0.0)
    page.locator("#command").click()
    page.keyboard.down("w")
    wait_until(page, lambda: sum(command[0] == 1.0 for command, _ in flown(drone)) >= 2 / STEP)
    assert drone.velocity.x > 0.9
    page.keyboard.up("w")
    wait_until(page, lambda: drone.command == (0.0, 0.0, 0.0))
    steps = flown(drone)
    cockpit.call("pause", True)
    places = np.array([place for _, place in steps])
    assert np.abs(fly_alike(steps) - places).max() < 1e-9
    assert places[-1][0] - places[0][0] > 1.2
    wait_until(page, lambda: is_where_odometry_says(cockpit, picture))
    assert np.abs(picture.project([drone.place]) - picture.project([before])).max() > 100


def test_a_click_on_the_drone_pushes_it_away_from_who_looks(cockpit, panel, picture):
    cockpit.call("pause", True)
    heard = []
    pushes = rospy.Subscriber("/drone/push", WrenchStamped, heard.append)
    wait_until(panel.page, lambda: is_where_odometry_says(cockpit, picture))
    box, (across, down) = picture.canvas.bounding_box(), picture.project([cockpit.drone.place])[0]
    panel.page.mouse.click(box["x"] + across, box["y"] + down)
    wait_until(panel.page, lambda: heard)
    pushes.unregister()
    force = heard[0].wrench.force
    along = np.subtract(cockpit.drone.place, EYE)
    assert np.allclose((force.x, force.y, force.z), 0.5 * along / np.linalg.norm(along), atol=0.01)
    cockpit.call("pause", False)
    wait_until(panel.page, lambda: cockpit.drone.velocity.y > 0.05)
