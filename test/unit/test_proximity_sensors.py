"""Proximity sensors of a scene: the nearest points in their volumes."""

import math

import pytest

from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

DOWN = "kind: proximity_sensor, rpy: [3.141592653589793, 0, 0]"
SCENE = f"""
objects:
  - {{name: Ray, {DOWN}, type: ray, range: 5, position: [5, 0, 3], offset: 0.5}}
  - {{name: Cone, {DOWN}, type: cone, range: 2.5, angle: 1.0, position: [10, 0, 3]}}
  - {{name: Pyramid, {DOWN}, type: pyramid, range: 2.5, angle: 1.0, position: [15, 0, 3]}}
  - {{name: Cylinder, {DOWN}, type: cylinder, range: 2.5, radius: 0.5, position: [20, 0, 3]}}
  - {{name: Disc, {DOWN}, type: disc, range: 2.5, angle: 1.0, position: [25, 0, 3]}}
  - {{name: Thin, {DOWN}, type: cone, range: 2.5, angle: 1.0, position: [30, 0, 3]}}
  - {{name: Under, {DOWN}, type: ray, range: 5, parent: Quadricopter_base}}
  - {{name: RayBox, shape: box, size: [1, 1, 1], position: [5, 0, 0.5]}}
  - {{name: ConeBall, shape: sphere, size: [0.2], position: [10.5, 0.3, 1.5]}}
  - {{name: PyramidBall, shape: sphere, size: [0.2], position: [15.4, 0.4, 1.5]}}
  - {{name: CylinderBall, shape: sphere, size: [0.2], position: [20.3, 0.3, 1.5]}}
  - {{name: DiscBall, shape: sphere, size: [0.2], position: [25.3, 0.1, 1.5]}}
  - {{name: Needle, shape: sphere, size: [0.003], position: [30.17, 0.13, 1.2]}}
  - {{name: Ghost, shape: box, size: [1, 1, 1], position: [5, 0, 2], respondable: false}}
"""


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    return new_shared_simulation(steps=1, scene=SCENE)


@pytest.fixture(name="sim")
def _sim(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def test_a_ray_sensor_measures_exactly(simulation, sim):
    handle = simulation.context.objects.handle
    state, distance, point, met, normal = sim.readProximitySensor(handle("Ray"))
    assert (state, met) == (1, handle("RayBox"))
    assert distance == pytest.approx(2, abs=1e-3) and point == pytest.approx([0, 0, 2], abs=1e-3)
    assert normal == pytest.approx([0, 0, -1], abs=1e-3)


def test_a_sensor_detects_the_objects_of_a_collection(sim):
    ray, boxes = sim.getObject("/Ray"), sim.createCollection(0)
    assert sim.checkProximitySensor(ray, boxes)[0] == 0, "the collection is empty"
    sim.addItemToCollection(boxes, sim.handle_all, -1, 0)
    assert sim.checkProximitySensor(ray, boxes) == sim.readProximitySensor(ray)
    sim.addItemToCollection(boxes, sim.handle_single, sim.getObject("/RayBox"), 1)
    state, distance, _, met, _ = sim.checkProximitySensor(ray, boxes)
    assert (state, met) == (1, sim.getObject("/Floor")) and distance == pytest.approx(3, abs=1e-3)


def test_a_sensor_detects_only_the_entity_that_is_set(simulation, sim):
    ray, obstacles = sim.getObject("/Ray"), sim.createCollection(0)
    assert sim.getObjectInt32Param(ray, sim.proxintparam_entity_to_detect) == sim.handle_all
    sim.addItemToCollection(obstacles, sim.handle_all, -1, 0)
    sim.addItemToCollection(obstacles, sim.handle_tree, sim.getObject("/RayBox"), 1)
    before = simulation.snapshot()
    sim.setObjectInt32Param(ray, sim.proxintparam_entity_to_detect, obstacles)
    assert sim.getObjectInt32Param(ray, sim.proxintparam_entity_to_detect) == obstacles
    assert sim.readProximitySensor(ray)[3] == sim.handleProximitySensor(ray)[3] == sim.getObject("/Floor")
    assert sim.checkProximitySensor(ray, sim.handle_all)[3] == sim.getObject("/RayBox"), "the argument has priority"
    with pytest.raises(ValueError, match="no object with the handle 4711"):
        sim.setObjectInt32Param(ray, sim.proxintparam_entity_to_detect, 4711)
    simulation.restore(before)
    assert sim.readProximitySensor(ray)[3] == sim.getObject("/RayBox")


def nearest_on_ball(x, y, z):
    """Return distance and position of the point nearest to the sensor on a ball of 0.2 m radius at x, y, z."""
    length = math.hypot(x, y, z)
    return length - 0.2, [one * (length - 0.2) / length for one in (x, y, z)]


@pytest.mark.parametrize(
    "name, centre, tolerance",
    [("Cone", (0.5, -0.3, 1.5), 1e-3), ("Pyramid", (0.4, -0.4, 1.5), 1e-3), ("Cylinder", (0.3, -0.3, 1.5), 1e-3)],
)
def test_a_volume_sensor_returns_the_nearest_point(simulation, sim, name, centre, tolerance):
    handle = simulation.context.objects.handle
    state, distance, point, met, _ = sim.readProximitySensor(handle(name))
    expected, expected_point = nearest_on_ball(*centre)
    assert (state, met) == (1, handle(f"{name}Ball"))
    assert distance == pytest.approx(expected, abs=tolerance) and point == pytest.approx(expected_point, abs=0.01)


def test_a_disc_sensor_has_no_thickness(simulation, sim):
    state, distance, point, *_ = sim.readProximitySensor(simulation.context.objects.handle("Disc"))
    radius = math.sqrt(0.2**2 - 0.1**2)  # of the ball's section in the plane of the disc
    assert state == 1 and point[1] == pytest.approx(0, abs=1e-6)
    assert distance == pytest.approx(math.hypot(0.3, 1.5) - radius, abs=1e-3)


def test_an_object_thinner_than_the_gaps_between_rays_is_detected(simulation, sim):
    handle = simulation.context.objects.handle
    state, distance, _, met, _ = sim.readProximitySensor(handle("Thin"))
    assert (state, met) == (1, handle("Needle"))
    assert distance == pytest.approx(math.hypot(0.17, 0.13, 1.8) - 0.003, abs=1e-3)


def test_a_check_for_one_object_and_with_a_distance_threshold(simulation, sim):
    handle = simulation.context.objects.handle
    ray, box = handle("Ray"), handle("RayBox")
    assert sim.checkProximitySensor(ray, handle("Floor"))[:2] == (1, pytest.approx(3, abs=1e-3))
    assert sim.checkProximitySensor(ray, handle("Needle"))[0] == 0
    assert sim.checkProximitySensor(ray, -2)[3] == box
    assert sim.checkProximitySensorEx(ray, box, 0, 1.0, 0)[0] == 0
    assert sim.handleProximitySensor(-3)[0] == 1
    assert sim.handleProximitySensor(ray) == sim.readProximitySensor(ray)
    sim.resetProximitySensor(ray)
    with pytest.raises(TypeError, match="'Floor' is neither a range sensor"):
        sim.readProximitySensor(handle("Floor"))


def test_a_sensor_does_not_detect_its_own_vehicle(simulation, sim):
    handle = simulation.context.objects.handle
    state, distance, _, met, _ = sim.readProximitySensor(handle("Under"))
    assert (state, met) == (1, handle("Floor"))
    assert distance == pytest.approx(simulation.drone.body.state.position[2] - 0.01, abs=1e-3)
