"""Script threads: they wait while the simulation continues, and yield at the same call every time."""

import itertools

import pytest

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError


@pytest.fixture(name="fly")
def _fly(tmp_path):
    """Return a function that runs a script for some steps and returns a signal's value after each step."""

    def fly(text, steps, signal="n", **overrides):
        path = tmp_path / f"script.{'py' if 'def ' in text else 'lua'}"
        path.write_text(text, encoding="utf-8")
        simulation = Simulation(parameters.load(overrides), script=str(path))
        values = []
        try:
            for _ in range(steps):
                simulation.step()
                values.append(simulation.context.signals.get(float, signal))
        finally:
            simulation.close()
        return [*values, simulation.context.signals.get(float, "end")] if "'end'" in text else values

    return fly


WAITS = {
    "3.0": """
simDelegateChildScriptExecution()
simSetThreadSwitchTiming(2)
n = 0
while simGetSimulationState()~=sim_simulation_advancing_abouttostop do
    n = n + 1
    simSetFloatSignal('n', n)
    simWait(0.1, true)
end
simSetFloatSignal('end', n)
""",
    "3.3": """
threadFunction=function()
    n = 0
    while simGetSimulationState()~=sim_simulation_advancing_abouttostop do
        n = n + 1
        simSetFloatSignal('n', n)
        simSwitchThread()
        simSwitchThread()
    end
end
simSetThreadSwitchTiming(200)
res,err=xpcall(threadFunction,function(err) return debug.traceback(err) end)
simSetFloatSignal('end', res and n or -1)
""",
    "3.6": """
if (sim_call_type==sim.syscb_threadmain) then
    n = 0
    while not sim.getThreadExistRequest() do
        n = n + 1
        sim.setFloatSignal('n', n)
        sim.wait(0.1)
    end
    sim.setFloatSignal('end', n)
end
""",
    "4.0": """
function sysCall_threadmain()
    sim.setThreadAutomaticSwitch(false)
    n = 0
    while sim.getSimulationState() ~= sim.simulation_advancing_abouttostop do
        n = n + 1
        sim.setFloatSignal('n', n)
        sim.switchThread()
        sim.switchThread()
    end
end
function sysCall_cleanup() sim.setFloatSignal('end', n) end
""",
    "4.3": """#luaExec
sim = require'sim'
function sysCall_thread()
    sim.setStepping(true)
    for step = 1, math.huge do
        sim.setFloatSignal('n', step)
        sim.step() sim.step()
    end
end
function sysCall_cleanup() sim.setFloatSignal('end', 4) end
""",
    "coroutine": """
function sysCall_init() corout = coroutine.create(coroutineMain) end
function sysCall_actuation()
    if coroutine.status(corout) ~= 'dead' then
        local ok, message = coroutine.resume(corout)
        if message then error(debug.traceback(corout, message), 2) end
    end
end
function coroutineMain()
    for n = 1, 1e9 do
        sim.setFloatSignal('n', n)
        sim.wait(0.1)
    end
end
function sysCall_cleanup() sim.setFloatSignal('end', 4) end
""",
    "python": """#python
def sysCall_thread():
    sim.setStepping(True)
    n = 0
    while not sim.getThreadExitRequest():
        n += 1
        sim.setFloatSignal('n', n)
        sim.wait(0.1)
    sim.setFloatSignal('end', n)
""",
}


@pytest.mark.parametrize("generation", WAITS)
def test_thread_waits_while_the_simulation_continues(fly, generation):
    assert fly(WAITS[generation], 8) == [1, 1, 2, 2, 3, 3, 4, 4, pytest.approx(4, abs=1)]


BUSY = {
    "lua": "function sysCall_thread() n = 0 while true do n = n + 1 sim.setFloatSignal('n', n) end end",
    "pcall": "function sysCall_thread() n = 0 while true do n = n + 1 pcall(sim.setFloatSignal, 'n', n) end end",
    "python": "def sysCall_thread():\n  n = 0\n  while True:\n    n += 1\n    sim.setFloatSignal('n', n)",
    "5.1": "simSetThreadSwitchTiming(2) n = 0\n"
    "while xpcall(function() n = n + 1 simSetFloatSignal('n', n) end, print) do end",
}


@pytest.mark.parametrize("busy", BUSY)
def test_busy_thread_yields_automatically_at_the_same_call_every_time(fly, busy):
    first = 199 if busy == "5.1" else 200  # after simSetThreadSwitchTiming
    values = fly(BUSY[busy], 4)
    assert [after - before for before, after in itertools.pairwise(values)] == [200] * 3 and abs(values[0] - first) <= 1
    assert fly(BUSY[busy], 4) == values


@pytest.mark.parametrize("busy", ["lua", "python"])
def test_busy_thread_without_automatic_yield_exceeds_the_time_limit(fly, busy):
    text = BUSY[busy].replace("n = 0", "sim.setAutoYield(false) n = 0" if busy == "lua" else "n = 0; sim.acquireLock()")
    with pytest.raises(ScriptError, match=r"stopped after 0\.2 s"):
        fly(text, 1, script_time_limit=0.2)


def test_thread_waits_for_a_signal(fly):
    text = """
    function sysCall_thread() sim.setFloatSignal('n', sim.waitForSignal('go')) end
    function sysCall_sensing() if sim.getSimulationTime() > 0.07 then sim.setFloatSignal('go', 7) end end
    """
    assert fly(text, 5) == [None, None, None, 7, 7]


@pytest.mark.parametrize(
    "text, words",
    [
        ("function sysCall_thread()\n sim.switchThread()\n x = nil + 1\nend", r"\[thread\] .*script.lua:3: attempt"),
        ("def sysCall_thread():\n  sim.step()\n  1 / 0", r"\[thread\] .*script.py:3: ZeroDivisionError"),
        ("function sysCall_actuation()\n sim.wait(1)\nend", "script.lua:2: sim.wait: only in a thread: in"),
        ("def sysCall_actuation():\n  sim.wait(1)", "script.py:2: sim.wait: only in a thread: in sysCall_thread"),
        ("function sysCall_thread()\n sim.wait('x')\nend", "script.lua:2: sim.wait: a number is expected"),
        ("function sysCall_thread() while true do end end", "stopped after 0.2 s"),
        ("def sysCall_thread():\n  while True: pass", "script.py:2: stopped after 0.2 s"),
        ("def sysCall_thread():\n  yield", "sysCall_thread would not run, because it has a `yield`"),
        (
            "function sysCall_init() c = coroutine.create(f) end function f()\n sim.wait(0.01)\n error('oh') end\n"
            "function sysCall_actuation()\n local _, e = coroutine.resume(c)\n"
            "if e then error(debug.traceback(c, e), 2) end end",
            r"script.lua:3: oh$",
        ),
    ],
)
def test_error_in_a_thread_is_reported_with_file_and_line(fly, text, words):
    with pytest.raises(ScriptError, match=words):
        fly(text, 3, script_time_limit=0.2 if "stopped" in words else 60.0)


@pytest.mark.parametrize("rest", ["while True: sim.step()", "while True:\n      try: sim.step()\n      except: pass"])
def test_thread_that_refuses_to_end_is_terminated(fly, rest):
    text = f"def sysCall_thread():\n  try:\n    {rest}\n  finally:\n    sim.setFloatSignal('n', 1); sim.step()"
    assert fly(text, 2) == [None, None]


def test_restore_logs_that_threads_continue_where_they_are(tmp_path, caplog, new_simulation):
    path = tmp_path / "script.lua"
    path.write_text(WAITS["4.3"], encoding="utf-8")
    simulation = new_simulation(script=str(path))
    simulation.step()
    simulation.restore(simulation.snapshot())
    simulation.step()
    assert [record.getMessage() for record in caplog.records if "coroutine" in record.getMessage()] == [
        f"{path}: its thread continues where it is now, because a coroutine cannot be restored"
    ]


# ---- scripts that are run as a whole


def test_script_of_v_rep_3_0_runs_once_per_step(fly):
    text = """
    if (simGetScriptExecutionCount()==0) then n = 0 end
    simHandleChildScript(sim_handle_all_except_explicit)
    n = n + 1
    simSetFloatSignal('n', n)
    if (simGetSimulationState()==sim_simulation_advancing_lastbeforestop) then simSetFloatSignal('end', n) end
    """
    assert fly(text, 3) == [1, 2, 3, 4]


@pytest.mark.parametrize("word", ["sim.syscb_{}", "sim_childscriptcall_{}"])
def test_script_that_reads_the_call_type_runs_in_every_phase(fly, word):
    init = word.format("init" if "syscb" in word else "initialization")
    text = f"""
    if (sim_call_type=={init}) then n = 0 end
    if (sim_call_type=={word.format("actuation")}) then simHandleChildScripts(sim_call_type) n = n + 1 end
    if (sim_call_type=={word.format("sensing")}) then sim.setFloatSignal('n', n) end
    if (sim_call_type=={word.format("cleanup")}) then sim.setFloatSignal('end', n * 10) end
    """
    assert fly(text, 2) == [1, 2, 20]
