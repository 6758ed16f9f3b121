"""The cockpit's picture: the drone is seen where odometry says, flies as it does without ROS, and is pushed."""

import base64
import io

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
import trimesh
from cockpit_page import Panel, let_pass, open_page, wait_until
from geometry_msgs.msg import WrenchStamped
from PIL import Image
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

# Nothing but sky is behind the drone then.
EYE, AIM, FOV = np.array((1.0, -2.2, 0.1)), np.array((1.0, 0.0, 0.9)), np.radians(50)  # m, m, rad
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


# Puts the eyes of a page somewhere; pan and zoom do so for whoever looks.
LOOK = """([center, yaw, pitch, far]) => {
    scene.look("free");
    Object.assign(scene.view, { yaw, pitch, zoom: far });
    scene.view.center.set(...center);
    scene.show({ labels: false, path: false, command: false, handles: false });
}"""
UNTIL_PAINTED = "new Promise(done => scene.canvas.then(done))"
# The frame of a camera whose vehicle has gone.
LEFT = """name => {
    scene.tree.hang(scene.tree.frames.length, name, -1);
    scene.sort();
}"""
# Where the camera, the drone and the words above it are in the world, in the picture that was painted last.
PLACES = """(() => {
    const at = (one) => [...one.matrixWorld.elements].slice(12, 15);
    const label = [...scene.tree.markers.values()].find((one) => one.userData.said.layer === "view/state");
    const track = scene.tree.byName.get("Track_base");
    const ahead = [...track.matrixWorld.elements].slice(0, 3);
    return { eye: at(scene.camera), drone: at(scene.tree.byName.get("base_link")), label: at(label), ahead };
})()"""


class Picture:
    """The scene seen by a camera that is known."""

    def __init__(self, page):
        self.page = page
        wait_until(
            page, lambda: not page.evaluate("scene.isUnframed")
        )  # the page frames the drone once, if its view is free
        page.click("#toggle")  # without the editor, the scene is wide
        ahead = AIM - EYE
        far = np.linalg.norm(ahead)
        yaw, pitch = np.arctan2(ahead[1], ahead[0]), np.arcsin(-ahead[2] / far)
        page.evaluate(LOOK, [AIM.tolist(), float(yaw), float(pitch), float(far)])
        self.canvas = page.locator("#scene canvas")
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
        self.page.evaluate(UNTIL_PAINTED)
        return np.asarray(Image.open(io.BytesIO(self.canvas.screenshot())).convert("RGB")).astype(int)

    def seen(self):
        """Return the pixels that are not sky, whose colour is its row's."""
        picture = self.look()
        sky = np.median(picture[:, -40:], axis=1, keepdims=True)
        return np.abs(picture - sky).max(axis=2) > 25

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


@pytest.fixture(name="picture")
def _picture(opened):
    return Picture(opened)


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


def test_a_key_held_for_2_s_flies_as_the_same_commands_without_ros_and_the_page_shows_it(cockpit, picture):
    page, drone = picture.page, cockpit.drone
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


def test_a_click_on_the_drone_pushes_it_away_from_who_looks(cockpit, picture):
    cockpit.call("pause", True)
    heard = []
    pushes = rospy.Subscriber("/drone/push", WrenchStamped, heard.append)
    wait_until(picture.page, lambda: is_where_odometry_says(cockpit, picture))
    box, (across, down) = picture.canvas.bounding_box(), picture.project([cockpit.drone.place])[0]
    picture.page.mouse.click(box["x"] + across, box["y"] + down)
    wait_until(picture.page, lambda: heard)
    let_pass(picture.page, 600)
    picture.page.mouse.dblclick(box["x"] + across, box["y"] + down)  # it is selected by now; this looks at it
    wait_until(picture.page, lambda: len(heard) > 1)
    let_pass(picture.page, 600)
    assert len(heard) == 2, "a double click is one push"
    pushes.unregister()
    force = heard[0].wrench.force
    along = np.subtract(cockpit.drone.place, EYE)
    assert np.allclose((force.x, force.y, force.z), 0.5 * along / np.linalg.norm(along), atol=0.01)
    cockpit.call("pause", False)
    wait_until(picture.page, lambda: cockpit.drone.velocity.y > 0.05)


def hover(cockpit, page):
    wait_until(page, lambda: cockpit.drone.place[2] > 0.75 and abs(cockpit.drone.velocity.z) < 0.05)
    there = "scene.bodies?.has('drone') && scene.tree.byName.has('Track_base')"
    label = "[...scene.tree.markers.values()].some((one) => one.userData.said.layer === 'view/state')"
    wait_until(page, lambda: page.evaluate(f"{there} && {label}"))


def drag(page, right, down, button="left"):
    box = page.locator("#scene canvas").bounding_box()
    x, y = box["x"] + 0.2 * box["width"], box["y"] + 0.8 * box["height"]  # where there is only floor
    page.mouse.move(x, y)
    page.mouse.down(button=button)
    page.mouse.move(x + right, y + down, steps=4)
    page.mouse.up(button=button)
    page.evaluate(UNTIL_PAINTED)


def seen_from(places):
    """Return where the camera is in the drone's level frame: ahead, to the left, above."""
    way = np.subtract(places["eye"], places["drone"])
    x, y = np.array(places["ahead"])[:2] / np.linalg.norm(places["ahead"][:2])
    return np.array((way[0] * x + way[1] * y, way[1] * x - way[0] * y, way[2]))


def test_the_drone_is_large_and_an_orbit_behind_it_goes_with_it(cockpit, opened):
    hover(cockpit, opened)
    before = seen_from(opened.evaluate(PLACES))
    assert before[0] < -0.5 and abs(before[1]) < 0.05 and before[2] > 0.1, "behind it, and above"
    assert np.linalg.norm(before) < 1.5, "it is near"
    drag(opened, 150, 0)
    orbited = seen_from(opened.evaluate(PLACES))
    assert abs(orbited[1]) > 0.3 and np.linalg.norm(orbited) == pytest.approx(np.linalg.norm(before), abs=0.05)
    opened.mouse.wheel(0, 300)
    opened.evaluate(UNTIL_PAINTED)
    farther = seen_from(opened.evaluate(PLACES))
    assert np.linalg.norm(farther) > 1.2 * np.linalg.norm(orbited)
    opened.keyboard.down("w")
    wait_until(opened, lambda: cockpit.drone.velocity.x > 0.8)
    opened.evaluate(UNTIL_PAINTED)
    places = opened.evaluate(PLACES)
    opened.keyboard.up("w")
    assert np.allclose(seen_from(places), farther, atol=0.05), "in flight as it was"
    assert opened.evaluate("scene.view.name") == "behind"
    opened.keyboard.press("Home")
    opened.evaluate(UNTIL_PAINTED)
    assert np.allclose(seen_from(opened.evaluate(PLACES)), before, atol=0.05)


def test_what_hangs_on_the_drone_does_not_trail_it(cockpit, opened):
    hover(cockpit, opened)
    still = opened.evaluate(PLACES)
    opened.keyboard.down("w")
    wait_until(opened, lambda: cockpit.drone.velocity.x > 0.9)
    seen = []
    for _ in range(10):
        opened.evaluate(UNTIL_PAINTED)
        seen.append(opened.evaluate(PLACES))
    opened.keyboard.up("w")
    offsets = [np.subtract(one["label"], one["drone"]) for one in (still, *seen)]
    assert np.abs(np.subtract(offsets[1:], offsets[0])).max() < 0.03  # m, of a drone that leans
    assert seen[-1]["drone"][0] > seen[0]["drone"][0]


def test_a_cameras_view_is_the_cameras_and_a_drag_makes_it_free(cockpit, opened):
    hover(cockpit, opened)
    views = ["behind", "free", "floor_optical", "front_optical", "track_optical"]
    assert opened.evaluate("scene.views") == views
    opened.evaluate(LEFT, "other/front_optical")
    assert opened.evaluate("scene.views") == views, "no other vehicle's, whose frames stay when it goes"
    opened.evaluate("scene.look('front_optical')")
    opened.evaluate(UNTIL_PAINTED)
    places = opened.evaluate(PLACES)
    assert np.linalg.norm(np.subtract(places["eye"], places["drone"])) < 0.2
    drag(opened, 60, 0)
    assert opened.evaluate("scene.view.name") == "free"
    drag(opened, 60, 30, button="right")
    assert np.linalg.norm(np.subtract(opened.evaluate(PLACES)["eye"], places["eye"])) > 0.05


# Whether a point is in the picture, and large enough to be seen.
IN_SIGHT = """point => {
    const at = scene.camera.position.clone().set(...point), far = at.distanceTo(scene.camera.position);
    const { x, y, z } = at.project(scene.camera);
    return Math.max(Math.abs(x), Math.abs(y)) < 0.9 && z < 1 && far < 10;
}"""


def test_one_browsers_view_is_its_own_and_is_kept(cockpit, browser, opened):
    hover(cockpit, opened)
    with open_page(cockpit, browser) as other:
        opened.evaluate("scene.look('free'); scene.show({ frames: true }); scene.select('drone')")
        drag(opened, 100, 0)
        wait_until(other, lambda: other.evaluate("scene.canvas.frames") > 20)
        assert other.evaluate("[scene.view.name, scene.shown.frames, scene.selected]") == ["behind", False, ""]
    opened.reload()
    wait_until(opened, lambda: opened.evaluate("window.scene?.bodies?.has('drone')"))
    assert opened.evaluate("[scene.view.name, scene.shown.frames]") == ["free", True]
    wait_until(opened, lambda: opened.evaluate(IN_SIGHT, cockpit.drone.place))


def stand_still(cockpit, page):
    """Pause, and wait until nothing is painted any more, not even the words that say so; return how often it was."""

    def is_still():
        before = page.evaluate("scene.canvas.frames")
        let_pass(page, 1000)
        return page.evaluate("scene.canvas.frames") - before <= 1

    cockpit.call("pause", True)
    wait_until(page, lambda: Panel(page).status == "paused")
    wait_until(page, is_still)
    return page.evaluate("scene.canvas.frames")


def test_nothing_is_painted_while_nothing_changes(cockpit, opened):
    hover(cockpit, opened)
    before = stand_still(cockpit, opened)
    cockpit.call("pause", False)
    wait_until(opened, lambda: opened.evaluate("scene.canvas.frames") > before + 10)


@pytest.mark.parametrize("layer", ["shadows", "marks"])
def test_shadows_and_metre_marks_can_be_switched_on_and_off_without_a_gpu(cockpit, opened, layer):
    hover(cockpit, opened)
    stand_still(cockpit, opened)
    canvas, pictures = opened.locator("#scene canvas"), []
    for is_shown in ("false", "true", "false"):
        opened.evaluate(f"scene.show({{ {layer}: {is_shown}, labels: false }})")
        opened.evaluate(UNTIL_PAINTED)
        pictures.append(np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("L")).astype(int))
    without, shaded, again = pictures
    assert np.abs(without - again).max() < 3
    assert 100 < (np.abs(without - shaded) > 20).sum() < without.size / 4


def test_frames_glide_from_step_to_step_where_there_is_a_gpu(cockpit, opened):
    hover(cockpit, opened)
    stand_still(cockpit, opened)
    glide = """() => {
        const base = scene.tree.byName.get("base_link"), index = scene.tree.frames.indexOf(base);
        const told = { whole: false, gone: [], frames: [], moved: [index], placed: [], markers: [] };
        const go = (z) => scene.take(told, new Uint8Array(new Float32Array([0, 0, z, 0, 0, 0, 1]).buffer));
        go(1);
        scene.tree.smooth = 0.05;
        go(1.2);
        const [{ began }] = scene.tree.moving.values(), seen = [];
        for (const after of [0, 25, 50]) {
            seen.push(scene.tree.advance(began + after), base.position.z);
        }
        go(3);
        return [...seen, base.position.z];
    }"""
    assert opened.evaluate(glide) == pytest.approx([True, 1, True, 1.1, False, 1.2, 3], abs=1e-6), "far is at once"


def test_many_objects_are_painted_at_once(cockpit, opened, tmp_path):
    hover(cockpit, opened)
    places = [[2 + number // 20, number % 20 - 10, 0.1] for number in range(400)]
    look = "shape: box, size: [0.2, 0.2, 0.2], position"
    boxes = [f"  - {{name: B{number}, {look}: {place}}}" for number, place in enumerate(places)]
    scene = tmp_path / "many.yaml"
    scene.write_text("\n".join(["objects:", *boxes]))
    rospy.set_param("/drone_sim/scene_file", str(scene))
    cockpit.call("load_scene")
    there = "[...scene.tree.markers.values()].filter((one) => one.userData.said.layer === 'scene').length"
    wait_until(opened, lambda: opened.evaluate(there) >= 400)
    opened.evaluate(UNTIL_PAINTED)
    assert opened.evaluate("scene.canvas.renderer.info.render.calls") < 150
    opened.evaluate("scene.select('B30')")
    opened.evaluate(UNTIL_PAINTED)
    assert opened.evaluate("scene.selected") == "B30" and opened.evaluate("scene.outline.scene.children.length") == 9
    rospy.set_param("/drone_sim/scene_file", "")
    cockpit.call("load_scene")
    wait_until(opened, lambda: opened.evaluate(there) == 0)


def test_a_picture_and_a_video_of_the_scene(cockpit, opened):
    hover(cockpit, opened)
    shot = "scene.snapshot().then(blob => new Promise(done => { const reader = new FileReader(); "
    shot += "reader.onload = () => done(reader.result); reader.readAsDataURL(blob) }))"
    kind, _, content = opened.evaluate(shot).partition(",")
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(content))).convert("RGB"))
    box = opened.locator("#scene canvas").bounding_box()
    assert kind == "data:image/png;base64" and picture.shape[:2] == (round(box["height"]), round(box["width"]))
    assert picture.reshape(-1, 3).std(axis=0).min() > 10, "it is not empty"
    assert opened.evaluate("scene.stream().getVideoTracks().map(one => one.readyState)") == ["live"]
