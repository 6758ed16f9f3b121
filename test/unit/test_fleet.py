"""Several vehicles in one world: independent control, collisions, adding and removing, scenes."""

import ctypes
import gc
import math
import os
from pathlib import Path

import numpy as np
import pytest
import yaml

from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters

THREE = {"drone1": {"position": [0, 0, 0.8]}, "drone2": {"position": [0, 3, 1.2]}, "drone3": {"position": [2, -3, 2]}}


@pytest.fixture(name="fly")
def _fly(new_simulation):
    return lambda **overrides: new_simulation(overrides)


def path(simulation, name, steps):
    """Step, and return the states of the vehicle `name` after each step."""
    states = []
    for _ in range(steps):
        simulation.step()
        states.append(simulation.vehicles[name].body.state)
    return states


def forward(speed):
    return Twist(Vector3(speed, 0.0, 0.0))


def test_a_number_of_vehicles_creates_a_row(fly):
    simulation = fly(vehicles=3)
    places = {name: vehicle.body.state.position for name, vehicle in simulation.vehicles.items()}
    assert places == {"drone1": (0, 1, 0.8), "drone2": (0, 0, 0.8), "drone3": (0, -1, 0.8)}


def test_each_vehicle_obeys_its_own_commands(fly):
    simulation = fly(vehicles=THREE)
    simulation.vehicles["drone1"].commands.receive(forward(1.0))
    simulation.vehicles["drone3"].commands.receive(Twist(Vector3(0.0, 0.0, 0.5)))
    for _ in range(100):
        simulation.step()
    one, two, three = (vehicle.body.state.position for vehicle in simulation.vehicles.values())
    assert one[0] > 3 and one[1:] == pytest.approx((0, 0.8), abs=0.05)
    assert two == pytest.approx((0, 3, 1.2), abs=0.005)
    assert three[2] > 3.5 and three[:2] == pytest.approx((2, -3), abs=0.01)


def test_a_vehicle_in_a_fleet_flies_exactly_as_if_alone(fly):
    company, alone = fly(vehicles=THREE), fly(drone={"position": [0, 3, 1.2]})
    for simulation, name in ((company, "drone2"), (alone, "drone")):
        simulation.vehicles[name].commands.receive(Twist(Vector3(0.7, -0.2, 0.1), Vector3(0.0, 0.0, 0.4)))
    assert path(company, "drone2", 200) == path(alone, "drone", 200)


def test_an_entry_overrides_only_its_own_vehicle_s_parameters(fly):
    simulation = fly(
        vehicles={"slow": {"control": {"angle_max": 0.1}, "script_parameters": {"MyGain": 3}}, "fast": {"yaw": 1.0}},
        control={"angle_max": 0.4},
    )
    slow, fast = (one.parameters for one in simulation.child_scripts.values())
    assert slow["angle_max"] == 0.1 and slow["Kzref"] == 5.0
    assert fast["angle_max"] == 0.4
    assert slow["MyGain"] == 3.0 and "MyGain" not in fast


@pytest.mark.parametrize(
    "vehicles, said",
    [
        ({"a": {"controll": {}}}, r"parameter vehicles/a/controll: unknown key; near names are control"),
        ({"a": {"control": {"Kzref": -1}}}, r"parameter vehicles/a/control/Kzref = -1: .*greater than or equal to 0"),
        ({"a b": {}}, r"parameter vehicles/a b.*: must begin with a letter"),
        ({"a": {"name": "b"}}, r"parameter vehicles/a/name: unknown key"),
        ({"a": 3}, r"parameter vehicles/a = 3: must hold `key: value` lines"),
        (2.5, r"parameter vehicles = 2\.5: must be a whole number from 0 to 256"),
        (257, r"parameter vehicles = 257: must be a whole number from 0 to 256"),
        ([1], r"parameter vehicles = \[1\]: must be a whole number from 0 to 256, or entries"),
        ("many", r"parameter vehicles = 'many': must be a whole number from 0 to 256, or entries"),
        (math.nan, r"parameter vehicles = nan: must be a whole number"),
        (math.inf, r"parameter vehicles = inf: must be a whole number"),
        (True, r"parameter vehicles = True: must be a whole number"),
        (None, r"parameter vehicles = None: must be a whole number"),
        ({"a": {"cameras": {"front": {"width": 0}}}}, r"parameter vehicles/a/cameras/front/width = 0: "),
    ],
)
def test_the_error_names_a_wrong_entry(vehicles, said):
    with pytest.raises(parameters.ParameterError, match=said) as refused:
        parameters.load({"vehicles": vehicles})
    assert "\n" not in str(refused.value)


def test_a_wrong_top_level_value_is_reported_once():
    with pytest.raises(parameters.ParameterError) as refused:
        parameters.load({"vehicles": 5, "control": {"Kzref": "much"}})
    assert str(refused.value).count("Kzref") == 1


def test_two_vehicles_collide_and_separate(fly):
    simulation = fly(vehicles={"left": {"position": [0, 0, 1]}, "right": {"position": [1.5, 0, 1], "yaw": math.pi}})
    vehicles = simulation.vehicles.values()
    for vehicle in vehicles:
        vehicle.commands.receive(forward(0.6))
    apart = []
    for _ in range(36):
        simulation.step()
        apart.append(math.dist(*(vehicle.body.state.position for vehicle in vehicles)))
    assert 0.3 < min(apart) < 0.4, "they touch: each reaches about 0.17 m from its centre"
    for vehicle in vehicles:
        vehicle.commands.receive(forward(-0.6))
    for _ in range(80):
        simulation.step()
    left, right = (vehicle.body.state.position for vehicle in vehicles)
    assert right[0] - left[0] > 2 and left[2] == pytest.approx(right[2], abs=0.05) and left[2] > 0.5


def test_a_vehicle_appears_in_another_vehicle_s_camera(fly):
    simulation = fly(vehicles={"one": {}, "two": {"position": [1.5, 0, 0.9]}})
    camera = simulation.drone.cameras["front"]
    with_two = camera.take().astype(int)
    simulation.vehicles["two"].body.move(Pose((-3.0, 0.0, 0.9)))
    without = camera.take().astype(int)
    changed = np.abs(with_two - without).max(axis=2) > 20
    rows, columns = np.nonzero(changed)
    assert changed.sum() > 500 and abs(columns.mean() - 320) < 40, "the other drone is straight ahead"
    assert rows.min() < 240 < rows.max() or rows.mean() < 300


def test_scripts_share_signals_and_find_their_own_vehicle(fly, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "def sysCall_init():\n"
        "    self.own = sim.getObjectHandle('Quadricopter_base')\n"
        "    seen = sim.getInt32Signal('seen') or 0\n"
        "    sim.setInt32Signal('seen', seen + 1)\n"
        "    self.number = seen + 1\n"
        "def sysCall_sensing():\n"
        "    sim.setFloatSignal(f'y{self.number}', sim.getObjectPosition(self.own, -1)[1])\n",
        encoding="utf-8",
    )
    simulation = fly(vehicles=3, script=str(script))
    simulation.step()
    signals = simulation.context.signals
    assert signals.get(int, "seen") == 3
    assert [signals.get(float, f"y{number}") for number in (1, 2, 3)] == pytest.approx([1, 0, -1], abs=1e-6)


def test_adding_and_removing_vehicles_does_not_change_other_flights(fly):
    quiet, busy = fly(vehicles=THREE), fly(vehicles=THREE)
    for simulation in (quiet, busy):
        simulation.vehicles["drone2"].commands.receive(Twist(Vector3(0.5, 0.1, 0.0), Vector3(0.0, 0.0, 0.3)))
    expected = path(quiet, "drone2", 90)
    flown = path(busy, "drone2", 30)
    assert busy.set_vehicles({**THREE, "guest": {"position": [-2, 0, 1]}}) == (["guest"], [])
    flown += path(busy, "drone2", 30)
    assert busy.vehicles["guest"].body.state.position == pytest.approx((-2, 0, 1), abs=0.02), "it hovers"
    assert busy.set_vehicles({name: THREE[name] for name in ("drone2", "drone3")}) == ([], ["drone1", "guest"])
    flown += path(busy, "drone2", 30)
    assert flown == expected
    assert list(busy.vehicles) == ["drone2", "drone3"]


def test_adding_and_removing_a_vehicle_leaks_no_files_names_or_visuals(fly):
    simulation = fly(vehicles=2)
    files, names = open_files(), set(simulation.context.objects.names)
    visuals = len(simulation.world.pictures.visuals())
    for _ in range(50):
        simulation.set_vehicles({"drone1": {}, "drone2": {}, "guest": {"position": [-2, 0, 1]}})
        simulation.step()
        simulation.set_vehicles({"drone1": {}, "drone2": {}})
        simulation.step()
    assert open_files() == files
    assert set(simulation.context.objects.names) == names
    assert len(simulation.world.pictures.visuals()) == visuals
    simulation.set_vehicles({"drone1": {}, "drone2": {}, "guest": {}})
    assert simulation.vehicles["guest"].object_name == "Drone#1", "the suffix of the removed vehicle is free again"


def test_removed_vehicles_free_their_memory_and_files(fly):
    """PyBullet keeps about 13 kB of each body until the next start."""
    simulation = fly(vehicles=1)
    folder = Path(simulation.world._files._folder.name)

    def add_and_remove(times):
        for _ in range(times):
            simulation.set_vehicles({"drone1": {}, "guest": {"position": [-2, 0, 1]}})
            simulation.set_vehicles({"drone1": {}})
        gc.collect()

    add_and_remove(5)
    files = sorted(folder.iterdir())
    growth = []
    for _ in range(3):
        before = allocated()
        add_and_remove(15)
        growth.append(allocated() - before)
    assert sorted(folder.iterdir()) == files
    # A leak grows in every round. A table of the process that doubles its size grows in only one of them.
    assert min(growth) < 15 * 16_000


class Mallinfo(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_size_t)
        for name in ("arena", "free", "fast", "maps", "mapped", "x", "free_fast", "used", "unused", "top")
    ]


def allocated():
    """Return the number of bytes allocated by C code."""
    mallinfo = ctypes.CDLL(None).mallinfo2
    mallinfo.restype = Mallinfo
    return mallinfo().used


def open_files():
    return len(os.listdir("/proc/self/fd"))


def test_a_vehicle_whose_script_fails_is_removed_with_those_added_before_it(fly, tmp_path):
    script = tmp_path / "broken.py"
    script.write_text("def sysCall_init():\n    no_such_name\n", encoding="utf-8")
    simulation = fly(vehicles=1)
    simulation.step()
    names = set(simulation.context.objects.names)
    with pytest.raises(Exception, match="no_such_name"):
        simulation.set_vehicles(
            {"drone1": {}, "sound": {"position": [2, 0, 1]}, "guest": {"script": str(script), "position": [3, 3, 1]}}
        )
    assert list(simulation.vehicles) == ["drone1"] == [vehicle.name for vehicle in simulation.parameters.fleet]
    assert simulation.running
    assert set(simulation.context.objects.names) == names
    simulation.step()


def test_vehicles_are_removed_although_their_cleanup_fails(fly, tmp_path):
    script = tmp_path / "broken.py"
    script.write_text("def sysCall_init():\n    pass\n\n\ndef sysCall_cleanup():\n    no_such_name\n", encoding="utf-8")
    failing = {"script": str(script)}
    simulation = fly(vehicles={"a": failing, "b": {**failing, "position": [2, 0, 1]}, "c": {"position": [4, 0, 1]}})
    with pytest.raises(Exception, match="no_such_name"):
        simulation.set_vehicles({"c": {}})
    assert list(simulation.vehicles) == ["c"] == [vehicle.name for vehicle in simulation.parameters.fleet]
    simulation.step()


def test_a_vehicle_that_cannot_be_built_leaves_nothing_behind(fly):
    simulation = fly(vehicles=1)
    names, bodies = set(simulation.context.objects.names), len(simulation.world.pictures.visuals())
    wrong = {"guest": {"cameras": {"front": {"frame": "nowhere"}}, "position": [2, 0, 1]}}
    with pytest.raises(parameters.ParameterError, match="nowhere"):
        simulation.set_vehicles({"drone1": {}, **wrong})
    assert set(simulation.context.objects.names) == names and len(simulation.world.pictures.visuals()) == bodies
    simulation.step()


def test_start_restores_the_vehicles_set_last(fly):
    simulation = fly(vehicles=2)
    simulation.set_vehicles({"drone1": {"position": [1, 1, 1]}})
    assert list(simulation.vehicles) == ["drone1"]
    simulation.start()
    assert simulation.drone.body.state.position == (1, 1, 1)


def test_a_snapshot_restores_all_vehicles_until_the_fleet_changes(fly):
    simulation = fly(vehicles=3)
    for vehicle in simulation.vehicles.values():
        vehicle.commands.receive(forward(0.3))
    path(simulation, "drone1", 20)
    snapshot = simulation.snapshot()
    flown = [path(simulation, "drone1", 20), [vehicle.body.state for vehicle in simulation.vehicles.values()]]
    simulation.restore(snapshot)
    assert [path(simulation, "drone1", 20), [vehicle.body.state for vehicle in simulation.vehicles.values()]] == flown
    simulation.set_vehicles(4)
    with pytest.raises(ValueError, match="from an earlier run"):
        simulation.restore(snapshot)


def test_a_scene_defines_the_vehicles_and_saves_them(fly, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "objects: []\nvehicles:\n  red: {position: [1, 0, 1], script: target}\n  blue: {position: [-1, 0, 1]}\n"
    )
    simulation = fly(scene_file=str(scene), vehicles=7)
    assert list(simulation.vehicles) == ["red", "blue"]
    simulation.vehicles["blue"].body.move(Pose((-1.5, 2.0, 1.0)))
    simulation.save_scene(tmp_path / "saved.yaml")
    saved = yaml.safe_load((tmp_path / "saved.yaml").read_text())["vehicles"]
    assert saved["red"]["script"] == "target" and saved["blue"]["position"] == [-1.5, 2.0, 1.0]
    again = fly(scene_file=str(tmp_path / "saved.yaml"))
    assert again.vehicles["blue"].body.state.position == (-1.5, 2.0, 1.0)


def test_the_error_names_the_line_of_a_wrong_vehicle_in_a_scene(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text("vehicles:\n  red:\n    position: [1, 0]\n")
    with pytest.raises(
        parameters.ParameterError, match=r"scene\.yaml: line 3: parameter vehicles/red/position = \[1, 0\]"
    ):
        parameters.load({"scene_file": str(scene)})


@pytest.mark.parametrize(
    "given, prefixes",
    [
        ({"vehicles": {"drone": {"position": [1, 0, 1]}}}, [""]),
        ({"vehicles": {"drone1": {}}}, ["drone1/"]),
        ({"vehicles": {"drone": {}, "drone1": {"position": [1, 0, 1]}}}, ["drone/", "drone1/"]),
        ({"drone": {"name": "red"}}, ["red/"]),
    ],
)
def test_frame_prefixes_are_empty_only_for_a_single_vehicle_named_drone(given, prefixes):
    assert [one.frame_prefix for one in parameters.load(given).fleet] == prefixes
