"""How the mass of a shape lies in it, and of what form it is, as scripts tell and ask."""

import math

import numpy as np
import pytest

from drone_sim.mechanics import frames
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

SCENE = """
objects:
  - {name: Box, shape: box, size: [1, 2, 3], position: [5, 0, 4], rpy: [0, 0, 1.5707963267948966], mass: 2}
  - {name: Wall, shape: box, size: [1, 1, 1], position: [0, 9, 3]}
  - {name: Ball, shape: sphere, size: [0.2], position: [0, 7, 3], mass: 1}
  - {name: Bottle, shape: capsule, size: [0.1, 0.5], position: [0, 5, 3]}
  - name: Table
    shape: compound
    mass: 1
    position: [-5, 0, 3]
    parts: [{shape: box, size: [1, 1, 0.1]}, {shape: cylinder, size: [0.05, 0.8]}]
  - {name: Goal, kind: dummy, position: [0, 0, 9]}
"""
ALONG_WORLD = [2.0, 0.3, 0.1, 0.3, 3.0, 0.2, 0.1, 0.2, 4.0]  # kg m²


@pytest.fixture(name="simulation")
def _simulation(tmp_path, new_simulation):
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE)
    made = new_simulation({"scene_file": str(file)})
    return made


@pytest.fixture(name="sim")
def _sim(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def test_mass_and_inertia_are_told_in_the_world(simulation, sim):
    box = simulation.context.objects.handle("Box")
    assert sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [5.1, 0.2, 4]) == 1
    mass, inertia, centre = sim.getShapeMassAndInertia(box)
    assert (mass, inertia, centre) == (6, pytest.approx(ALONG_WORLD), pytest.approx([5.1, 0.2, 4]))


def test_mass_and_inertia_are_told_in_a_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    frame = sim.getObjectMatrix(box)
    sim.setShapeMassAndInertia(box, 6, ALONG_WORLD, [0.1, 0.2, 0.3], frame)
    _, inertia, centre = sim.getShapeMassAndInertia(box, frame)
    assert (inertia, centre) == (pytest.approx(ALONG_WORLD), pytest.approx([0.1, 0.2, 0.3]))


def test_an_inertia_is_told_in_the_shapes_frame(simulation, sim):
    box = simulation.context.objects.handle("Box")
    turned = frames.from_euler((0.0, 0.1, 0.0), (0.0, 0.0, math.pi / 2))
    sim.setShapeInertia(box, [2, 0, 0, 0, 3, 0, 0, 0, 4], turned)
    tensor, frame = sim.getShapeInertia(box)
    axes = np.reshape(frame, (3, 4))[:, :3]
    assert axes @ np.reshape(tensor, (3, 3)) @ axes.T == pytest.approx(np.diag([3, 2, 4]))
    assert frames.position(frame) == pytest.approx((0, 0.1, 0)) and sim.getShapeMass(box) == pytest.approx(2)


def test_what_stands_still_goes_on_to_stand_still(simulation, sim):
    wall = simulation.context.objects.handle("Wall")
    sim.setShapeMassAndInertia(wall, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 9, 3])
    for _ in range(5):
        simulation.step()
    assert sim.getObjectPosition(wall, -1) == pytest.approx([0, 9, 3])


def test_what_has_no_mass_of_its_own_has_no_inertia(simulation, sim):
    with pytest.raises(ValueError, match="'Wall' has no mass of its own"):
        sim.setShapeInertia(simulation.context.objects.handle("Wall"), [1, 0, 0, 0, 1, 0, 0, 0, 1], frames.IDENTITY)
    with pytest.raises(ValueError, match="is a part of a vehicle"):
        sim.setShapeMassAndInertia(
            simulation.context.objects.handle("Drone"), 1, [1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 0, 0]
        )


@pytest.mark.parametrize(
    ("name", "info"),
    [
        ("Box", (6, 3, [1, 2, 3, 0])),
        ("Ball", (6, 4, [0.4, 0.4, 0.4, 0])),
        ("Bottle", (6, 8, [0.2, 0.2, 0.7, 0])),
        ("Table", (3, 0, [0, 0, 0, 0])),
        ("Floor", (0, 0, [0, 0, 0, 0])),
    ],
)
def test_the_form_of_a_shape(simulation, sim, name, info):
    bits, form, size = sim.getShapeGeomInfo(simulation.context.objects.handle(name))
    assert (bits, form) == info[:2] and size == pytest.approx(info[2])


def test_what_is_no_shape_has_no_form(simulation, sim):
    with pytest.raises(TypeError, match="'Goal' is not a shape"):
        sim.getShapeGeomInfo(simulation.context.objects.handle("Goal"))
