"""File and program access of Lua scripts: reading in the script's folder, and error messages for the rest."""

import logging

import pytest

from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

FLAT = "local _ = function() simGetSimulationTime() end\n"  # the flat API selects Lua 5.1
DIALECTS = pytest.mark.parametrize("dialect", ["", FLAT], ids=["newest", "5.1"])


@pytest.fixture(name="run")
def _run(tmp_path, caplog):
    caplog.set_level(logging.INFO)

    def run(text, **files):
        """Run a script with `files` beside it; return the log lines, including what it printed."""
        for name, contents in files.items():
            (tmp_path / name.replace("__", "/")).parent.mkdir(exist_ok=True)
            (tmp_path / name.replace("__", "/")).with_suffix(".lua").write_text(contents, encoding="utf-8")
        path = tmp_path / "main.lua"
        path.write_text(text, encoding="utf-8")
        caplog.clear()
        load.load(str(path), {}, TimeLimit(2.0)).close()
        return caplog.messages

    return run


def load_error(run, text, **files):
    with pytest.raises(ScriptError) as error:
        run(text, **files)
    return str(error.value)


@DIALECTS
def test_writes_to_files_are_discarded_and_the_script_continues(run, dialect, tmp_path):
    record = (
        "local f = io.open('./pid.txt', 'w')\n"
        "f:write('alpha', 1, '\\n'):write('beta')\nf:flush()\nprint(io.type(f), f:seek('cur'))\nf:close()\n"
        "io.open('other.txt', 'a'):write(2)\nio.write('gain ', 2, '\\n')\nio.stderr:write('careful')"
    )
    output = run(dialect + record)
    assert output[0].startswith("io.open: './pid.txt' is not written: a Lua script cannot write files")
    assert output[1:] == ["file\t0", "gain 2", "careful"]
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
def test_refused_file_or_system_call_is_reported_in_one_line(run, dialect, call, words):
    output = load_error(run, dialect + "\n" + call)
    assert f"main.lua:{2 + bool(dialect)}: {words}" in output and "\n" not in output


@DIALECTS
def test_file_beside_the_script_can_be_read(run, dialect, tmp_path):
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
def test_file_outside_the_scripts_folder_cannot_be_opened(run, dialect, name):
    output = load_error(run, dialect + f"print(io.open('{name}'))")
    assert "main.lua:" in output.partition("io.open: ")[0]
    assert "must be a file in the script's folder" in output


@DIALECTS
def test_links_out_of_the_folder_and_too_large_files_cannot_be_opened(run, dialect, tmp_path):
    (tmp_path / "out.txt").symlink_to("/etc/hostname")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "large").write_bytes(b"x" * 2**21)
    for name in ("out.txt", "zero"):
        assert "is outside of the script's folder" in load_error(run, dialect + f"io.open('{name}')")
    assert all(line.startswith("nil\t") for line in run(dialect + "print(io.open('large')) print(io.open('parts'))"))


@DIALECTS
def test_requiring_an_unsupported_plugin_reports_the_reason(run, dialect):
    assert "there is no plugin simIK here: inverse kinematics is not supported" in load_error(
        run, dialect + "require 'simIK'"
    )


@DIALECTS
def test_dofile_and_loadfile_load_lua_files_beside_the_script(run, dialect):
    main = (
        "count = 0\nfor _ = 1, 3 do dofile('step.lua') end\n"
        "print(count, dofile('./parts/gains.lua'), assert(loadfile('parts/gains.lua'))())"
    )
    assert run(dialect + main, step="count = count + 1", parts__gains="return 7") == ["3\t7\t7"]


@DIALECTS
@pytest.mark.parametrize("name", ["../main.lua", "/etc/passwd", "/main.lua", "notes.txt", "parts/../a.lua", "x\\0.lua"])
def test_loadfile_refuses_every_other_file(run, dialect, name):
    output = run(dialect + f"print(loadfile('{name}'))")
    assert output[0].startswith("nil\tcannot load '") and "must be a .lua file in the script's folder" in output[0]


@DIALECTS
def test_dofile_does_not_follow_a_link_out_of_the_folder(run, dialect, tmp_path):
    (tmp_path / "out.lua").symlink_to("/etc/hostname")
    assert "is outside of the script's folder" in load_error(run, dialect + "dofile('out.lua')")


@DIALECTS
def test_errors_in_loaded_files_name_the_file(run, dialect, tmp_path):
    assert f"{tmp_path}/step.lua:2: " in load_error(run, dialect + "dofile('step.lua')", step="\nnothing.x = 1")
    assert "near names are step.lua" in load_error(run, dialect + "dofile('stp.lua')")
    assert "step.lua:1: unexpected symbol" in load_error(run, dialect + "assert(loadfile('step.lua'))", step="= 1")


def test_lua_5_1_helper_may_use_the_module_function(run):
    helper = "module(..., package.seeall)\nfunction new(height) return {height = math.max(height, 1)} end\n"
    main = FLAT + "local q = require 'quad'\nprint(q.new(0.5).height, quad == q, new)"
    assert run(main, quad=helper) == ["1\ttrue\tnil"]
    assert "module is of Lua 5.1: let the file return a table instead" in load_error(run, "require 'quad'", quad=helper)


@DIALECTS
def test_script_cannot_require_itself(run, dialect):
    output = load_error(run, dialect + "require 'main'")
    assert "no module 'main': main.lua is this script itself" in output and "\n" not in output
    assert run(dialect + "print(require 'main')", main__init="return 7") == ["7"]


def test_function_may_be_named_goto_as_in_lua_5_1(run):
    assert run("function goto(place) return place end\nprint(goto('there'))") == ["there"]


def test_script_may_combine_flat_api_names_with_operators_of_newer_lua_versions(run):
    assert run(FLAT + "print(5 | 2, 1 << 3)") == ["7\t8"]
    assert run(FLAT + "print('5 | 2', table.getn({1, 2}))") == ["5 | 2\t2"], "Lua 5.1, unless newer syntax is used"
    assert "main.lua:2: unexpected symbol near '='" in load_error(run, FLAT + "= 1")


@DIALECTS
def test_random_seed_may_have_a_fraction(run, dialect):
    program = "math.randomseed(4711.8)\nlocal a = math.random()\nmath.randomseed(4711.8)\nprint(a == math.random())\n"
    assert run(dialect + program + "math.randomseed()\nprint(math.random(1000))") == run(
        dialect + program + "math.randomseed(1)\nprint(math.random(1000))"
    )


@pytest.mark.parametrize("before", [b"\xef\xbb\xbf", b"#!/usr/bin/lua\r\n", b"\xef\xbb\xbf#!lua\n", b"-- \xe4\n", b""])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lua_file_may_have_a_bom_a_shebang_and_any_line_ending(tmp_path, caplog, before, end):
    caplog.set_level(logging.INFO)
    (tmp_path / "helper.lua").write_bytes(before + b"return 7" + end)
    path = tmp_path / "bytes.lua"
    path.write_bytes(before + b"print(require 'helper', dofile 'helper.lua')" + end + b"x = 1" + end)
    load.load(str(path), {}, TimeLimit(2.0)).close()
    assert "7\t7" in caplog.messages
