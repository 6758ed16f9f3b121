"""Breakpoints and variables of scripts, and a flight that stays the same to the last bit when they are inspected."""

import struct
import sys
from functools import partial

import pytest

from drone_sim.files.resources import package_path
from drone_sim.run.player import Player
from drone_sim.scripting.breakpoints import LONGEST_VALUE, MOST_INSIDE, MOST_ROWS, read_breakpoints
from drone_sim.scripting.errors import ScriptError

PYTHON = """\
import math
gain = 2.5

class Pid:
    def __init__(self):
        self.sum = 0.25

    def __repr__(self):
        raise SystemExit

def sysCall_init():
    self.count = 0
    self.target = [1, 2.0, 3]
    self.pid = Pid()
    self.gains = {'p': 1.5, 'i': [0.1, 0.2]}

def sysCall_actuation():
    before = self.count
    if before >= 2:
        self.count = before + 10
    self.count += 1

def sysCall_sensing():
    limited(self.count)

def limited(value):
    return min(value, 5)
"""
LUA = """\
gain = 2.5
local hidden = 'here'
function sysCall_init()
  count = 0
  target = {1, 2.0, 3}
  gains = {p = 1.5, i = {0.1, 0.2}}
  setmetatable(gains, {__index = error, __tostring = error, __len = error})
end
function sysCall_actuation()
  local before = count
  if before >= 2 then
    count = before + 10
  end
  count = count + 1
end
function sysCall_sensing()
  return hidden
end
"""


@pytest.fixture(name="begin")
def _begin(tmp_path, new_simulation):
    """Return a function that creates a simulation with a script's text and returns it with the script's path."""

    def begin(text, name="script.py", **overrides):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        simulation = new_simulation(overrides, script=str(path), started=False)
        return simulation, str(path)

    return begin


def table(scopes):
    """Return the shown values, by scope and name."""
    return {scope.name: {row.name: row.value for row in scope.rows} for scope in scopes}


def variables_of(simulation):
    return next(scopes for _, _, scopes in simulation.variables())


def assert_has_variables(simulation):
    assert variables_of(simulation)


def row(scopes, name):
    return next(one for scope in scopes for one in scope.rows if one.name == name)


def record_states(simulation, steps, after_step=lambda: None):
    """Return the state of the drone after each step, as bytes."""
    path = []
    for _ in range(steps):
        simulation.step()
        simulation.breakpoints.reached = None
        after_step()
        state = simulation.drone.body.state
        path.append(struct.pack("13d", *(value for part in state for value in part)))
    return path


# ---- breakpoints


@pytest.mark.parametrize(("text", "name", "line"), [(PYTHON, "script.py", 20), (LUA, "script.lua", 12)])
def test_the_simulation_pauses_after_the_step_in_which_a_line_is_reached(begin, text, name, line):
    simulation, path = begin(text, name)
    states = []
    player = Player(simulation, states.append, simulated_time=False)
    simulation.set_breakpoints({path: frozenset((line,))})
    player.start()
    while player.playing:
        player.step()
    reached = simulation.breakpoints.reached
    assert (reached.file, reached.line, simulation.steps) == (path, line, 3) and states[-1] == "paused"
    assert reached.time == pytest.approx(2 * simulation.clock.time_step)
    assert table(reached.scopes)["locals"]["before"] == "2", "its value at that line"
    assert row(reached.scopes, "count").value == "2" and row(variables_of(simulation), "count").value == "13"
    player.order_steps(1)
    player.step()
    assert simulation.breakpoints.reached.time == pytest.approx(3 * simulation.clock.time_step)
    simulation.set_breakpoints({})
    player.pause(False)
    assert player.step() and player.playing and simulation.breakpoints.reached is None


def test_breakpoints_at_top_level_in_init_and_in_an_imported_file(begin, tmp_path):
    (tmp_path / "helper.py").write_text("def doubled(x):\n    y = 2 * x\n    return y\n", encoding="utf-8")
    text = "import helper\nx = 1\ndef sysCall_init():\n    self.y = x\ndef sysCall_sensing():\n    helper.doubled(4)\n"
    simulation, path = begin(text)
    player = Player(simulation, lambda _: None, simulated_time=False)
    for line in (2, 4):
        simulation.set_breakpoints({path: frozenset((line,)), "/no/such/file.py": frozenset((1,))})
        player.start()
        assert player.paused and simulation.breakpoints.reached.line == line and simulation.steps == 0
        player.stop()
    simulation.set_breakpoints({str(tmp_path / "helper.py"): frozenset((3,))})
    player.start()
    player.step()
    assert player.paused and table(simulation.breakpoints.reached.scopes)["locals"] == {"x": "4", "y": "8"}


THREADS = {
    "script.py": "def sysCall_thread():\n    n = 0\n    while True:\n        n += 1\n        sim.switchThread()\n",
    "script.lua": "function sysCall_thread()\n  local n = 0\n  while true do\n    n = n + 1\n    sim.switchThread()\n"
    "  end\nend\n",
}


@pytest.mark.parametrize("name", THREADS)
def test_breakpoints_in_a_thread(begin, name):
    simulation, path = begin(THREADS[name], name)
    simulation.load_scripts()
    record_states(simulation, 3)
    simulation.set_breakpoints({path: frozenset((5,))})
    simulation.step()
    reached = simulation.breakpoints.reached
    assert reached.line == 5 and table(reached.scopes)["locals"]["n"] == "4"
    simulation.set_breakpoints({})
    simulation.breakpoints.reached = None
    simulation.step()
    assert simulation.breakpoints.reached is None and sys.gettrace() is None


def test_the_time_limit_also_stops_a_script_with_a_breakpoint(begin):
    simulation, path = begin("def sysCall_actuation():\n    while True:\n        x = 1\n", script_time_limit=0.3)
    simulation.set_breakpoints({path: frozenset((3,))})
    simulation.load_scripts()
    trace = sys.gettrace()
    with pytest.raises(ScriptError, match="stopped after"):
        simulation.step()
    assert sys.gettrace() is trace and simulation.breakpoints.reached.line == 3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([], "must be a mapping"),
        ({"script.py": [1]}, "whole path"),
        ({"/a\0.py": [1]}, "whole path"),
        ({"/a.py": [1.5]}, "whole numbers"),
        ({"/a.py": [True]}, "whole numbers"),
        ({"/a.py": list(range(501))}, "at most 500"),
        ({f"/{n}.py": [] for n in range(51)}, "at most 50"),
    ],
)
def test_invalid_breakpoints_are_refused(given, said):
    with pytest.raises(ValueError, match=said):
        read_breakpoints(given)


# ---- variables


def test_variables_of_python(begin):
    simulation, _ = begin(PYTHON)
    simulation.load_scripts()
    simulation.step()
    scopes = variables_of(simulation)
    assert table(scopes) == {
        "self": {"count": "1", "target": "[1, 2.000, 3]", "pid": "", "gains": "2 entries"},
        "globals": {"gain": "2.5"},
    }
    assert row(scopes, "pid").type == "Pid" and row(scopes, "pid").inside == (("sum", "float", "0.25", ()),)
    assert [one.value for one in row(scopes, "gains").inside] == ["1.5", "[0.100, 0.200]"]


def test_variables_of_lua(begin):
    simulation, _ = begin(LUA, "script.lua")
    simulation.load_scripts()
    simulation.step()
    scopes = variables_of(simulation)
    assert table(scopes) == {
        "globals": {
            "count": "1",
            "gain": "2.5",
            "gains": "2 entries",
            "hidden": "'here'",
            "target": "{1.000, 2.000, 3.000}",
        }
    }
    assert [one[:3] for one in row(scopes, "gains").inside] == [
        ("i", "table", "{0.100, 0.200}"),
        ("p", "number", "1.5"),
    ]


HOSTILE = """\
import collections
class Evil(dict):
    def __getattribute__(self, name): raise SystemExit
    def __iter__(self): raise SystemExit
    def items(self): raise SystemExit
    def __len__(self): raise SystemExit
class Key:
    def __repr__(self): raise SystemExit
    __str__ = __eq__ = __repr__
    def __hash__(self): return 1
class Lazy:
    @property
    def __dict__(self): raise SystemExit
class Meta(type):
    def __getattribute__(cls, name): raise SystemExit
class Odd(metaclass=Meta):
    __slots__ = ('a',)
def sysCall_init():
    self.evil, self.lazy, self.odd = Evil(a=1), Lazy(), Odd()
    self.long, self.large, self.wide = 'x' * 10**6, 10**10000, list(range(10**5))
    self.itself = self
    self.infinite, self.none, self.raw = float('inf'), None, b'\\x00\\xff'
    self.queue = collections.deque([1.5, 2.5])
    self.bad_key = {Key(): 1, 'a\\x1eb\\n': 2, (1, 2): 3}
    vars(self).update({f'v{n}': n for n in range(1000)})
def sysCall_sensing(): pass
"""


def test_showing_hostile_variables_runs_none_of_their_code(begin):
    simulation, _ = begin(HOSTILE)
    simulation.load_scripts()
    scopes = variables_of(simulation)
    shown = table(scopes)["self"]
    assert shown["evil"] == "1 entry" and shown["lazy"] == shown["odd"] == shown["itself"] == ""
    assert len(shown["long"]) == LONGEST_VALUE and shown["large"] == "a number of 33220 bits"
    assert shown["infinite"] == "inf" and shown["none"] == "None" and shown["raw"] == r"b'\x00\xff'"
    assert shown["queue"] == "[1.500, 2.500]" and "… 100000 values" in shown["wide"]
    assert [one.name for one in row(scopes, "bad_key").inside] == ["Key", r"'a\x1eb\n'", "(1, 2)"]
    assert len(shown) == MOST_ROWS and len(row(scopes, "wide").inside) == MOST_INSIDE


def test_the_number_and_length_of_shown_lua_variables_are_limited(begin):
    text = """
    function sysCall_init()
      long, wide, odd = string.rep('x', 100000), {}, 'a\\30b\\31c\\n'
      for i = 1, 10000 do wide[i] = {i} end
      for i = 1, 1000 do _G['v' .. i] = i end
      itself = {}
      itself.itself = itself
      keys = {[1.5] = 1, [true] = 2, [itself] = 3, [10] = 4, [-1] = 5}
      nan, infinite = 0/0, 1/0
    end
    function sysCall_sensing() end
    """
    simulation, _ = begin(text, "script.lua")
    simulation.load_scripts()
    (scope,) = variables_of(simulation)
    assert len(scope.rows) == MOST_ROWS
    assert all(len(one.value) <= LONGEST_VALUE + 2 and len(one.inside) <= MOST_INSIDE for one in scope.rows)


# ---- the flight


@pytest.mark.parametrize("script", ["pilot", "tutorial_v4", "tutorial_v3"])
def test_breakpoints_and_inspection_do_not_change_the_flight(new_simulation, script):
    flights = []
    for inspects in (False, True):
        simulation = new_simulation(script=script, started=False)
        if inspects:
            file = str(package_path() / "src/drone_sim/child_scripts/pilot.py") if script == "pilot" else script
            simulation.set_breakpoints({file: frozenset(range(1, 400))})
        simulation.load_scripts()
        flights.append(record_states(simulation, 60, partial(assert_has_variables, simulation) if inspects else int))
    assert flights[0] == flights[1]
