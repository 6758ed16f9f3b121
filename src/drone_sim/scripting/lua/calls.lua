-- Functions for Python: the script, its phases, callbacks and snapshots.
-- Each returns the bits of the script's present phases, and then the results of within_limits.
local bridge, sandbox = ...

local error, type, next, rawget, rawset = error, type, next, rawget, rawset
local match, concat = string.match, table.concat
local getinfo, getupvalue, setupvalue = sandbox.debug.getinfo, sandbox.debug.getupvalue, sandbox.debug.setupvalue
local getmeta, setmeta = sandbox.debug.getmetatable, sandbox.debug.setmetatable
local within_limits, protected = sandbox.within_limits, sandbox.protected
local take_turn, thread_has_ended, pass = sandbox.take_turn, sandbox.thread_has_ended, sandbox.pass
local env, loaded = sandbox.globals, sandbox.loaded
local callbacks, sources = sandbox.callbacks, sandbox.sources

local PHASES, CALL_TYPES = {bridge.phases()}, {bridge.call_types()}
local may_have_thread = bridge.threads
local THREADS = {'sysCall_thread', 'sysCall_threadmain'}
local INIT, ACTUATION, SENSING, CLEANUP, THREAD = 1, 2, 4, 8, 16 -- bits of a script's phases
local MISSING = 3 -- in addition to the numbers of the limits
local chunk, chunk_has -- the script, if it is run as a whole; bits of the phases in which it is

local function thread_function()
  for _, name in next, THREADS do
    local f = rawget(env, name)
    if type(f) == 'function' then return f end
  end
end

-- Return the sum of the bits of the script's phases, with THREAD for an unfinished thread.
local function phases()
  local found, bit = chunk_has, INIT
  if not found then
    found = 0
    for number = 1, 4 do
      if type(rawget(env, PHASES[number])) == 'function' then found = found + bit end
      bit = bit + bit
    end
    if may_have_thread and thread_function() then found = found + THREAD end
  end
  if found >= THREAD and thread_has_ended() then found = found - THREAD end
  return found
end

local function after_phases(...)
  return phases(), ...
end

local function run(f, ...)
  return after_phases(within_limits(f, ...))
end

local WHOLE = { -- the forms of a script that is run as a whole
  phases = INIT + ACTUATION + SENSING + CLEANUP,
  phases_and_thread = INIT + ACTUATION + SENSING + CLEANUP + THREAD,
  steps = ACTUATION + CLEANUP,
  thread = THREAD,
}

sandbox.run = run

-- Compile the script; run it, unless it has a form that each phase runs as a whole.
function sandbox.open(text, form)
  return run(function()
    local f, message = sandbox.compile(text, sandbox.source)
    if not f then error(message, 0) end
    chunk_has = WHOLE[form]
    if chunk_has then chunk = f else f() end
  end)
end

function sandbox.phase(number)
  if chunk then rawset(env, 'sim_call_type', CALL_TYPES[number]) end
  if number == 5 then return run(take_turn, chunk or thread_function()) end
  local f = chunk or rawget(env, PHASES[number])
  if not f then return phases() end
  return run(f)
end

-- Call a function and pass its results to Python.
function sandbox.called(name, ...)
  local f = rawget(env, name)
  if type(f) ~= 'function' then return phases(), MISSING, 0 end
  return run(function(...) return pass(name, f(...)) end, ...)
end

-- Like `called`, for a call by the script itself, which is running: within its limits.
function sandbox.called_own(name, ...)
  local f = callbacks[name] or rawget(env, name)
  if type(f) ~= 'function' then return MISSING end
  return protected(function(...) return pass(name, f(...)) end, ...)
end

-- Run a text in the script, and pass its results to Python.
local function execute(text)
  local f, message = sandbox.compile_once(text, '=(text)')
  if not f then error(message, 0) end
  return pass('executeScriptString', f())
end

function sandbox.executed(text)
  return run(execute, text)
end

-- Like `executed`, for a call by the script itself, which is running: within its limits.
function sandbox.executed_own(text)
  return protected(execute, text)
end

-- Call a callback with a message; if `returns`, its results are passed to Python.
function sandbox.called_back(name, message, returns)
  local f = callbacks[name] or rawget(env, name)
  if type(f) ~= 'function' then return phases(), MISSING, 0 end
  if returns then return run(function() return pass(name, f(message)) end) end
  return run(f, message)
end

local function has_function(name)
  return callbacks[name] ~= nil or type(rawget(env, name)) == 'function'
end

function sandbox.has(name)
  return run(has_function, name)
end

-- Return name, line and file of each of the script's global functions, on separate lines.
local function list_functions()
  local found, count = {}, 0
  for name, value in next, env do
    if type(name) == 'string' and #name <= 60 and match(name, '^[%w_]+$') and type(value) == 'function' then
      local info = getinfo(value, 'S')
      if sources[info.source] and count < 3000 then
        found[count + 1], found[count + 2], found[count + 3] = name, info.linedefined, sources[info.source]
        count = count + 3
      end
    end
  end
  return concat(found, '\n')
end

function sandbox.functions()
  return run(list_functions)
end

---- snapshots of the script's variables

-- Return a function that restores the present values of all variables that the script can access: contents of tables,
-- metatables, and upvalues of functions. Coroutines are not restored.
local function take_snapshot()
  local tables, metatables, locals = {}, {}, {}
  local seen, waiting, count = {}, {}, 0

  local function visit(value)
    local kind = type(value)
    if (kind ~= 'table' and kind ~= 'function') or seen[value] then return end
    seen[value] = true
    count = count + 1
    waiting[count] = value
  end

  local function keep_table(t)
    local copy, meta = {}, getmeta(t)
    for key, value in next, t do
      copy[key] = value
      visit(key)
      visit(value)
    end
    visit(meta)
    tables[t], metatables[t] = copy, meta or false
  end

  local function keep_locals(f)
    if getinfo(f, 'S').what == 'C' then return end
    for index = 1, 255 do
      local name, value = getupvalue(f, index)
      if name == nil then return end
      locals[#locals + 1] = {f, index, value}
      visit(value)
    end
  end

  visit(env)
  visit(loaded)
  visit(getmeta(''))
  for _, f in next, callbacks do visit(f) end
  visit(chunk)
  while count > 0 do
    local value = waiting[count]
    waiting[count] = nil
    count = count - 1
    if type(value) == 'table' then keep_table(value) else keep_locals(value) end
  end
  return function()
    for t, copy in next, tables do
      for key in next, t do
        if copy[key] == nil then rawset(t, key, nil) end
      end
      for key, value in next, copy do rawset(t, key, value) end
      setmeta(t, metatables[t] or nil)
    end
    for _, kept in next, locals do setupvalue(kept[1], kept[2], kept[3]) end
  end
end

function sandbox.save_state()
  return run(take_snapshot)
end

function sandbox.restore(snapshot)
  return run(snapshot)
end
