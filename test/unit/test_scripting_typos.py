"""Misspelt names of phases, parameters, callbacks and API functions are reported before the flight."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.python.helpers import BUILT_IN
from drone_sim.scripting.time_limit import TimeLimit

PARAMETERS = parameters.load()


@pytest.fixture(name="load")
def _load(tmp_path):
    """Return a function that loads and closes a script and returns the error message and the script's path."""

    def load(ending, source):
        path = tmp_path / f"script.{ending}"
        path.write_text(source, encoding="utf-8")
        try:
            Simulation(PARAMETERS, script=str(path)).close()
        except ScriptError as error:
            return str(error), path
        return "", path

    return load


def define(ending, name, body=""):
    return f"def {name}():\n    {body or 'pass'}\n" if ending == "py" else f"function {name}()\n    {body}\nend\n"


ENDINGS = pytest.mark.parametrize("ending", ["py", "lua"])


@ENDINGS
@pytest.mark.parametrize(
    "name, meant",
    [
        ("sysCall_actuate", "sysCall_actuation"),
        ("sysCall_Init", "sysCall_init"),
        ("syscall_sensing", "sysCall_sensing"),
        ("sysCall_actution", "sysCall_actuation"),
        ("sysCallCleanup", "sysCall_cleanup"),
        ("sysCal_init", "sysCall_init"),
        ("sys_actuation", "sysCall_actuation"),
        ("ysCall_init", "sysCall_init"),
        ("SYSCALL_CLEANUP", "sysCall_cleanup"),
        ("sysCall_begin", "sysCall_init"),
        ("sysCall_threadmani", "sysCall_threadmain"),
    ],
)
def test_a_misspelt_phase_is_refused_with_its_line(load, ending, name, meant):
    others = "".join(define(ending, one) for one in ("sysCall_init", "sysCall_cleanup") if one != meant)
    said, path = load(ending, f"{others}\n{define(ending, name)}")
    assert said == f"[load] {path}:{others.count(chr(10)) + 2}: {name} would never be called; near names are {meant}"


@ENDINGS
def test_unrelated_function_names_are_accepted_without_a_warning(load, caplog, ending):
    names = ["sensing", "init", "set_actuation", "scale_actuation", "call_init", "system", "Sysiphus"]
    assert load(ending, "".join(define(ending, name) for name in ("sysCall_actuation", *names)))[0] == ""
    assert not caplog.records


@ENDINGS
def test_unsupported_coppeliasim_callbacks_are_logged_once(load, caplog, ending):
    said, path = load(ending, "".join(define(ending, f"sysCall_{name}") for name in ("init", "msg", "joint")))
    assert said == ""
    phases = "these are: sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup"
    assert [record.getMessage() for record in caplog.records] == [
        f"{path}: sysCall_joint, sysCall_msg are never called here; {phases}"
    ]


@ENDINGS
def test_old_version_of_a_phase_function_is_accepted_with_a_warning(load, caplog, ending):
    said, _ = load(ending, define(ending, "sysCall_actuation") + define(ending, "sysCall_actuation_old"))
    assert said == ""
    assert [record.getMessage().partition(": ")[2] for record in caplog.records] == [
        "sysCall_actuation_old is never called; did you mean sysCall_actuation?"
    ]


IDLE = (
    "has none of the functions sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup, sysCall_thread, "
    "so nothing flies the drone"
)


@ENDINGS
@pytest.mark.parametrize("name, more", [("fly", ""), ("actuation", "; rename actuation to sysCall_actuation")])
def test_a_script_without_phases_is_refused(load, ending, name, more):
    said, path = load(ending, define(ending, name))
    assert said == f"[load] {path}: {IDLE}{more}"


@ENDINGS
def test_empty_script_logs_that_nothing_flies_the_drone(load, caplog, ending):
    said, path = load(ending, "")
    assert said == ""
    assert [record.getMessage() for record in caplog.records] == [f"{path}: {IDLE}"]


@pytest.mark.parametrize("source", ["def sysCall_actuation():\n    yield", "async def sysCall_actuation():\n    pass"])
def test_generator_or_async_phase_is_refused(load, source):
    said, path = load("py", source)
    assert said == f"[load] {path}:1: sysCall_actuation would not run, because it has a `yield` or is `async`"


@pytest.mark.parametrize("word", ["actuaton", "init", "Sensing"])
def test_a_misspelt_call_type_is_refused(load, word):
    said, path = load("lua", f"-- sim_childscriptcall_nonsense\nif sim_call_type==sim_childscriptcall_{word} then\nend")
    assert said.startswith(f"[load] {path}:2: there is no sim_childscriptcall_{word}; near names are childscriptcall_")


# ---- two API generations in one script

TEMPLATE = (BUILT_IN / "template_v4.lua").read_text()
OLD_BLOCK = """
if (sim_call_type==sim_childscriptcall_sensing) then
    pos=simGetObjectPosition(d,-1)
end
"""


def test_script_that_mixes_two_api_generations_is_refused_with_both_lines(load):
    function = TEMPLATE[: TEMPLATE.index("function sysCall_init")].count("\n") + 1
    block = TEMPLATE.count("\n") + 2
    said, path = load("lua", TEMPLATE + OLD_BLOCK)
    assert said.startswith(f"[load] {path}:{block}: line {function} defines a function sysCall_")
    assert f"line {block} compares sim_call_type" in said and "template_v3" in said
    commented = TEMPLATE.replace("function sysCall_init", "--[[ one\ntwo ]]\nfunction sysCall_init")
    said, path = load("lua", OLD_BLOCK + commented)
    assert f":{OLD_BLOCK.count(chr(10)) + function + 2}: " in said and "line 2 compares sim_call_type" in said


@pytest.mark.parametrize(
    "source",
    [
        TEMPLATE,
        (BUILT_IN / "template_v3.lua").read_text(),
        TEMPLATE + f"--[[{OLD_BLOCK}]]\n-- sim_call_type",
        "function sysCall_init() end\nif sim_call_type==sim_childscriptcall_initialization then sysCall_init() end",
    ],
)
def test_script_of_one_generation_or_calling_its_own_functions_is_loaded(load, source):
    assert load("lua", source)[0] == ""


# ---- parameters of the propellers

SET = "sim.setScriptSimulationParameter({}, '{}', 5.0)"
PROPELLER = "sim.getScriptHandle('Quadricopter_propeller_respondable1')"


TRY = {
    "py": "try:\n        {}\n    except ValueError as error:\n        print(error)",
    "lua": "print(select(2, pcall(function() {} end)))",
}


@ENDINGS
def test_a_misspelt_parameter_of_a_propeller_is_refused(load, caplog, ending):
    caplog.set_level("INFO")
    names = ["particleVelocty", "particlevelocity", "particle_velocity", "ParticleVelocity", "particleSpeedVelocity"]
    calls = [SET.format(handle, name) for handle in (PROPELLER, "sim.handle_tree") for name in names]
    tries = "\n    ".join(TRY[ending].format(one) for one in calls)
    assert load(ending, define(ending, "sysCall_init", tries))[0] == ""
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == len(calls)
    for line, name in zip(said, 2 * names):
        assert f"a propeller has no script parameter '{name}'; near names are particleVelocity" in line
    said, path = load(ending, define(ending, "sysCall_init", calls[0]))
    assert said.startswith(f"[init] {path}:2: sim.setScriptSimulationParameter: a propeller has no script parameter")


@ENDINGS
def test_other_parameters_are_accepted_and_misplaced_ones_are_logged_once(load, caplog, ending):
    reported = {
        (PROPELLER, "velocity"): "nothing reads 'velocity' of a propeller; particleVelocity drives it",
        ("sim.handle_self", "particleVelocity"): (
            "'particleVelocity' is a parameter of the propellers; in the script of Drone"
        ),
    }
    unreported = [("sim.handle_self", name) for name in ("Kzreff", "mine")]
    unreported += [(PROPELLER, "particlesAreVisible"), ("sim.handle_tree", "particlesAreVisible")]
    calls = [SET.format(*one) for one in (*reported, *unreported, (PROPELLER, "particleVelocity"))]
    source = "".join(define(ending, phase, "\n    ".join(calls)) for phase in ("sysCall_init", "sysCall_cleanup"))
    assert load(ending, source)[0] == ""
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == len(reported) and all(words in line for words, line in zip(reported.values(), said))


# ---- subscriptions


@ENDINGS
def test_a_callback_may_be_defined_later_in_the_file(load, ending):
    subscribe = define(ending, "sysCall_init", "simROS.subscribe('/x', 'std_msgs/Int32', 'on_x')")
    assert load(ending, subscribe + ("def on_x(m):\n    pass" if ending == "py" else "function on_x(m) end"))[0] == ""


@ENDINGS
def test_missing_callback_is_reported_after_init_with_near_names(load, ending):
    subscribe = define(ending, "sysCall_init", "simROS.subscribe('/x', 'std_msgs/Int32', 'on_twst')")
    said, path = load(ending, subscribe + define(ending, "on_twist"))
    assert said == f"[on_twst] {path}: no function 'on_twst' for this callback; near names are on_twist"


@ENDINGS
def test_a_callback_that_is_subscribed_in_flight_is_checked_in_the_next_step(tmp_path, ending):
    path = tmp_path / f"script.{ending}"
    path.write_text(define(ending, "sysCall_sensing", "simROS.subscribe('/x', 'std_msgs/Int32', 'on_twst')"))
    simulation = Simulation(PARAMETERS, script=str(path))
    simulation.step()
    with pytest.raises(ScriptError, match="no function 'on_twst'"):
        simulation.step()
    simulation.close()


@ENDINGS
@pytest.mark.parametrize(
    "topic, kind, words",
    [
        (
            "cmd_vel",
            "geometry_msgs/Twst",
            "messages on /drone/cmd_vel have the type geometry_msgs/Twist, not 'geometry_msgs/Twst'",
        ),
        ("/drone/cmd_vel", "std_msgs/Float32", "messages on /drone/cmd_vel have the type geometry_msgs/Twist"),
        ("/x", "Twist", "'Twist' is not a message type"),
        ("/x", "geometry_msgs.msg.Twist", "is not a message type"),
    ],
)
def test_a_wrong_message_type_is_refused(load, ending, topic, kind, words):
    source = define(ending, "on_x") + f"simROS.subscribe('{topic}', '{kind}', 'on_x')"
    said, path = load(ending, source)
    assert said.startswith(f"[load] {path}:{source.count(chr(10)) + 1}: simROS.subscribe: ") and words in said


# ---- unknown API names in Lua


@pytest.fixture(name="failed")
def _failed(tmp_path, monkeypatch):
    """Return a function that loads a script of one line and returns its error message, or ''."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "docs"))
    import make_api

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
def test_reading_an_unknown_name_is_an_error(failed, body, said):
    assert failed(body).startswith(said)


def test_calling_an_unsupported_plugin_is_an_error(failed):
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
def test_scripts_may_check_whether_a_name_exists(failed, body):
    assert failed(body) == ""
