"""Objects with child scripts that come, go and change: the scripts begin and end with them, as V-REP's do."""

import pytest
import yaml
from vrep_encoder import file, mesh, script, shape
from vrep_quadricopter import quadricopter

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

TELL = """
local function tell(phase)
    local own = sim.getObject('.')
    local script = sim.getScript(sim.scripttype_childscript, own)
    assert(sim.getObjectAssociatedWithScript(script) == own and script == sim.getScriptHandle())
    sim.setStringSignal('told', (sim.getStringSignal('told') or '') .. sim.getObjectName(own) .. ':' .. phase .. ' ')
end
for _, phase in ipairs{'init', 'sensing', 'cleanup'} do _G['sysCall_' .. phase] = function() tell(phase) end end
"""
GOES = """
def sysCall_sensing():
    if sim.getSimulationTime() > 0.03:
        sim.removeObject(sim.getObject("."))
        sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "goes ")

def sysCall_cleanup():
    sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "gone ")
"""
THREAD = """
def sysCall_thread():
    while not sim.getThreadExitRequest():
        sim.step()
    sim.setStringSignal("told", (sim.getStringSignal("told") or "") + "thread ended ")
"""
REMOVES = {
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
    """Give a function that builds a simulation of the scene; some objects have further scripts."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "tell.lua").write_text(TELL, encoding="utf-8")
    still = tmp_path / "still.py"
    still.write_text("def sysCall_init(): pass\n", encoding="utf-8")
    built = []

    def build(started=True, limit=0.0, **scripts):
        scene = {**SCENE, "scripts": [*SCENE["scripts"]]}
        for name, text in scripts.items():
            file = tmp_path / f"{name}.{'py' if 'def ' in text else 'lua'}"
            file.write_text(text, encoding="utf-8")
            scene["scripts"].append({"object": name, "script": file.name})
        path = tmp_path / "scene.yaml"
        path.write_text(yaml.safe_dump(scene), encoding="utf-8")
        loaded = parameters.load({"scene_file": str(path), "script_time_limit": limit})
        built.append(Simulation(loaded, script=str(still), started=started))
        return built[-1]

    yield build
    for one in built:
        one.close()


def told(simulation):
    """Return what scripts have told since this was last asked."""
    found = simulation.context.signals.get(str, "told") or ""
    simulation.context.signals.forget(str, "told")
    return found.split()


def parts(simulation):
    return simulation.operations, simulation.context.objects


def test_the_script_of_a_copy_begins_and_ends_with_it(build):
    simulation = build()
    operations, tree = parts(simulation)
    assert told(simulation) == ["Gate:init"]
    snapshot = simulation.snapshot()
    (copy,) = operations.copy([tree.handle("Gate")])
    attached = simulation.context.scripts.attached_to("Gate#0")
    assert attached.parameters == {"step": 2.0} and attached.script is None
    with pytest.raises(ValueError, match="from an earlier run"):
        simulation.restore(snapshot)
    simulation.step()
    assert told(simulation) == ["Gate#0:init", "Gate:sensing", "Gate#0:sensing"]
    operations.rename(copy, "Door")
    simulation.step()
    assert told(simulation) == ["Gate:sensing", "Door:sensing"]
    assert "Gate#0" not in simulation.context.scripts and "Door" in simulation.context.scripts
    operations.remove([copy])
    assert told(simulation) == ["Door:cleanup"] and "Door" not in simulation.context.scripts
    simulation.step()
    assert told(simulation) == ["Gate:sensing"]
    operations.remove([tree.handle("Gate")])
    simulation.stop()
    assert "Gate" in simulation.context.objects
    simulation.start()
    simulation.step()
    assert told(simulation) == ["Gate:init", "Gate:sensing"], "stop has undone it"


def test_a_script_that_runs_or_has_a_thread_ends_after_the_phase(build):
    simulation = build(Lamp=GOES, Ball=THREAD)
    operations, tree = parts(simulation)
    for _ in range(3):
        simulation.step()
    assert [one for one in told(simulation) if not one.startswith("Gate:")] == ["goes", "gone"]
    assert "Lamp" not in tree and [one.own_script for one in simulation._setup.scripts.attached] == ["Gate", "Ball"]
    assert not simulation.failed_scripts
    operations.remove([tree.handle("Ball")])
    simulation.step()
    assert " ".join(told(simulation)).startswith("thread ended Gate:sensing")
    simulation.stop()
    assert {"Lamp", "Ball"} <= {*simulation.context.objects.names}


@pytest.mark.parametrize("language", ["py", "lua"])
def test_a_script_that_removes_another_ones_object_has_its_cleanup_called(build, language):
    simulation = build(limit=20.0, Ball=REMOVES[language])
    for _ in range(3):
        simulation.step()
    assert told(simulation)[-3:] == ["Gate:sensing", "Gate:cleanup", "removed"]
    assert "Gate" not in simulation.context.objects and not simulation.failed_scripts


def test_what_is_done_to_scripts_while_stopped_stays_and_is_saved(build, tmp_path):
    simulation = build(started=False)
    operations, tree = parts(simulation)
    gate = tree.handle("Gate")
    operations.save_model(gate, "model.yaml")
    operations.copy([gate])
    operations.rename(gate, "Door")
    top = operations.load_model("model.yaml")
    operations.group([tree.handle("Door"), tree.handle("Ball")])
    assert tree[top].name == "Gate#1", "a model's names have one suffix, and of others of these #0 is taken"
    for again in range(2):
        simulation.start()
        assert sorted(told(simulation)) == ["Door:init", "Gate#0:init", "Gate#1:init"]
        simulation.stop()
        if not again:
            simulation.save_scene(tmp_path / "saved.yaml")
            simulation.load_scene(str(tmp_path / "saved.yaml"))
    operations, tree = parts(simulation)
    operations.remove([tree.handle(name) for name in ("Door", "Gate#0", "Gate#1")])
    simulation.start()
    assert told(simulation) == [] and not simulation.scene.scripts


def test_a_model_of_v_reps_comes_with_its_scripts(build, tmp_path):
    box = shape(0, "Box", mesh("cuboid", (0.2, 0.2, 0.2)), at=(1, 0, 0.5), alias="box")
    ball = shape(1, "Ball", mesh("sphere", (0.2, 0.2, 0.2)), parent=0, at=(0, 0, 1))
    (tmp_path / "box.ttm").write_bytes(file(box, ball, script(0, TELL)))
    (tmp_path / "drone.ttm").write_bytes(file(*quadricopter()))
    (tmp_path / "torn.ttm").write_bytes(b"VREP")
    simulation = build()
    operations, tree = parts(simulation)
    told(simulation)
    for name in ("Box#0", "Box#1"):  # the scene has a Ball
        top = operations.load_model("box.ttm")
        assert tree[top].name == name and tree.path(top).startswith("/box")
        assert [tree[one].kind for one in operations.model(top)] == ["shape", "shape"]
        simulation.step()
        assert told(simulation)[0] == f"{name}:init"
    with pytest.raises(ValueError, match=r"drone\.ttm: .*`vehicles`"):
        operations.load_model("drone.ttm")
    with pytest.raises(ValueError, match=r"torn\.ttm: is truncated"):
        operations.load_model("torn.ttm")


def test_made_meshes_do_not_fill_the_disk_and_saved_ones_stay(build, tmp_path, monkeypatch):
    monkeypatch.setattr("drone_sim.scene.models._MAX_MESHES", 3)
    simulation = build(started=False)
    operations, _ = parts(simulation)
    made = [operations.add_mesh(f"M{number}", [0, 0, 0, 1, 0, 0, 0, 1, number + 1], [0, 1, 2]) for number in range(5)]
    folder = tmp_path / "cache" / "drone_sim" / "meshes"
    assert len([*folder.iterdir()]) == 5, "the scene has them"
    simulation.save_scene(tmp_path / "kept" / "scene.yaml")
    operations.remove(made)
    for number in range(10):
        operations.remove([operations.add_mesh("M", [0, 0, 0, 2, 0, 0, 0, 2, number + 1], [0, 1, 2])])
    assert len([*folder.iterdir()]) <= 4
    for one in folder.iterdir():
        one.unlink()
    simulation.load_scene(str(tmp_path / "kept" / "scene.yaml"))
    assert len([one for one in simulation.context.objects.names if one.startswith("M")]) == 5
