"""The objects of the scene: names, paths, parents, where cameras look."""

import pytest

from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.scripting.api.names import NameFunctions


@pytest.fixture(name="simulation", scope="module")
def _simulation(new_shared_simulation):
    return new_shared_simulation()


@pytest.fixture(name="objects")
def _objects(simulation):
    simulation.drone.reset()
    return simulation.context.objects


@pytest.fixture(name="find")
def _find(simulation, objects):
    """Return sim.getObject of the drone's script, but with the object's name in place of its handle."""
    functions = NameFunctions(simulation.child_scripts["drone"])

    def found(path, **options):
        handle = functions.getObject(path, options)
        return handle if handle == -1 else objects[handle].name

    return found


@pytest.mark.parametrize(
    "path, name",
    [
        ("Drone", "Drone"),
        ("Quadricopter", "Drone"),
        ("Quadcopter", "Drone"),
        ("Quadricopter_base", "Quadricopter_base"),
        ("Quadricopter_base#", "Quadricopter_base"),
        ("Quadricopter_base#0", "Quadricopter_base"),
        ("Quadricopter_target", "DronePosition"),
        ("/Quadcopter", "Drone"),
        ("/Quadcopter/base", "Quadricopter_base"),
        ("/Quadcopter/base/target", "DronePosition"),
        ("/propeller[0]/respondable/body/joint", "Quadricopter_propeller_joint1"),
        ("/Drone/base", "Quadricopter_base"),
        ("/Quadricopter/Quadricopter_base", "Quadricopter_base"),
        ("/base", "Quadricopter_base"),
        ("/target", "DronePosition"),
        ("./target", "DronePosition"),
        ("../target", "DronePosition"),
        (":/base", "Quadricopter_base"),
        (".", "Drone"),
        ("..", "Drone"),
        (":", "Drone"),
        ("./base", "Quadricopter_base"),
        ("./base/..", "Drone"),
        ("./propeller[0]/respondable", "Quadricopter_propeller_respondable1"),
        ("../propeller[2]/respondable", "Quadricopter_propeller_respondable3"),
        ("/Quadcopter/propeller[3]/joint", "Quadricopter_propeller_joint4"),
        ("/Quadcopter/propeller/joint", "Quadricopter_propeller_joint1"),
        ("/propeller[1]", "Quadricopter_propeller2"),
        ("/Quadcopter/respondable", "Quadricopter_propeller_respondable1"),
        ("/Quadcopter/body/../../joint", "Quadricopter_propeller_joint1"),
        ("/*/base", "Quadricopter_base"),
        ("/Quad*/prop*[2]/j?int", "Quadricopter_propeller_joint3"),
        ("./pro*[1]/*[0]", "Quadricopter_propeller_respondable2"),
        ("/Quadcopter/Script", "Drone_script"),
        ("./Script", "Drone_script"),
        ("../Script/..", "Drone"),
        ("/TrackCam", "TrackCam"),
        ("./Track_base/TrackCam", "TrackCam"),
        ("/FrontVision", "FrontVision"),
        ("/Floor", "Floor"),
        ("ResizableFloor_5_25", "Floor"),
    ],
)
def test_path_finds_the_object(find, path, name):
    assert find(path) == name


@pytest.mark.parametrize(
    "path, near",
    [
        ("Quadricopter_bas", "near names are Quadricopter_base"),
        ("/Quadcopter/propeller[4]", "/Quadcopter/propeller[3]"),
        ("/Quadcopter/bases", "/Quadcopter/base"),
        ("/", "no object '/';"),
        ("/Floor/base", "near names"),
        ("/Quadcopter/propeller[x]", "near names"),
        ("/Quadcopter/respondable[1]", "near names"),  # each propeller has only one
        ("/Quadcopter/zzz*", "no object '/Quadcopter/zzz*'"),
        ("/Quadcopter" + "/*" * 99, "no object"),
        ("/*" * 5000, "no object"),
        ("../..", "known are"),
        ("zzzzzzzz", "known are"),
    ],
)
def test_unknown_path_is_reported_with_near_names(find, path, near):
    with pytest.raises(ValueError, match="no object") as raised:
        find(path)
    assert near in str(raised.value)


def test_the_path_of_every_object_finds_that_object(find, objects):
    for handle in objects:
        assert find(objects.path(handle)) == objects[handle].name


def test_index_selects_among_all_objects_that_match_the_path(find):
    found = [find("/Quadcopter/respondable", index=index, noError=True) for index in range(5)]
    assert found == [f"Quadricopter_propeller_respondable{number}" for number in (1, 2, 3, 4)] + [-1]
    assert find("/Quadcopter/propeller[2]/*", index=2) == "Quadricopter_propeller_joint3"
    assert find("/*/*/respondable", index=3) == "Quadricopter_propeller_respondable4", "each match counts once"
    with pytest.raises(ValueError, match=r"no object '/Quadcopter/base' with the index 1, from 0"):
        find("/Quadcopter/base", index=1)


def test_relative_paths_start_at_the_proxy(find, objects):
    propeller = objects.handle("Quadricopter_propeller3")
    assert find("./joint", proxy=propeller) == "Quadricopter_propeller_joint3"
    assert find("..", proxy=propeller) == "Drone" and find(".", proxy=propeller) == "Quadricopter_propeller3"
    assert find(":/base", proxy=propeller) == "Quadricopter_base", "':' is the proxy's model"
    assert find("/base", proxy=propeller) == "Quadricopter_base", "an absolute path ignores the proxy"
    with pytest.raises(ValueError, match="no object with the handle 4711"):
        find("./joint", proxy=4711)


def test_parents_of_the_drones_objects(objects):
    def parent(name):
        return objects[objects.handle(name)].parent

    assert parent("Drone") is None
    assert parent("TrackCam").name == "Track_base"
    assert parent("Quadricopter_propeller_respondable2").name == "Quadricopter_propeller2"
    assert parent("DronePosition").name == "Quadricopter_base"


def test_target_without_parent_does_not_move_with_the_drone(simulation, objects):
    target = objects.handle("DronePosition")
    original = objects.matrix(target)
    assert frames.position(original) == pytest.approx((0, 0, 0.79))
    objects.set_parent(target, -1, True)
    simulation.drone.body.move(Pose((1, 2, 3)))
    assert objects.matrix(target) == original


def test_object_cannot_become_its_own_ancestor(objects):
    with pytest.raises(ValueError, match="its own ancestor"):
        objects.set_parent(objects.handle("Track_base"), objects.handle("TrackCam"), True)


@pytest.mark.parametrize("upwards", [False, True])
def test_depth_of_the_object_tree_is_limited(objects, upwards):
    """The limit holds in whichever order a script builds a chain."""
    handles = [objects.add(f"o{number}") for number in range(999)]
    pairs = list(zip(handles[1:], handles))
    with pytest.raises(ValueError, match=r"'o\d+'.* 200 "):
        for below, above in reversed(pairs) if upwards else pairs:
            objects.set_parent(below, above, True)
    assert len(objects.matrix(handles[-1])) == 12
    objects.remove(handles)


@pytest.mark.parametrize("name, toward", [("FrontVision", (1, 0, 0)), ("Quadricopter_floorCamera", (0, 0, -1))])
def test_cameras_look_along_z_with_x_to_the_left(objects, name, toward):
    m = objects.matrix(objects.handle(name), objects.handle("Drone"))
    assert (m[2], m[6], m[10]) == pytest.approx(toward, abs=1e-9)
    assert (m[0], m[4], m[8]) == pytest.approx((0, 1, 0), abs=1e-9)


def test_track_cam_looks_at_the_track_frame(objects):
    m = objects.matrix(objects.handle("TrackCam"), objects.handle("Track_base"))
    assert frames.position(m) == pytest.approx((-1.2, 0, 0.5))
    ahead = frames.transform(m, (0, 0, (1.2**2 + 0.5**2) ** 0.5))
    assert ahead == pytest.approx((0, 0, 0), abs=1e-12)
    assert m[9] > 0, "y is up"
