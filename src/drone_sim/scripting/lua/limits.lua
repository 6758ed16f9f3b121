-- Limits of time and memory, and errors that a script may not catch.
local bridge, sandbox, source = ...

local pcall, error, type, tostring, setmetatable = pcall, error, type, tostring, setmetatable
local current, resume, status = coroutine.running, coroutine.resume, coroutine.status
local next = next
local sub = string.sub
local getinfo, sethook = debug.getinfo, debug.sethook
local look = bridge.look

-- C code may take long between two checks of time and memory, for example to compare or join strings of 100 MB. In the
-- simulation's own thread, only a few such operations may happen between checks; 1000 instructions take about 10 us.
local INSTRUCTIONS = bridge.direct and 200 or 2000
local FEW = 20 -- instructions of a script that uses much memory, because each may take long
local LONG = 1000000 -- bytes of a string for which operations take long
local running, stopped, stopped_at, stopped_in = false, false, 0, ''

sandbox.debug = debug
debug = nil -- otherwise lupa looks up its traceback in every call
local sources = {[source] = sub(source, 2)} -- chunks of the script and its helpers: '=name' -> 'name'
sandbox.source, sandbox.sources = source, sources

-- Return the running line of the script or a helper, and the name of the file.
local function place_in_script()
  for level = 3, 250 do
    local info = getinfo(level, 'Sl')
    if not info then break end
    if sources[info.source] and info.currentline > 0 then return info.currentline, sources[info.source] end
  end
  return 0, sources[source]
end
sandbox.place_in_script = place_in_script

-- Stop the script; `why` is one of the numbers in state.py.
local function stop(why)
  stopped = why
  stopped_at, stopped_in = place_in_script()
  error('stopped', 0)
end
sandbox.stop = stop

-- Stop the script if a limit is exceeded; return whether to check again soon.
local function check()
  if not running then return end
  if stopped then error('stopped', 0) end
  local why = look()
  if why > 0 then stop(why) end
  return why < 0
end
sandbox.check = check

local counts = setmetatable({}, {__mode = 'k'}) -- instructions between hooks by coroutine, if not INSTRUCTIONS
local is_careful = false -- whether `counts` has entries
local limited = setmetatable({}, {__mode = 'k'}) -- coroutines with a hook of their own
local mask = '' -- 'l' while there are breakpoints, so that the hook is also called for every line
local hook

-- Set the number of instructions between hooks in the running coroutine, if it differs; sethook scans the whole stack.
local function come_after(count)
  local here = current() or hook -- 5.1 returns nil for the main coroutine
  if (counts[here] or INSTRUCTIONS) ~= count then
    is_careful, counts[here] = true, count
    sethook(hook, mask, count)
  end
end

function hook(event, line)
  if event == 'line' then
    if running and not stopped then sandbox.at_line(line) end
    return
  end
  if not running or (stopped and getinfo(2, 'f').func == sandbox.within_limits) then return end
  if stopped then come_after(1) end -- otherwise code that closes variables could run again and again
  local much = check()
  if much or is_careful then come_after(much and FEW or INSTRUCTIONS) end
end
sethook(hook, mask, INSTRUCTIONS)

-- Switch the hook for every line on or off.
function sandbox.watch_lines(on)
  mask = on and 'l' or ''
  counts = setmetatable({}, {__mode = 'k'})
  sethook(hook, mask, INSTRUCTIONS)
  for thread in next, limited do
    if status(thread) ~= 'dead' then sethook(thread, hook, mask, INSTRUCTIONS) end
  end
end

-- Set a coroutine's hook. Check the limits, because many short coroutines might never reach their hooks.
function sandbox.limit(thread)
  check()
  limited[thread] = true
  sethook(thread, hook, mask, INSTRUCTIONS)
end

-- Return a function that checks time and memory before and after calling f with a long string.
function sandbox.checked(f, length_of)
  return function(text, ...)
    if length_of(text, ...) < LONG then return f(text, ...) end
    check()
    local result = f(text, ...)
    if check() then come_after(FEW) end
    return result
  end
end

-- Return the results of a pcall or resume, unless the error is one that a script may not catch: that it was stopped, or a
-- Python exception. If the C stack is exhausted, the hook itself fails, and the script gets that error.
local function caught(ok, ...)
  if not ok then
    if stopped or type((...)) == 'userdata' then error((...), 0) end
    check()
  end
  return ok, ...
end
sandbox.caught = caught

-- Lua limits nested calls of pcall to about 200, except in the coroutines of newer versions, where each error takes longer the
-- more there are. This smaller limit leaves room for the hook.
local MOST_PCALLS = 150
local depth = 0
local TOO_DEEP = 'stack overflow: more than ' .. MOST_PCALLS .. ' pcall within each other'

local function left(before, ...)
  depth = before
  return ...
end

function sandbox.protected(f, ...)
  if depth >= MOST_PCALLS then error(TOO_DEEP, 0) end
  local before = depth
  depth = before + 1
  return caught(left(before, pcall(f, ...)))
end

-- Resume a coroutine, which may be suspended inside a pcall.
function sandbox.resume(...)
  return left(depth, resume(...))
end

local function message_of(value)
  if type(value) == 'number' then return tostring(value) end
  if type(value) == 'string' then return sub(value, 1, bridge.longest_message) end
  return 'an error that is a ' .. type(value)
end

-- Call f within the limits. Return nothing if it returned nothing; or true and its result; or the number of the exceeded limit,
-- the line and the name of the file; or false and a message, which may begin with file and line.
function sandbox.within_limits(f, ...)
  if stopped then come_after(INSTRUCTIONS) end
  running, stopped, depth = true, false, 0
  local ok, value = pcall(f, ...)
  running = false
  if stopped then return stopped, stopped_at, stopped_in end
  if ok and value == nil then return end
  if ok then return true, value end
  if type(value) == 'userdata' then error(value, 0) end
  return false, message_of(value)
end
