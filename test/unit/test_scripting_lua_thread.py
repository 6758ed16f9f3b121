"""The thread that Lua runs in: who does what, and what is left behind."""

import threading
import time
from types import SimpleNamespace

import pytest

from drone_sim.scripting.lua import thread as lua_thread
from drone_sim.scripting.lua.functions import lua_function
from drone_sim.scripting.lua.thread import Abandoned, LuaThread
from drone_sim.scripting.time_limit import TimeLimit


@pytest.fixture(name="thread")
def _thread():
    thread = LuaThread(TimeLimit(0.1))
    yield thread
    thread.close()


def spin(until):
    while not until.is_set():
        pass


def test_results_and_errors_come_back(thread):
    assert thread.run(lambda a, b: a + b, 1, 2) == 3
    assert thread.run(threading.get_ident) != threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        thread.run(lambda: 1 / 0)
    assert thread.run(lambda: 4) == 4


def test_what_is_bound_to_the_callers_thread_runs_there_uncounted(thread):
    limit = thread._limit

    def draw():
        time.sleep(0.3)
        return threading.get_ident()

    assert thread.run(lambda: limit.outside(draw)) == threading.get_ident()
    with pytest.raises(ZeroDivisionError):
        thread.run(lambda: limit.outside(lambda: 1 / 0))
    assert thread.run(lambda: 5) == 5


def test_who_hangs_is_left_behind_and_finds_the_api_closed(thread):
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
