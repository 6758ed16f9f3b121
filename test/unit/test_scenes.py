"""Scene files: all shapes, saving and loading, and one-line errors."""

import re

import numpy as np
import pytest
import trimesh
from drawing import CAMERA, looking, seen

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError
from drone_sim.run.simulation import Simulation
from drone_sim.shapes.box import Box
from drone_sim.shapes.sphere import Sphere
from drone_sim.world import World

URDF = """<robot name="barrel"><link name="barrel">
  <inertial><mass value="2"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="block.stl"/></geometry></visual>
  <collision><geometry><box size="0.6 0.6 0.6"/></geometry></collision>
</link></robot>"""
BLOCK = "{shape: mesh, file: block.obj, position: [0, 0, 0]}"
SHAPES = {
    "box": "{shape: box, size: [0.6, 0.6, 0.6], position: [%s, 0, 0.3], mass: %s}",
    "cylinder": "{shape: cylinder, size: [0.3, 0.6], position: [%s, 0, 0.3], mass: %s}",
    "sphere": "{shape: sphere, size: [0.3], position: [%s, 0, 0.3], mass: %s}",
    "obj": "{shape: mesh, file: block.obj, position: [%s, 0, 0.3], mass: %s}",
    "stl": "{shape: mesh, file: parts/block.stl, size: [0.5, 0.5, 1], position: [%s, 0, 0.3], mass: %s}",
    "text_stl": "{shape: mesh, file: text.stl, position: [%s, 0, 0.3], mass: %s}",
    "dae": "{shape: mesh, file: parts/block.dae, position: [%s, 0, 0.3], mass: %s}",
    "urdf": "{shape: urdf, file: parts/barrel.urdf, position: [%s, 0, 0.3], mass: %s}",
    "collada": "{shape: urdf, file: parts/collada.urdf, position: [%s, 0, 0.3], mass: %s}",
}


@pytest.fixture(name="write")
def _write(tmp_path):
    """Return a function that writes a scene file, with meshes beside and below it, and returns its name."""
    block = trimesh.creation.box((0.6, 0.6, 0.6))
    (tmp_path / "parts").mkdir()
    for name in ("block.obj", "block.stl", "parts/block.stl", "parts/block.dae"):
        block.export(str(tmp_path / name))
    block.export(str(tmp_path / "text.stl"), file_type="stl_ascii")
    (tmp_path / "parts" / "barrel.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "parts" / "collada.urdf").write_text(URDF.replace(".stl", ".dae"), encoding="utf-8")
    for name in ("nonsense.stl", "nonsense.obj", "nonsense.png", "nonsense.urdf"):
        (tmp_path / name).write_text("nonsense", encoding="utf-8")

    def write(text):
        (tmp_path / "scene.yaml").write_text(text, encoding="utf-8")
        return str(tmp_path / "scene.yaml")

    return write


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    small = {"front": {"width": 16, "height": 12}}
    return lambda file: new_simulation({"scene_file": file, "cameras": small})


@pytest.mark.parametrize("mass", [0, 2])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_loaded_drawn_and_collides(write, simulate, renderer, shape, mass):
    simulation = simulate(write(f"drone: {{position: [1, 0, 3]}}\nobjects: [{SHAPES[shape] % (1, mass)}]"))
    view = looking((-3, 0, 1.5), (1, 0, 0.3))
    labels = seen(renderer, simulation.world.pictures.visuals(), simulation.world.pictures.visual_poses(), view)
    things = [index for index, visual in enumerate(simulation.world.pictures.visuals()) if visual.key[0] == 1]
    assert np.isin(labels, things).sum() > 500
    ball = simulation.world.add_object(Sphere((0.05,)), Pose((1.0, 0, 0.7)), mass=0.1)
    simulation.world.advance({}, 100)
    assert simulation.world.state(ball).position[2] == pytest.approx(0.65, abs=0.03), "the ball lies on top"


def test_restitution_and_friction_of_objects(write, simulate):
    ball = "shape: sphere, size: [0.1], mass: 1"
    box = "shape: box, size: [0.2, 0.2, 0.2], mass: 1"
    simulation = simulate(
        write(
            f"objects:\n- {{name: Rebounds, {ball}, position: [3, 0, 1.1], restitution: 0.8}}\n"
            f"- {{name: Lies, {ball}, position: [4, 0, 1.1]}}\n"
            f"- {{name: Slides, {box}, position: [0, 3, 0.1], friction: 0.05}}\n"
            f"- {{name: Stops, {box}, position: [0, 4, 0.1]}}\n"
        )
    )
    tree, world = simulation.context.objects, simulation.world
    for name in ("Slides", "Stops"):
        world.set_velocity(tree[tree.handle(name)].number, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    places = []
    for _ in range(18):
        simulation.step()
        places.append({name: tree.matrix(tree.handle(name)) for name in ("Rebounds", "Lies", "Slides", "Stops")})
    assert max(one["Rebounds"][11] for one in places[10:]) == pytest.approx(0.1 + 0.64, abs=0.03)
    assert max(one["Lies"][11] for one in places[10:]) == pytest.approx(0.1, abs=0.01)
    assert places[-1]["Slides"][3] > 0.6
    assert places[-1]["Stops"][3] < 0.1


def test_a_saved_and_reloaded_scene_is_the_same(write, simulate, tmp_path):
    objects = "\n".join(f"  - {SHAPES[shape] % (2 * n, n % 2)}" for n, shape in enumerate(SHAPES, start=1))
    look = "{name: A, shape: box, size: [1, 2, 3], position: [1, -9, 2], rpy: [0.1, 0.2, 0.3], color: [1, 0, 0, 0.5]}"
    simulation = simulate(write(f"floor: {{size: 33}}\ndrone: {{yaw: 0.3}}\nobjects:\n{objects}\n  - {look}"))
    simulation.drone.commands.receive(Twist(Vector3(0.5, 0, 0.2)))
    for _ in range(10):
        simulation.step()
    saved = tmp_path / "elsewhere" / "saved.yaml"
    simulation.save_scene(saved)
    loaded = simulate(str(saved))
    assert loaded.drone.body.state.position == pytest.approx(simulation.drone.body.state.position, abs=1e-9)
    for ours, theirs in zip(simulation.parameters.scene.objects, loaded.parameters.scene.objects):
        assert ours.model_dump(exclude={"position", "rpy"}) == theirs.model_dump(exclude={"position", "rpy"})
    assert loaded.parameters.scene.floor == simulation.parameters.scene.floor
    # Body numbers and the angles of the propeller blades may differ.
    np.testing.assert_allclose(
        loaded.world.pictures.visual_poses()[:10], simulation.world.pictures.visual_poses()[:10], rtol=0, atol=1e-9
    )
    looks = [[visual.shape, visual.rgba, visual.texture] for visual in simulation.scene.visuals()[0]]
    assert [[v.shape, v.rgba, v.texture] for v in loaded.scene.visuals()[0]] == looks


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "must hold `key: value` lines"),
        ("objects: [", "scene.yaml: while parsing"),
        ("boxes: []", "line 1: parameter boxes: unknown key; near names are objects"),
        ("1: 2", "key '1' must be a string (line 1, column 1)"),
        ("objects: {}", "scene.yaml: line 1: parameter objects = {}: input should be a valid list"),
        (
            "objects: [5]",
            "scene.yaml: line 1: parameter objects/0 = 5: must have `key: value` lines, one of them `shape`",
        ),
        ("drone:", "parameter drone = None"),
        ("drone: {position: [0, 0, .nan]}", "drone/position/2 = nan: input should be a finite number"),
        (
            "floor: {size: -1}",
            "scene.yaml: line 1: parameter floor/size = -1: input should be greater than or equal to 0.01",
        ),
        ("floor: {texture: no.png}", "no.png': no such file"),
        ("floor: {texture: nonsense.png}", "nonsense.png: cannot be read"),
        ("objects: [{shape: cone, size: [1], position: [0, 0, 0]}]", "'box', 'cylinder', 'sphere', 'mesh', 'urdf'"),
        (
            "objects: [{size: [1], position: [0, 0, 0]}]",
            "parameter objects/0/shape: missing; must be one of 'box', 'cylinder', 'sphere', 'mesh', 'urdf'",
        ),
        (
            "objects: [{shape: box, size: [1, 1], position: [0, 0, 0]}]",
            "parameter objects/0/size = [1, 1]: must be 3 numbers, [length, width, height] in m",
        ),
        (
            "objects: [{shape: sphere, size: [-1], position: [0, 0, 0]}]",
            "size/0 = -1: input should be greater than or equal to 0.0001",
        ),
        ("objects: [{shape: sphere, size: [.inf], position: [0, 0, 0]}]", "size/0 = inf: input should be a finite"),
        ("objects: [{shape: sphere, size: [1], position: [0, 0, 0], mass: -1}]", "mass = -1"),
        (
            "objects: [{shape: sphere, size: [1], position: [0, 0, 0], colour: [1, 0, 0, 1]}]",
            "scene.yaml: line 1: parameter objects/0/colour: unknown key; near names are color",
        ),
        ("objects: [{shape: box, size: [1, 1, 1], position: [0, 0, 0], texture: nonsense.png}]", "cannot be read"),
        (f"objects: [{BLOCK.replace('block', 'missing')}]", "missing.obj': no such file"),
        (f"objects: [{BLOCK.replace('block', 'nonsense')}]", "mesh"),
        (f"objects: [{BLOCK.replace('block.obj', 'nonsense.stl')}]", "nonsense.stl: "),
        (f"objects: [{BLOCK.replace('block.obj', 'nonsense.png')}]", "must be one of .obj, .stl, .dae"),
        pytest.param(
            f"objects: [{BLOCK.replace('block.obj', 'package://nowhere_at_all/a.obj')}]",
            "no ROS package nowhere_at_all",
            marks=pytest.mark.ros,
        ),
        ("objects: [{shape: urdf, file: nonsense.urdf, position: [0, 0, 0]}]", "nonsense.urdf: syntax error"),
        (
            "objects: [{name: Drone, shape: sphere, size: [1], position: [9, 0, 0]}]",
            "scene.yaml: line 1: an object named 'Drone'",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_an_invalid_scene_gives_a_one_line_error(write, text, words):
    file = write(text)
    with pytest.raises(ParameterError) as refused:
        Simulation(parameters.load({"scene_file": file})).close()
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_every_wrong_key_of_a_scene_is_named_with_its_line(write):
    file = write(
        """floor: {size: a}
boxes: []
drone:
  position: [1, 2]
  yam: 3
objects:
  - shape: box
    size: [1, 1, 1]
    color: [1, 0]
    position: [0, 0, 1]
  - {shape: cone}
  - {color: red}
  - {shape: sphere, size: 0.3, colour: [1, 0, 0]}
"""
    )
    with pytest.raises(ParameterError) as refused:
        parameters.load({"scene_file": file, "gravity": "down"})
    assert str(refused.value).startswith(f"{file}: line 1: ") and str(refused.value).endswith("; and 3 more")
    assert re.findall(r"line (\d+): parameter ([\w/]+)", str(refused.value)) == [
        ("1", "floor/size"),
        ("2", "boxes"),
        ("4", "drone/position"),
        ("5", "drone/yam"),
        ("9", "objects/0/color"),
        ("11", "objects/1/shape"),
        ("12", "objects/2/shape"),
        ("13", "objects/3/size"),
    ]


def test_an_error_in_a_yaml_merge_names_the_line_of_the_merge(write):
    thing = "&a {shape: box, name: A, size: [1, 1, 1], position: [0, 0, 1]}"
    file = write(f"objects:\n  - {thing}\n  -\n    <<: *a\n")
    with pytest.raises(ParameterError) as refused:
        parameters.load({"scene_file": file})
    assert str(refused.value).startswith(f"{file}: line 4: parameter objects/1/name = 'A': ")


def test_errors_outside_the_scene_file_name_no_line_of_it(write):
    file = write("drone: {yaw: 1}\nfloor: {size: 3}")
    with pytest.raises(ParameterError) as refused:
        parameters.load({"scene_file": file, "drone": {"position": 5}, "floor": 3})
    assert re.findall(r"parameter ([\w/]+)", str(refused.value)) == ["drone/position", "floor"]
    assert "line" not in str(refused.value) and "scene/floor" in str(refused.value)


def test_a_color_of_three_numbers_is_opaque(write):
    thing = "{shape: box, size: [1, 1, 1], position: [0, 0, 1], color: %s}"
    scene = parameters.load(
        {"scene_file": write(f"objects: [{thing % [1, 0, 0.5]}, {thing % [1, 0, 0.5, 0.2]}]")}
    ).scene
    assert [one.color for one in scene.objects] == [(1, 0, 0.5, 1), (1, 0, 0.5, 0.2)]


@pytest.mark.parametrize("file", ["no.yaml", "/no/such.yaml", "package://drone_sim/config/scenes/no.yaml", "/tmp"])
def test_a_missing_scene_file_gives_a_one_line_error(file):
    with pytest.raises(ParameterError, match=f"parameter scene_file = '{file}': no such file") as refused:
        parameters.load({"scene_file": file})
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["empty", "gates", "room"])
def test_the_shipped_scenes_load_and_let_the_drone_hover(simulate, name):
    simulation = simulate(f"package://drone_sim/config/scenes/{name}.yaml")
    (x, y, z), things = simulation.drone.body.state.position, simulation.world.pictures.visual_poses()[:, :3, 3]
    for _ in range(100):
        simulation.step()
    assert simulation.drone.body.state.position == pytest.approx((x, y, z), abs=0.002)
    np.testing.assert_allclose(simulation.world.pictures.visual_poses()[:, :3, 3], things, rtol=0, atol=0.005)


def test_the_drone_flies_through_the_first_gate(simulate):
    simulation = simulate("package://drone_sim/config/scenes/gates.yaml")
    simulation.drone.commands.receive(Twist(Vector3(1.0, 0, 0.05)))
    for _ in range(100):
        simulation.step()
    x, y, _ = simulation.drone.body.state.position
    assert x > 4.0 and abs(y) < 1e-6


def test_pictures_follow_added_painted_moved_and_removed_objects(renderer):
    world = World(0.005, -9.81)
    view = looking((-3, 0, 1), (1, 0, 1))

    def picture():
        renderer.set_visuals(world.pictures.visuals())
        return renderer.render(CAMERA, view, world.pictures.visual_poses()).astype(int)

    empty = picture()
    first = world.add_object(Sphere((0.5,)), Pose((1, 1, 1)), color=(1, 0, 0, 1))
    second = world.add_object(Box((1, 1, 1)), Pose((1, -1, 1)))
    both = picture()
    assert (both != empty).any(axis=2)[:, :160].sum() > 500 and (both != empty).any(axis=2)[:, 160:].sum() > 500
    assert np.argmax(both[120, 100]) == 0
    world.set_color(first, (0, 0, 1, 1))
    assert np.argmax(picture()[120, 100]) == 2
    painted, snapshot = picture(), world.saved_states.snapshot()
    world.set_pose(first, Pose((1, 9, 1)))
    np.testing.assert_array_equal(picture()[:, :150], empty[:, :150])
    world.saved_states.restore(snapshot)
    np.testing.assert_array_equal(picture(), painted)
    world.remove(first)
    np.testing.assert_array_equal(picture()[:, :150], empty[:, :150])
    world.remove(second)
    np.testing.assert_array_equal(picture(), empty)
    world.close()


def test_a_changed_mesh_file_is_reloaded_by_the_next_start(tmp_path, new_simulation):
    """The name of the file stays the same; only its content changes."""
    mesh, scene = tmp_path / "thing.stl", tmp_path / "scene.yaml"
    scene.write_text("objects: [{shape: mesh, file: thing.stl, position: [2, 0, 0.8], color: [1, 0, 0, 1]}]\n")
    trimesh.creation.box((0.2, 0.2, 0.2)).export(mesh)
    simulation = new_simulation({"scene_file": str(scene)})

    def red():
        picture = simulation.drone.cameras["front"].look().astype(int)
        return int((picture[:, :, 0] > picture[:, :, 1] + 60).sum())

    small = red()
    trimesh.creation.box((0.8, 0.8, 0.8)).export(mesh)
    simulation.start()
    assert red() > 8 * small > 0


def test_a_scene_with_too_many_overlapping_objects_is_refused():
    box = {"shape": "box", "size": [1, 1, 1], "position": [0, 0, 5], "mass": 1}
    assert len(Simulation(parameters.load({"scene": {"objects": [box] * 10}})).world.queries.overlaps()) == 45
    wall = [{**box, "position": [x, 0, z + 0.5]} for x in range(10) for z in range(5)]  # the boxes touch
    Simulation(parameters.load({"scene": {"objects": wall}})).close()
    ghosts = [{**box, "respondable": False}] * 31  # without collisions
    Simulation(parameters.load({"scene": {"objects": ghosts}})).close()
    Simulation(parameters.load({"scene": {"objects": [{**box, "mass": 0}] * 100}})).close()  # static objects
    with pytest.raises(ParameterError, match="4950 pairs of moving objects"):
        Simulation(parameters.load({"scene": {"objects": [box] * 100}}))
    disc = {"shape": "cylinder", "size": [1, 0.2], "position": [0, 0, 5], "rpy": [-4.9, 0, -6.7], "mass": 2}
    for one in (box, disc):
        with pytest.raises(ParameterError, match="465 pairs of moving objects or vehicles are deep inside each other"):
            Simulation(parameters.load({"scene": {"objects": [one] * 31}}))


def test_copies_are_grouped_under_the_name_of_the_first(new_simulation):
    cuboid = {"name": "Cuboid", "shape": "box", "size": [1, 1, 1], "position": [2, 0, 1]}
    simulation = new_simulation({"scene": {"objects": [cuboid]}})
    operations, tree = simulation.operations, simulation.tree
    copies = [operations.copy([tree.handle("Cuboid")])[0] for _ in range(2)]
    assert tree[operations.group(copies)].name == "Cuboid#0"


CHAIN = [
    {"name": "Mark", "kind": "dummy", "position": [1, 1, 1]},
    {"name": "Hinge", "kind": "joint", "type": "revolute", "position": [3, 0, 1]},
    {"name": "Rod", "shape": "box", "size": [1, 0.1, 0.1], "mass": 1, "parent": "Hinge", "position": [0.5, 0, 0]},
]


def position_of(simulation, name):
    return list(simulation.tree.matrix(simulation.tree.handle(name))[3::4])


def test_an_operation_that_fails_in_flight_does_not_change_start_positions(monkeypatch, new_simulation):
    simulation = new_simulation({"scene": {"objects": CHAIN}})
    simulation.start()
    mark = simulation.tree.handle("Mark")
    simulation.tree.set_position(mark, WORLD, (5.0, 5.0, 5.0))

    def fail(*_):
        raise ValueError("no")

    with monkeypatch.context() as patch, pytest.raises(ValueError, match="no"):
        patch.setattr(simulation.scene, "rebuild", fail)
        simulation.operations.remove([simulation.tree.handle("Rod")])
    simulation.stop()
    assert position_of(simulation, "Mark") == [1, 1, 1]


def test_edits_made_while_stopped_stay_if_the_scene_cannot_be_rebuilt(monkeypatch, new_simulation):
    simulation = new_simulation({"scene": {"objects": CHAIN[:1]}})
    simulation.start()
    simulation.stop()
    simulation.tree.set_position(simulation.tree.handle("Mark"), WORLD, (5.0, 5.0, 5.0))
    simulation.scene.is_changed = True

    def fail(*_):
        raise ValueError("no")

    monkeypatch.setattr(simulation, "_rebuild", fail)
    simulation.stop()
    assert position_of(simulation, "Mark") == [5, 5, 5]
