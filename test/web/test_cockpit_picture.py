"""The cockpit's picture of the scene: the drone's position, pushes, views, and when it is painted."""

import base64
import io

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
import trimesh
from cockpit_page import Panel, let_time_pass, open_page, wait_until
from geometry_msgs.msg import WrenchStamped
from PIL import Image
from visualization_msgs.msg import Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

# Only sky is behind the drone from this point of view.
EYE, AIM, FOV = np.array((1.0, -2.2, 0.1)), np.array((1.0, 0.0, 0.9)), np.radians(50)  # m, m, rad
STEP = 0.05  # s
SEARCH_RADIUS = 12  # px each way


POINTS = {  # of the drone's parts, which are convex; other markers have points
    Marker.SPHERE: trimesh.creation.icosphere(3, 0.5).vertices,
    Marker.CYLINDER: trimesh.creation.cylinder(0.5, 1.0).vertices,
}


def size(marker):
    return marker.scale.x, marker.scale.y, marker.scale.z


def transform(points, pose):
    """Transform points from the frame with this pose to its parent frame."""
    at, turn = pose.position, pose.orientation
    matrix = np.reshape(frames.from_quaternion((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)), (3, 4))
    return points @ matrix[:, :3].T + matrix[:, 3]


# Set the camera of a page, as pan and zoom do for a user.
SET_CAMERA = """([center, yaw, pitch, far]) => {
    scene.look("free");
    Object.assign(scene.view, { yaw, pitch, zoom: far });
    scene.view.center.set(...center);
    scene.show({ labels: false, path: false, command: false, handles: false });
}"""
UNTIL_PAINTED = "new Promise(done => scene.canvas.then(done))"
# Add the camera frame of a vehicle that was removed.
ADD_STALE_FRAME = """name => {
    scene.tree.hang(scene.tree.frames.length, name, -1);
    scene.sort();
}"""
# Return the world positions of the camera, the drone and its label in the last painted picture.
PLACES = """(() => {
    const at = (one) => [...one.matrixWorld.elements].slice(12, 15);
    const label = [...scene.tree.markers.values()].find((one) => one.userData.said.layer === "view/state");
    const track = scene.tree.byName.get("Track_base");
    const ahead = [...track.matrixWorld.elements].slice(0, 3);
    return { eye: at(scene.camera), drone: at(scene.tree.byName.get("base_link")), label: at(label), ahead };
})()"""


class Picture:
    """The scene, seen by a camera with a known pose."""

    def __init__(self, page):
        self.page = page
        wait_until(
            page, lambda: not page.evaluate("scene.isUnframed")
        )  # the page frames the drone once, if its view is free
        page.click("#toggle")  # without the editor, the scene is wide
        ahead = AIM - EYE
        distance = np.linalg.norm(ahead)
        yaw, pitch = np.arctan2(ahead[1], ahead[0]), np.arcsin(-ahead[2] / distance)
        page.evaluate(SET_CAMERA, [AIM.tolist(), float(yaw), float(pitch), float(distance)])
        self.canvas = page.locator("#scene canvas")
        self.bodies = rospy.wait_for_message("/drone/view/bodies", MarkerArray, 30).markers

    def project(self, points):
        """Project points of the world to the canvas, px from its top left."""
        box = self.canvas.bounding_box()
        ahead = (AIM - EYE) / np.linalg.norm(AIM - EYE)
        right = np.cross(ahead, (0, 0, 1)) / np.linalg.norm(np.cross(ahead, (0, 0, 1)))
        seen = (np.asarray(points) - EYE) @ np.array((right, np.cross(ahead, right), ahead)).T
        focal = box["height"] / 2 / np.tan(FOV / 2)
        return focal * seen[:, :2] / seen[:, 2:] + (box["width"] / 2, box["height"] / 2)

    def expected(self, pose):
        """Return the mask of the drone's body at an odometry pose, without its blades, which turn."""
        mask = np.zeros(self.look().shape[:2], np.uint8)
        for marker in (one for one in self.bodies if one.header.frame_id == "base_link"):
            points = POINTS.get(marker.type, np.array([(one.x, one.y, one.z) for one in marker.points]))
            corners = self.project(transform(transform(points * size(marker), marker.pose), pose))
            cv2.fillConvexPoly(mask, cv2.convexHull(np.floor(corners).astype(np.int32)), 1)
        return mask.astype(bool)

    def look(self):
        self.page.evaluate(UNTIL_PAINTED)
        return np.asarray(Image.open(io.BytesIO(self.canvas.screenshot())).convert("RGB")).astype(int)

    def seen(self):
        """Return the mask of the pixels that differ from the sky, whose colour is constant in a row."""
        picture = self.look()
        sky = np.median(picture[:, -40:], axis=1, keepdims=True)
        return np.abs(picture - sky).max(axis=2) > 25

    def measure_offset(self, pose):
        """Return the drone's offset in the picture from its expected pixels (right, down); nan if it is not found."""
        expected, seen = self.expected(pose), self.seen()
        assert expected.sum() > 100, "the drone is out of sight"
        scores = {
            (right, down): (np.roll(expected, (down, right), (0, 1)) & seen).sum() / expected.sum()
            for right in range(-SEARCH_RADIUS, SEARCH_RADIUS + 1)
            for down in range(-SEARCH_RADIUS, SEARCH_RADIUS + 1)
        }
        best = max(scores.values())
        if best < 0.85 or min(scores.values()) > 0.6:
            return np.array((np.nan, np.nan))
        return np.mean([shift for shift, score in scores.items() if score == best], axis=0)


@pytest.fixture(name="picture")
def _picture(opened):
    return Picture(opened)


def is_drawn_at_odometry(cockpit, picture):
    """Return whether the paused drone is drawn at its odometry pose; the picture may lag behind the odometry."""
    return np.abs(picture.measure_offset(cockpit.drone.pose)).max() < 2  # px


def flight_steps(drone):
    """Return the commands and places of the steps that moved the drone, in their order."""
    steps = [drone.flight_steps[stamp] for stamp in sorted(drone.flight_steps)]
    whole = [(one["command"], one["place"]) for one in steps if len(one) == 2]
    return [step for before, step in zip([None, *whole], whole) if before is None or before[1] != step[1]]


def fly_without_ros(steps):
    """Fly the same commands without ROS, from the step that reaches the first place; return the places."""
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


def test_a_key_held_for_2_s_flies_as_the_same_commands_without_ros(cockpit, picture):
    page, drone = picture.page, cockpit.drone
    wait_until(page, lambda: abs(drone.velocity.z) < 0.01 and drone.place[2] > 0.5)
    cockpit.call("pause", True)
    wait_until(page, lambda: is_drawn_at_odometry(cockpit, picture))
    before = drone.place
    cockpit.call("stop")
    drone.flight_steps.clear()  # of the paused flight, of which no message is still in transit
    cockpit.call("start")
    wait_until(page, lambda: flight_steps(drone))  # the comparison needs a step before the first one with the key
    assert flight_steps(drone)[0][0] == (0.0, 0.0, 0.0, 0.0)
    page.locator("#command").click()
    page.keyboard.down("w")
    wait_until(page, lambda: sum(command[0] == 1.0 for command, _ in flight_steps(drone)) >= 2 / STEP)
    page.keyboard.up("w")
    wait_until(page, lambda: drone.command == (0.0, 0.0, 0.0))
    steps = flight_steps(drone)
    cockpit.call("pause", True)
    places = np.array([place for _, place in steps])
    # After 2 s; later the velocity swings below the command for a while.
    *_, before_last, last = [place for command, place in steps if command[0] == 1.0][: round(2 / STEP)]
    assert (last[0] - before_last[0]) / STEP > 0.9
    assert np.abs(fly_without_ros(steps) - places).max() < 1e-9
    assert places[-1][0] - places[0][0] > 1.2
    wait_until(page, lambda: is_drawn_at_odometry(cockpit, picture))
    assert np.abs(picture.project([drone.place]) - picture.project([before])).max() > 100


def test_a_click_on_the_drone_pushes_it_away_from_the_camera(cockpit, picture):
    cockpit.call("pause", True)
    wrenches = []
    pushes = rospy.Subscriber("/drone/push", WrenchStamped, wrenches.append)
    wait_until(picture.page, lambda: is_drawn_at_odometry(cockpit, picture))
    box, (across, down) = picture.canvas.bounding_box(), picture.project([cockpit.drone.place])[0]
    picture.page.mouse.click(box["x"] + across, box["y"] + down)
    wait_until(picture.page, lambda: wrenches)
    let_time_pass(picture.page, 600)
    picture.page.mouse.dblclick(box["x"] + across, box["y"] + down)  # the drone is selected; a double click frames it
    wait_until(picture.page, lambda: len(wrenches) > 1)
    let_time_pass(picture.page, 600)
    assert len(wrenches) == 2, "a double click is one push"
    pushes.unregister()
    force = wrenches[0].wrench.force
    direction = np.subtract(cockpit.drone.place, EYE)
    assert np.allclose((force.x, force.y, force.z), 0.5 * direction / np.linalg.norm(direction), atol=0.01)
    cockpit.call("pause", False)
    wait_until(picture.page, lambda: cockpit.drone.velocity.y > 0.05)


def hover(cockpit, page):
    wait_until(page, lambda: cockpit.drone.place[2] > 0.75 and abs(cockpit.drone.velocity.z) < 0.05)
    expression = "scene.bodies?.has('drone') && scene.tree.byName.has('Track_base')"
    label = "[...scene.tree.markers.values()].some((one) => one.userData.said.layer === 'view/state')"
    wait_until(page, lambda: page.evaluate(f"{expression} && {label}"))


def drag(page, right, down, button="left"):
    box = page.locator("#scene canvas").bounding_box()
    x, y = box["x"] + 0.2 * box["width"], box["y"] + 0.8 * box["height"]  # here is only floor
    page.mouse.move(x, y)
    page.mouse.down(button=button)
    page.mouse.move(x + right, y + down, steps=4)
    page.mouse.up(button=button)
    page.evaluate(UNTIL_PAINTED)


def camera_offset(places):
    """Return the camera's position in the drone's level frame: ahead, left, up."""
    difference = np.subtract(places["eye"], places["drone"])
    x, y = np.array(places["ahead"])[:2] / np.linalg.norm(places["ahead"][:2])
    return np.array((difference[0] * x + difference[1] * y, difference[1] * x - difference[0] * y, difference[2]))


def test_the_view_begins_close_behind_the_drone_and_follows_it(cockpit, opened):
    hover(cockpit, opened)
    before = camera_offset(opened.evaluate(PLACES))
    assert before[0] < -0.5 and abs(before[1]) < 0.05 and before[2] > 0.1, "behind and above the drone"
    assert np.linalg.norm(before) < 1.5, "the camera is near"
    drag(opened, 150, 0)
    orbited = camera_offset(opened.evaluate(PLACES))
    assert abs(orbited[1]) > 0.3 and np.linalg.norm(orbited) == pytest.approx(np.linalg.norm(before), abs=0.05)
    opened.mouse.wheel(0, 300)
    opened.evaluate(UNTIL_PAINTED)
    farther = camera_offset(opened.evaluate(PLACES))
    assert np.linalg.norm(farther) > 1.2 * np.linalg.norm(orbited)
    opened.keyboard.down("w")
    wait_until(opened, lambda: cockpit.drone.velocity.x > 0.8)
    opened.evaluate(UNTIL_PAINTED)
    places = opened.evaluate(PLACES)
    opened.keyboard.up("w")
    assert np.allclose(camera_offset(places), farther, atol=0.05), "the same view in flight"
    assert opened.evaluate("scene.view.name") == "behind"
    opened.keyboard.press("Home")
    opened.evaluate(UNTIL_PAINTED)
    assert np.allclose(camera_offset(opened.evaluate(PLACES)), before, atol=0.05)


def test_the_drones_label_does_not_lag_behind_it(cockpit, opened):
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
    assert np.abs(np.subtract(offsets[1:], offsets[0])).max() < 0.03  # m, since the drone tilts
    assert seen[-1]["drone"][0] > seen[0]["drone"][0]


def test_a_camera_view_begins_at_the_camera_and_a_drag_frees_it(cockpit, opened):
    hover(cockpit, opened)
    views = ["behind", "free", "floor_optical", "front_optical", "track_optical"]
    assert opened.evaluate("scene.views") == views
    opened.evaluate(ADD_STALE_FRAME, "other/front_optical")
    assert opened.evaluate("scene.views") == views, "frames of a removed vehicle are no views"
    opened.evaluate("scene.look('front_optical')")
    opened.evaluate(UNTIL_PAINTED)
    places = opened.evaluate(PLACES)
    assert np.linalg.norm(np.subtract(places["eye"], places["drone"])) < 0.2
    drag(opened, 60, 0)
    assert opened.evaluate("scene.view.name") == "free"
    drag(opened, 60, 30, button="right")
    assert np.linalg.norm(np.subtract(opened.evaluate(PLACES)["eye"], places["eye"])) > 0.05


# Return whether a point is in the picture, and near enough to be visible.
IN_SIGHT = """point => {
    const at = scene.camera.position.clone().set(...point), far = at.distanceTo(scene.camera.position);
    const { x, y, z } = at.project(scene.camera);
    return Math.max(Math.abs(x), Math.abs(y)) < 0.9 && z < 1 && far < 10;
}"""


def test_each_browser_has_its_own_view_which_survives_a_reload(cockpit, browser, opened):
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


def pause_painting(cockpit, page):
    """Pause, and wait until nothing is painted any more, not even the status; return the number of pictures."""

    def is_still():
        before = page.evaluate("scene.canvas.frames")
        let_time_pass(page, 1000)
        return page.evaluate("scene.canvas.frames") - before <= 1

    cockpit.call("pause", True)
    wait_until(page, lambda: Panel(page).status == "paused")
    wait_until(page, is_still)
    return page.evaluate("scene.canvas.frames")


def test_nothing_is_painted_while_nothing_changes(cockpit, opened):
    hover(cockpit, opened)
    opened.evaluate("scene.look('free'); scene.view.hold(); scene.view.letGo()")  # as a drag does
    before = pause_painting(cockpit, opened)
    cockpit.call("pause", False)
    wait_until(opened, lambda: opened.evaluate("scene.canvas.frames") > before + 10)


@pytest.mark.parametrize("layer", ["shadows", "marks"])
def test_shadows_and_metre_marks_can_be_switched_on_and_off_without_a_gpu(cockpit, opened, layer):
    hover(cockpit, opened)
    pause_painting(cockpit, opened)
    canvas, pictures = opened.locator("#scene canvas"), []
    for is_shown in ("false", "true", "false"):
        opened.evaluate(f"scene.show({{ {layer}: {is_shown}, labels: false }})")
        opened.evaluate(UNTIL_PAINTED)
        pictures.append(np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("L")).astype(int))
    without, shaded, again = pictures
    assert np.abs(without - again).max() < 3
    assert 100 < (np.abs(without - shaded) > 20).sum() < without.size / 4


def test_frames_are_interpolated_between_steps_as_with_a_gpu(cockpit, opened):
    hover(cockpit, opened)
    pause_painting(cockpit, opened)
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
    assert opened.evaluate(glide) == pytest.approx([True, 1, True, 1.1, False, 1.2, 3], abs=1e-6), "long moves jump"


def test_many_objects_are_painted_with_few_draw_calls(cockpit, opened, tmp_path):
    hover(cockpit, opened)
    places = [[2 + number // 20, number % 20 - 10, 0.1] for number in range(400)]
    look = "shape: box, size: [0.2, 0.2, 0.2], position"
    boxes = [f"  - {{name: B{number}, {look}: {place}}}" for number, place in enumerate(places)]
    scene = tmp_path / "many.yaml"
    scene.write_text("\n".join(["objects:", *boxes]))
    rospy.set_param("/drone_sim/scene_file", str(scene))
    cockpit.call("load_scene")
    expression = "[...scene.tree.markers.values()].filter((one) => one.userData.said.layer === 'scene').length"
    wait_until(opened, lambda: opened.evaluate(expression) >= 400)
    opened.evaluate(UNTIL_PAINTED)
    assert opened.evaluate("scene.canvas.renderer.info.render.calls") < 150
    opened.evaluate("scene.select('B30')")
    opened.evaluate(UNTIL_PAINTED)
    assert opened.evaluate("scene.selected") == "B30" and opened.evaluate("scene.outline.scene.children.length") == 9
    rospy.set_param("/drone_sim/scene_file", "")
    cockpit.call("load_scene")
    wait_until(opened, lambda: opened.evaluate(expression) == 0)


def test_the_scene_can_be_saved_as_a_picture_and_as_a_video(cockpit, opened):
    hover(cockpit, opened)
    shot = "scene.snapshot().then(blob => new Promise(done => { const reader = new FileReader(); "
    shot += "reader.onload = () => done(reader.result); reader.readAsDataURL(blob) }))"
    kind, _, content = opened.evaluate(shot).partition(",")
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(content))).convert("RGB"))
    box = opened.locator("#scene canvas").bounding_box()
    assert kind == "data:image/png;base64" and picture.shape[:2] == (round(box["height"]), round(box["width"]))
    assert picture.reshape(-1, 3).std(axis=0).min() > 10, "the picture is not empty"
    assert opened.evaluate("scene.stream().getVideoTracks().map(one => one.readyState)") == ["live"]
