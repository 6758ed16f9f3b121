"""A script's own parameters, under any name: numbers, truth values, texts and lists of numbers."""

import numpy as np
import pytest
from several_drones import Drone, Scene

OWN = {"MyGain": 0.25, "steps": 3, "isBold": True, "mode": "slow", "route": (1.0, 2.0, 3.5), "limits": [4, 5]}

LUA = """
local function get(name) return sim.getScriptSimulationParameter(sim.handle_self, name) end
local function set(name, value) simSetScriptSimulationParameter(sim_handle_self, name, value) end
function sysCall_init()
    assert(get('MyGain') == 0.25 and get('steps') == 3 and get('isBold') == true and get('mode') == 'slow')
    local route, limits = get('route'), get('limits')
    assert(#route == 3 and route[1] == 1 and route[3] == 3.5 and #limits == 2 and limits[2] == 5)
    route[1] = 100
    assert(get('route')[1] == 1)
    assert(sim.getUserParameter(sim.getObject('.'), 'MyGain') == 0.25)
    assert(not pcall(get, 'MyGian'))
    set('MyGain', 0.5) set('steps', '4') set('isBold', 'false') set('mode', 'fast') set('route', {9, 8})
    sim.setUserParameter(sim.handle_self, 'limits', {7})
end
"""
PYTHON = """
def get(name): return sim.getScriptSimulationParameter(sim.handle_self, name)
def put(name, value): sim.setScriptSimulationParameter(sim.handle_self, name, value)
def sysCall_init():
    assert [get(name) for name in ("MyGain", "steps", "isBold", "mode")] == [0.25, 3, True, "slow"]
    route = get("route")
    assert route == [1, 2, 3.5] and get("limits") == [4, 5]
    route[0] = 100
    assert get("route")[0] == 1
    assert sim.getUserParameter(sim.getObject("."), "MyGain") == 0.25
    mine = [9, 8]
    put("MyGain", 0.5); put("steps", "4"); put("isBold", "false"); put("mode", "fast"); put("route", mine)
    mine.append(7)
    sim.setUserParameter(sim.handle_self, "limits", [7])
"""


@pytest.mark.parametrize("ending, source", [("lua", LUA), ("py", PYTHON)])
def test_a_script_reads_and_sets_its_own(tmp_path, caplog, ending, source):
    path = tmp_path / f"script.{ending}"
    path.write_text(source, encoding="utf-8")
    drone = Drone(Scene(), own=OWN)
    script = drone.load(path)
    script.call("init")
    script.close()
    assert {name: drone.parameters[name] for name in OWN} == {
        "MyGain": 0.5,
        "steps": 4.0,
        "isBold": False,
        "mode": "fast",
        "route": [9, 8],
        "limits": [7],
    }
    assert not caplog.records


def test_mistakes(caplog):
    sim = Drone(Scene(), own=OWN).sim()
    with pytest.raises(ValueError, match="no script parameter 'MyGian'; near names are MyGain"):
        sim.getScriptSimulationParameter(sim.handle_self, "MyGian")
    with pytest.raises(TypeError, match="expected a number"):
        sim.setScriptSimulationParameter(sim.handle_self, "MyGain", "much")
    with pytest.raises(ValueError, match="no script is attached to 'Floor'"):
        sim.getUserParameter(sim.getObject("/Floor"), "MyGain")
    assert not caplog.records


def test_a_parameter_for_all_scripts_is_one_that_the_own_script_has(caplog):
    drone = Drone(Scene(), own=OWN)
    sim = drone.sim()
    sim.setScriptSimulationParameter(sim.handle_tree, "MyGain", 2)
    assert [one["MyGain"] for one in drone.script_parameters.values()] == [2, 2]
    assert not caplog.records
    sim.setScriptSimulationParameter(sim.handle_tree, "nobodys", 2)
    assert "nothing reads 'nobodys'" in caplog.text


def test_a_number_of_numpys_is_a_number():
    sim = Drone(Scene(), own=OWN).sim()
    sim.setScriptSimulationParameter(sim.handle_self, "MyGain", np.float64(2.5))
    assert type(sim.getScriptSimulationParameter(sim.handle_self, "MyGain")) is float
    with pytest.raises(TypeError, match="expected a finite number"):
        sim.setScriptSimulationParameter(sim.handle_self, "MyGain", np.float64("nan"))
