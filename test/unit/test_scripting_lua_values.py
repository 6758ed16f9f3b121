"""Conversion of values between Lua and Python, in every form, and the thread that runs Lua."""

import random
import threading
import time
from types import SimpleNamespace

import pytest

from drone_sim.mechanics import frames
from drone_sim.scripting.api.calls import Api
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.lua import thread as lua_thread
from drone_sim.scripting.lua.functions import lua_function
from drone_sim.scripting.lua.script import LuaScript
from drone_sim.scripting.lua.thread import Abandoned, LuaThread
from drone_sim.scripting.time_limit import TimeLimit

PROLOGUE = {
    "5.1": b"local _ = function() simGetSimulationTime() end ",
    "newest": b"",
    "in a thread": b"local _ = string.find ",
}


@pytest.fixture(name="call", params=PROLOGUE)
def _call(request):
    scripts = []

    def call(arguments, give=lambda *values: None, then=""):
        received = []

        def f(*values):
            received.append(values)
            return give(*values)

        source = PROLOGUE[request.param] + f"local r = {{test.f({arguments})}} {then}".encode()
        scripts.append(LuaScript("script.lua", source, {"test": Api("test", {"f": f}, {})}, TimeLimit(20)))
        return received[0]

    yield call
    for script in scripts:
        script.close()


@pytest.mark.parametrize(
    "arguments, expected",
    [
        ("", ()),
        ("nil, nil", ()),
        ("1, nil, true", (1, None, True)),
        ("1.5, 'a', false", (1.5, "a", False)),
        ("'\\255', nil", (b"\xff",)),
        ("{1, 2.5}", ([1, 2.5],)),
        ("1, {1, 2}", (1, [1, 2])),
        ("1, {1, 2}, 3", (1, [1, 2], 3)),
        ("{1, 2}, 'a', 3", ([1, 2], "a", 3)),
        ("1, 2, {1, 2}", (1, 2, [1, 2])),
        ("{1, 2}, {1, 2, 3}", ([1, 2], [1, 2, 3])),
        ("1, {1, 2, 3}, {4, 5}", (1, [1, 2, 3], [4, 5])),
        ("{1, 2, 3}, {1, 2, 3}, {4, 5}", ([1, 2, 3], [1, 2, 3], [4, 5])),
        ("{1, 'a'}, {1, {2}, 3}", ([1, "a"], [1, [2], 3])),
        ("1, {true}", (1, [True])),
        ("{}, {a = {b = {1}}}", ([], {"a": {"b": [1]}})),
        ("1, 2, 3, nil, 5", (1, 2, 3, None, 5)),
        ("{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}", (list(range(1, 14)),)),
        ("('x'):rep(5000)", ("x" * 5000,)),
    ],
)
def test_lua_arguments_are_converted_to_python(call, arguments, expected):
    assert call(arguments) == expected


@pytest.mark.parametrize("count", [199, 200, 201, 400, 100_000])
def test_long_lists_are_converted_in_both_directions(call, count):
    (values,) = call(
        f"(function() local t = {{}} for i = 1, {count} do t[i] = i end return t end)()",
        lambda values: values,
        f"assert(#r[1] == {count} and r[1][{count}] == {count})",
    )
    assert values == list(range(1, count + 1))


@pytest.mark.parametrize(
    "result, check",
    [
        (None, "#r == 0"),
        ((1, "a", None, True), "r[1] == 1 and r[2] == 'a' and r[4]"),
        ([1.5, "x", [2]], "r[1][1] == 1.5 and r[1][2] == 'x' and r[1][3][1] == 2"),
        ({"a": {"b": [1]}}, "r[1].a.b[1] == 1"),
        (b"\xff\x00", "#r[1] == 2"),
        (10**30, "r[1] == 1e30"),
    ],
)
def test_python_results_are_converted_to_lua(call, result, check):
    call("", lambda: result, f"assert({check})")


@pytest.mark.parametrize("result, words", [({None: 1}, "cannot be a key"), ({float("nan"): 1}, "cannot be a key"),
                                           (b"x" * 2**27, "cannot be passed"), ([0] * 2**24, "too many")])  # fmt: skip
def test_result_that_lua_cannot_represent_is_an_error(call, result, words):
    with pytest.raises(ScriptError, match=words):
        call("", lambda: result)


@pytest.mark.parametrize("prologue", PROLOGUE.values())
def test_lua_multiplies_matrices_as_python_does(prologue, new_simulation):
    generator = random.Random(1)
    m = [generator.uniform(-2, 2) for _ in range(12)]
    v = [generator.uniform(-2, 2) for _ in range(3)]
    lua = "{{{}}}".format
    source = prologue.decode() + (
        f"local m, v = {lua(', '.join(map(repr, m)))}, {lua(', '.join(map(repr, v)))}\n"
        "sim.setScriptSimulationParameter(sim.handle_self, 'product', sim.multiplyVector(m, v))\n"
        "sim.setScriptSimulationParameter(sim.handle_self, 'inverse', sim.getMatrixInverse(m))\n"
        "assert(not pcall(sim.multiplyVector, m, {1, 2, 0/0}) and not pcall(sim.getMatrixInverse, {}))\n"
        "assert(sim.multiplyVector({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {1, 2, 3})[3] == 3)\n"
        "function sysCall_init() end"
    )
    simulation = new_simulation(lua=source)
    results = simulation.child_scripts["drone"].parameters
    assert results["product"] == list(frames.transform(m, v)) and results["inverse"] == list(frames.invert(m))


def test_lua_loop_variable_may_be_assigned():
    """As up to Lua 5.4, the version of CoppeliaSim."""
    keys = []
    api = Api("test", {"f": lambda value: keys.append(value)}, {})
    source = b"for key, value in pairs({a = 1}) do key = key .. '!' test.f(key) end"
    LuaScript("script.lua", source, {"test": api}, TimeLimit(20)).close()
    assert keys == ["a!"]


# ---- Lua's thread


@pytest.fixture(name="thread")
def _thread():
    thread = LuaThread(TimeLimit(0.1))
    yield thread
    thread.close()


def spin(until):
    while not until.is_set():
        pass


def test_lua_thread_passes_on_results_and_errors(thread):
    assert thread.run(lambda a, b: a + b, 1, 2) == 3
    assert thread.run(threading.get_ident) != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        thread.run(lambda: 1 / 0)
    assert thread.run(lambda: 4) == 4


def test_outside_runs_a_function_in_the_callers_thread_without_a_time_limit(thread):
    limit = thread._limit

    def draw():
        time.sleep(0.3)
        return threading.get_ident()

    assert thread.run(lambda: limit.outside(draw)) == threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        thread.run(lambda: limit.outside(lambda: 1 / 0))
    assert thread.run(lambda: 5) == 5


def test_hanging_script_is_abandoned_and_its_api_calls_fail(thread):
    class Values:
        def readers(self):
            return (tuple,)

        def encoder_of(self, function):
            return lambda value: (1, value)

    state = SimpleNamespace(executor=thread, values=Values(), used=int)
    called, outcomes, wake = [], [], threading.Event()
    api = lua_function("sim.x", lambda: called.append(1), state)

    def script():
        outcomes.append(api(0))
        spin(wake)
        outcomes.append(api(0))

    before = lua_thread.count_abandoned()
    with pytest.raises(Abandoned):
        thread.run(script)
    assert lua_thread.count_abandoned() == before + 1
    with pytest.raises(Abandoned):
        thread.run(lambda: None)
    wake.set()
    thread._thread.join(20)
    assert outcomes == [(1, None), (0, b"stopped")] and called == [1]
    assert lua_thread.count_abandoned() == before
