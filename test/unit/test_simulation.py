"""Repeated starts and stops, snapshots, and the resources that every run must release."""

import gc
import os
from itertools import pairwise

import pybullet
import pytest

from drone_sim.forces.pushes import Push
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.run.stepping import Diverged
from drone_sim.scripting.errors import ScriptError

RUNS = 100
LEAK = 20 * 30_000  # bytes that 20 runs may add to the process: 30 kB a run
SMALL = {name: {"width": 16, "height": 12} for name in ("front", "track")}
CLUTTER = [
    {"name": "Tower", "shape": "box", "size": [0.3, 0.3, 0.3], "position": [0.0, 0.0, 0.15], "mass": 0.5},
    {"name": "Top", "shape": "box", "size": [0.2, 0.2, 0.2], "position": [0.05, 0.0, 0.42], "mass": 0.2},
    {"name": "Ball", "shape": "sphere", "size": [0.1], "position": [0.3, 0.25, 0.9], "mass": 0.1},
    {"name": "Log", "shape": "cylinder", "size": [0.1, 0.5], "position": [0.6, 0, 0.5], "rpy": [1.4, 0, 0], "mass": 1},
]
COUNTING = """
def sysCall_init(): print('init')
def sysCall_actuation(): {actuation}
def sysCall_cleanup(): print('cleanup')
"""


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    def simulate(script="", **overrides):
        return new_simulation({"cameras": SMALL, **overrides}, script=str(script))

    return simulate


def full_state(simulation):
    """Return the time, the states of all moving objects, and the current command."""
    objects = simulation.context.objects
    moving = [objects[handle].body.state for handle in objects if objects[handle].body is not None]
    return [simulation.time, simulation.drone.body.state, *moving, simulation.drone.commands.now]


def fly(simulation, steps):
    path = []
    for _ in range(steps):
        simulation.step()
        path.append(full_state(simulation))
    return path


def maneuver(simulation):
    simulation.drone.commands.receive(Twist(Vector3(1.0, -0.5, 0.3), Vector3(0, 0, 0.6)))
    simulation.drone.pushes.add(Push((0.4, 0.3, 0.0), (0.0, 0.01, 0.0), 0.4))


def resources():
    """Return resident memory (bytes) and the numbers of open files and PyBullet clients."""
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        resident = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    clients = [client for client in range(100) if pybullet.getConnectionInfo(client)["isConnected"]]
    return resident, len(os.listdir("/proc/self/fd")), len(clients)


@pytest.mark.long
def test_100_runs_give_the_same_flight_and_leak_nothing(simulate):
    simulation = simulate(scene={"objects": CLUTTER})
    first, measured = None, []
    for run in range(RUNS):
        maneuver(simulation)
        path = fly(simulation, 5)
        first = first or path
        assert path == first
        simulation.stop()
        simulation.start()
        if run in (39, 59, 79, 99):  # by then the caches are full and the heap is stable
            measured.append(resources())
    assert {one[1:] for one in measured} == {measured[0][1:]}
    # A leak grows in every interval; other memory, of earlier tests, may change once.
    assert min(after[0] - before[0] for before, after in pairwise(measured)) < LEAK


def test_simultaneous_worlds_do_not_affect_each_other(simulate):
    reference = fly(simulate(scene={"objects": CLUTTER}), 20)
    first, second = simulate(scene={"objects": CLUTTER}), simulate(scene={"objects": CLUTTER})
    path = fly(first, 10)
    second.start()
    fly(second, 7)
    second.stop()
    assert path + fly(first, 10) == reference
    second.start()
    assert fly(second, 20) == reference


@pytest.mark.parametrize("script", ["", "tutorial_v3", "tutorial_v4"])
def test_restored_flight_is_bit_identical(simulate, script):
    """The snapshot is taken during a manoeuvre and a push, while objects of the scene tumble."""
    simulation = simulate(script, scene={"objects": CLUTTER})
    maneuver(simulation)
    fly(simulation, 4)
    snapshot, now = simulation.snapshot(), full_state(simulation)
    path = fly(simulation, 40)
    assert path[-1][3:] != now[3:], "the objects of the scene did not move"
    for steps in (3, 25, 40):
        simulation.drone.body.move(Pose((3, 3, 3), (0, 0, 0, 1)))
        simulation.drone.pushes.add(Push((0, 0, 5), (0, 0, 0), 1.0))
        simulation.restore(snapshot)
        assert full_state(simulation) == now
        assert fly(simulation, steps) == path[:steps]
    simulation.forget(snapshot)
    simulation.stop()
    with pytest.raises(ValueError, match="earlier run"):
        simulation.restore(snapshot)


def test_stop_restores_the_initial_scene(simulate):
    simulation = simulate(scene={"objects": CLUTTER})
    initial = full_state(simulation)
    target = simulation.context.objects.matrix(simulation.context.objects.handle("DronePosition"))
    maneuver(simulation)
    fly(simulation, 20)
    objects = simulation.context.objects
    objects.set_matrix(objects.handle("DronePosition"), -1, frames.from_rpy((5, 5, 5), (0, 0, 0)))
    simulation.stop()
    assert full_state(simulation) == initial
    objects = simulation.context.objects
    assert objects.matrix(objects.handle("DronePosition")) == target
    assert not simulation.running


def test_start_reads_script_and_scene_again(simulate, tmp_path):
    script, scene = tmp_path / "script.py", tmp_path / "scene.yaml"
    script.write_text("def sysCall_init(): self.x = sim.getObjectPosition(sim.getObject('/Drone'), -1)[0]\n")
    scene.write_text(
        "drone: {position: [1, 0, 2]}\nobjects: [{name: A, shape: sphere, size: [1], position: [5, 0, 1]}]"
    )
    simulation = simulate(script, scene_file=str(scene))
    assert "A" in simulation.context.objects
    script.write_text("def sysCall_init(): sim.setInt32Signal('edited', 1)\n")
    scene.write_text("drone: {yaw: 0.5}\n")
    simulation.stop()
    assert simulation.drone.body.state.position[0] == 1.0 and "A" in simulation.context.objects
    simulation.start()
    assert simulation.drone.body.state.position == (0.0, 0.0, 0.8), "a removed value returns to its default"
    assert "A" not in simulation.context.objects
    assert simulation.context.signals.get(int, "edited") == 1
    simulation.start(scene_file="")
    assert frames.to_euler(simulation.drone.body.matrix)[2] == 0.0


MESH = "objects: [{shape: mesh, file: %s, position: [0, 0, 0]}]"


@pytest.mark.parametrize("wrong", [MESH % "no.obj", MESH % "scene.yaml", "drone: [", "x: 1"])
def test_unreadable_scene_leaves_the_previous_scene(simulate, tmp_path, wrong):
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "drone: {position: [1, 0, 2]}\nobjects: [{name: A, shape: sphere, size: [1], position: [5, 0, 1]}]"
    )
    simulation = simulate(scene_file=str(scene))
    path = fly(simulation, 10)
    good = scene.read_text()
    scene.write_text(wrong)
    with pytest.raises(parameters.ParameterError) as caught:
        simulation.start()
    assert str(tmp_path) in str(caught.value) and "\n" not in str(caught.value)
    assert (simulation.running, simulation.time, simulation.drone.body.state.position) == (False, 0.0, (1.0, 0.0, 2.0))
    assert simulation.drone.cameras["front"].take().shape == (12, 16, 3)
    scene.write_text(good)
    simulation.start()
    assert fly(simulation, 10) == path


@pytest.mark.parametrize("end", ["stop", "close", "start", "error", "close twice", "stop twice"])
def test_cleanup_runs_once_for_every_way_to_end(simulate, tmp_path, caplog, end):
    caplog.set_level("INFO")
    script = tmp_path / "script.py"
    script.write_text(COUNTING.format(actuation="1 / 0" if end == "error" else "pass"))
    simulation = simulate(script)
    if end == "error":
        with pytest.raises(ScriptError, match="ZeroDivisionError"):
            simulation.step()
        simulation.stop()
    else:
        simulation.step()
        for _ in range(2 if "twice" in end else 1):
            getattr(simulation, end.split()[0])()
    assert [record.getMessage() for record in caplog.records].count("cleanup") == 1


@pytest.mark.parametrize("end", ["stop", "close"])
def test_failing_cleanup_runs_only_once(simulate, tmp_path, caplog, end):
    caplog.set_level("INFO")
    script = tmp_path / "script.py"
    script.write_text("def sysCall_cleanup():\n    print('cleanup')\n    1 / 0\n")
    simulation = simulate(script)
    with pytest.raises(ScriptError, match=r"\[cleanup\]"):
        getattr(simulation, end)()
    simulation.close()
    assert [record.getMessage() for record in caplog.records].count("cleanup") == 1


def test_a_scene_that_cannot_be_built_leaves_the_previous_scene(simulate, tmp_path):
    """The error, a name that the drone already has, is found only while the scene is built."""
    simulation = simulate(scene={"objects": CLUTTER})
    world, drone, path = simulation.world, simulation.drone, fly(simulation, 10)
    scene = tmp_path / "scene.yaml"
    scene.write_text("objects: [{name: Drone, shape: sphere, size: [1], position: [9, 0, 1]}]")
    before = resources()[1:]
    for _ in range(3):
        with pytest.raises(parameters.ParameterError, match="named 'Drone' already exists"):
            simulation.start(scene_file=str(scene))
    assert simulation.world is world and simulation.drone is drone and resources()[1:] == before
    simulation.start()
    assert fly(simulation, 10) == path


def test_a_nan_force_ends_the_flight_with_a_one_line_error(simulate):
    simulation = simulate()
    path = fly(simulation, 3)
    simulation.drone.pushes.add(Push((0.0, 0.0, float("nan")), (0.0, 0.0, 0.0), 1.0))
    with pytest.raises(Diverged, match=r"the simulation has diverged at t = 0\.\d\d s: position") as raised:
        fly(simulation, 20)
    assert "\n" not in str(raised.value)
    simulation.start()
    assert fly(simulation, 3) == path


@pytest.mark.parametrize("script", ["missing.py", "missing.lua", "nosuch", "x" * 300 + ".py", "a\0.py"])
def test_a_missing_script_raises_a_one_line_error(tmp_path, script):
    for started in (True, False):
        with pytest.raises(ScriptError) as raised:
            Simulation(parameters.load(), script=script, started=started)
        assert "\n" not in str(raised.value)


def test_start_with_a_deleted_script_fails_and_the_simulation_can_be_stopped(simulate, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("def sysCall_init(): pass\n")
    simulation = simulate(script)
    simulation.stop()
    script.unlink()
    with pytest.raises(ScriptError, match="no such file"):
        simulation.start()
    simulation.stop()
    assert not simulation.running


def test_world_with_a_window_is_reused_and_gives_the_same_flight(simulate, tmp_path):
    """A process has at most one window; `_gui` is set here without opening it."""
    simulation = simulate(scene={"objects": CLUTTER})
    simulation._gui = True
    world, path = simulation.world, fly(simulation, 10)
    scene = tmp_path / "scene.yaml"
    scene.write_text("objects: [{name: Drone, shape: sphere, size: [1], position: [9, 0, 1]}]")
    with pytest.raises(parameters.ParameterError, match="named 'Drone' already exists"):
        simulation.start(scene_file=str(scene))
    simulation.start()
    assert simulation.world is world
    assert fly(simulation, 10) == path


def test_memory_of_a_script_is_freed_at_the_next_start(tmp_path, new_simulation):
    script = tmp_path / "eats.lua"
    script.write_text("t = {}\nfor i = 1, 500000 do t[i] = {i} end\nfunction sysCall_init() end\n")
    simulation = new_simulation({"script_time_limit": 0.0})
    simulation.start()
    before = resources()[0]
    simulation.script = str(script)
    simulation.start()
    used = resources()[0] - before
    simulation.script = ""
    simulation.start()
    assert used > 30e6
    assert resources()[0] - before < used / 4


def test_a_scene_that_cannot_be_restored_at_stop_is_read_again_at_start(simulate, tmp_path, caplog):
    mesh = tmp_path / "wedge.obj"
    wedge = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    mesh.write_text(wedge)
    wedge_object = {"name": "Wedge", "shape": "mesh", "file": str(mesh), "position": [3, 0, 0.5]}
    simulation = simulate(
        scene={"objects": [wedge_object, {"name": "Crate", "shape": "box", "size": [0.2] * 3, "position": [2, 0, 1]}]}
    )
    simulation.operations.remove([simulation.object_handles["Crate"]])
    mesh.unlink()
    simulation.stop()
    assert any("wedge.obj" in one.getMessage() for one in caplog.records)
    mesh.write_text(wedge)
    simulation.start()
    assert "Crate" in simulation.object_handles
