"""The Lua sandbox: a script has access to nothing but the API."""

import itertools
import logging

import pytest

from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.lua.source import LuaSource

DIALECTS = {"5.1": "local _ = function() simGetSimulationTime() end", "newest": "local _ = sim.getSimulationTime"}

WALK = """
local seen, found = {}, {}
local function walk(value, path)
    if type(value) == 'userdata' or type(value) == 'thread' then found[#found + 1] = path end
    if type(value) ~= 'table' or seen[value] then return end
    seen[value] = true
    for k, v in pairs(value) do walk(k, path .. '.key') walk(v, path .. '.' .. tostring(k)) end
    walk(getmetatable(value), path .. '.meta')
end
walk(_G, '_G')
walk(getmetatable(''), 'string.meta')
print('found: ' .. table.concat(found, ' '))
"""

ESCAPES = [
    "io.open('/etc/passwd')",
    "os.execute('true')",
    "os.remove('/tmp/nothing')",
    "os.getenv('HOME')",
    "os.exit(1)",
    "dofile('/dev/null')",
    "loadfile('/dev/null')()",
    "package.loadlib('libc.so.6', '*')",
    "package.loaded.io.open('/dev/null')",
    "require('io').open('/dev/null')",
    "require('debug').getregistry()",
    "require('python').eval('1')",
    "python.eval('1')",
    "python.builtins.open('/etc/passwd')",
    "debug.getregistry()",
    "debug.sethook()",
    "debug.getupvalue(print, 1).x()",
    "getfenv(print).x()",
    "setfenv(1, {})",
    "newproxy(true)",
    "module('x')",
    "string.dump(print)",
    "assert(load('\\27Lua'))()",
    "assert(loadstring('\\27Lua'))()",
    "sim.getObjectPosition.__globals__()",
    "sim.__class__()",
    "sim._api()",
    "simROS.backend()",
    "local ok, e = pcall(sim.getObjectPosition) ; local x = e.__traceback__.tb_frame",
    "setmetatable({}, {__gc = function() end})",
    "sim.getObject(sim)",
    "sim.setStringSignal('x', coroutine.create(print))",
]


@pytest.fixture(name="run")
def _run(tmp_path, caplog):
    def run(source):
        caplog.clear()
        path = tmp_path / "script.lua"
        path.write_text(f"{source}\nfunction sysCall_init() end", encoding="utf-8")
        with caplog.at_level(logging.INFO):
            Simulation(parameters.load(), script=str(path)).close()
        return [record.getMessage() for record in caplog.records if record.name == "drone_sim.script"]

    return run


def execution_mode(attempt):
    """Return the properties of the source that decide how it runs; only attempts that agree in them share a script."""
    text = LuaSource(attempt.encode())
    return text.loops_in_c, text.coroutines, text.threads


@pytest.mark.parametrize("dialect", DIALECTS)
def test_escapes_fail(run, dialect):
    for _, attempts in itertools.groupby(sorted(ESCAPES, key=execution_mode), execution_mode):
        tries = {call: f"do local ok, e = pcall(function() {call} end) print(ok, type(e)) end" for call in attempts}
        assert dict(zip(tries, run("\n".join([DIALECTS[dialect], *tries.values()])))) == dict.fromkeys(
            tries, "false\tstring"
        )


@pytest.mark.parametrize("dialect", DIALECTS)
def test_no_python_object_is_in_reach(run, dialect):
    assert run(DIALECTS[dialect] + WALK) == ["found: "]


@pytest.mark.parametrize("dialect, version", [("5.1", "Lua 5.1"), ("newest", "Lua 5.5")])
def test_the_api_generation_selects_the_lua_version(run, dialect, version):
    lupa = pytest.importorskip("lupa.lua55" if dialect == "newest" else "lupa.lua51")
    assert lupa and run(f"{DIALECTS[dialect]}\nprint(_VERSION)") == [version]


def test_comments_do_not_select_the_lua_version(run):
    (version,) = run("-- simGetObjectHandle('x') sim_call_type\n--[[ simFoo() ]] print(_VERSION)")
    assert version != "Lua 5.1"


def test_permitted_standard_functions_work(run):
    source = """
    print(os.time() > 0, os.clock() >= 0, type(os.date()), math.mod(7, 4), math.pow(2, 3), unpack({1}))
    print(pcall(error, 'x'))
    print(xpcall(function() error('y', 0) end, function(e) return e .. '!' end))
    print(select(2, coroutine.resume(coroutine.create(function(a) return a + 1 end), 1)))
    print(coroutine.wrap(function() coroutine.yield(5) end)())
    print(load('return 1 + 1')(), loadstring('return 3')(), #{table.unpack({1, 2, 3})})
    print(require'sim' == sim, require('simROS') == simROS)
    """
    output = run(source)
    assert output[0].startswith("true\ttrue\tstring\t3")
    assert output[1:] == ["false\tx", "false\ty!", "2", "5", "2\t3\t3", "true\ttrue"]
