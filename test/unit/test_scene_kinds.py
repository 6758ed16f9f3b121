"""Joints, dummies, paths, sensors and compounds of a scene: hierarchy, motion, saving and errors."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run.parameters import ParameterError
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.modules import make_sim

SCENE = """
objects:
  - {name: Hand, kind: dummy, parent: Elbow, position: [1, 0, 0]}
  - {name: Elbow, kind: joint, type: revolute, parent: Slide, position: [0, 0, 1], value: 0.5}
  - {name: Slide, kind: joint, type: prismatic, position: [5, 0, 0], rpy: [1.5707963267948966, 0, 0], limits: [0, 2]}
  - {name: Finger, shape: box, size: [0.1, 0.1, 0.1], parent: Hand, position: [0, 0, 0.5], color: [1, 0, 0]}
  - {name: Flag, alias: cloth, shape: box, size: [0.02, 0.02, 0.2], parent: Quadricopter_base, position: [0, 0, 0.3]}
  - {name: Ball, kind: joint, type: spherical, position: [0, 5, 1]}
  - {name: Under, alias: cloth, kind: dummy, parent: Ball, position: [0, 0, 1]}
  - {name: Ghost, shape: box, size: [1, 1, 1], position: [0, -6, 0.5], respondable: false, color: [0, 1, 0]}
  - {name: Unseen, shape: box, size: [1, 1, 1], position: [0, -9, 0.5], visible: false}
  - name: Table
    shape: compound
    mass: 4
    position: [0, 9, 0.85]
    parts:
      - {shape: box, size: [1, 1, 0.1]}
      - {shape: cylinder, size: [0.05, 0.8], position: [0, 0, -0.45], color: [0, 0, 1]}
      - {shape: box, size: [0.6, 0.6, 0.02], position: [0, 0, -0.84]}
  - {name: Way, kind: path, parent: Table, position: [0, 0, 1], points: [[0, 0, 0], [3, 0, 0], [3, 4, 0]],
     closed: false}
  - {name: Eye, kind: vision_sensor, parent: Hand, position: [0, 0, 2], rpy: [3.141592653589793, 0, 0],
     width: 32, height: 24}
  - {name: Plan, kind: vision_sensor, parent: Hand, position: [0, 0, 2], rpy: [3.141592653589793, 0, 0],
     width: 24, height: 32, size: 1.6}
"""


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    return lambda text: new_simulation(scene=text)


def named(simulation, name):
    objects = simulation.context.objects
    return objects[objects.handle(name)]


def sim_of(simulation):
    return make_sim(simulation.child_scripts["drone"], SceneServices(operations=simulation.operations))


def place(simulation, name):
    return frames.position(named(simulation, name).matrix())


def test_the_motions_of_joints_in_a_chain_compose(simulate):
    simulation = simulate(SCENE)
    sim, objects = sim_of(simulation), simulation.context.objects
    slide, elbow, hand = (objects.handle(name) for name in ("Slide", "Elbow", "Hand"))
    assert place(simulation, "Hand") == pytest.approx((5 + math.cos(0.5), -1, math.sin(0.5)))
    sim.setJointPosition(slide, 1.5)
    sim.setJointPosition(elbow, math.pi / 2)
    assert place(simulation, "Hand") == pytest.approx((5, -2.5, 1))
    assert sim.getObjectPosition(elbow, PARENT) == pytest.approx([0, 0, 1])
    assert sim.getObjectPosition(elbow, slide) == pytest.approx([0, 0, 1]), "relative to the moving side of the joint"
    sim.setJointPosition(slide, 9)
    assert sim.getJointPosition(slide) == 2, "clipped to the limit of the joint"
    sim.setObjectPosition(hand, WORLD, [5, 0, 0])
    assert sim.getObjectPosition(hand, WORLD) == pytest.approx([5, 0, 0])
    sim.setJointPosition(elbow, 100)
    assert sim.getJointPosition(elbow) == pytest.approx(100 - 32 * math.pi), "without limits, within half a turn"


def test_a_shape_without_mass_moves_with_its_parent(simulate):
    simulation = simulate(SCENE)
    flag = named(simulation, "Flag")
    simulation.drone.commands.receive(Twist(Vector3(0.5, 0, 0.3)))
    for _ in range(20):
        simulation.step()
    above = frames.transform(simulation.drone.body.matrix, (0, 0, 0.29))
    assert simulation.drone.body.state.position[0] > 0.05
    assert simulation.world.state(flag.number).position == pytest.approx(above)
    finger, sim = named(simulation, "Finger"), sim_of(simulation)
    sim.setJointPosition(simulation.context.objects.handle("Slide"), 2)
    simulation.step()
    assert simulation.world.state(finger.number).position == pytest.approx(frames.position(finger.matrix()))
    tree = simulation.context.objects
    tree.set_parent(tree.handle("Flag"), WORLD, keep_in_place=True)
    detached_pose = flag.matrix()
    for _ in range(5):
        simulation.step()
    assert flag.matrix() == detached_pose, "a detached shape stays"


def test_a_spherical_joint_accepts_any_rotation(simulate):
    simulation = simulate(SCENE)
    sim, joint = sim_of(simulation), simulation.context.objects.handle("Ball")
    sim.setSphericalJointMatrix(joint, list(frames.from_rpy((0, 0, 0), (math.pi / 2, 0, 0))))
    assert place(simulation, "Under") == pytest.approx((0, 4, 1))
    assert sim.getJointMatrix(joint)[3::4] == [0, 0, 0]
    assert sim.getJointType(joint) == 12
    for call in (lambda: sim.setSphericalJointMatrix(joint, [2.0] * 12), lambda: sim.setJointPosition(joint, 1)):
        with pytest.raises(TypeError):
            call()


def test_kinds_aliases_and_paths_from_the_root(simulate):
    simulation = simulate(SCENE)
    objects, sim = simulation.context.objects, sim_of(simulation)
    kinds = {name: named(simulation, name).kind for name in ("Hand", "Elbow", "Finger", "Table", "Way", "Eye", "Floor")}
    assert list(kinds.values()) == ["dummy", "joint", "shape", "shape", "path", "vision_sensor", "shape"]
    assert named(simulation, "Drone").kind == "shape" and named(simulation, "FrontVision").kind == "vision_sensor"
    assert named(simulation, "Quadricopter_propeller_joint1").kind == "joint"
    assert sim.getObject("/Quadcopter/cloth") == objects.handle("Flag")
    assert sim.getObject("/Ball/cloth") == objects.handle("Under")
    assert objects.path(objects.handle("Finger")) == "/Slide/Elbow/Hand/Finger"


def test_non_respondable_and_invisible_shapes(simulate):
    simulation = simulate(SCENE)
    world, visuals = simulation.world, simulation.scene.visuals()[0]
    assert world.queries.ray((0, -6, 3), (0, -6, 0.1)) is None
    assert world.queries.ray((0, -9, 3), (0, -9, 0.1)).distance == pytest.approx(2, abs=1e-3)
    shown = {visual.key[0] for visual in visuals}
    assert named(simulation, "Ghost").number in shown and named(simulation, "Unseen").number not in shown
    simulation.drone.body.move(Pose((0, -6, 0.5)))
    for _ in range(5):
        simulation.step()
    assert simulation.drone.body.state.position == pytest.approx((0, -6, 0.5), abs=0.06), "the drone flies inside"


def test_a_compound_is_one_rigid_body(simulate):
    simulation = simulate(SCENE)
    blue_visuals = [one for one in simulation.scene.visuals()[0] if one.rgba[:3] == (0, 0, 1)]
    assert len(blue_visuals) == 1, "one part has its own color"
    for _ in range(40):
        simulation.step()
    assert place(simulation, "Table") == pytest.approx((0, 9, 0.85), abs=0.005), "the table stands on its foot"
    body = named(simulation, "Table").body
    centre = frames.position(simulation.world.inertial_frame(body.number))
    volumes, heights = np.array([0.1, math.pi * 0.05**2 * 0.8, 0.0072]), np.array([0, -0.45, -0.84])
    assert centre == pytest.approx((0, 0, volumes @ heights / volumes.sum()), abs=1e-3)


def test_paths(simulate):
    simulation = simulate(SCENE)
    sim, way = sim_of(simulation), simulation.context.objects.handle("Way")
    assert sim.getPathLength(way) == 7
    assert sim.getPositionOnPath(way, 5 / 7) == pytest.approx([3, 11, 1.85], abs=1e-3)
    assert sim.getOrientationOnPath(way, 1)[2] == pytest.approx(math.pi / 2)
    sim.setPathPosition(way, sim.getPathPosition(way) + 2)
    assert sim.getPathPosition(way) == 2
    half = math.sqrt(0.5)
    table = named(simulation, "Way").table
    assert table == pytest.approx([0, 0, 0, 0, 0, 0, 1, 3, 0, 0, 0, 0, half, half, 3, 4, 0, 0, 0, half, half])
    assert sim.unpackDoubleTable(sim.readCustomDataBlock(way, "PATH")) == table
    flat = [0, 0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 1, 0]
    lengths, total = sim.getPathLengths(flat, 7)
    assert (lengths, total) == ([0, 2], 2)
    assert sim.getPathInterpolatedConfig(flat, lengths, 1) == pytest.approx([1, 0, 0, 0, 0, half, half])
    for call in (lambda: sim.getPathLength(0), lambda: sim.getPathLengths(flat, 4), lambda: sim.getPathLengths([], 3)):
        with pytest.raises(TypeError):
            call()


def test_images_and_depths_of_a_vision_sensor(simulate):
    simulation = simulate(SCENE)
    sim, eye = sim_of(simulation), simulation.context.objects.handle("Eye")
    image, width, height = sim.getVisionSensorCharImage(eye)
    assert (width, height, len(image)) == (32, 24, 32 * 24 * 3)
    middle = np.frombuffer(image, np.uint8).reshape(24, 32, 3)[12, 16].astype(int)
    assert middle[0] > middle[1] + 50, "the red finger, 1.5 m below the sensor"
    assert named(simulation, "Eye").picture("depth")[12, 16] == pytest.approx(1.45, abs=0.01)
    plan = named(simulation, "Plan").picture("depth")
    assert plan.shape == (32, 24) and plan[16, 12] == pytest.approx(1.45, abs=0.01)
    assert (abs(plan - 1.45) < 0.01).sum() == 4, "0.1 m at 20 px/m along the larger side"


def test_a_vision_sensor_renders_a_single_entity_or_handles(simulate):
    simulation = simulate(SCENE)
    sim, objects = sim_of(simulation), simulation.context.objects
    eye, finger, floor = (objects.handle(name) for name in ("Eye", "Finger", "Floor"))
    depths = np.reshape(sim.checkVisionSensorEx(eye, finger, False), (24, 32))
    whole = named(simulation, "Eye").picture("depth")[::-1]
    assert (depths < 1).sum() == 4 and whole[depths < 1] == pytest.approx(1.45, abs=0.01)
    result, statistics, _ = sim.checkVisionSensor(eye, finger)
    assert result == 1 and statistics[6] > 0.5 and statistics[14] == pytest.approx(depths.mean())
    assert sim.checkVisionSensor(eye, objects.handle("Quadricopter_base"))[0] == 0, "not in view"

    sim.setObjectInt32Param(eye, sim.visionintparam_render_mode, 2)
    image = np.frombuffer(sim.getVisionSensorImg(eye)[0], np.uint8).reshape(24, 32, 3).astype(int) @ (1, 256, 65536)
    assert ((image == finger) == (depths < 1)).all() and {*np.unique(image)} == {finger, floor, 0xFFFFFF}, (
        "white where there is no object"
    )
    assert sim.readVisionSensor(eye) == (0, sorted([finger, floor]), ())
    sim.setObjectInt32Param(eye, sim.visionintparam_entity_to_render, finger)
    assert sim.readVisionSensor(eye)[1] == [finger]
    assert sim.getObjectInt32Param(eye, sim.visionintparam_entity_to_render) == finger


def test_joints_and_parents_are_saved_restored_and_reset(simulate, tmp_path, new_simulation):
    simulation = simulate(SCENE)
    sim, objects = sim_of(simulation), simulation.context.objects
    sim.setJointPosition(objects.handle("Slide"), 1)
    sim.setObjectParent(objects.handle("Finger"), objects.handle("Quadricopter_base"), True)
    simulation.step()
    simulation.save_scene(tmp_path / "saved.yaml")
    reloaded = new_simulation({"scene_file": str(tmp_path / "saved.yaml")})
    for handle in objects:
        name = objects[handle].name
        assert named(reloaded, name).matrix() == pytest.approx(objects[handle].matrix(), abs=1e-6), name
    snapshot, before = simulation.snapshot(), place(simulation, "Finger")
    sim.setJointPosition(objects.handle("Slide"), 0)
    sim.setObjectPosition(objects.handle("Finger"), WORLD, [0, 0, 9])
    simulation.restore(snapshot)
    assert place(simulation, "Finger") == before and named(simulation, "Slide").value == 1
    finger = named(simulation, "Finger")
    assert simulation.world.state(finger.number).position == pytest.approx(before)
    simulation.start()
    assert named(simulation, "Slide").value == 0
    assert named(simulation, "Finger").parent.name == "Hand"


DUMMY = "kind: dummy, position: [0, 0, 0]"


@pytest.mark.parametrize(
    "entry, words",
    [
        ("{kind: dummy}", "scene.yaml: line 2: parameter objects/0/name: missing"),
        ("{kind: cone}", "line 2: parameter objects/0/kind = 'cone': must be one of 'dummy', 'joint', 'pro"),
        ("{name: A, kind: dummy, mass: 1}", "line 2: parameter objects/0/mass: unknown key"),
        (f"{{name: A, {DUMMY}}}\n  - {{name: A, {DUMMY}}}", "line 3: parameter objects/1/name = 'A': is used twice"),
        (f"{{name: A, parent: A, {DUMMY}}}", "line 2: parameter objects/0/parent = 'A': 'A' would be its own ancestor"),
        (
            f"{{name: A, parent: B, {DUMMY}}}\n  - {{name: B, parent: A, {DUMMY}}}",
            "line 2: parameter objects/0/parent = 'B': 'A' would be its own ancestor",
        ),
        (
            "\n  - ".join(f"{{name: o{i}, parent: {f'o{i - 1}' if i else ''!r}, {DUMMY}}}" for i in range(999)),
            "line 203: parameter objects/201/parent = 'o200': 'o201' has more than 200 ancestors",
        ),
        (
            f"{{name: A, parent: Quadricopter_bas, {DUMMY}}}",
            "line 2: no object is named 'Quadricopter_bas', the parent of 'A'; near names are Quadricopter_base",
        ),
        (
            "{shape: sphere, size: [1], position: [0, 0, 9], parent: B}",
            "line 2: parameter objects/0/parent = 'B': an entry",
        ),
        ("{name: A, kind: joint, type: revolute, limits: [1, 0]}", "must be [lowest, highest] with lowest < highest"),
        (
            "{name: A, kind: joint, type: revolute, limits: [0, 1], value: 2}",
            "line 2: parameter objects/0/value = 2: must be within the limits, 0 to 1",
        ),
        ("{name: A, kind: joint, type: spherical, value: 2}", "a spherical joint must not have them"),
        ("{name: A, kind: joint, type: screw}", "line 2: parameter objects/0/type = 'screw'"),
        (
            "{name: A, kind: proximity_sensor, type: cone, range: 1}",
            "parameter objects/0/angle = 0: must be greater than 0",
        ),
        ("{name: A, kind: proximity_sensor, type: pyramid, range: 1, angle: 3.2}", "must be at most 3.1"),
        (
            "{name: A, kind: proximity_sensor, type: ray, range: .inf}",
            "objects/0/range = inf: input should be a finite",
        ),
        ("{name: A, kind: vision_sensor, near: 2, far: 1}", "parameter objects/0/near = 2: must be less than far = 1"),
        (
            "{name: A, kind: path, points: [[0, 0, 0], [1, 0, 0]], turns: [[0, 0, 0, 1]]}",
            "turns: 1 quaternions for 2 points",
        ),
        (
            "{name: A, kind: path, points: [[0, 0, 0], [1, 0, 0]], turns: [[0, 0, 0, 1], [0, 0, 0, 9]]}",
            "must be a unit quaternion",
        ),
        ("{name: A, kind: vision_sensor, width: 5000}", "objects/0/width = 5000: input should be less than or equal"),
        ("{name: A, kind: path, points: [[0, 0, 0]]}", "parameter objects/0/points = [[0, 0, 0]]: list should have at"),
        (
            "{name: A, shape: compound, position: [0, 0, 0], parts: []}",
            "objects/0/parts = []: list should have at least 1",
        ),
        (
            "{name: A, shape: compound, position: [0, 0, 0], parts: [{shape: urdf}]}",
            "parameter objects/0/parts/0/shape = 'urdf': must be one of 'box', 'cylinder', 'sphere', 'mesh', 'capsule'",
        ),
        (
            "{name: A, shape: sphere, size: [1], position: [0, 0, 9], inertia: {moments: [1, 0, 1]}}",
            "objects/0/inertia/moments/1 = 0",
        ),
    ],
)
def test_an_invalid_entry_gives_a_one_line_error(simulate, entry, words):
    with pytest.raises(ParameterError) as refused:
        simulate(f"objects:\n  - {entry}\n")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_joints_that_the_dynamics_cannot_move_are_logged_once(simulate, caplog):
    simulate(
        """
objects:
  - {name: Empty, kind: joint, type: revolute, mode: velocity, position: [4, 0, 1]}
  - {name: Bare, kind: joint, type: revolute, mode: velocity, position: [4, 1, 1]}
  - {name: Round, kind: joint, type: spherical, mode: passive, position: [4, 2, 1]}
  - {name: Bob, shape: sphere, size: [0.1], mass: 1, parent: Round, position: [0, 0, -0.5]}
"""
    )
    lines = [one.getMessage() for one in caplog.records if "only scripts move these joints" in one.getMessage()]
    assert sorted(line.rpartition(": ")[2] for line in lines) == ["Empty, Bare", "Round"]


@pytest.mark.ros
def test_rviz_shows_dummies_as_balls_and_paths_as_lines(simulate):
    scene_markers = pytest.importorskip("drone_sim.ros.rviz.scene_markers")
    shown = [*scene_markers.bodiless_markers(simulate(SCENE).scene.objects.values())]
    balls, lines = ([one for one in shown if one.type == kind] for kind in (2, 4))
    assert len(balls) == 2 and len(lines) == 1
    assert balls[0].pose.position.x == pytest.approx(5 + math.cos(0.5))
    points = [(one.x, one.y, one.z) for one in lines[0].points]
    np.testing.assert_allclose(points, [(0, 9, 1.85), (3, 9, 1.85), (3, 13, 1.85)])


def test_a_child_of_a_removed_vehicle_stays_where_it_was(new_simulation):
    two = {"a": {"position": [0, 0, 1]}, "b": {"position": [2, 0, 1]}}
    flag = "{name: Flag, shape: box, size: [0.1, 0.1, 0.1], parent: Drone#0, position: [0, 0, 0.3]}"
    simulation = new_simulation({"vehicles": two}, scene=f"objects: [{flag}]")
    simulation.step()
    simulation.set_vehicles({"a": two["a"]})
    simulation.step()
    assert place(simulation, "Flag") == pytest.approx((2, 0, 1.3), abs=1e-3)
    simulation.stop()
    assert place(simulation, "Flag") == pytest.approx((2, 0, 1.3))


DOCS = (Path(__file__).parents[2] / "docs/scenes.md").read_text(encoding="utf-8")


def test_the_examples_of_the_docs_load(simulate):
    examples = re.findall(r"^```yaml\n(.*?)^```", DOCS, re.S | re.M)
    entries = ["".join(line for line in one.splitlines(True) if "file:" not in line) for one in examples]
    contents = [yaml.safe_load(one) for one in entries]
    objects = [entry for one in contents for entry in one.get("objects", [])]
    vehicles = next(one["vehicles"] for one in contents if "vehicles" in one)
    simulation = simulate(yaml.safe_dump({"objects": objects, "vehicles": vehicles}))
    names = set(simulation.context.objects.names)
    assert {"Crate", "Hinge", "Gauge", "Sonar", "Watch", "Way", "Ball", "Door", "Aim"} <= names
    assert "Quadricopter_floorCamera" not in names
    assert "floor" not in simulation.vehicles["drone"].cameras
    simulation.step()
