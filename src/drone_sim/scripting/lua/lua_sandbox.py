"""The Lua side of a Lua child script: what it finds, what it may not reach, and how it is stopped.

The chunk runs once in a fresh Lua state (5.1 or newer), before the script is read. The script has globals of its
own; the real ones, which lupa looks at, stay as they are. Nothing of Python is left in the script's reach: API
functions are Lua closures over Python functions, and an error that is a Python object passes through every pcall.
Finalizers run with hooks switched off, and so do the handlers of Lua's own xpcall: neither is to be had.
"""

from drone_sim.scripting.lua.lua_crossing import CROSSING
from drone_sim.scripting.lua.lua_functions import FUNCTIONS
from drone_sim.scripting.lua.lua_matrices import MATRICES
from drone_sim.scripting.lua.lua_snapshots import SNAPSHOTS

_LIMITS = r"""
local bridge, source = ...

local pcall, error, type, tostring, select, next, pairs = pcall, error, type, tostring, select, next, pairs
local rawget, rawset, rawlen, setmetatable = rawget, rawset, rawlen, setmetatable
local unpack = table.unpack or unpack
local concat, byte, sub, match = table.concat, string.byte, string.sub, string.match
local load, loadstring, setfenv = load, loadstring, setfenv
local getinfo, sethook = debug.getinfo, debug.sethook
local getupvalue, setupvalue = debug.getupvalue, debug.setupvalue
local getmeta, setmeta = debug.getmetatable, debug.setmetatable
local create, resume, close = coroutine.create, coroutine.resume, coroutine.close
local look, log = bridge.look, bridge.log
local newer = _VERSION ~= 'Lua 5.1'
debug = nil -- or lupa looks up its traceback in every call
local sources = {[source] = sub(source, 2)} -- of the script and what it requires: '=name' -> 'name'
rawlen = rawlen or function(t) return #t end -- which knows no __len in 5.1

local function pack(...)
  return {n = select('#', ...), ...}
end

---- errors, and the limits of time and memory

-- In the simulation's own thread what takes long in C (comparing or joining strings of 100 MB, say) may take so only a
-- few times between two looks at the clock and the memory; 1000 instructions are some 10 us.
local INSTRUCTIONS = bridge.direct and 200 or 2000
local MISSING = 3 -- beside the reasons for which `look` stops a script (lua_script.py)
local running, stopped, stopped_at, stopped_in = false, false, 0, ''

local function place_in_script()
  for level = 3, 250 do
    local info = getinfo(level, 'Sl')
    if not info then break end
    if sources[info.source] and info.currentline > 0 then return info.currentline, sources[info.source] end
  end
  return 0, sources[source]
end

local function stop(why)
  stopped = why
  stopped_at, stopped_in = place_in_script()
  error('stopped', 0)
end

local function hook()
  if not running then return end
  if stopped then error('stopped', 0) end
  local why = look()
  if why > 0 then stop(why) end
end
sethook(hook, '', INSTRUCTIONS)

-- Neither a limit nor a Python exception can be caught.
local function caught(ok, ...)
  if not ok and (stopped or type((...)) == 'userdata') then error((...), 0) end
  return ok, ...
end

local function protected(f, ...)
  return caught(pcall(f, ...))
end

local function message_of(value)
  if type(value) == 'number' then return tostring(value) end
  if type(value) == 'string' then return sub(value, 1, bridge.longest_message) end
  return 'an error that is a ' .. type(value)
end
"""

_PHASES = r"""
---- what Python calls: phases, callbacks, and the script itself

local env, chunk = {}, nil
local PHASES = {bridge.phases()}

-- Tell which phases the script has: the sum of 1 for the first of them, 2 for the second, ...
local function phases()
  if chunk then return 15 end
  local found, bit = 0, 1
  for number = 1, 4 do
    if type(rawget(env, PHASES[number])) == 'function' then found = found + bit end
    bit = bit + bit
  end
  return found
end

-- Run f; return which phases there are, and then nothing; or true and what f returned; or the number of the limit,
-- the line and the name of the file; or false and a message, which may begin with the line.
local function run(f, ...)
  running, stopped = true, false
  local ok, value = pcall(f, ...)
  running = false
  if stopped then return phases(), stopped, stopped_at, stopped_in end
  if ok and value == nil then return phases() end
  if ok then return phases(), true, value end
  if type(value) == 'userdata' then error(value, 0) end
  return phases(), false, message_of(value)
end

local function phase(number)
  if chunk then
    rawset(env, 'sim_call_type', number - 1)
    return run(chunk)
  end
  return run(rawget(env, PHASES[number]))
end

local function called_back(name, message)
  local f = callbacks[name]
  if f == nil then f = rawget(env, name) end
  if type(f) ~= 'function' then return phases(), MISSING, 0 end
  return run(f, message)
end

local function compile(text, name)
  if byte(text) == 27 then return nil, 'precompiled code' end
  if newer then return load(text, name, 't', env) end
  local f, message = loadstring(text, name)
  if f then setfenv(f, env) end
  return f, message
end

-- Compile the script; run it, unless it is to run in every phase.
local function open(text, per_phase)
  return run(function()
    local f, message = compile(text, source)
    if not f then error(message, 0) end
    if per_phase then chunk = f else f() end
  end)
end
"""

_GLOBALS = r"""
---- the script's globals

for _, name in pairs{'_VERSION', 'assert', 'collectgarbage', 'error', 'getmetatable', 'ipairs', 'math', 'next', 'pairs',
    'rawequal', 'rawget', 'rawlen', 'rawset', 'select', 'string', 'table', 'tonumber', 'tostring', 'type', 'utf8',
    'coroutine', 'bit32'} do
  env[name] = _G[name]
end
env._G = env
env.os = {time = os.time, clock = os.clock, date = os.date, difftime = os.difftime}
for _, name in pairs{'math', 'string', 'table', 'coroutine', 'os', 'utf8'} do modules[name] = env[name] end
string.dump = nil

function env.print(...)
  local words = {}
  for i = 1, select('#', ...) do words[i] = tostring((select(i, ...))) end
  local line = sub(concat(words, '\t'), 1, bridge.longest_line)
  log(line)
end

env.pcall = protected

function env.xpcall(f, handler, ...)
  local results = pack(protected(f, ...))
  if results[1] then return unpack(results, 1, results.n) end
  return false, handler(results[2])
end

function coroutine.create(f)
  local thread = create(f)
  sethook(thread, hook, '', INSTRUCTIONS)
  return thread
end

function coroutine.resume(thread, ...)
  return caught(resume(thread, ...))
end

if close then
  function coroutine.close(thread) return caught(close(thread)) end
end

local function unwrapped(ok, ...)
  if ok then return ... end
  error((...), 0)
end

local new_thread = coroutine.create
function coroutine.wrap(f)
  local thread = new_thread(f)
  return function(...) return unwrapped(resume(thread, ...)) end
end

function env.setmetatable(t, meta)
  if type(meta) == 'table' and rawget(meta, '__gc') ~= nil then
    error('a child script has no finalizers (__gc)', 2)
  end
  return setmetatable(t, meta)
end

local function read_all(reader)
  if type(reader) == 'string' then return reader end
  local pieces = {}
  for piece in reader do
    if piece == '' then break end
    pieces[#pieces + 1] = piece
  end
  return concat(pieces)
end

function env.load(text, name, mode, ...)
  text = read_all(text)
  if byte(text) == 27 or mode == 'b' then return nil, 'only text can be loaded' end
  if newer then
    local its = env
    if select('#', ...) > 0 then its = ... end
    return load(text, name or '=(load)', 't', its)
  end
  local f, message = loadstring(text, name or '=(load)')
  if f then setfenv(f, env) end
  return f, message
end
env.loadstring = env.load

env.require = require

---- what Lua 5.1 and newer call differently

if not newer then -- whose matcher takes a piece of the C stack for each item of a pattern
  for _, name in pairs{'find', 'match', 'gmatch', 'gsub'} do
    local f = string[name]
    string[name] = function(text, pattern, third, plain, ...)
      if type(pattern) == 'string' and #pattern > 10000 and not (name == 'find' and plain) then
        error('pattern too long: more than 10000 bytes', 2)
      end
      return f(text, pattern, third, plain, ...)
    end
  end
end
for _, name in pairs{'insert', 'remove', 'concat'} do
  local f = table[name]
  table[name] = function(t, ...)
    local meta = type(t) == 'table' and getmeta(t)
    if meta and rawget(meta, '__len') ~= nil then error('table.' .. name .. ': not with a table that has __len', 2) end
    return f(t, ...)
  end
end
local rep = string.rep
function string.rep(text, count, separator)
  if text == '' and (separator or '') == '' then return '' end -- which would be joined one by one
  return rep(text, count, separator)
end
if bridge.direct then -- see lua_source.py
  for _, name in pairs{'find', 'match', 'gmatch', 'gfind', 'gsub'} do string[name] = nil end
  table.sort, table.move = nil, nil
  env.os.date, env.load, env.loadstring, env.collectgarbage, env.utf8, modules.utf8 = nil, nil, nil, nil, nil, nil
end
env.unpack, table.unpack = unpack, unpack
math.mod = math.mod or math.fmod
math.fmod = math.fmod or math.mod
math.pow = math.pow or function(x, y) return x ^ y end
table.getn = table.getn or function(t) return #t end
string.gfind = string.gmatch and (string.gfind or string.gmatch)
math.randomseed(1) -- the same flight every time

return {
  phase = phase, called_back = called_back, open = open, remember = remember, recall = recall, define = define,
  list = list, modules = modules, globals = env, has = has, functions = functions,
}
"""

PRELUDE = _LIMITS + MATRICES + CROSSING + _PHASES + FUNCTIONS + SNAPSHOTS + _GLOBALS
