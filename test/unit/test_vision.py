"""Cameras in a simulation, with OpenGL and without."""

import os
import subprocess
import sys

import numpy as np
import pytest

from drone_sim.files.resources import package_path
from drone_sim.hosting.child_scripts import services
from drone_sim.mechanics.state import Pose
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.modules import make_sim
from drone_sim.scripting.time_limit import TimeLimit

SCENE = {
    "scene": {"objects": [{"shape": "box", "size": [0.5, 0.5, 0.5], "position": [2, 0, 0.8], "color": [1, 0, 0, 1]}]}
}

SOURCE = os.pathsep.join(path for path in sys.path if path)
PICTURE = """
import logging, sys
import numpy as np
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.mechanics.state import Pose
logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(message)s")
simulation = Simulation(parameters.load({scene!r}))
pictures = {{name: simulation.drone.cameras[name].take() for name in ("front", "depth", "front", "depth")}}
np.savez(sys.argv[1], **pictures)
simulation.close()
"""


def pictures_of_a_process(folder, **environment):
    file = folder / "pictures.npz"
    command = [sys.executable, "-c", PICTURE.format(scene=SCENE), str(file)]
    completed = subprocess.run(
        command,
        env={**os.environ, "PYTHONPATH": SOURCE, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )
    assert completed.returncode == 0, completed.stderr
    return dict(np.load(file)), completed.stderr


def red(picture):
    picture = picture.astype(int)
    return (picture[:, :, 0] > 2 * picture[:, :, 1]) & (picture[:, :, 0] > 2 * picture[:, :, 2])


def test_without_egl_pybullet_draws_the_same_view_after_one_warning(tmp_path):
    # glvnd reads its vendors from this list; an empty list is like a machine without EGL.
    rendered, warnings = pictures_of_a_process(tmp_path, __EGL_VENDOR_LIBRARY_FILENAMES="/dev/null")
    assert warnings.count("WARNING") == 1, warnings
    assert "TinyRenderer" in warnings
    expected, quiet = pictures_of_a_process(tmp_path)
    assert "WARNING" not in quiet
    ours, theirs = red(expected["front"]), red(rendered["front"])
    assert (ours & theirs).sum() / (ours | theirs).sum() > 0.98
    both = ours & theirs
    assert rendered["depth"][both] == pytest.approx(expected["depth"][both], abs=0.02)
    assert np.isnan(rendered["depth"][0]).all()


def test_pictures_are_taken_only_while_there_is_a_viewer(new_simulation):
    simulation = new_simulation()
    front = simulation.drone.cameras["front"]
    simulation.step()
    assert front.image is None
    front.viewers.add(lambda: True)
    simulation.step()
    assert front.image.shape == (480, 640, 3)
    front.viewers.clear()
    simulation.step()
    assert front.image is None


def test_front_camera_does_not_see_its_own_vehicle(new_simulation):
    simulation = new_simulation()
    depth = simulation.drone.cameras["depth"].take()
    assert np.nanmin(depth) > 0.5


def test_an_unknown_parent_of_a_camera_is_named():
    wrong = {"cameras": {"track": {"mount": {"parent": "Nobody"}}}}
    with pytest.raises(parameters.ParameterError, match="no object is named Nobody"):
        Simulation(parameters.load(wrong))


def test_the_track_camera_stays_level_while_its_parent_is_the_track_frame(new_simulation):
    level = {}
    for parent in ("Track_base", "Quadricopter_base"):
        simulation = new_simulation({"cameras": {"track": {"mount": {"parent": parent}}}})
        simulation.drone.body.move(simulation.drone.body.state._replace(orientation=(0.2, 0.0, 0.0, 0.98)))
        simulation.step()
        x_axis_height = simulation.drone.cameras["track"].pose()[8]  # z of the optical x axis in the world
        level[parent] = abs(x_axis_height) < 1e-6
    assert level == {"Track_base": True, "Quadricopter_base": False}


SCRIPT = """
import numpy as np
def sysCall_init():
    self.camera = sim.getObject('/FrontVision')
    sim.setStringSignal('init', sim.getVisionSensorCharImage(self.camera)[0])
def sysCall_sensing():
    sim.setStringSignal('sensing', sim.getVisionSensorCharImage(self.camera)[0])
"""
SMALL = {"cameras": {"front": {"width": 32, "height": 24}}, **SCENE}


def as_script(picture):
    return picture[::-1].tobytes()  # the bottom row first


@pytest.fixture(name="simulation")
def _simulation(new_simulation):
    return new_simulation(SMALL, python=SCRIPT)


def test_a_camera_image_shows_the_current_scene(simulation):
    front = simulation.drone.cameras["front"]
    front.viewers.add(lambda: True)
    first = front.take()
    assert simulation.context.signals.get(str, "init") == as_script(first)
    simulation.drone.body.move(Pose((-3, 0, 2)))
    simulation.look()
    moved = front.image
    assert np.array_equal(moved, front.take()) and not np.array_equal(moved, first)
    snapshot = simulation.snapshot()
    simulation.step()
    after_step = front.image
    assert simulation.context.signals.get(str, "sensing") == as_script(after_step)
    assert np.array_equal(after_step, front.take()) and not np.array_equal(after_step, moved)
    simulation.restore(snapshot)
    simulation.look()
    assert np.array_equal(front.image, moved)
    simulation.stop()
    simulation.look()
    assert np.array_equal(front.image, first)
    simulation.start()
    assert simulation.context.signals.get(str, "init") == as_script(first)


def test_camera_sees_another_scene_immediately(simulation, tmp_path):
    front = simulation.drone.cameras["front"]
    first = front.look()
    (tmp_path / "scene.yaml").write_text("objects: [{shape: box, size: [1, 1, 1], position: [3, 0, 0.8]}]")
    simulation.start(str(tmp_path / "scene.yaml"))
    now = simulation.context.signals.get(str, "init")
    assert now == as_script(front.take()) != as_script(first)


def test_unchanged_view_is_not_rendered_again(simulation):
    front = simulation.drone.cameras["front"]
    assert front.look() is front.look()
    simulation.drone.body.move(Pose((0, 0, 1)))
    assert front.look() is not None
    cached = front.look()
    simulation.look()
    assert front.look() is cached
    objects = simulation.context.objects
    camera = objects[objects.handle("FrontVision")]
    camera_matrix = camera.matrix()
    camera.put((*camera_matrix[:3], camera_matrix[3] + 0.5, *camera_matrix[4:]))  # a script moves the camera
    assert not np.array_equal(front.look(), cached)


def depths_and_colours(sim, handle):
    image, size = sim.getVisionSensorImg(handle)
    depth, _ = sim.getVisionSensorDepth(handle, 1)
    return np.frombuffer(image, np.uint8).reshape(*size[::-1], 3), np.frombuffer(depth, "<f4").reshape(size[::-1])


def test_every_vision_sensor_returns_colours_and_depths(new_simulation):
    eye = {
        "name": "Eye",
        "kind": "vision_sensor",
        "position": [0.3, 0, 0.8],
        "rpy": [np.pi / 2, 0, np.pi / 2],
        "width": 64,
    }
    simulation = new_simulation({"scene": {"objects": [*SCENE["scene"]["objects"], {**eye, "height": 48}]}})
    scene_services = services([simulation.drone], simulation.context, simulation.operations, TimeLimit(0.0), Turns())
    sim = make_sim(simulation.child_scripts["drone"], scene_services)
    for name in ("FrontVision", "DepthVision", "Eye"):
        handle = sim.getObjectHandle(name)
        colours, depths = depths_and_colours(sim, handle)
        box = red(colours)
        assert box.sum() > 20 and box[box.shape[0] // 2, box.shape[1] // 2]
        near = depths[box].min()
        assert 1.4 < near < 1.8 and depths[box].max() < near + 0.01
        assert np.isinf(depths[-1]).all(), "the sky has no depth"
        _, values, _ = sim.readVisionSensor(handle)
        assert values[4] == pytest.approx(sim.getVisionSensorDepthBuffer(handle)[depths.argmin()])
        assert values[6] > 0.5, "the maximum of red"


LARGE = """
function sysCall_init()
    local eye = sim.getObject('/Eye')
    local image = sim.getVisionSensorImage(eye)
    local depth = sim.getVisionSensorDepthBuffer(eye)
    sim.setInt32Signal('numbers', #image)
    sim.setInt32Signal('depths', #depth)
    sim.setInt32Signal('bytes', #sim.getVisionSensorImg(eye))
    sim.setInt32Signal('packed', #sim.packTable({image = image}))
end
"""


def test_lua_receives_the_image_of_a_large_sensor_as_numbers(new_simulation):
    eye = {"name": "Eye", "kind": "vision_sensor", "width": 640, "height": 560}  # more than a million numbers
    signals = new_simulation({"scene": {"objects": [eye]}, "script_time_limit": 0.0}, lua=LARGE).context.signals
    numbers = [signals.get(int, name) for name in ("numbers", "depths", "bytes")]
    assert numbers == [3 * 640 * 560, 640 * 560, 3 * 640 * 560]


@pytest.mark.parametrize(("width", "height"), [(80, 40), (40, 80), (80, 80)])
def test_field_of_view_applies_to_the_larger_side(new_simulation, width, height):
    down = {"position": [9, 9, 3], "rpy": [np.pi, 0, 0], "fov": np.pi / 2, "width": width, "height": height}
    eye = {"name": "Eye", "kind": "vision_sensor", **down}
    box = {"name": "Box", "shape": "box", "size": [0.5, 0.5, 1], "position": [9, 9, 0.5]}  # 2 m below the sensor
    simulation = new_simulation({"scene": {"objects": [eye, box]}})
    tree = simulation.context.objects
    is_box = tree[tree.resolve("Eye")].picture("handles") == tree.resolve("Box")
    assert is_box.any(axis=0).sum() == is_box.any(axis=1).sum() == 10  # 80 px are 4 m there


def test_right_stereo_camera_projects_points_given_in_the_left_cameras_frame(new_simulation):
    simulation = new_simulation({"config": str(package_path() / "config" / "stereo.yaml")})
    left, right = (simulation.drone.cameras[name] for name in ("left", "right"))
    point = np.array([0.3, -0.2, 2.0, 1.0])  # m, in the frame of the left camera
    poses = [np.reshape((*one.pose(), 0, 0, 0, 1), (4, 4)) for one in (left, right)]
    own = np.linalg.inv(poses[1]) @ poses[0] @ point
    u, v, w = np.reshape(right.intrinsics.P, (3, 4)) @ point
    np.testing.assert_allclose((u / w, v / w), right.intrinsics.project(own[:3]), atol=1e-9)
    assert left.intrinsics.P[3] == 0
