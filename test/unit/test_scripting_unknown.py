"""Names that the API does not have, in Lua: an error where they are read, unless the script only asks for a plugin."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
import make_api


@pytest.fixture(name="failed")
def _failed(tmp_path):
    """Return a function that returns what is wrong with a script of one line, '' for nothing."""

    def read(line):
        script = tmp_path / "s.lua"
        script.write_text(line, encoding="utf-8")
        try:
            load.load(str(script), make_api.apis(), TimeLimit(10.0)).close()
        except ScriptError as error:
            return str(error).partition("s.lua:1: ")[2]
        return ""

    return read


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("local x = sim.handle_sefl", "sim has no 'handle_sefl'; near names are handle_self,"),
        ("local x = sim_handle_sefl", "there is no 'sim_handle_sefl'; near names are sim_handle_self,"),
        ("local x = sim.getObjectPositon", "sim has no 'getObjectPositon'; near names are getObjectPosition,"),
        ("simGetObjectPositon(1, -1)", "there is no 'simGetObjectPositon'; near names are simGetObjectPosition,"),
        ("if simROS.advertize then end", "simROS has no 'advertize'; near names are advertise"),
        ("simExtRosInterface_advertize('x')", "there is no 'simExtRosInterface_advertize'; near names are simExtRos"),
        ("simUI.creat('')", "simUI has no 'creat'; near names are create"),
        ("sim.createIkGroup(1)", "there is no sim.createIkGroup here: inverse kinematics is not supported"),
        ("simCreateIkGroup(1)", "there is no simCreateIkGroup here: inverse kinematics is not supported"),
        ("local s = 'AB' print(s[1])", "a string has no [1]: a uint8[] field is a string here"),
        ("simExtROS_enablePublisher('x')", "there is no simExtROS_enablePublisher here: the plugin of V-REP 3.0"),
    ],
)
def test_an_unknown_name_is_an_error_where_it_is_read(failed, body, said):
    assert failed(body).startswith(said)


def test_a_plugin_that_is_not_there_says_so(failed):
    assert "there is no plugin simIK here: inverse kinematics" in failed("simIK.createEnvironment()")


def test_without_the_package_ompl_scripts_say_how_to_install_it(tmp_path):
    text = """
import importlib.util
importlib.util.find_spec = lambda name, find=importlib.util.find_spec: None if name == "ompl" else find(name)
from drone_sim.scripting import load
from drone_sim.scripting.api.listing import apis
from drone_sim.scripting.time_limit import TimeLimit
for line in ("assert(simOMPL == nil)", "simOMPL.createTask('x')", "simExtOMPL_createTask('x')", "require('simOMPL')"):
    open("s.lua", "w").write(line)
    try:
        load.load("s.lua", apis(), TimeLimit(10.0))
    except Exception as error:
        print(error)
"""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "src")}
    command = [sys.executable, "-c", text]
    run = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    lines = run.stdout.splitlines()
    assert len(lines) == 3 and all("./dev.sh setup --all, or pip install ompl, installs" in line for line in lines)


@pytest.mark.parametrize(
    "body",
    [
        "assert(simROS2 == nil and not simIK and simROS and simUI)",
        "local r = simIK and simIK.createEnvironment()",
        "if simTimePub then error('set') end simTimePub = 1 assert(simTimePub == 1)",
        "if simDone then error('set') end function simDone() end",
        "sim.mine = 3 assert(sim.mine == 3)",
        "assert(simulation == nil and foo == nil)",
        "assert(not pcall(function() return sim.nothing end))",
        "assert(require('sim') == sim and require('simUI') == simUI)",
        "local i, n = -1 repeat i = i + 1 n = simGetModuleName(i) until not n or n == 'RosInterface' assert(n)",
        "local s = 'AB' assert(s:len() == 2 and s.upper and s.nothing == nil)",
        "simRemoteApi.start(19999) simExtRemoteApiStart(19999)",
    ],
)
def test_what_scripts_ask_on_purpose(failed, body):
    assert failed(body) == ""
