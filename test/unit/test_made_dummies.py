"""Dummies that scripts create: names, parents, removal, deletion after the run, and their maximum number."""

import pytest

from drone_sim.scene import operations
from drone_sim.scripting.errors import ScriptError

SCRIPT = """
def sysCall_init():
    self.first, self.second = sim.createDummy(0.01), sim.createDummy(0.01, [1, 0, 0])
    print(sim.getObjectName(self.first), sim.getObjectName(self.second), sim.getObjectAlias(self.second))
    sim.setObjectParent(self.second, sim.getObject('/Quadcopter'), True)
    sim.setObjectPosition(self.second, -11, [0, 0, 1])
    sim.setObjectParent(self.first, self.second, False)

def sysCall_actuation():
    sim.removeObjects([self.second])
    print(sim.getObjectParent(self.first), [round(one, 2) for one in sim.getObjectPosition(self.first, -1)])
"""


VALUES = {"gravity": 0.0, "drone": {"position": [0.0, 0.0, 2.0]}, "script_time_limit": 0.0}


def test_a_script_creates_and_removes_dummies(new_simulation, caplog):
    caplog.set_level("INFO")
    simulation = new_simulation(VALUES, python=SCRIPT)
    assert "Dummy0" in simulation.context.objects
    simulation.step()
    assert "Dummy0" not in simulation.context.objects and "Dummy" in simulation.context.objects
    simulation.stop()
    simulation.start()
    assert caplog.messages == ["Dummy Dummy0 Dummy", "-1 [0.0, 0.0, 3.0]", "Dummy Dummy0 Dummy"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("[sim.createDummy(0.01) for _ in range(30)]", "a scene has at most 20 objects"),
        ("sim.removeObject(sim.getObject('/Floor'))", "'Floor' is the floor"),
        ("sim.removeObjects(3)", "expected a table of handles"),
        ("sim.createDummy('large')", "a number is expected"),
        ("sim.createPureShape(3, 0, [1, 1, 1], 1)", "primitiveType = 3: must be one of"),
    ],
)
def test_invalid_calls_that_create_or_remove_objects_are_refused(new_simulation, monkeypatch, call, words):
    monkeypatch.setattr(operations, "MAX_OBJECTS", 20)
    with pytest.raises(ScriptError, match=words):
        new_simulation(VALUES, python=f"def sysCall_init():\n    {call}\n")
