"""All changes of all kinds of objects, running and stopped, by a child script and by CoppeliaSim's own client.

DRONE_SIM_TIMES=100 repeats the changes 100 times and checks memory use, too.
"""

import concurrent.futures
import gc
import os
import re
from pathlib import Path

import pytest
import yaml
from living import KINDS, SCENE, picture, sizes
from remote_client import official_client

from drone_sim.editing.editor import SceneEditor
from drone_sim.remote.server import RemoteApiServer
from drone_sim.run.player import Player
from drone_sim.run.simulation import give_back_memory

TIMES = int(os.environ.get("DRONE_SIM_TIMES", "2"))
MEMORY_CHECK_TIMES = 50  # repetitions after which memory use no longer grows
MEMORY_LIMIT = 20e6  # bytes; PyBullet keeps 1 to 3 kB of each of the 4000 removed bodies
# Shared by the child script and the client, therefore it uses nothing but `sim`.
CHANGES = """
CORNERS, TRIANGLES = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]

def cuboid(sim):
    return sim.createPureShape(0, 8, [0.2, 0.3, 0.4], 1.0)

def grouped(sim):
    return sim.groupShapes([cuboid(sim), sim.createPrimitiveShape(sim.primitiveshape_cylinder, [0.2, 0.2, 0.4])])

MAKE = {
    "cuboid": cuboid,
    "sphere": lambda sim: sim.createPureShape(1, 24, [0.2, 0.2, 0.2], 1.0),
    "capsule": lambda sim: sim.createPrimitiveShape(sim.primitiveshape_capsule, [0.2, 0.2, 0.6]),
    "mesh": lambda sim: sim.createShape(0, 0.0, CORNERS, TRIANGLES),
    "group": grouped,
    "parts": lambda sim: sim.ungroupShape(grouped(sim)),
    "dummy": lambda sim: sim.createDummy(0.1),
    "joint": lambda sim: sim.createJoint(sim.joint_revolute_subtype, sim.jointmode_force, 0),
    "force sensor": lambda sim: sim.createForceSensor(0, [0] * 5, [0] * 5),
    "proximity sensor": lambda sim: sim.createProximitySensor(
        sim.proximitysensor_ray_subtype, 16, 0, [0] * 8, [0, 2] + [0] * 13),
    "vision sensor": lambda sim: sim.createVisionSensor(2, [16, 16, 0, 0], [0.1, 10, 1.0] + [0] * 8),
    "path": lambda sim: sim.copyPasteObjects([sim.getObject("/Way")], 0),
    "with a script": lambda sim: sim.copyPasteObjects([sim.getObject("/Gate")], 0),
    "held by a joint": lambda sim: sim.copyPasteObjects([sim.getObject("/Post")], 1),
    "model": lambda sim: sim.loadModel("gate.yaml"),
}

def change(sim, kind):
    made = MAKE[kind](sim)
    made = list(made) if isinstance(made, (list, tuple)) else [made]
    first = made[0]
    sim.setObjectName(first, f"Other {kind}")
    sim.setObjectAlias(first, "other")
    sim.setObjectParent(first, sim.getObject("/Ball"), True)
    sim.setObjectPosition(first, -1, [3, 3, 3])
    made += sim.copyPasteObjects([first], 0)
    if sim.getObjectType(first) == sim.object_shape_type:
        sim.setShapeColor(first, None, sim.colorcomponent_ambient_diffuse, [1, 0, 0])
        sim.setShapeMass(first, 2.0)
    sim.scaleObjects(made[-1:], 2.0, True)
    sim.setObjectParent(first, -1, True)
    return made

def change_all(sim):
    for kind in MAKE:
        sim.removeObjects(change(sim, kind))
"""
SCRIPT = f"""{CHANGES}
def sysCall_actuation():
    for _ in range(sim.getInt32Signal("times") or 0):
        change_all(sim)
    if sim.getInt32Signal("keep"):
        sim.clearInt32Signal("keep")
        for kind in MAKE:
            change(sim, kind)
        sim.removeObject(sim.getObject("/Sign"))
"""
client_functions = {}
exec(CHANGES, client_functions)  # the client's copy of the functions


@pytest.fixture(name="simulation")
def _simulation(tmp_path, monkeypatch, new_simulation):
    """Return a stopped simulation of a scene with one object of each kind and a script that changes them."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "changes.py").write_text(SCRIPT, encoding="utf-8")
    (tmp_path / "gate.py").write_text("def sysCall_init(): pass\n", encoding="utf-8")
    gate = {
        "objects": [{"name": "Gate", "position": [2, 0, 1], **KINDS["static"]}],
        "scripts": [{"object": "Gate", "script": "gate.py"}],
    }
    (tmp_path / "gate.yaml").write_text(yaml.safe_dump(gate), encoding="utf-8")
    scene = {**gate, "objects": [*SCENE["objects"], *gate["objects"], {"name": "Way", **KINDS["path"]}]}
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
    values = {"scene_file": str(tmp_path / "scene.yaml"), "drone": {"position": [0, 0, 2]}, "script_time_limit": 0.0}
    created = new_simulation(values, script=str(tmp_path / "changes.py"), started=False)
    return created


def resources():
    """Return the process's memory (bytes) and its number of open file descriptors."""
    gc.collect()  # closes the sockets of earlier tests' clients
    give_back_memory()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE"), len(os.listdir("/proc/self/fd"))


def assert_no_growth(do, simulation):
    """Call `do` for one repetition, then for TIMES, and assert that the second call leaves nothing behind."""
    do(1)
    before, (memory, descriptors) = sizes(simulation), resources()
    do(TIMES)
    assert sizes(simulation) == before
    after, after_descriptors = resources()
    assert after_descriptors <= descriptors  # descriptors of earlier tests may be closed meanwhile
    print(f"{TIMES} times: {(after - memory) / 1e6:.2f} MB more, of {memory / 1e6:.0f}")
    assert TIMES < MEMORY_CHECK_TIMES or after - memory < MEMORY_LIMIT


def assert_same_picture(one, other):
    """Assert that two pictures of a scene are equal, apart from handles and the folder of meshes."""
    assert sorted(map(repr, one[0].values())) == sorted(map(repr, other[0].values()))
    looks, other_looks = (
        sorted(re.sub("file='.*/", "file='", repr(look)) for look in each[1]) for each in (one, other)
    )
    assert looks == other_looks


def test_changes_by_a_child_script_leave_nothing_behind(simulation):
    before = picture(simulation)
    simulation.start()

    def do(times):
        simulation.context.signals.set(int, "times", times)
        simulation.step()
        simulation.context.signals.set(int, "times", 0)
        simulation.step()

    assert_no_growth(do, simulation)
    simulation.context.signals.set(int, "keep", 1)
    simulation.step()
    assert "Sign" not in simulation.context.objects and len(picture(simulation)[0]) > len(before[0]) + 15
    simulation.stop()
    assert picture(simulation) == before


class Served:
    """The official client in another thread, while this thread serves and steps the simulation."""

    def __init__(self, simulation):
        self.player = Player(simulation, lambda _state: None, simulated_time=False)
        self.server = RemoteApiServer(self.player, "127.0.0.1", 0)
        self.thread = concurrent.futures.ThreadPoolExecutor(1)
        self.sim = self._wait_for(lambda: official_client(self.server.port).require("sim"))

    def do(self, action):
        """Return the result of an action with the client's `sim`."""
        return self._wait_for(lambda: action(self.sim))

    def _wait_for(self, action):
        future = self.thread.submit(action)
        while not future.done():
            self.server.wait(0.01)
            if self.player.playing and not self.server.holds:
                self.player.step()
        return future.result()

    def close(self):
        self.thread.shutdown()
        self.server.close()


@pytest.mark.parametrize("running", [True, False], ids=["running", "stopped"])
def test_changes_by_a_client_leave_nothing_behind(simulation, tmp_path, running):
    before = picture(simulation)
    served = Served(simulation)

    try:
        if running:
            served.do(lambda sim: sim.startSimulation())

        def do(times):
            served.do(lambda sim: [client_functions["change_all"](sim) for _ in range(times)])

        assert_no_growth(do, simulation)
        served.do(lambda sim: [client_functions["change"](sim, kind) for kind in client_functions["MAKE"]])
        created = picture(simulation)
        assert len(created[0]) > len(before[0]) + 15
        if not running:
            served.do(lambda sim: sim.startSimulation())
        served.do(lambda sim: sim.stopSimulation())
        assert picture(simulation) == (before if running else created)
        if not running:
            simulation.save_scene(tmp_path / "saved" / "scene.yaml")
            simulation.load_scene(str(tmp_path / "saved" / "scene.yaml"))
            assert_same_picture(picture(simulation), created)
    finally:
        served.close()


@pytest.mark.parametrize("running", [True, False], ids=["running", "stopped"])
def test_the_editor_a_client_and_a_program_save_the_same_bytes(simulation, tmp_path, running):
    program, client = tmp_path / "program.yaml", tmp_path / "client.yaml"
    served = Served(simulation)
    try:
        if running:
            served.player.start()
            served.player.step()
            served.player.pause(True)
        simulation.operations.paint(simulation.context.objects.handle("Ball"), (0.1, 0.2, 0.3, 1.0))
        simulation.save_scene(program)
        served.do(lambda sim: sim.saveScene(client.name))
        SceneEditor(served.player).answer({"save": str(tmp_path / "window.yaml")})
    finally:
        served.close()
    assert client.read_bytes() == program.read_bytes() == (tmp_path / "window.yaml").read_bytes()
    assert "[0.1, 0.2, 0.3, 1]" in program.read_text(encoding="utf-8")
