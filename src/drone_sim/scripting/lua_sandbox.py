"""The Lua side of a Lua child script: what it finds, what it may not reach, and how it is stopped.

The chunk runs once in a fresh Lua state (5.1 or newer), before the script is read. Nothing of Python
is left in the script's reach: API functions are Lua closures over Python functions, and an error that
is a Python object passes through every pcall. Finalizers run with hooks switched off, and so do the
handlers of Lua's own xpcall: neither is to be had, for an endless loop in one could not be stopped.
"""

PRELUDE = r"""
local exceeded, log, source = ...

local pcall, error, type, tostring, select, next = pcall, error, type, tostring, select, next
local rawget, rawset, setmetatable = rawget, rawset, setmetatable
local unpack = table.unpack or unpack
local concat, byte = table.concat, string.byte
local load, loadstring = load, loadstring
local getinfo, sethook = debug.getinfo, debug.sethook
local getupvalue, setupvalue = debug.getupvalue, debug.setupvalue
local create, resume, close = coroutine.create, coroutine.resume, coroutine.close
local global = _G
local newer = _VERSION ~= 'Lua 5.1'
local name_of_script = source:sub(2) -- source is '=name'

local function pack(...)
  return {n = select('#', ...), ...}
end

---- errors, and the time limit

local INSTRUCTIONS = 10000 -- between two looks at the clock: some 0.1 ms
local stopped, stopped_at = false, 0

local function line_in_script()
  for level = 3, 250 do
    local info = getinfo(level, 'Sl')
    if not info then return 0 end
    if info.source == source and info.currentline > 0 then return info.currentline end
  end
  return 0
end

local function hook()
  if stopped then error('stopped', 0) end
  if exceeded() then
    stopped, stopped_at = true, line_in_script()
    error('stopped', 0)
  end
end
sethook(hook, '', INSTRUCTIONS)

-- Neither the end of the time limit nor a Python exception can be caught.
local function caught(ok, ...)
  if not ok and (stopped or type((...)) == 'userdata') then error((...), 0) end
  return ok, ...
end

local function protected(f, ...)
  return caught(pcall(f, ...))
end

local function message_of(value)
  if type(value) == 'string' or type(value) == 'number' then return tostring(value) end
  return 'an error that is a ' .. type(value)
end

-- Run f; return true, or false with line and message (no line: the message may begin with it).
local function run(f, ...)
  stopped = false
  local ok, value = pcall(f, ...)
  if ok then return true end
  if type(value) == 'userdata' then error(value, 0) end
  if stopped then return false, stopped_at end
  return false, nil, message_of(value)
end

---- what the script calls

local function define(place, name, f)
  rawset(place, name, function(...)
    local results = pack(f(...))
    if not results[1] then
      error(name_of_script .. ':' .. line_in_script() .. ': ' .. results[2], 0)
    end
    return unpack(results, 2, results.n)
  end)
end

local function list(...)
  return {...}
end

local function items(t)
  return unpack(t)
end

local callbacks = {}

-- Return what to call back, by name or, for functions themselves, by number.
local function callback_number(f)
  callbacks[#callbacks + 1] = f
  return #callbacks
end

---- snapshots

-- Return a function that gives every variable that the script can reach the value that it has now:
-- contents of tables, and locals that functions share. Coroutines are left as they are.
local function remember()
  local tables, locals, seen = {}, {}, {}
  local visit

  local function visit_table(t)
    local copy = {}
    for key, value in next, t do copy[key] = value end
    tables[t] = copy
    for key, value in next, copy do
      visit(key)
      visit(value)
    end
  end

  local function visit_function(f)
    if getinfo(f, 'S').what == 'C' then return end
    for index = 1, 255 do
      local name, value = getupvalue(f, index)
      if name == nil then return end
      locals[#locals + 1] = {f, index, value}
      visit(value)
    end
  end

  function visit(value)
    local kind = type(value)
    if seen[value] or (kind ~= 'table' and kind ~= 'function') then return end
    seen[value] = true
    if kind == 'table' then visit_table(value) else visit_function(value) end
  end

  for _, f in next, callbacks do visit(f) end
  visit(global)
  return function()
    for t, copy in next, tables do
      for key in next, t do
        if copy[key] == nil then rawset(t, key, nil) end
      end
      for key, value in next, copy do rawset(t, key, value) end
    end
    for _, kept in next, locals do setupvalue(kept[1], kept[2], kept[3]) end
  end
end

local function find(name)
  local f = callbacks[name]
  if f == nil then f = rawget(global, name) end
  if type(f) == 'function' then return f end
end

local function compile(text, name)
  if newer then return load(text, name, 't') end
  if byte(text) == 27 then return nil, 'precompiled code' end
  return loadstring(text, name)
end

---- the script's globals

local modules = {math = math, string = string, table = table, coroutine = coroutine, os = {
  time = os.time, clock = os.clock, date = os.date, difftime = os.difftime,
}}
if utf8 then modules.utf8 = utf8 end

for _, name in pairs{'io', 'debug', 'package', 'python', 'dofile', 'loadfile', 'module', 'newproxy', 'getfenv',
    'setfenv', 'warn', 'gcinfo'} do
  global[name] = nil
end
os = modules.os
string.dump = nil

function print(...)
  local words = {}
  for i = 1, select('#', ...) do words[i] = tostring((select(i, ...))) end
  log(concat(words, '\t'))
end

_G.pcall = protected

function xpcall(f, handler, ...)
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

function coroutine.wrap(f)
  local thread = coroutine.create(f)
  return function(...) return unwrapped(resume(thread, ...)) end
end

_G.setmetatable = function(t, meta)
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

function _G.load(text, name, mode, ...)
  text = read_all(text)
  if byte(text) == 27 or mode == 'b' then return nil, 'only text can be loaded' end
  if not newer then return loadstring(text, name or '=(load)') end
  return load(text, name or '=(load)', 't', ...)
end
_G.loadstring = _G.load

function require(name)
  local module = modules[name]
  if module == nil then error("no module '" .. tostring(name) .. "'", 2) end
  return module
end

---- what Lua 5.1 and newer call differently

_G.unpack, table.unpack = unpack, unpack
math.mod = math.mod or math.fmod
math.fmod = math.fmod or math.mod
math.pow = math.pow or function(x, y) return x ^ y end
table.getn = table.getn or function(t) return #t end
string.gfind = string.gfind or string.gmatch
math.randomseed(1) -- the same flight every time

return {
  run = run, define = define, list = list, items = items, find = find, compile = compile,
  callback_number = callback_number, remember = remember, modules = modules, globals = global, type = type,
}
"""
