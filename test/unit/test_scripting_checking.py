"""Checks of a script's text while it is typed: syntax, unknown names and misspelt phases; no script is run."""

import pytest

from drone_sim.files.resources import package_path
from drone_sim.scripting.checking import Checker

PACKAGE = package_path()


@pytest.fixture(name="check", scope="module")
def _check():
    return Checker().check


def said(found):
    return [(one.line, one.column, one.end, one.said) for one in found]


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("x = 1\ndef f(:\n", (2, 7), "SyntaxError: invalid syntax"),
        ("def sysCall_init():\n    sim.getObjectPositon(1)\n", (2, 9), "near names are getObjectPosition"),
        (
            "def sysCall_init():\n    self.x = heigt\n\nheight = 1\n",
            (2, 14),
            "'heigt' is not defined; near names are he",
        ),
        ("sim = require('sim')\nsim.getFoo()\n", (2, 5), "sim has no 'getFoo'"),
        ("x = sim.handle_selff\n", (1, 9), "near names are handle_self"),
        ("def sysCall_actuatoin():\n    pass\n", (1, 1), "would never be called; near names are sysCall_actuation"),
        ("x = '\0'", (1, 1), "null bytes"),
        ("x = " + "-" * 100_000 + "1", (1, 1), ""),
    ],
)
def test_errors_in_python_are_found(check, text, place, words):
    (found,) = check(text, False)
    assert (found.line, found.column) == place and words in found.said


@pytest.mark.parametrize(
    "text",
    [
        "def sysCall_init():\n    self.x = sim.getObject('.')\n    print(self.x, simROS, __file__)\n",
        "def f():\n    global made\n    made = 1\n\ndef g():\n    return made\n",
        "from math import *\nprint(sin(1))\n",
        "def f(sim):\n    return [y for y in sim.anything]\n\nclass A:\n    b = 1\n    c = b\n",
        "try:\n    import numpy\nexcept ImportError as error:\n    print(error)\nif simROS2:\n    pass\n",
        "globals()['x'] = 1\nprint(x)\n",
        "match sim.getSimulationTime():\n    case float() as t:\n        print(t)\n",
    ],
)
def test_valid_python_gives_no_findings(check, text):
    assert check(text, False) == []


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("x = 1\nif x then\n", (3, 1), "'end' expected"),
        ("function sysCall_init()\n  h = sim.getObjectPositon(1, -1)\nend\n", (2, 11), "getObjectPosition"),
        ("p = simGetObjectPositon(1, -1)\n", (1, 5), "simGetObjectPosition"),
        ("local function limit(x) return x end\ny = limt(1)\n", (2, 5), "'limt' is not defined; near names are limit"),
        ("local sim = require 'sim'\nsim.getFoo()\n", (2, 5), "sim has no 'getFoo'"),
        ("x = sim_handle_selff", (1, 5), "sim_handle_self"),
        (
            "function sysCall_init()\nend\nif sim_call_type==sim_childscriptcall_sensing then\nend\n",
            (3, 1),
            "line 1 defines a function sysCall_",
        ),
    ],
)
def test_errors_in_lua_are_found(check, text, place, words):
    (found,) = check(text, True)
    assert (found.line, found.column) == place and words in found.said


@pytest.mark.parametrize(
    "text",
    [
        "if (sim_call_type==sim_childscriptcall_actuation) then\n  simSetJointPosition(1, 2)\nend\n",
        "-- simFoo()\nx = 'sim.bar()' --[[ baz() ]] .. [[ simGoo( ]]\nprint(x)\n",
        "local pid = require('pid')\nanything_of_it()\n",
        "function f(a,\n  callback)\n  return callback(a)\nend\nfor i, one in ipairs{print} do one(i) end\n",
        "if simROS2 then end\nsimulationStep = 1\n",
        "x = 3 // 2 | 1\n",
    ],
)
def test_valid_lua_gives_no_findings(check, text):
    assert check(text, True) == []


@pytest.mark.parametrize(
    "script",
    sorted(
        [
            *PACKAGE.glob("src/drone_sim/child_scripts/[a-z]*.py"),
            *PACKAGE.glob("docs/tutorial/[0-9]*.py"),
            *PACKAGE.glob("docs/tutorial/**/[0-9]*.lua"),
            *PACKAGE.glob("tasks/*/*.py"),
            *PACKAGE.glob("test/unit/scripts/**/*.lua"),
        ]
    ),
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_the_scripts_of_the_package_give_no_findings(check, script):
    assert said(check(script.read_text(encoding="utf-8"), script.suffix == ".lua")) == []


def test_checking_a_script_does_not_run_it(check, tmp_path):
    marker = tmp_path / "made"
    assert check(f"open({str(marker)!r}, 'w')\n__import__('os').mkdir({str(marker)!r})\n", False) == []
    assert check(f"io.open('{marker}', 'w')\n", True) == [] and not marker.exists()


# ---- in the cockpit, by a separate process


def test_a_checking_process_that_does_not_answer_is_replaced():
    pytest.importorskip("rospy", reason="needs ROS")
    from drone_sim.ros.cockpit.editor.checks import LARGEST, TextChecker

    checker = TextChecker()
    (found,) = checker.check("sim.getFoo()", False)["found"]
    assert found["line"] == 1 and "getFoo" in found["said"]
    assert "bytes" in checker.check("#" * (LARGEST + 1), False)["unchecked"]
    process = checker._process
    process.kill()  # as the checker does after a timeout
    process.wait()
    assert "too long" in checker.check("x = 1", False)["unchecked"]
    assert checker.check("x = = 1", True)["found"][0]["line"] == 1
    checker.close()
