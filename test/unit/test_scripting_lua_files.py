"""What a Lua script finds of files and programs: the code beside it, and clear words on the rest."""

import logging

import pytest

from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

FLAT = "local _ = function() simGetSimulationTime() end\n"  # which asks for Lua 5.1
DIALECTS = pytest.mark.parametrize("dialect", ["", FLAT], ids=["newest", "5.1"])


@pytest.fixture(name="run")
def _run(tmp_path, caplog):
    caplog.set_level(logging.INFO)

    def run(text, **files):
        """Run a script beside files; return what it printed."""
        for name, contents in files.items():
            (tmp_path / name.replace("__", "/")).parent.mkdir(exist_ok=True)
            (tmp_path / name.replace("__", "/")).with_suffix(".lua").write_text(contents, encoding="utf-8")
        path = tmp_path / "main.lua"
        path.write_text(text, encoding="utf-8")
        caplog.clear()
        load.load(str(path), {}, TimeLimit(2.0)).close()
        return caplog.messages

    return run


def refused(run, text, **files):
    with pytest.raises(ScriptError) as error:
        run(text, **files)
    return str(error.value)


@DIALECTS
def test_what_is_written_goes_nowhere_and_the_script_goes_on(run, dialect, tmp_path):
    record = (
        "local f = io.open('./pid.txt', 'w')\n"
        "f:write('alpha', 1, '\\n'):write('beta')\nf:flush()\nprint(io.type(f), f:seek('cur'))\nf:close()\n"
        "io.open('other.txt', 'a'):write(2)\nio.write('gain ', 2, '\\n')\nio.stderr:write('careful')"
    )
    said = run(dialect + record)
    assert said[0].startswith("io.open: './pid.txt' is not written: a Lua script cannot write files")
    assert said[1:] == ["file\t0", "gain 2", "careful"]
    assert not list(tmp_path.glob("*.txt"))


@DIALECTS
@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("assert(io.open('best.dat', 'r'))", "best.dat: No such file or directory"),
        ("for line in io.lines('best.dat') do end", "io.lines: best.dat: No such file or directory"),
        ("for line in io.lines() do end", "io.lines: a Lua script can only read files in its own folder"),
        ("io.read()", "io.read: a Lua script can only read files in its own folder"),
        ("io.open('main.lua'):write('x')", "write: a Lua script cannot write files"),
        ("io.open('main.lua'):read('x')", "read: a number of bytes, 'a', 'l', 'L' or 'n' is expected"),
        ("io.open('a', 'w'):read()", "read: this file is open for writing"),
        ("io.popen('ls')", "io.popen: a child script cannot start programs"),
        ("os.execute('clear')", "os.execute: a child script cannot start programs"),
        ("os.getenv('HOME')", "os.getenv: a Lua script sees no environment: use script_parameters"),
        ("os.remove('a')", "os.remove: a Lua script cannot write files"),
        ("os.exit()", "os.exit: sim.stopSimulation() ends a flight"),
    ],
)
def test_what_is_refused_says_so_in_one_line(run, dialect, call, words):
    said = refused(run, dialect + "\n" + call)
    assert f"main.lua:{2 + bool(dialect)}: {words}" in said and "\n" not in said


@DIALECTS
def test_a_file_beside_the_script_is_read(run, dialect, tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "way points.csv").write_bytes(b"1.5 -2.5,x\n\nlast \xff")
    main = """
local f = assert(io.open('./data/way points.csv', 'r'))
print(io.type(f), f:read('*n', 'n'))
print(f:read(2), f:read('*l'), f:read(), f:read('*a') == 'last \\255', f:read('*l'), f:read('a'))
print(f:seek('set', 1), f:read(2), f:seek('end'), f:read(1), f:seek('cur', -3), f:read(9))
f:close()
for line in io.lines('data/way points.csv') do print(#line) end
for line in io.open('data/way points.csv'):lines() do printf('%d %s %s', #line, true, nil) end
"""
    assert run(dialect + main) == [
        "file\t1.5\t-2.5",
        ",x\t\t\ttrue\tnil\t",
        "1\t.5\t18\tnil\t15\tt \N{REPLACEMENT CHARACTER}",
        *["10", "0", "6"],
        *["10 true nil", "0 true nil", "6 true nil"],
    ]


@DIALECTS
@pytest.mark.parametrize(
    "name", ["../main.lua", "/etc/passwd", "data/../../main.lua", ".hidden", "a\\0b", "", "x" * 300]
)
def test_no_data_elsewhere_are_read(run, dialect, name):
    said = refused(run, dialect + f"print(io.open('{name}'))")
    assert "main.lua:" in said.partition("io.open: ")[0]
    assert "must be a file in the script's folder" in said


@DIALECTS
def test_data_are_neither_links_out_of_the_folder_nor_endless(run, dialect, tmp_path):
    (tmp_path / "out.txt").symlink_to("/etc/hostname")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "large").write_bytes(b"x" * 2**21)
    for name in ("out.txt", "zero"):
        assert "is outside of the script's folder" in refused(run, dialect + f"io.open('{name}')")
    assert all(line.startswith("nil\t") for line in run(dialect + "print(io.open('large')) print(io.open('parts'))"))


@DIALECTS
def test_a_plugin_that_is_required_says_why_it_is_not_there(run, dialect):
    assert "there is no plugin simIK here: inverse kinematics is not supported" in refused(
        run, dialect + "require 'simIK'"
    )


@DIALECTS
def test_code_beside_the_script_is_loaded_by_file(run, dialect):
    main = (
        "count = 0\nfor _ = 1, 3 do dofile('step.lua') end\n"
        "print(count, dofile('./parts/gains.lua'), assert(loadfile('parts/gains.lua'))())"
    )
    assert run(dialect + main, step="count = count + 1", parts__gains="return 7") == ["3\t7\t7"]


@DIALECTS
@pytest.mark.parametrize("name", ["../main.lua", "/etc/passwd", "/main.lua", "notes.txt", "parts/../a.lua", "x\\0.lua"])
def test_no_other_file_is_reached(run, dialect, name):
    said = run(dialect + f"print(loadfile('{name}'))")
    assert said[0].startswith("nil\tcannot load '") and "must be a .lua file in the script's folder" in said[0]


@DIALECTS
def test_a_link_out_of_the_folder_is_not_followed(run, dialect, tmp_path):
    (tmp_path / "out.lua").symlink_to("/etc/hostname")
    assert "is outside of the script's folder" in refused(run, dialect + "dofile('out.lua')")


@DIALECTS
def test_errors_are_told_by_their_file(run, dialect, tmp_path):
    assert f"{tmp_path}/step.lua:2: " in refused(run, dialect + "dofile('step.lua')", step="\nnothing.x = 1")
    assert "near names are step.lua" in refused(run, dialect + "dofile('stp.lua')")
    assert "step.lua:1: unexpected symbol" in refused(run, dialect + "assert(loadfile('step.lua'))", step="= 1")


def test_a_helper_may_be_a_module_of_lua_5_1(run):
    helper = "module(..., package.seeall)\nfunction new(height) return {height = math.max(height, 1)} end\n"
    main = FLAT + "local q = require 'quad'\nprint(q.new(0.5).height, quad == q, new)"
    assert run(main, quad=helper) == ["1\ttrue\tnil"]
    assert "module is of Lua 5.1: let the file return a table instead" in refused(run, "require 'quad'", quad=helper)


@DIALECTS
def test_a_script_is_no_helper_of_its_own(run, dialect):
    said = refused(run, dialect + "require 'main'")
    assert "no module 'main': main.lua is this script itself" in said and "\n" not in said
    assert run(dialect + "print(require 'main')", main__init="return 7") == ["7"]


def test_a_function_may_be_called_goto_as_in_lua_5_1(run):
    assert run("function goto(place) return place end\nprint(goto('there'))") == ["there"]


def test_flat_names_and_operators_of_newer_luas_may_stand_in_one_script(run):
    assert run(FLAT + "print(5 | 2, 1 << 3)") == ["7\t8"]
    assert run(FLAT + "print('5 | 2', table.getn({1, 2}))") == ["5 | 2\t2"], "in 5.1, where nothing else is asked for"
    assert "main.lua:2: unexpected symbol near '='" in refused(run, FLAT + "= 1")


@DIALECTS
def test_a_seed_may_have_a_fraction(run, dialect):
    two = "math.randomseed(4711.8)\nlocal a = math.random()\nmath.randomseed(4711.8)\nprint(a == math.random())\n"
    assert run(dialect + two + "math.randomseed()\nprint(math.random(1000))") == run(
        dialect + two + "math.randomseed(1)\nprint(math.random(1000))"
    )


@pytest.mark.parametrize("before", [b"\xef\xbb\xbf", b"#!/usr/bin/lua\r\n", b"\xef\xbb\xbf#!lua\n", b"-- \xe4\n", b""])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_a_file_may_be_of_any_editor(tmp_path, caplog, before, end):
    caplog.set_level(logging.INFO)
    (tmp_path / "helper.lua").write_bytes(before + b"return 7" + end)
    path = tmp_path / "bytes.lua"
    path.write_bytes(before + b"print(require 'helper', dofile 'helper.lua')" + end + b"x = 1" + end)
    load.load(str(path), {}, TimeLimit(2.0)).close()
    assert "7\t7" in caplog.messages
