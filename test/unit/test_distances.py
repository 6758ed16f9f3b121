"""sim.checkDistance and sim.checkCollision: between vehicles, shapes of the scene, the floor, and points."""

import math

import pytest

from drone_sim.hosting.child_scripts import services
from drone_sim.mechanics.state import Pose
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.modules import make_sim
from drone_sim.scripting.time_limit import TimeLimit

SCENE = {
    "objects": [
        {"name": "Wall", "shape": "box", "size": [0.2, 4, 4], "position": [3, 0, 2]},
        {"name": "Ball", "shape": "sphere", "size": [0.2], "position": [0, 3, 1], "mass": 0.5},
        {"name": "Pole", "shape": "cylinder", "size": [0.1, 2], "position": [-3, 0, 1]},
        {"name": "Arm", "shape": "box", "size": [1, 0.1, 0.1], "position": [0.5, 0, 0], "parent": "Frame"},
        {"name": "Frame", "kind": "dummy", "position": [-6, 0, 1]},
        {"name": "Hinge", "kind": "joint", "type": "revolute", "position": [0, -6, 1]},
        {"name": "Leaf", "shape": "box", "size": [1, 0.1, 0.1], "mass": 1, "position": [0.5, 0, 0], "parent": "Hinge"},
        {"shape": "box", "size": [1, 1, 1], "position": [9, 9, 0.5]},
        {"name": "Near", "kind": "dummy", "position": [9, 9, 1.25]},
        {"name": "Shell", "kind": "dummy", "position": [0, 0, 9], "parent": "Quadricopter_base", "part": True},
    ]
}
STILL = "def sysCall_init(): pass\n"


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    fleet = {"drone": {"position": [0, 0, 1]}, "other": {"position": [0, 1, 1]}}
    return new_shared_simulation({"scene": SCENE, "vehicles": fleet, "gravity": 0.0}, python=STILL)


@pytest.fixture(name="sim")
def _sim(simulation):
    simulation.drone.body.move(Pose((0.0, 0.0, 1.0)))
    own = simulation.child_scripts["drone"]
    return make_sim(
        own, services([simulation.drone], simulation.context, simulation.operations, TimeLimit(0.0), Turns())
    )


def check_distance(sim, one, other, *threshold):
    other_handle = sim.handle_all if other == "all" else sim.getObject(other)
    return sim.checkDistance(sim.getObject(one), other_handle, *threshold)


def test_the_shortest_distance_between_two_shapes(sim):
    result, way, pair = check_distance(sim, "/Wall", "/Pole")
    assert result == 1 and pair == [sim.getObject("/Wall"), sim.getObject("/Pole")]
    assert way[6] == pytest.approx(5.8, abs=1e-4)
    assert (way[0], way[3]) == (pytest.approx(2.9, abs=1e-4), pytest.approx(-2.9, abs=1e-4))
    assert math.dist(way[:3], way[3:6]) == pytest.approx(way[6], abs=1e-6)


def test_no_distance_is_returned_beyond_the_threshold(sim):
    assert check_distance(sim, "/Wall", "/Pole", 5.79) == (0, [0.0] * 7, [-1, -1])
    assert check_distance(sim, "/Wall", "/Pole", 5.81)[0] == 1


def test_any_part_of_a_drone_stands_for_the_whole_drone(simulation, sim):
    whole = check_distance(sim, "/Quadcopter", "/Ball")[1]
    assert whole[6] == pytest.approx(3 - 0.1 - 0.2, abs=0.15)
    for part in ("/Quadcopter/base", "/Quadcopter/propeller[0]/respondable", "/Quadcopter/propeller[0]", "/Shell"):
        assert check_distance(sim, part, "/Ball")[1] == whole
    simulation.drone.body.move(Pose((0.0, 0.0, 3.0)))
    assert check_distance(sim, "/Quadcopter", "/Ball")[1][6] > whole[6] + 0.1


def test_the_nearest_object_of_the_whole_scene(simulation, sim):
    result, way, pair = check_distance(sim, "/Quadcopter", "all")
    assert result == 1 and pair == [sim.getObject("/Quadcopter"), sim.getObject("/Quadcopter[1]")]
    simulation.drone.body.move(Pose((2.0, -5.0, 0.5)))
    result, way, pair = check_distance(sim, "/Quadcopter", "all")
    assert pair[1] == sim.getObject("/Floor") and way[5] == pytest.approx(0.0, abs=1e-6) and way[6] < 0.5


@pytest.mark.parametrize("turned", [False, True])
def test_the_distance_from_a_point(sim, turned):
    names = ("/Near", "/Wall") if not turned else ("/Wall", "/Near")
    result, way, _ = check_distance(sim, *names)
    ends = way[:3], way[3:6]
    assert result == 1 and ends[turned] == pytest.approx([9, 9, 1.25])
    assert way[6] == pytest.approx(math.dist((9, 9), (3.1, 2)), abs=1e-3)
    assert check_distance(sim, "/Near", "/Frame")[1][6] == pytest.approx(math.dist((9, 9, 1.25), (-6, 0, 1)))
    assert check_distance(sim, "/Near", "/Frame", 3)[0] == 0


def test_a_target_is_a_point_whatever_its_parent_is(sim):
    target = sim.getObject("/target")
    for parent in (sim.getObject("/Quadcopter"), -1):
        sim.setObjectParent(target, parent, True)
        sim.setObjectPosition(target, -1, [0, 0, 5])
        assert 3.5 < check_distance(sim, "/Quadcopter", "/target")[1][6] < 4.1


def test_a_point_inside_a_shape_has_its_distance_to_the_surface(simulation, sim):
    sim.setObjectPosition(sim.getObject("/Near"), -1, [3.08, 0, 2])
    way = check_distance(sim, "/Near", "/Wall")[1]
    assert way[6] == pytest.approx(0.02, abs=1e-3) and way[3] == pytest.approx(3.1, abs=1e-3)
    assert sim.checkCollision(sim.getObject("/Near"), sim.getObject("/Wall"))[0] == 0, "a point has no collisions"
    sim.setObjectPosition(sim.getObject("/Near"), -1, [9, 9, 1.25])


def test_a_child_shape_moves_with_its_parent(sim):
    before = check_distance(sim, "/Arm", "/Pole")[1][6]
    sim.setObjectPosition(sim.getObject("/Frame"), -1, [-6.5, 0, 1])
    assert check_distance(sim, "/Arm", "/Pole")[1][6] == pytest.approx(before + 0.5, abs=1e-4)
    sim.setObjectPosition(sim.getObject("/Frame"), -1, [-6, 0, 1])


def test_the_distance_of_a_shape_on_a_joint(sim):
    _, way, _ = check_distance(sim, "/Leaf", "/Floor")
    assert way[6] == pytest.approx(0.95, abs=1e-3) and way[1] == pytest.approx(-6, abs=0.06)


def test_a_collision_is_reported_with_its_pair(simulation, sim):
    drone, wall = sim.getObject("/Quadcopter"), sim.getObject("/Wall")
    assert sim.checkCollision(drone, wall) == sim.checkCollision(drone, sim.handle_all) == (0, [-1, -1])
    simulation.drone.body.move(Pose((2.95, 0.0, 2.0)))
    assert sim.checkCollision(drone, wall) == sim.checkCollision(drone, sim.handle_all) == (1, [drone, wall])
    assert check_distance(sim, "/Quadcopter", "/Wall")[1][6] == 0.0
    simulation.drone.body.move(Pose((9.0, 9.0, 1.0)))
    assert sim.checkCollision(drone) == (1, [drone, sim.getObject("/Cuboid")]), "unnamed shapes count"


# ---- collections


def collect(sim, *items):
    handle = sim.createCollection(0)
    for item_kind, path, *options in items:
        sim.addItemToCollection(handle, item_kind, sim.getObject(path), *options)
    return handle


def paths(sim, collection):
    return [sim.getObjectAlias(one, 1) for one in sim.getCollectionObjects(collection)]


def test_the_objects_of_a_collection(sim):
    frame = collect(sim, (sim.handle_tree, "/Frame"))
    assert paths(sim, frame) == ["/Frame", "/Frame/Arm"]
    assert paths(sim, collect(sim, (sim.handle_tree, "/Frame", 2))) == ["/Frame/Arm"]
    assert paths(sim, collect(sim, (sim.handle_chain, "/Frame/Arm"))) == ["/Frame/Arm", "/Frame"]
    assert paths(sim, collect(sim, (sim.handle_chain, "/Frame/Arm", 2))) == ["/Frame"]
    most = collect(sim, (sim.handle_single, "/Wall"), (sim.handle_tree, "/Frame"), (sim.handle_single, "/Frame", 1))
    assert paths(sim, most) == ["/Wall", "/Frame/Arm"]
    sim.addItemToCollection(most, sim.handle_all)
    assert len(sim.getCollectionObjects(most)) == len(sim.getObjectsInTree(sim.handle_scene))
    sim.setObjectParent(sim.getObject("/Frame/Arm"), -1, True)
    assert paths(sim, frame) == ["/Frame"], "a tree item follows changes of the tree"
    sim.setObjectParent(sim.getObject("/Arm"), sim.getObject("/Frame"), True)
    sim.emptyCollection(most)
    assert sim.getCollectionObjects(most) == []
    sim.removeCollection(most)
    with pytest.raises(ValueError, match=f"no collection with the handle {most}"):
        sim.getCollectionObjects(most)
    sim.destroyCollection(sim.handle_all)


def test_collections_of_3_x_have_names(sim):
    handle = sim.createCollection("walls", 0)
    assert sim.addObjectToCollection(handle, sim.getObject("/Wall"), sim.handle_single, 0) == 1
    assert sim.getCollectionHandle("walls") == sim.getCollectionHandle("walls#") == handle
    assert sim.getCollectionName(handle) == "walls" and paths(sim, handle) == ["/Wall"]
    with pytest.raises(ValueError, match="walls"):
        sim.createCollection("walls", 0)
    with pytest.raises(ValueError, match="no collection named 'wall'; near names are walls"):
        sim.getCollectionHandle("wall")
    sim.destroyCollection(sim.handle_all)


def test_the_shortest_distance_between_collections_and_objects(simulation, sim):
    drone, obstacles = sim.getObject("/Quadcopter"), collect(sim, (sim.handle_all, "/Wall"))
    sim.addItemToCollection(obstacles, sim.handle_tree, drone, 1)
    for path in ("/target", "/Quadcopter[1]"):
        sim.addItemToCollection(obstacles, sim.handle_tree, sim.getObject(path), 1)
    simulation.drone.body.move(Pose((2.0, -5.0, 0.5)))
    _, way, pair = sim.checkDistance(drone, obstacles)
    assert pair == [drone, sim.getObject("/Floor")] and way == check_distance(sim, "/Quadcopter", "/Floor")[1]
    poles = collect(sim, (sim.handle_single, "/Pole"), (sim.handle_single, "/Wall"))
    _, way, pair = sim.checkDistance(poles, sim.getObject("/Near"))
    assert pair == [sim.getObject("/Wall"), sim.getObject("/Near")] and way == check_distance(sim, "/Wall", "/Near")[1]
    _, way, pair = sim.checkDistance(poles, sim.handle_all)
    assert pair[1] == sim.getObject("/Floor") and way[6] == pytest.approx(0, abs=1e-6), "not within the collection"
    _, way, pair = sim.checkDistance(poles, poles)
    assert pair == [sim.getObject("/Pole"), sim.getObject("/Wall")] and way == check_distance(sim, "/Pole", "/Wall")[1]
    assert sim.checkDistance(collect(sim), sim.handle_all) == (0, [0.0] * 7, [-1, -1])


def test_a_collection_collides_if_one_of_its_objects_does(simulation, sim):
    robot = collect(sim, (sim.handle_tree, "/Quadcopter"))
    walls = collect(sim, (sim.handle_single, "/Pole"), (sim.handle_single, "/Wall"))
    assert sim.checkCollision(robot, walls) == (0, [-1, -1])
    simulation.drone.body.move(Pose((2.95, 0.0, 2.0)))
    pair = [sim.getObject("/Quadcopter"), sim.getObject("/Wall")]
    assert sim.checkCollision(robot, walls) == sim.checkCollision(robot, sim.handle_all) == (1, pair)
    assert sim.checkCollision(walls, robot) == (1, pair[::-1])
    assert sim.checkCollision(pair[1], robot) == (1, pair[::-1])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("sim.addItemToCollection(sim.createCollection(0), 7, sim.getObject('/Wall'), 0)", "handle_single, _tree"),
        (
            "sim.addItemToCollection(4711, sim.handle_single, sim.getObject('/Wall'), 0)",
            "no collection with the handle",
        ),
        (
            "sim.addItemToCollection(sim.createCollection(0), sim.handle_tree, 4711, 0)",
            "no object with the handle 4711",
        ),
        ("sim.checkCollision(sim.getObject('/Wall'), sim.getObject('/Wall'))", "parts of one rigid body"),
        ("sim.checkDistance(sim.getObject('/Near'), sim.handle_all)", "'Near' is a point"),
        ("sim.checkDistance(99999, sim.handle_all)", "no object with the handle 99999"),
        ("sim.checkDistance(sim.getObject('/Near'), sim.getObject('/Wall'), float('nan'))", "finite numbers"),
    ],
)
def test_an_invalid_call_is_refused(sim, call, said):
    with pytest.raises((ValueError, TypeError), match=said):
        eval(call)
