"""Objects with child scripts: the scripts start and end with their objects, as in V-REP."""

import pytest
import yaml
from vrep_encoder import file, mesh, script, shape
from vrep_quadricopter import quadricopter

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

REPORTING_SCRIPT = """
local function tell(phase)
    local own = sim.getObject('.')
    local script = sim.getScript(sim.scripttype_childscript, own)
    assert(sim.getObjectAssociatedWithScript(script) == own and script == sim.getScriptHandle())
    sim.setStringSignal('told', (sim.getStringSignal('told') or '') .. sim.getObjectName(own) .. ':' .. phase .. ' ')
end
for _, phase in ipairs{'init', 'sensing', 'cleanup'} do _G['sysCall_' .. phase] = function() tell(phase) end end
"""
SELF_REMOVING_SCRIPT = """
def sysCall_sensing():
    if sim.getSimulationTime() > 0.03:
        sim.removeObject(sim.getObject("."))
        sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "goes ")

def sysCall_cleanup():
    sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "gone ")
"""
THREADED_SCRIPT = """
def sysCall_thread():
    while not sim.getThreadExitRequest():
        sim.step()
    sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "thread ended ")
"""
GATE_REMOVING_SCRIPTS = {
    "py": """
def sysCall_sensing():
    gate = sim.getObject("/Gate", {"noError": True})
    if gate >= 0 and sim.getSimulationTime() > 0.06:
        sim.removeObject(gate)
        sim.setStringSignal("told", sim.getStringSignal("told") + "removed ")
""",
    "lua": """
function sysCall_sensing()
    local gate = sim.getObject('/Gate', {noError = true})
    if gate >= 0 and sim.getSimulationTime() > 0.06 then
        sim.removeObject(gate)
        sim.setStringSignal('told', sim.getStringSignal('told') .. 'removed ')
    end
end
""",
}
SCENE = {
    "objects": [
        {"name": "Gate", "shape": "box", "size": [0.1, 1, 1], "position": [2, 0, 1]},
        {"name": "Lamp", "kind": "dummy", "parent": "Gate"},
        {"name": "Ball", "shape": "sphere", "size": [0.1], "position": [5, 0, 1], "mass": 1.0},
    ],
    "scripts": [{"object": "Gate", "script": "tell.lua", "parameters": {"step": 2.0}}],
}


@pytest.fixture(name="build")
def _build(tmp_path, monkeypatch):
    """Return a function that builds a simulation of the scene, with further scripts for the given objects."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "tell.lua").write_text(REPORTING_SCRIPT, encoding="utf-8")
    idle_script = tmp_path / "still.py"
    idle_script.write_text("def sysCall_init(): pass\n", encoding="utf-8")
    simulations = []

    def build(started=True, limit=0.0, **scripts):
        scene = {**SCENE, "scripts": [*SCENE["scripts"]]}
        for name, text in scripts.items():
            file = tmp_path / f"{name}.{'py' if 'def ' in text else 'lua'}"
            file.write_text(text, encoding="utf-8")
            scene["scripts"].append({"object": name, "script": file.name})
        path = tmp_path / "scene.yaml"
        path.write_text(yaml.safe_dump(scene), encoding="utf-8")
        loaded = parameters.load({"scene_file": str(path), "script_time_limit": limit})
        simulations.append(Simulation(loaded, script=str(idle_script), started=started))
        return simulations[-1]

    yield build
    for one in simulations:
        one.close()


def new_messages(simulation):
    """Return the messages of the scripts since the last call."""
    messages = simulation.context.signals.get(str, "told") or ""
    simulation.context.signals.forget(str, "told")
    return messages.split()


def parts(simulation):
    return simulation.operations, simulation.context.objects


def test_the_script_of_a_copy_starts_and_ends_with_the_copy(build):
    simulation = build()
    operations, tree = parts(simulation)
    assert new_messages(simulation) == ["Gate:init"]
    snapshot = simulation.snapshot()
    (copy,) = operations.copy([tree.handle("Gate")])
    attached = simulation.context.scripts.attached_to("Gate#0")
    assert attached.parameters == {"step": 2.0} and attached.script is None
    with pytest.raises(ValueError, match="from an earlier run"):
        simulation.restore(snapshot)
    simulation.step()
    assert new_messages(simulation) == ["Gate#0:init", "Gate:sensing", "Gate#0:sensing"]
    operations.rename(copy, "Door")
    simulation.step()
    assert new_messages(simulation) == ["Gate:sensing", "Door:sensing"]
    assert "Gate#0" not in simulation.context.scripts and "Door" in simulation.context.scripts
    operations.remove([copy])
    assert new_messages(simulation) == ["Door:cleanup"] and "Door" not in simulation.context.scripts
    simulation.step()
    assert new_messages(simulation) == ["Gate:sensing"]
    operations.remove([tree.handle("Gate")])
    simulation.stop()
    assert "Gate" in simulation.context.objects
    simulation.start()
    simulation.step()
    assert new_messages(simulation) == ["Gate:init", "Gate:sensing"], "stop undoes the removal"


def test_a_script_whose_object_is_removed_ends_after_the_phase(build):
    simulation = build(Lamp=SELF_REMOVING_SCRIPT, Ball=THREADED_SCRIPT)
    operations, tree = parts(simulation)
    for _ in range(3):
        simulation.step()
    assert [one for one in new_messages(simulation) if not one.startswith("Gate:")] == ["goes", "gone"]
    assert "Lamp" not in tree and [one.own_script for one in simulation._setup.scripts.attached] == ["Gate", "Ball"]
    assert not simulation.failed_scripts
    operations.remove([tree.handle("Ball")])
    simulation.step()
    assert " ".join(new_messages(simulation)).startswith("thread ended Gate:sensing")
    simulation.stop()
    assert {"Lamp", "Ball"} <= {*simulation.context.objects.names}


@pytest.mark.parametrize("language", ["py", "lua"])
def test_removing_the_object_of_another_script_calls_its_cleanup(build, language):
    simulation = build(limit=20.0, Ball=GATE_REMOVING_SCRIPTS[language])
    for _ in range(3):
        simulation.step()
    assert new_messages(simulation)[-3:] == ["Gate:sensing", "Gate:cleanup", "removed"]
    assert "Gate" not in simulation.context.objects and not simulation.failed_scripts


def test_changes_of_scripts_while_stopped_stay_and_are_saved(build, tmp_path):
    simulation = build(started=False)
    operations, tree = parts(simulation)
    gate = tree.handle("Gate")
    operations.save_model(gate, "model.yaml")
    operations.copy([gate])
    operations.rename(gate, "Door")
    top = operations.load_model("model.yaml")
    operations.group([tree.handle("Door"), tree.handle("Ball")])
    assert tree[top].name == "Gate#1", "all names of a model have the same suffix, and #0 is in use"
    for repetition in range(2):
        simulation.start()
        assert sorted(new_messages(simulation)) == ["Door:init", "Gate#0:init", "Gate#1:init"]
        simulation.stop()
        if not repetition:
            simulation.save_scene(tmp_path / "saved.yaml")
            simulation.load_scene(str(tmp_path / "saved.yaml"))
    operations, tree = parts(simulation)
    operations.remove([tree.handle(name) for name in ("Door", "Gate#0", "Gate#1")])
    simulation.start()
    assert new_messages(simulation) == [] and not simulation.scene.scripts


def test_a_v_rep_model_is_loaded_with_its_scripts(build, tmp_path):
    box = shape(0, "Box", mesh("cuboid", (0.2, 0.2, 0.2)), at=(1, 0, 0.5), alias="box")
    ball = shape(1, "Ball", mesh("sphere", (0.2, 0.2, 0.2)), parent=0, at=(0, 0, 1))
    (tmp_path / "box.ttm").write_bytes(file(box, ball, script(0, REPORTING_SCRIPT)))
    (tmp_path / "drone.ttm").write_bytes(file(*quadricopter()))
    (tmp_path / "torn.ttm").write_bytes(b"VREP")
    simulation = build()
    operations, tree = parts(simulation)
    new_messages(simulation)
    for name in ("Box#0", "Box#1"):  # the scene has a Ball
        top = operations.load_model("box.ttm")
        assert tree[top].name == name and tree.path(top).startswith("/box")
        assert [tree[one].kind for one in operations.model(top)] == ["shape", "shape"]
        simulation.step()
        assert new_messages(simulation)[0] == f"{name}:init"
    with pytest.raises(ValueError, match=r"drone\.ttm: .*`vehicles`"):
        operations.load_model("drone.ttm")
    with pytest.raises(ValueError, match=r"torn\.ttm: is truncated"):
        operations.load_model("torn.ttm")


def test_unused_mesh_files_are_deleted_and_saved_ones_stay(build, tmp_path, monkeypatch):
    monkeypatch.setattr("drone_sim.scene.models._MAX_MESHES", 3)
    simulation = build(started=False)
    operations, _ = parts(simulation)
    meshes = [operations.add_mesh(f"M{number}", [0, 0, 0, 1, 0, 0, 0, 1, number + 1], [0, 1, 2]) for number in range(5)]
    folder = tmp_path / "cache" / "drone_sim" / "meshes"
    assert len([*folder.iterdir()]) == 5, "the scene uses all of them"
    simulation.save_scene(tmp_path / "kept" / "scene.yaml")
    operations.remove(meshes)
    for number in range(10):
        operations.remove([operations.add_mesh("M", [0, 0, 0, 2, 0, 0, 0, 2, number + 1], [0, 1, 2])])
    assert len([*folder.iterdir()]) <= 4
    for one in folder.iterdir():
        one.unlink()
    simulation.load_scene(str(tmp_path / "kept" / "scene.yaml"))
    assert len([one for one in simulation.context.objects.names if one.startswith("M")]) == 5
