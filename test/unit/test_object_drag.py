"""Objects of a scene that are held and dragged while the simulation runs."""

import math

import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import from_rpy

SCENE = """
floor: {size: 20}
drone: {position: [0, 0, 1]}
objects:
  - {name: Ball, shape: sphere, size: [0.15], position: [3, 0, 0.15], mass: 0.2}
  - {name: Table, shape: box, size: [1, 1, 0.1], position: [0, 3, 0.5]}
  - {name: Foot, shape: box, size: [0.1, 0.1, 0.4], parent: Table, position: [0, 0, -0.3]}
  - {name: Mark, kind: dummy, parent: Table, position: [0, 0, 1]}
  - {shape: box, size: [0.2, 0.2, 0.2], position: [-3, 0, 0.1], mass: 1}
  - {name: Cart, shape: box, size: [0.6, 0.2, 0.2], position: [0, -3, 0.1], mass: 1}
  - {name: Hinge, kind: joint, type: revolute, mode: passive, parent: Cart, position: [0, 0, 0.2], rpy: [1.57, 0, 0]}
  - {name: Rod, shape: box, size: [0.05, 0.4, 0.05], mass: 0.3, parent: Hinge, position: [0, 0.3, 0]}
  - {name: Nail, kind: joint, type: revolute, mode: passive, position: [5, 5, 2]}
  - {name: Sign, shape: box, size: [0.2, 0.2, 0.02], mass: 0.3, parent: Nail, position: [0, 0, 0.1]}
"""


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    return new_shared_simulation(scene=SCENE)


@pytest.fixture(name="drag")
def _drag(simulation):
    simulation.stop()
    simulation.load_scripts()
    return simulation.scene.drag


def place(simulation, name):
    return frames.position(simulation.scene.things()[name].matrix())


def run(simulation, steps):
    for _ in range(steps):
        simulation.step()


def at(*position, yaw=0.0):
    return from_rpy(position, (0, 0, yaw))


def near(place, tolerance=1e-6):
    return pytest.approx(place, abs=tolerance)


def test_a_held_object_stands_still_and_falls_when_released(simulation, drag):
    for name in ("Ball", "Cuboid"):
        drag.hold(name)
        drag.put(name, at(2, 2, 1.5, yaw=0.5))
        run(simulation, 10)
        assert place(simulation, name) == near((2, 2, 1.5))
        assert frames.to_rpy(simulation.scene.things()[name].matrix())[2] == pytest.approx(0.5)
        drag.let_go(name)
        run(simulation, 5)
        assert place(simulation, name)[2] == near(1.5 - 9.81 * 0.25**2 / 2, 0.03)


def test_children_move_with_a_dragged_object(simulation, drag):
    drag.put("Table", at(1, 4, 0.6, yaw=math.pi / 2))
    assert place(simulation, "Mark") == near((1, 4, 1.6))
    assert place(simulation, "Foot") == near((1, 4, 0.3))
    run(simulation, 2)
    assert place(simulation, "Foot") == near((1, 4, 0.3))
    drag.put("Foot", at(1, 4, 0.2))
    assert place(simulation, "Table") == near((1, 4, 0.6)), "the parent stays where it is"


def test_a_dragged_shape_pulls_the_shape_connected_by_its_joint(simulation, drag):
    x, y, z = place(simulation, "Rod")
    drag.hold("Rod")
    drag.put("Rod", at(x + 1, y, z + 1, yaw=0))
    run(simulation, 10)
    cart, rod = place(simulation, "Cart"), place(simulation, "Rod")
    assert math.dist(cart, rod) == pytest.approx(math.hypot(0.2, 0.3), abs=0.2) and cart[2] > 0.9
    drag.let_go("Rod")
    with pytest.raises(ValueError, match="'Sign' cannot be dragged"):
        drag.put("Sign", at(5, 5, 1))


def test_a_dragged_object_pushes_a_hovering_drone(simulation, drag):
    run(simulation, 20)
    before = simulation.drone.body.state.position
    for count in range(20):
        drag.hold("Ball")
        drag.put("Ball", at(-1 + 0.05 * count, 0, 1))
        run(simulation, 1)
    assert simulation.drone.body.state.position[0] > before[0] + 0.05


@pytest.mark.parametrize(
    "name, position, words",
    [
        ("Ball", (1e9, 0, 1), "position.x = 1e\\+09: must be from -10 to 10 m"),
        ("Ball", (0, -11, 1), "position.y = -11"),
        ("Ball", (0, 0, -0.1), "position.z = -0.1: must be from 0 to 20 m"),
        ("Ball", (math.nan, 0, 1), "position.x = nan"),
        ("Bal", (0, 0, 1), "no object named 'Bal'; near names are Ball"),
    ],
)
def test_dragging_to_an_invalid_position_is_refused(simulation, drag, name, position, words):
    before = place(simulation, "Ball")
    with pytest.raises(ValueError, match=words):
        drag.put(name, at(*position))
    assert place(simulation, "Ball") == before


def test_restoring_a_snapshot_and_stopping_release_a_held_object(simulation, drag):
    snapshot = simulation.snapshot()
    run(simulation, 3)
    expected = place(simulation, "Ball"), simulation.drone.body.state
    drag.hold("Ball")
    drag.put("Ball", at(0, 5, 3))
    simulation.restore(snapshot)
    run(simulation, 3)
    assert (place(simulation, "Ball"), simulation.drone.body.state) == expected, "to the last bit"
    drag.hold("Ball")
    drag.put("Ball", at(0, 5, 3))
    simulation.stop()
    assert not drag.held and place(simulation, "Ball") == near((3, 0, 0.15))
    drag.put("Ball", at(0, 5, 3))
    run(simulation, 3)
    assert place(simulation, "Ball")[2] < 2.95, "the ball has its mass again"


def test_an_object_made_static_by_a_script_stays_static(simulation, drag):
    ball = simulation.scene.things()["Ball"]
    drag.hold("Ball")
    ball.set_static(True)
    drag.let_go("Ball")
    drag.put("Ball", at(0, 5, 3))
    run(simulation, 3)
    assert place(simulation, "Ball") == near((0, 5, 3))
    ball.set_static(False)
    run(simulation, 5)
    assert place(simulation, "Ball")[2] < 2.95
    drag.let_go("Ball")
    drag.hold("Ball")
    drag.hold("Ball")
    drag.let_go("Ball")
    run(simulation, 3)
    assert place(simulation, "Ball")[2] < 2.7, "held twice and released once, the ball is free"


def test_every_visual_belongs_to_a_named_object(simulation):
    names = simulation.scene.visual_names()
    assert len(names) == len(simulation.scene.visuals()[0])
    assert {*names} == simulation.scene.things().keys() - {"Mark"}
