-- Threads: coroutines that the simulation resumes once in each step. A thread is suspended when it waits or switches, or after a
-- number of API calls in its turn, so that flights do not depend on the speed of the computer.
local bridge, sandbox = ...

local error, type, next, select = error, type, next, select
local unpack = table.unpack or unpack
local create, resume, yield, status = coroutine.create, sandbox.resume, coroutine.yield, coroutine.status
local running, isyieldable = coroutine.running, coroutine.isyieldable
local upper = string.upper
local limit, caught = sandbox.limit, sandbox.caught

local api, own = {}, {} -- functions of the API; functions here that replace some of them
local called, forbidden, most = 0, 0, bridge.default_ms * bridge.calls_per_ms
sandbox.api, sandbox.own = api, own

-- Return whether a coroutine runs that can be suspended.
local function in_thread()
  local thread, is_main = running()
  return thread ~= nil and not is_main and (isyieldable == nil or isyieldable())
end

-- Return a version of an API function that counts its calls in threads.
function sandbox.counted(f)
  if not bridge.threads then return f end
  return function(...)
    called = called + 1
    if called > most and forbidden == 0 and in_thread() then
      yield()
      called = 1
    end
    return f(...)
  end
end

local function after_turn(before, ...)
  called = before
  return ...
end

-- Resume a coroutine for a new turn.
local function resumed(thread, ...)
  local before = called
  called = 0
  return after_turn(before, resume(thread, ...))
end
sandbox.resume = resumed

---- the script's own thread

local thread = nil

-- Computed and not stored, because the time limit may stop the script before anything is stored.
function sandbox.thread_has_ended() return thread ~= nil and status(thread) == 'dead' end

-- Start the thread with f, or resume it, for a turn.
function sandbox.take_turn(f)
  if thread == nil then
    thread = create(function() f() end)
    limit(thread)
  end
  local ok, message = resumed(thread)
  if not caught(ok, message) then error(message, 0) end
end

-- In Lua 5.1, a coroutine cannot be suspended inside a pcall, so pcall runs its function in another coroutine.
if bridge.threads and _VERSION == 'Lua 5.1' then
  local protected = sandbox.protected
  function sandbox.protected(f, ...)
    if not in_thread() then return protected(f, ...) end
    local inner = create(function(...) return f(...) end)
    limit(inner)
    local function go(ok, ...)
      if ok and status(inner) ~= 'dead' then return go(resume(inner, yield(...))) end
      return caught(ok, ...)
    end
    return go(resume(inner, ...))
  end
end

---- functions for threads

local function pack(...)
  return {n = select('#', ...), ...}
end

-- Return a waiting version of an API function. `start` returns a function that returns, in each step, whether to wait longer and
-- the results, or a function of the script to call first; `results` decodes that.
function sandbox.waiting(name, start, results)
  return function(...)
    local poll = start(...)
    local function with_calls(waits, f, ...)
      if not waits or f == nil then return waits, f, ... end
      return with_calls(results(poll(0, sandbox.own_function(name, f)(...) and true or false)))
    end
    local answer = pack(with_calls(results(poll(0))))
    while answer[1] do
      if not in_thread() then error(name .. ': ' .. bridge.no_thread, 2) end
      yield()
      answer = pack(with_calls(results(poll(0))))
    end
    return unpack(answer, 2, answer.n)
  end
end

local functions = {}

function functions.setThreadSwitchTiming(milliseconds)
  if type(milliseconds) ~= 'number' or milliseconds ~= milliseconds then
    error('sim.setThreadSwitchTiming: a number of milliseconds is expected', 2)
  end
  if milliseconds < bridge.shortest_ms then milliseconds = bridge.shortest_ms end
  if milliseconds > bridge.longest_ms then milliseconds = bridge.longest_ms end
  most = milliseconds * bridge.calls_per_ms
end

local function set_automatic(allowed)
  local before = forbidden
  if type(allowed) == 'number' and allowed >= 0 then
    forbidden = allowed
  elseif allowed == true then
    forbidden = before > 0 and before - 1 or 0
  elseif allowed == false then
    forbidden = before + 1
  else
    error('expected true, false, or a level of 0 or more', 3)
  end
  return before
end

local function is_automatic() return forbidden == 0 end

function functions.setThreadAutomaticSwitch(allowed) return set_automatic(allowed) end
function functions.setAutoYield(allowed) return set_automatic(allowed) end
function functions.setStepping(enabled) return set_automatic(not enabled) end
function functions.acquireLock() set_automatic(false) end
function functions.releaseLock() set_automatic(true) end
functions.getThreadAutomaticSwitch, functions.getAutoYield = is_automatic, is_automatic

for name, f in next, functions do
  own['sim.' .. name] = f
  own['sim' .. upper(name:sub(1, 1)) .. name:sub(2)] = f
end
