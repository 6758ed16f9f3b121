"""Customization scripts: order of the callbacks in Lua and Python, calls to child scripts, errors, copies."""

import pytest

from drone_sim.config.types import ParameterError

PHASES = ("init", "nonSimulation", "beforeSimulation", "actuation", "sensing", "afterSimulation", "cleanup")
LUA = """
for _, phase in ipairs{PHASES} do
    _G['sysCall_' .. phase] = function() print('NAME ' .. phase) end
end
""".replace("PHASES", str(PHASES)[1:-1])
PYTHON = "\n".join(f"def sysCall_{phase}(): print('NAME {phase}')" for phase in PHASES)
OLD = "\n".join(
    f"if sim_call_type == sim_customizationscriptcall_{name} then print('NAME {phase}') end"
    for name, phase in zip(
        ("initialization", "nonsimulation", "lastbeforesimulation", "simulationactuation", "simulationsensing",
         "firstaftersimulation", "cleanup"),
        PHASES,
    )
)  # fmt: skip
CHILD = "\n".join(f"def sysCall_{phase}(): print('child {phase}')" for phase in PHASES)
OBJECTS = [{"name": "Gate", "shape": "box", "size": [0.1, 1, 1], "position": [2, 0, 1]}]


@pytest.fixture(name="fly")
def _fly(tmp_path, new_simulation):
    """Return a function that attaches scripts to an object, advances the simulation and returns it."""

    def fly(on="Gate", steps=1, **texts):
        entry = {"object": on, "parameters": {"size": 3.0}}
        for key, text in texts.items():
            path = tmp_path / f"{key}.{'py' if 'def ' in text else 'lua'}"
            path.write_text(text)
            entry[key] = str(path)
        simulation = new_simulation({"scene": {"objects": OBJECTS, "scripts": [entry]}})
        for _ in range(steps):
            simulation.step()
        return simulation

    return fly


def lines(caplog):
    return [record.getMessage() for record in caplog.records if record.name.startswith("drone_sim.script")]


@pytest.mark.parametrize("text", [LUA, PYTHON, OLD], ids=["lua", "python", "3.x"])
@pytest.mark.parametrize("on", ["Gate", "Quadcopter"])
def test_the_callbacks_are_called_in_v_reps_order(fly, caplog, text, on):
    caplog.set_level("INFO")
    child = {"script": CHILD} if on == "Gate" else {}
    simulation = fly(on.replace("Quadcopter", "Drone"), customization=text.replace("NAME", "custom"), **child)
    simulation.stop()
    log_lines = [line for line in lines(caplog) if line.startswith(("custom ", "child "))]
    own = [line for line in log_lines if line.startswith("custom ")]
    assert own == [f"custom {phase}" for phase in PHASES]
    assert not child or log_lines == [
        *own[:3], "child init", "child actuation", own[3], "child sensing", own[4], "child cleanup", *own[5:]
    ]  # fmt: skip


def test_a_customization_script_is_called_again_at_every_start(fly, caplog):
    caplog.set_level("INFO")
    simulation = fly(customization=LUA.replace("NAME", "custom"))
    simulation.start()
    assert lines(caplog).count("custom beforeSimulation") == 2


CALLS = """
def sysCall_init():
    me, gate = sim.handle_self, sim.getObject("/Gate")
    assert sim.getObject(".") == gate and sim.getScriptSimulationParameter(me, "size") == 3
    assert sim.getSimulationState() == sim.STATE
    own, other = (sim.getScript(sim.scripttype_OWN, gate), sim.getScript(sim.scripttype_OTHER, "/Gate"))
    assert own != other and -1 not in (own, other) and sim.getScript(sim.scripttype_OWN) == own
    assert sim.getObjectAssociatedWithScript(other) == gate
    assert sim.getCustomizationScriptAssociatedWithObject(gate) == CUSTOMIZATION
    assert sim.getScriptAssociatedWithObject(gate) == CHILD

def sysCall_actuation():
    found = sim.callScriptFunction("OTHER@/Gate", sim.scripttype_OTHER), sim.callScriptFunction("OWN", sim.handle_self)
    sim.setStringSignal("OWN", "/".join(found))

def OWN():
    return "OWN"
"""


def test_both_scripts_of_an_object_find_and_call_each_other(fly):
    child = CALLS.replace("STATE", "simulation_advancing_firstafterstop").replace("OWN", "childscript")
    child = child.replace("OTHER", "customizationscript").replace("CUSTOMIZATION", "other").replace("CHILD", "own")
    custom = CALLS.replace("STATE", "simulation_stopped").replace("OWN", "customizationscript")
    custom = custom.replace("OTHER", "childscript").replace("CUSTOMIZATION", "own").replace("CHILD", "other")
    signals = fly(script=child, customization=custom).context.signals
    assert signals.get(str, "childscript") == "customizationscript/childscript"
    assert signals.get(str, "customizationscript") == "childscript/customizationscript"


MAZE = """
function sysCall_beforeSimulation()
    for i = 1, 3 do
        local wall = sim.createPrimitiveShape(sim.primitiveshape_cuboid, {0.1, 0.5, 0.5})
        sim.setObjectPosition(wall, sim.getObject('.'), {i, 0, 0})
        sim.setObjectAlias(wall, 'wall')
    end
end
"""


def test_objects_built_before_the_simulation_exist_once_for_child_scripts(fly, caplog):
    walls = "function sysCall_init() local n = 0 while sim.getObject('/wall[' .. n .. ']', {noError = true}) > 0 do "
    walls += "n = n + 1 end print(n .. ' walls') end"
    caplog.set_level("INFO")
    fly(customization=MAZE, script=walls).start()
    assert lines(caplog).count("3 walls") == 2


DIALOG = """
function sysCall_init()
    ui = simUI.create([[<ui title="x"><button text="ok" on-click="pressed"/></ui>]])
end
function sysCall_nonSimulation()
    local s = sim.getObjectSelection()
    if s and #s >= 1 then error('selected') end
end
function sysCall_cleanup() simUI.destroy(ui) end
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (DIALOG, ""),
        ("function sysCall_beforeSimulation() error('boom') end", "[beforeSimulation] "),
        ("function sysCall_init() sim.nothing() end", "sim has no 'nothing'"),
        ("x = = 1", "unexpected symbol"),
        ("def sysCall_afterSimulation(): pass", ""),
        ("function sysCall_userConfig() end function sysCall_init() end", "sysCall_userConfig is never called here"),
    ],
)
def test_an_error_is_logged_in_one_line_and_the_flight_continues(fly, caplog, text, said):
    simulation = fly(customization=text, steps=20)
    log_lines = [line for line in lines(caplog) if "accepted and ignored" not in line]
    assert len(log_lines) == bool(said) and all(said in line for line in log_lines), log_lines
    assert simulation.drone.body.state.position[2] == pytest.approx(0.8, abs=0.05)


def test_a_child_script_with_callbacks_of_customization_scripts_logs_a_warning(fly, caplog):
    fly(script="function sysCall_beforeSimulation() error('called') end function sysCall_init() end")
    assert "sysCall_beforeSimulation is never called here" in caplog.text and "ERROR" not in caplog.text


def test_copies_renames_and_removals_of_an_object_apply_to_its_scripts(fly):
    simulation = fly(script=CHILD, customization=PYTHON)
    scene, operations = simulation.scene, simulation.operations
    (copy,) = operations.copy([simulation.tree.handle("Gate")])
    name = simulation.tree[copy].name
    assert scene.scripts[name].customization == scene.scripts["Gate"].customization
    simulation.step()
    operations.rename(copy, "Door")
    simulation.step()
    scripts = simulation.context.scripts
    assert {script.name for script in scripts if script.kind == 6} == {"Gate", "Door"}
    operations.remove([copy])
    simulation.step()
    assert {script.name for script in scripts if script.kind == 6} == {"Gate"}


def test_an_entry_needs_a_script(fly):
    with pytest.raises(ParameterError, match="scripts/0/script = '': no file"):
        fly()
