"""Helper modules beside a script: import, reload at start, isolation, and errors with the helper's file and line."""

import logging
import os
import sys

import pytest

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError

PARAMETERS = parameters.load({"script_time_limit": 60.0})


@pytest.fixture(name="write")
def _write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    return lambda path: new_simulation(script=path)


@pytest.fixture(name="printed")
def _printed(caplog):
    caplog.set_level(logging.INFO)
    return lambda: [record.getMessage() for record in caplog.records if record.name == "drone_sim.script"]


def load_error(path, limit=60.0):
    with pytest.raises(ScriptError) as error:
        Simulation(parameters.load({"script_time_limit": limit}), script=path).close()
    return str(error.value)


HELPERS = {"py": "def answer():\n    return 42\n", "lua": "local M = {}\nfunction M.answer() return 42 end\nreturn M\n"}
USERS = {
    "py": "import helper\n\ndef sysCall_init():\n    print(helper.answer())\n",
    "lua": "local helper = require 'helper'\nfunction sysCall_init() print(helper.answer()) end\n",
}
ENDINGS = pytest.mark.parametrize("ending", ["py", "lua"])


@ENDINGS
def test_helper_is_imported_and_read_again_at_each_start(write, simulate, printed, tmp_path, ending):
    helper = write(f"helper.{ending}", HELPERS[ending])
    simulation = simulate(write(f"script.{ending}", USERS[ending]))
    stamp = os.stat(helper)
    write(f"helper.{ending}", HELPERS[ending].replace("42", "43"))
    os.utime(helper, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # a change within the clock's resolution counts too
    simulation.start()
    assert printed() == ["42", "43"]
    assert sorted(os.listdir(tmp_path)) == [f"helper.{ending}", f"script.{ending}"]


@ENDINGS
def test_scripts_with_the_same_name_have_separate_helpers(write, simulate, printed, ending):
    for number in ("1", "2"):
        write(f"{number}/script/helper.{ending}", HELPERS[ending].replace("42", number))
    simulations = [simulate(write(f"{number}/script/script.{ending}", USERS[ending])) for number in ("1", "2")]
    for simulation in simulations:
        simulation.start()
    assert printed() == ["1", "2", "1", "2"]
    assert "helper" not in sys.modules


@ENDINGS
def test_closed_script_leaves_no_modules_and_no_import_hooks(write, ending):
    write(f"helper.{ending}", HELPERS[ending])
    before = set(sys.modules), list(sys.meta_path)
    Simulation(PARAMETERS, script=write(f"script.{ending}", USERS[ending])).close()
    write(f"helper.{ending}", "x = = 1")
    load_error(write(f"script.{ending}", USERS[ending]))
    assert {name for name in set(sys.modules) - before[0] if "script" in name and "drone_sim" not in name} == set()
    assert sys.meta_path == before[1]


@pytest.mark.parametrize(
    "ending, helper, user, phase, line, words",
    [
        ("py", "\n1 / 0\n", USERS["py"], "load", 2, "ZeroDivisionError"),
        ("py", "x = 1\nx = = 1\n", USERS["py"], "load", 2, "SyntaxError"),
        ("py", "def answer():\n    return undefined\n", USERS["py"], "init", 2, "NameError"),
        ("py", "def answer():\n    while True:\n        pass\n", USERS["py"], "init", (2, 3), "stopped after 0.5 s"),
        (
            "py",
            "def answer():\n    sim.getObjctPosition(1)\n",
            USERS["py"],
            "init",
            2,
            "near names are getObjectPosition",
        ),
        ("lua", "\nlocal x = nil + 1\n", USERS["lua"], "load", 2, "arithmetic"),
        ("lua", "x = 1\nx = = 1\n", USERS["lua"], "load", 2, "unexpected symbol"),
        ("lua", "return {answer = function()\n  return nil + 1\nend}", USERS["lua"], "init", 2, "arithmetic"),
        (
            "lua",
            "return {answer = function()\n  while true do end\nend}",
            USERS["lua"],
            "init",
            2,
            "stopped after 0.5 s",
        ),
        (
            "lua",
            "return {answer = function()\n  sim.getObjectPosition()\nend}",
            USERS["lua"],
            "init",
            2,
            "wrong number",
        ),
        (
            "lua",
            "return {answer = function()\n  sim.getObjctPosition()\nend}",
            USERS["lua"],
            "init",
            2,
            "near names are",
        ),
    ],
)
def test_error_in_a_helper_is_reported_with_its_file_and_line(write, ending, helper, user, phase, line, words):
    path = write(f"helper.{ending}", helper)
    message = load_error(write(f"script.{ending}", user), limit=0.5 if "stopped" in words else 60.0)
    lines = line if isinstance(line, tuple) else (line,)
    assert any(message.startswith(f"[{phase}] {path}:{number_of_line}: ") for number_of_line in lines), message
    assert words in message and "\n" not in message and "_script" not in message


@ENDINGS
def test_misspelt_phase_in_a_helper_is_reported(write, ending):
    define = {"py": "def sysCall_actuate():\n    pass", "lua": "function sysCall_actuate() end"}[ending]
    path = write(f"helper.{ending}", f"\n{define}\n")
    message = load_error(write(f"script.{ending}", {"py": "from helper import *", "lua": "require 'helper'"}[ending]))
    assert message == f"[load] {path}:2: sysCall_actuate would never be called; near names are sysCall_actuation"


@ENDINGS
def test_snapshot_includes_the_variables_of_helpers(write, simulate, printed, ending):
    helper = {
        "py": "count = [0]\ndef up():\n    count[0] += 1\n    return count[0]\n",
        "lua": "local count = 0\nreturn {up = function() count = count + 1 return count end}",
    }[ending]
    user = {
        "py": "def sysCall_sensing():\n    import helper\n    print(helper.up())\nimport helper\n",
        "lua": "require 'helper'\nfunction sysCall_sensing() print(require('helper').up()) end",
    }[ending]
    write(f"helper.{ending}", helper)
    simulation = simulate(write(f"script.{ending}", user))
    simulation.step()
    snapshot = simulation.snapshot()
    for _ in range(2):
        simulation.step()
        simulation.step()
        simulation.restore(snapshot)
    assert [float(line) for line in printed()] == [1, 2, 3, 2, 3]


# ---- Python


def test_python_packages_and_their_submodules_can_be_imported(write, simulate, printed):
    write("lib/__init__.py", "from .gains import Kp\n")
    write("lib/gains.py", "from __future__ import annotations\nfrom dataclasses import dataclass\nKp = 2\n"
          "@dataclass\nclass Gain:\n    value: float = 7\n")  # fmt: skip
    write("plain/deep.py", "import lib\nKd = lib.Kp + 1\n")
    path = write(
        "script.py",
        "import lib, lib.gains as g, plain.deep\nfrom lib.gains import Gain\nfrom plain import deep as d\n"
        "def sysCall_init():\n    print(lib.Kp, g.Kp, plain.deep.Kd, d.Kd, Gain().value)\n",
    )
    simulate(path)
    assert printed() == ["2 2 3 3 7"]


@pytest.mark.parametrize("first", ["", "from __future__ import annotations\n"])
def test_dataclasses_work_in_a_script(write, simulate, printed, first):
    text = "from dataclasses import dataclass\n@dataclass\nclass Gain:\n    value: float = 7\nprint(Gain(8).value)\n"
    text += "def sysCall_init():\n    pass\n"
    simulate(write("script.py", f"{first}{text}"))
    assert printed() == ["8"]


def test_python_helper_has_the_same_globals_as_the_script(write, simulate, printed):
    write("helper.py", "print(sim.getObjectHandle('Drone') >= 0, simROS is not None)\nself.x = 3\n")
    simulate(write("script.py", "import helper\ndef sysCall_init():\n    print(self.x)\n"))
    assert printed() == ["True True", "3"]


def test_standard_library_takes_precedence_over_a_helper_and_a_line_is_logged(write, simulate, printed, caplog):
    write("random.py", "raise RuntimeError")
    folder = os.path.dirname(write("yaml.py", "mine = 5"))
    simulate(
        write("script.py", "import random, yaml\ndef sysCall_init():\n    print(random.randint(3, 3), yaml.mine)\n")
    )
    assert printed() == ["3 5"]
    assert f"{folder}: random is not used" in caplog.text
    assert sys.modules["yaml"].__name__ == "yaml" and not hasattr(sys.modules["yaml"], "mine")


def test_missing_python_helper_is_reported_with_near_names(write):
    write("helper.py", "")
    path = write("script.py", "\nimport helpr\n")
    message = f"[load] {path}:2: ModuleNotFoundError: No module named 'helpr'; near names are helper"
    assert load_error(path) == message


def test_python_helper_larger_than_1_mib_is_refused(write, tmp_path):
    write("large.py", "#" * (1024 * 1024 + 1))
    path = write("script.py", "\nimport large\n")
    assert load_error(path).startswith(f"[load] {path}:2: ImportError: {tmp_path}/large.py: larger than 1 MiB")


# ---- Lua


@pytest.mark.parametrize("old", ["", "simGetSimulationTime()\n"], ids=["newest", "5.1"])
def test_lua_modules_in_folders_share_the_scripts_globals_and_are_read_once(write, simulate, printed, old):
    write("lib/gains.lua", "print('read', ...)\ncount = (count or 0) + 1\nreturn {Kp = 2}")
    write("kit/init.lua", "return 'kit'")
    write("nothing.lua", "")
    simulate(
        write(
            "script.lua",
            f"{old}function sysCall_init() print(require('lib.gains').Kp, require('lib.gains').Kp, count) "
            "print(require 'kit', require 'nothing') end",
        )
    )
    assert printed() == ["read\tlib.gains", "2\t2\t1", "kit\ttrue"]


@pytest.mark.parametrize(
    "name, words",
    [
        ("../outside", "no module '../outside': the name of a module"),
        ("lib..outside", "the name of a module"),
        ("/etc/passwd", "the name of a module"),
        ("", "the name of a module"),
        ("helper.lua", "no module 'helper.lua': there is no file helper/lua.lua"),
        ("helpr", "no module 'helpr': there is no file helpr.lua in the script's folder; near names are helper"),
        ("linked", "is outside of the script's folder"),
        ("pipe", "must be a regular file"),
        ("folder", "must be a regular file"),
        ("large", "larger than 1 MiB"),
        ("compiled", "precompiled"),
        ("circle", "requires itself"),
    ],
)
def test_lua_module_must_be_a_small_text_file_in_the_scripts_folder(write, tmp_path, name, words):
    write("outside.lua", "return 1")
    (tmp_path / "inner" / "folder.lua").mkdir(parents=True)
    write("inner/helper.lua", "return 1")
    write("inner/large.lua", "-" * (1024 * 1024 + 1))
    write("inner/compiled.lua", "\x1bLua")
    write("inner/circle.lua", "require 'circle'")
    os.mkfifo(tmp_path / "inner" / "pipe.lua")
    (tmp_path / "inner" / "linked.lua").symlink_to(tmp_path / "outside.lua")
    message = load_error(write("inner/script.lua", f"\nrequire '{name}'"))
    place = "circle.lua:1" if name == "circle" else "script.lua:2"
    assert message.startswith(f"[load] {tmp_path}/inner/{place}: ")
    assert words in message


def test_built_in_scripts_can_be_imported_and_a_local_file_takes_precedence(write, simulate, printed):
    user = "import tutorial\nfrom tutorial import *\n"
    simulation = simulate(write("mine/script.py", user))
    for _ in range(20):
        simulation.step()
    assert simulation.drone.body.state.position[2] == pytest.approx(0.8, abs=1e-3)
    write("mine/tutorial.py", "def sysCall_init():\n    print('mine')\n")
    simulation.start()
    assert printed() == ["mine"]
