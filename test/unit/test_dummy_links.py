"""Linked dummies hold their parent bodies rigidly together."""

import math

import pytest
import yaml

from drone_sim.config.types import ParameterError
from drone_sim.mechanics import frames

STEP, SUB_STEP = 0.05, 0.005  # s
BOX = {"shape": "box", "size": [0.2, 0.2, 0.2]}
TIP = {"kind": "dummy"}
SCENE = {
    "objects": [
        {"name": "Heavy", **BOX, "mass": 2.0, "position": [0.0, 5.0, 50.0]},
        {"name": "Light", **BOX, "mass": 1.0, "position": [2.0, 5.0, 50.0]},
        {"name": "Wall", **BOX, "position": [-1.0, 5.0, 50.0]},
        {"name": "HeavyTip", **TIP, "parent": "Heavy", "position": [1.0, 0.0, 0.0], "rpy": [0.3, 0.2, 0.1]},
        {"name": "LightTip", **TIP, "parent": "Light", "position": [-1.0, 0.0, 0.0], "rpy": [0.3, 0.2, 0.1]},
        {"name": "WallTip", **TIP, "parent": "Wall", "position": [1.5, 0.0, 0.0]},
    ],
    "vehicles": {"drone": {"position": [0.0, 0.0, 1.0]}},
}
PUSH = """
def sysCall_init():
    self.heavy, self.tip = sim.getObjectHandle("Heavy"), sim.getObjectHandle("HeavyTip")
    self.other = sim.getObjectHandle("LightTip")
def sysCall_actuation():
    sim.addForceAndTorque(self.heavy, [3.0, 0.0, 0.0], [0.0, 0.0, 0.0])
"""
LIFTING_SCRIPT = """
def sysCall_actuation():
    for number in (1, 2, 3, 4):
        script = sim.getScriptHandle(f"Quadricopter_propeller_respondable{number}#0")
        sim.setScriptSimulationParameter(script, "particleVelocity", 15.0)
"""


@pytest.fixture(name="fly")
def _fly(new_simulation):
    """Return a function that simulates a scene with `links` {dummy: other dummy} and a vehicle script."""

    def fly(text=PUSH, links=(), scene=SCENE):
        linked = {name: {"linked": other} for name, other in dict(links).items()}
        objects = [{**one, **linked.get(one["name"], {})} for one in scene["objects"]]
        text_of_scene = yaml.safe_dump({**scene, "objects": objects}, sort_keys=False)
        return new_simulation(python=text, scene=text_of_scene)

    return fly


def place(simulation, name):
    tree = simulation.context.objects
    return frames.position(tree.matrix(tree.handle(name)))


def steps(simulation, count):
    for _ in range(count):
        simulation.step()


def distance(acceleration, seconds):
    """Return the distance travelled from rest. Bullet updates the velocity before the position."""
    return acceleration * seconds * (seconds + SUB_STEP) / 2


def test_linked_bodies_move_as_one_and_unlinked_bodies_move_separately(fly):
    simulation = fly(links={"HeavyTip": "LightTip"})
    steps(simulation, 20)
    assert place(simulation, "Heavy")[0] == pytest.approx(distance(1.0, 1.0), abs=1e-4)
    assert place(simulation, "Light")[0] == pytest.approx(2.0 + distance(1.0, 1.0), abs=1e-4)
    alone = fly()
    steps(alone, 20)
    assert place(alone, "Heavy")[0] == pytest.approx(distance(1.5, 1.0), abs=1e-4) and place(alone, "Light")[0] == 2.0


def test_a_script_links_and_unlinks(fly):
    simulation = fly(
        PUSH
        + """
    if sim.getSimulationTime() < 0.01:
        sim.setLinkDummy(self.tip, self.other)
        assert sim.getLinkDummy(self.tip) == self.other and sim.getLinkDummy(self.other) == self.tip
    if abs(sim.getSimulationTime() - 1.0) < 0.01:
        sim.setLinkDummy(self.other, -1)
        assert sim.getLinkDummy(self.tip) == sim.getLinkDummy(self.other) == -1
"""
    )
    steps(simulation, 20)
    assert place(simulation, "Light")[0] == pytest.approx(2.0 + distance(1.0, 1.0), abs=1e-3)
    before = place(simulation, "Light")[0]
    steps(simulation, 20)
    assert place(simulation, "Light")[0] - before == pytest.approx(1.0, abs=1e-2), "the unlinked body keeps its speed"
    assert place(simulation, "Heavy")[0] == pytest.approx(distance(1.0, 1.0) + 1.0 + distance(1.5, 1.0), abs=1e-2)
    simulation.stop()
    assert place(simulation, "Light")[0] == 2.0
    simulation.load_scripts()
    steps(simulation, 20)
    assert place(simulation, "Light")[0] == pytest.approx(2.0 + distance(1.0, 1.0), abs=1e-3), "a restart is the same"


def test_a_body_linked_to_a_static_body_does_not_fall(fly):
    simulation = fly("def sysCall_init(): pass", links={"WallTip": "HeavyTip"})
    steps(simulation, 20)
    x, _, z = place(simulation, "Heavy")
    assert (x, z) == (pytest.approx(-0.5, abs=0.05), pytest.approx(50.0, abs=0.3))
    steps(simulation, 20)
    assert place(simulation, "Heavy")[2] == pytest.approx(z, abs=0.05)


def test_two_drones_dock(fly, tmp_path):
    dummies = [
        {"name": "Top", "kind": "dummy", "parent": "Quadricopter", "position": [0.0, 0.0, 0.2]},
        {"name": "Bottom", "kind": "dummy", "parent": "Quadricopter#0", "position": [0.0, 0.0, -0.2]},
    ]
    lifts = tmp_path / "lifts.py"
    lifts.write_text(LIFTING_SCRIPT, encoding="utf-8")
    pair = {
        "below": {"position": [0.0, 0.0, 2.0], "script": "none"},
        "above": {"position": [0.0, 0.0, 2.4], "script": str(lifts)},
    }
    simulation = fly("def sysCall_init(): pass", {"Top": "Bottom"}, {"objects": dummies, "vehicles": pair})
    steps(simulation, 10)
    below, above = (simulation.vehicles[name].body.state.position for name in ("below", "above"))
    assert below[2] > 2.1 and math.dist(below, above) == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize("linked", ["Nobody", "Heavy", "HeavyTip"])
def test_a_link_to_something_else_than_another_dummy_is_refused(fly, linked):
    with pytest.raises(ParameterError, match=r"objects/3/linked = .*must be the name of another dummy"):
        fly(links={"HeavyTip": linked})


def test_a_dummy_has_one_link(fly):
    with pytest.raises(ParameterError, match="is linked to a third one"):
        fly(links={"HeavyTip": "LightTip", "WallTip": "LightTip"})


def test_links_survive_rename_copy_and_remove(fly, tmp_path):
    simulation = fly(links={"HeavyTip": "LightTip"})
    operations, tree = simulation.operations, simulation.context.objects
    tip, other = tree.handle("HeavyTip"), tree.handle("LightTip")
    with pytest.raises(ValueError, match="'Heavy' is no dummy"):
        operations.link(tip, tree.handle("Heavy"))
    operations.rename(other, "Renamed")
    assert operations.linked(tip) == other and operations.entry(tip).linked == "Renamed"
    handles = [tree.handle(name) for name in ("Heavy", "Light", "HeavyTip", "Renamed")]
    copies = operations.copy(handles)
    assert operations.linked(copies[2]) == copies[3], "a copied dummy is linked to the copy of the other"
    alone = operations.copy([tip])
    assert operations.linked(alone[0]) == -1
    steps(simulation, 2)
    operations.remove([handles[1]])
    with pytest.raises(ValueError, match="must be the name of another dummy"):
        operations.change(tip, linked="Nobody")
    with pytest.raises(ValueError, match="must be the name of another dummy"):
        operations.add([{"name": "New", **TIP, "linked": "Nobody"}])
    operations.write_model([tip], tmp_path / "tip.yaml")
    assert "linked" not in (tmp_path / "tip.yaml").read_text(encoding="utf-8"), "the linked dummy is not in the model"
    operations.remove([other])
    assert operations.linked(tip) == -1 and operations.entry(tip).linked == "", "no link to a removed dummy is saved"
    assert operations.linked(tree.handle("Track_base")) == -1
    steps(simulation, 2)
