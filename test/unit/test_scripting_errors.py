"""Errors in a script are reported in one line with phase, file, line and message, and the next start works."""

import logging
import time

import pytest

from drone_sim.mechanics.state import Twist
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting import time_limit
from drone_sim.scripting.api.constants import PHASES
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import ScriptStopped, TimeLimit

LIMIT = 0.5  # s, for scripts that never return; the others get a long limit, since the machine may be busy
STOPPED = "stopped after {} s without returning (script_time_limit)"


def run(path, steps=3, limit=60.0):
    """Run a script with a velocity command; return the messages of the ScriptErrors that it raised."""
    output = []
    simulation = None
    try:
        simulation = Simulation(parameters.load({"script_time_limit": limit}), script=str(path))
        simulation.drone.commands.receive(Twist())
        for _ in range(steps):
            simulation.step()
    except ScriptError as error:
        output.append(str(error))
    try:
        if simulation is not None:
            simulation.close()
    except ScriptError as error:
        output.append(str(error))
    return output


@pytest.fixture(name="fails")
def _fails(tmp_path):
    def check(ending, source, phase, line, *words, limit=60.0):
        path = tmp_path / f"script.{ending}"
        path.write_text(source, encoding="utf-8")
        output = run(path, limit=limit)
        assert len(output) == 1 and "\n" not in output[0]
        assert output[0].startswith(f"[{phase}] {path}:{line}: ")
        for word in words:
            assert word in output[0]
        path.write_text("", encoding="utf-8")
        assert run(path) == [], "the next start works"

    return check


@pytest.mark.parametrize(
    "source, phase, line, words",
    [
        ("x = 1\nx = = 1\n", "load", 2, ["unexpected symbol"]),
        ("function f()\n", "load", 2, ["'end' expected"]),
        ("\nerror('boom')", "load", 2, ["boom"]),
        *((f"function sysCall_{phase}()\n  error('boom')\nend", phase, 2, ["boom"]) for phase in PHASES),
        *(
            (
                f"if (sim_call_type==sim_childscriptcall_{name}) then\n\n  local x = nil + 1\nend",
                phase,
                3,
                ["arithmetic"],
            )
            for name, phase in (
                ("initialization", "init"),
                ("actuation", "actuation"),
                ("sensing", "sensing"),
                ("cleanup", "cleanup"),
            )
        ),
        (
            "function sysCall_init()\n  sim.getObjctPosition(1)\nend",
            "init",
            2,
            ["getObjctPosition", "getObjectPosition"],
        ),
        ("\n\nsimGetObjctHandle('x')", "load", 3, ["near names are simGetObjectHandle"]),
        ("sim.getObject('/Quadcopter/bse')", "load", 1, ["near names are /Quadcopter/base"]),
        ("local function f() return sim.getObjectHandle('Quadricopter_bas') end\nlocal h = f()", "load", 2, []),
        ("sim.multiplyVector({1,2,3},{1,2,3})", "load", 1, ["sim.multiplyVector: 12 numbers are expected, not 3"]),
        ("simSetObjectPosition(1,-1,{1,2})\n", "load", 1, ["simSetObjectPosition: 3 numbers", "[1, 2]", "position"]),
        ("sim.getObjectPosition()", "load", 1, ["wrong number of values: got (), expected (handle: Handle"]),
        (
            "sim.getObjectPosition('x',-1,3)",
            "load",
            1,
            ["wrong kind of value: got ('x', -1), expected (handle: Handle"],
        ),
        ("sim.getObjectPosition(nil,-1)", "load", 1, ["wrong kind of value: got (nothing, -1)"]),
        ("local h = 1\nsim.setObjectPosition(h,-1,{0,0,0/0})", "load", 2, ["finite numbers are expected"]),
        (
            "sim.setScriptSimulationParameter(sim.getScriptHandle('Quadricopter_propeller_respondable1'),"
            "'particleVelocity',{})",
            "load",
            1,
            ["expected a number"],
        ),
        (
            "function on_twist(m)\n error('x')\nend\nsimROS.subscribe('cmd_vel','geometry_msgs/Twist','on_twist')",
            "on_twist",
            2,
            ["x"],
        ),
        ("\nrequire'foo'", "load", 2, ["no module 'foo'"]),
    ],
)
def test_lua_error_is_reported_with_phase_file_and_line(fails, source, phase, line, words):
    fails("lua", source, phase, line, *words)


def test_lua_may_pass_more_arguments_than_a_function_takes(tmp_path, caplog):
    """As in V-REP, where old scripts pass a value to functions that only return one."""
    caplog.set_level(logging.INFO)
    script = tmp_path / "lavish.lua"
    call = "local result, mass = simGetObjectFloatParameter(simGetObjectHandle('Drone'), 3005, 1.5, {})"
    script.write_text(f"function sysCall_actuation()\n  {call}\n  print(result, mass)\nend")
    run(script)
    output = [message for message in caplog.messages if "Object" in message or "0.12" in message]
    assert output == ["simGetObjectFloatParameter: got 4 values and uses 2: the others are ignored", *["1\t0.12"] * 3]


@pytest.mark.parametrize(
    "source, phase, line, words",
    [
        ("x = 1\nx = = 1\n", "load", 2, ["SyntaxError"]),
        ("\n1 / 0", "load", 2, ["ZeroDivisionError: division by zero"]),
        *(
            (f"def sysCall_{phase}():\n    raise RuntimeError('boom')", phase, 2, ["RuntimeError: boom"])
            for phase in PHASES
        ),
        ("def sysCall_init():\n    sim.getObjctPosition(1)", "init", 2, ["near names are getObjectPosition"]),
        ("sim.getObject('/Quadcopter/bse')", "load", 1, ["near names are /Quadcopter/base"]),
        ("sim.multiplyVector([1, 2, 3], [1, 2])", "load", 1, ["sim.multiplyVector: 12 numbers", "expected (matrix"]),
        ("sim.getObjectPosition()", "load", 1, ["sim.getObjectPosition: wrong number of values, expected (handle"]),
        ("sim.getObjectPosition(1, 2, 3)", "load", 1, ["sim.getObjectPosition: wrong number of values"]),
        ("def f(a):\n    pass\nf()", "load", 3, ["TypeError: f() missing 1 required"]),
        ("float('x')", "load", 1, ["ValueError: could not convert"]),
        ("simROS.advertise(3, 'T')", "load", 1, ["simROS.advertise: ", "got (3, 'T', 1, False)"]),
        ("sim.getObjectPosition('Drone')", "load", 1, ["wrong kind of value: got ('Drone', -1)"]),
        ("sim.getObjectPosition(99)", "load", 1, ["no object with the handle 99"]),
        ("def f(m):\n    undefined\nsimROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'f')", "f", 2, ["NameError"]),
        ("\nrequire('foo')", "load", 2, ["no module 'foo'"]),
        ("import sys\nsys.exit(1)", "load", 2, ["SystemExit"]),
        ("import no_such_module_", "load", 1, ["ModuleNotFoundError"]),
    ],
)
def test_python_error_is_reported_with_phase_file_and_line(fails, source, phase, line, words):
    fails("py", source, phase, line, *words)


LOOP = "while true do end"


@pytest.mark.parametrize(
    "source, phase, line",
    [
        (f"\n{LOOP}", "load", 2),
        *((f"function sysCall_{phase}()\n{LOOP}\nend", phase, 2) for phase in PHASES),
        (f"function f(m)\n{LOOP}\nend\nsimROS.subscribe('cmd_vel','geometry_msgs/Twist','f')", "f", 2),
        (f"\nif sim_call_type==sim_childscriptcall_sensing then\n{LOOP}\nend", "sensing", 3),
        (f"while true do pcall(function() {LOOP} end) end", "load", 1),
        (f"while true do xpcall(function() {LOOP} end, function() {LOOP} end) end", "load", 1),
        (f"while true do coroutine.wrap(function() {LOOP} end)() end", "load", 1),
        (f"while true do coroutine.resume(coroutine.create(function() pcall(load('{LOOP}')) end)) end", "load", 1),
        ("c = coroutine.wrap(function() while true do coroutine.yield() end end) while true do c() end", "load", 1),
        (f"table.sort({{3,2,1}}, function() {LOOP} end)", "load", 1),
        (f"local t = setmetatable({{}}, {{__index = function() {LOOP} end}})\nlocal x = t.y", "load", 1),
        (f"print(setmetatable({{}}, {{__tostring = function() {LOOP} end}}))", "load", 1),
        ("while true do sim.getSimulationTime() end", "load", 1),
    ],
)  # fmt: skip
def test_endless_lua_is_stopped(fails, source, phase, line):
    fails("lua", source, phase, line, STOPPED.format(LIMIT), limit=LIMIT)


@pytest.mark.parametrize(
    "source, phase, line",
    [
        ("\nwhile True: pass", "load", 2),
        *((f"def sysCall_{phase}():\n    while True: pass", phase, 2) for phase in PHASES),
        ("def f(m):\n    while True: pass\nsimROS.subscribe('cmd_vel', 'geometry_msgs/Twist', f)", "f", 2),
        ("while True:\n  try:\n    while True: pass\n  except: pass", "load", 3),
        ("while True:\n  try:\n    while True: pass\n  except BaseException: pass\n  finally: pass", "load", 3),
        ("import time\nwhile True: time.sleep(0.001)", "load", 2),
        ("while True: sim.getSimulationTime()", "load", 1),
    ],
)
def test_endless_python_is_stopped(fails, source, phase, line):
    fails("py", source, phase, line, STOPPED.format(LIMIT), limit=LIMIT)


def test_endless_python_is_stopped_even_if_the_script_disables_the_timer(fails):
    off = "import _signal, time\n_signal.setitimer(_signal.ITIMER_REAL, 0)\ntime.sleep(0.3)\n"  # defeats the limit
    later = "def sysCall_init():\n    time.sleep(0.3)\ndef sysCall_actuation():\n    while True: pass"
    fails("py", off + later, "actuation", 7, STOPPED.format(0.5), limit=0.5)


def test_missing_callback_function_is_reported_by_name(tmp_path):
    for ending in ("py", "lua"):
        path = tmp_path / f"script.{ending}"
        path.write_text("simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'on_twst')", encoding="utf-8")
        assert run(path) == [f"[on_twst] {path}: no function 'on_twst' for this callback"]


@pytest.mark.parametrize(
    "name, words",
    [
        ("script.txt", "must end in .py or .lua"),
        ("missing.lua", "no such file"),
        ("missing.py", "no such file"),
        ("turtorial", "near names are tutorial"),
        pytest.param("package://no_such_package_/x.lua", "no ROS package", marks=pytest.mark.ros),
    ],
)
def test_invalid_script_path_is_reported(name, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "script.txt").write_text("", encoding="utf-8")
    (output,) = run(name)
    assert output.startswith(f"[load] {name}: ") and words in output


def test_memory_is_limited(tmp_path):
    path = tmp_path / "script.lua"
    path.write_text("x = string.rep('x', 1e9)", encoding="utf-8")
    (output,) = run(path)
    assert "not enough memory" in output


def test_time_limit_of_zero_disables_the_limit(new_simulation):
    new_simulation({"script_time_limit": 0}, python="import time\ntime.sleep(0.3)\ndef sysCall_init(): pass")


def test_paused_time_does_not_count_against_the_time_limit(monkeypatch):
    now = time.monotonic()
    monkeypatch.setattr(time_limit, "monotonic", lambda: now)
    limit = TimeLimit(60.0)

    def work():
        nonlocal now
        with limit.paused():
            now += 100.0
        assert not limit.exceeded()
        now += 61.0
        assert limit.exceeded()

    limit.run(work)


def test_time_limit_that_expires_while_paused_stops_the_script_afterwards():
    def work():
        with limit.paused():
            while time.monotonic() < end:
                pass
        while True:
            pass

    limit, end = TimeLimit(0.2), time.monotonic() + 0.5
    with pytest.raises(ScriptStopped):
        limit.run(work)


def test_time_limit_that_expires_during_its_own_check_stops_the_script():
    class Slow(TimeLimit):
        checks = 0

        def exceeded(self):
            self.checks += 1
            return self.checks > 1 and super().exceeded()

        def left(self):
            return super().left() - 1.0  # as if the process had not been scheduled for a second

    with pytest.raises(ScriptStopped):
        Slow(0.05).run(time.sleep, 10)


def test_late_stop_is_never_raised_outside_the_script():
    """The exception for a script that returns at the last moment must not reach the simulator."""
    limit = TimeLimit(0.02)
    for wait in range(40):
        try:
            limit.run(time.sleep, 0.016 + 0.0002 * wait)
        except ScriptStopped:
            continue
    time.sleep(0.2)
