"""Objects that are added, removed and changed while the simulation runs or is stopped: no leaks, stop restores them."""

import math

import numpy as np
import pybullet
import pytest
import yaml
from living import KINDS, SCENE, picture, sizes

TIMES = 20


def simulate_with(build):
    """Return a function that builds the scene with a script that does nothing."""
    values = {"drone": {"position": [0.0, 0.0, 2.0]}, "script_time_limit": 0.0}
    idle_script = "def sysCall_init(): pass\n"
    return lambda **options: build(values, scene=yaml.safe_dump(SCENE), python=idle_script, **options)


@pytest.fixture
def simulate(new_simulation):
    return simulate_with(new_simulation)


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    return simulate_with(new_shared_simulation)(started=False)


def apply_all_operations(operations, tree, kind):
    """Add an object and apply every operation to it; return the handles to remove."""
    (handle,) = operations.add([{"name": "New", "position": [8.0, 0.0, 3.0], **kind}])
    operations.rename(handle, "Renamed")
    operations.set_alias(handle, "alias")
    operations.set_parent(handle, tree.handle("Post"), True)
    copies = operations.copy([handle])
    if "shape" in kind:
        operations.paint(handle, (1.0, 0.0, 0.0, None))
        operations.change(handle, mass=2.0)
    operations.scale([handle, *copies], (2.0, 2.0, 2.0), True)
    operations.set_parent(handle, -1, False)
    return [handle, *copies]


@pytest.mark.parametrize("started", [True, False], ids=["running", "stopped"])
def test_nothing_leaks(simulate, started):
    simulation = simulate(started=started)
    operations, tree = simulation.operations, simulation.context.objects
    before = sizes(simulation)
    for kind in KINDS.values():
        for _ in range(TIMES // (1 if "shape" not in kind else 4)):
            operations.remove(apply_all_operations(operations, tree, kind))
        assert sizes(simulation) == before, kind
        if started:
            simulation.step()


def test_reading_a_moved_object_does_not_change_its_initial_pose(simulate):
    simulation = simulate(started=False)
    before = picture(simulation)
    simulation.load_scripts()
    tree = simulation.context.objects
    box = tree.handle("Cuboid")
    tree.set_position(box, -1, (4.0, 4.0, 2.0))
    simulation.operations.color(box)
    simulation.stop()
    assert picture(simulation) == before


def test_stop_undoes_changes_made_while_running(simulate):
    simulation = simulate(started=False)
    before = picture(simulation)
    simulation.load_scripts()
    operations, tree = simulation.operations, simulation.context.objects
    for kind in KINDS.values():
        apply_all_operations(operations, tree, kind)
        operations.rename(tree.handle("Renamed"), f"Kept{len(list(tree))}")
        simulation.step()
    operations.remove([tree.handle("Ball"), tree.handle("Hinge")])
    operations.scale([tree.handle("Post")], (1, 1, 0.5))
    operations.set_parent(tree.handle("Rod"), tree.handle("Drone"), True)
    simulation.step()
    simulation.stop()
    assert picture(simulation) == before
    simulation.start()
    assert picture(simulation) == before


def test_changes_made_while_stopped_stay_and_are_saved(simulate, tmp_path):
    simulation = simulate(started=False)
    operations, tree = simulation.operations, simulation.context.objects
    created, _ = apply_all_operations(operations, tree, KINDS["free"])
    operations.remove([tree.handle("Sign")])
    operations.paint(tree.handle("Ball"), (0.0, 1.0, 0.0, 1.0))
    operations.rename(tree.handle("Rod"), "Stick")
    before, stick = picture(simulation), tree.handle("Stick")
    simulation.start()
    assert picture(simulation) == before and simulation.context.objects.handle("Stick") == stick
    for _ in range(3):
        simulation.step()
    assert picture(simulation) != before
    simulation.stop()
    assert picture(simulation) == before and created in list(simulation.context.objects)
    simulation.save_scene(tmp_path / "saved.yaml")
    simulation.start(str(tmp_path / "saved.yaml"))
    reloaded = picture(simulation)
    assert list(reloaded[0].values()) == list(before[0].values()) and reloaded[1] == before[1]
    assert np.allclose(reloaded[2], before[2], atol=1e-6) and np.allclose(reloaded[3], before[3], atol=1e-5)


def test_a_joint_holds_its_child_until_the_child_is_detached(simulate):
    simulation = simulate()
    operations, tree = simulation.operations, simulation.context.objects
    hinge, rod = tree.handle("Hinge"), tree.handle("Rod")
    for _ in range(10):
        simulation.step()
    angle, speed = tree[hinge].value, tree[hinge].velocity_along
    assert abs(speed) > 0.1
    operations.change(rod, mass=2.0)
    assert (tree[hinge].value, tree[hinge].velocity_along) == pytest.approx((angle, speed), abs=1e-6)
    pose, motion = tree[rod].matrix(), tree[rod].body.state[2:]
    operations.set_parent(rod, -1, True)
    assert tree[rod].matrix() == pytest.approx(pose, abs=1e-6) and tree[hinge].drive is None
    assert np.allclose(tree[rod].body.state[2:], motion, atol=1e-5)
    simulation.step()
    assert tree[rod].matrix()[11] < pose[11], "the rod falls"
    operations.set_parent(rod, hinge, True)
    assert tree[hinge].drive is not None and tree[rod].is_held
    operations.remove([hinge])
    assert tree[rod].parent is None and not tree[rod].is_held


def test_unnamed_shapes_of_a_model_get_free_names(simulate, tmp_path):
    simulation = simulate(started=False)
    operations, tree = simulation.operations, simulation.context.objects
    box = {"shape": "box", "size": [0.1, 0.1, 0.1], "position": [0, 0, 1]}
    (tmp_path / "boxes.yaml").write_text(yaml.safe_dump({"objects": [box, box]}), encoding="utf-8")
    assert [tree[operations.load_model("boxes.yaml")].name for _ in range(2)] == [
        "Cuboid#0",
        "Cuboid#1",
    ]  # the scene has a Cuboid
    assert {"Cuboid0#0", "Cuboid0#1"} <= set(tree.names), "all names of a model have the same suffix"
    assert tree[tree.handle("Cuboid0#0")].alias == "Cuboid"


def test_shapes_are_grouped_and_ungrouped(simulate, tmp_path):
    simulation = simulate(started=False)
    operations, tree = simulation.operations, simulation.context.objects
    ball, sign = tree.handle("Ball"), tree.handle("Sign")
    whole = operations.group([ball, sign])
    assert tree[whole].name == "Ball" and tree[whole].mass == 1.0 and "Sign" not in tree
    size, centre = operations.box(whole)
    assert size == pytest.approx((0.4, 0.5, 0.95), abs=0.01) and centre == pytest.approx((0, 0, 0.275), abs=0.01)
    first, second = operations.ungroup(whole)
    assert tree[first].mass + tree[second].mass == pytest.approx(1.0)
    assert tree[second].matrix()[3::4] == pytest.approx((5, 0, 2.5))
    file = "model.yaml"
    operations.save_model(tree.handle("Post"), file)
    top = operations.load_model(file)
    names = [tree[part].name for part in operations.model(top)]
    assert names == ["Post#0", "Hinge#0", "Rod#0"] and tree[tree.handle("Hinge#0")].drive is not None
    operations.save_model(top, file)
    with pytest.raises(ValueError, match=r"scene\.yaml: is not overwritten"):
        operations.save_model(top, "scene.yaml")
    assert yaml.safe_load((tmp_path / "scene.yaml").read_text(encoding="utf-8")) == SCENE


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda do, tree: do.remove([tree.handle("Drone")]), "'Drone' is a part of a vehicle"),
        (lambda do, tree: do.remove([tree.handle("Floor")]), "'Floor' is the floor"),
        (lambda do, tree: do.remove([999]), "999"),
        (lambda do, tree: do.add([{"name": "Ball", **KINDS["free"]}]), "an object named 'Ball'"),
        (lambda do, tree: do.add([{"name": "x", "shape": "box", "size": [1, 1]}]), "size"),
        (lambda do, tree: do.add([{"name": "x", "shape": "wedge"}]), "shape = 'wedge': must be one of"),
        (lambda do, tree: do.add([{"name": "x", "parent": "Bal", **KINDS["free"]}]), "no object is named 'Bal'"),
        (lambda do, tree: do.rename(tree.handle("Ball"), "Post"), "an object named 'Post'"),
        (lambda do, tree: do.scale([tree.handle("Ball")], (1, 2, 1)), "'Ball' is a sphere"),
        (lambda do, tree: do.scale([tree.handle("Ball")], (0, 0, 0)), "'Ball' is scaled by 0"),
        (lambda do, tree: do.paint(tree.handle("Mark"), (1, 0, 0, 1)), "'Mark' has no color of its own"),
        (lambda do, tree: do.change(tree.handle("Ball"), mass=-1.0), "mass = -1"),
        (lambda do, tree: do.set_parent(tree.handle("Ball"), tree.handle("Sign"), True), "cannot be its own ancestor"),
        (lambda do, tree: do.load_model("../model.yaml"), "in the folder of the scene file"),
        (lambda do, tree: do.load_model("robot.ttm"), "robot.ttm: No such file"),
        (lambda do, tree: do.load_model("robot.ttt"), "name of a .yaml or .ttm file in the folder of the scene file"),
        (lambda do, tree: do.add_mesh("x", [0, 0, 0], [0, 1, 2]), "indices: each must be from 0 to 0"),
    ],
)
def test_a_refused_operation_gives_a_one_line_error_and_changes_nothing(simulation, call, words):
    before = picture(simulation), sizes(simulation)
    with pytest.raises(ValueError, match=words) as refused:
        call(simulation.operations, simulation.context.objects)
    assert "\n" not in str(refused.value)
    assert (picture(simulation), sizes(simulation)) == before


SCRIPT = """
import math
def sysCall_init():
    box = sim.createPureShape(0, 8, [0.2, 0.2, 0.2], 1.0)
    sim.setObjectPosition(box, -1, [1, 1, 3])
    sim.setObjectName(box, 'Box')
    sim.setShapeColor(box, None, sim.colorcomponent_ambient_diffuse, [1, 0, 0])
    print(sim.getShapeColor(box), sim.getShapeMass(box), sim.getShapeBB(box)[0])
    slab = sim.createPrimitiveShape(sim.primitiveshape_cuboid, [1, 1, 0.1])
    sim.setObjectInt32Param(slab, sim.shapeintparam_respondable, 1)
    print(sim.getObjectInt32Param(slab, sim.shapeintparam_static), round(sim.getShapeMass(slab)))
    sim.setObjectInt32Param(slab, sim.shapeintparam_static, 0)
    sim.setObjectPosition(slab, -1, [1, 1, 1])
    wedge = sim.createShape(0, 0.0, [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
    print(sim.getShapeBB(wedge)[0])
    joint = sim.createJoint(sim.joint_revolute_subtype, sim.jointmode_force, 0)
    eye = sim.createVisionSensor(2, [16, 16, 0, 0], [0.1, 10, 1.0, 0, 0, 0, 0, 0, 0, 0, 0])
    feeler = sim.createProximitySensor(sim.proximitysensor_ray_subtype, 16, 0, [0] * 8, [0, 2] + [0] * 13)
    gauge = sim.createForceSensor(0, [0] * 5, [0] * 5)
    print([sim.getObjectType(one) for one in (box, joint, eye, feeler, gauge)])
    copies = sim.copyPasteObjects([box, joint], 0)
    print([sim.getObjectName(one) for one in copies])
    sim.scaleObjects(copies[:1], 2.0, False)
    print(sim.getObjectSizeFactor(copies[0]), round(sim.getShapeMass(copies[0]), 6))
    self.box = box
    print(sim.removeObjects([*copies, joint, eye, feeler, gauge, wedge]))

def sysCall_sensing():
    print(round(sim.getObjectPosition(self.box, -1)[2], 2))
"""


def test_a_script_creates_and_changes_objects(tmp_path, caplog, monkeypatch, new_simulation):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    caplog.set_level("INFO")
    simulation = new_simulation({"drone": {"position": [0.0, 0.0, 2.0]}, "script_time_limit": 0.0}, python=SCRIPT)
    simulation.step()
    assert caplog.messages == [
        "(1, [1.0, 0.0, 0.0]) 1.0 [0.2, 0.2, 0.2]",
        "1 100",
        "[1.0, 1.0, 1.0]",
        "[0, 1, 9, 5, 12]",
        "['Box#0', 'Joint#0']",
        "2.0 8.0",
        "1",
        f"{3 - 9.81 * 0.05 * 0.055 / 2:.2f}",
    ]
    bodies = pybullet.getNumBodies(simulation.world._client)
    simulation.stop()
    assert "Box" not in simulation.context.objects and pybullet.getNumBodies(simulation.world._client) == bodies - 2
    assert math.isfinite(simulation.drone.body.state.position[2])
