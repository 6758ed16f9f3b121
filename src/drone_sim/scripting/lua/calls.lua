-- What Python calls: the script itself, its phases, callbacks and snapshots.
-- Each call returns which phases the script has now, and then what within_limits returns.
local bridge, sandbox = ...

local error, type, next, rawget, rawset = error, type, next, rawget, rawset
local match, concat = string.match, table.concat
local getinfo = sandbox.debug.getinfo
local within_limits, take_snapshot = sandbox.within_limits, sandbox.take_snapshot
local env, callbacks, sources = sandbox.globals, sandbox.callbacks, sandbox.sources

local PHASES = {bridge.phases()}
local CALL_TYPES = {bridge.call_types()} -- of sim_call_type, by phase
local MISSING = 3 -- beside the numbers of the limits
local chunk -- the script, where it runs once for each phase

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

local function after_phases(...)
  return phases(), ...
end

local function run(f, ...)
  return after_phases(within_limits(f, ...))
end

-- Compile the script; run it, unless it is to run in every phase.
function sandbox.open(text, per_phase)
  return run(function()
    local f, message = sandbox.compile(text, sandbox.source)
    if not f then error(message, 0) end
    if per_phase then chunk, sandbox.chunk = f, f else f() end
  end)
end

function sandbox.phase(number)
  if chunk then
    rawset(env, 'sim_call_type', CALL_TYPES[number])
    return run(chunk)
  end
  return run(rawget(env, PHASES[number]))
end

function sandbox.called_back(name, message)
  local f = callbacks[name]
  if f == nil then f = rawget(env, name) end
  if type(f) ~= 'function' then return phases(), MISSING, 0 end
  return run(f, message)
end

local function has_function(name)
  return callbacks[name] ~= nil or type(rawget(env, name)) == 'function'
end

function sandbox.has(name)
  return run(has_function, name)
end

-- Return name, line and file of the script's global functions, each on a line of its own.
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

function sandbox.remember()
  return run(take_snapshot)
end

function sandbox.recall(snapshot)
  return run(snapshot)
end
