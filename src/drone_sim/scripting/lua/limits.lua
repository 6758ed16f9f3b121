-- The limits of time and memory, and the errors that nothing in a script may catch.
local bridge, sandbox, source = ...

local pcall, error, type, tostring = pcall, error, type, tostring
local sub = string.sub
local getinfo, sethook = debug.getinfo, debug.sethook
local look = bridge.look

-- A script's C code may take long between two looks at the clock and the memory: comparing or joining strings of
-- 100 MB, say. In the simulation's own thread it may do so only a few times; 1000 instructions are some 10 us.
local INSTRUCTIONS = bridge.direct and 200 or 2000
local running, stopped, stopped_at, stopped_in = false, false, 0, ''

sandbox.debug = debug
debug = nil -- or lupa looks up its traceback in every call
local sources = {[source] = sub(source, 2)} -- of the script and what it requires: '=name' -> 'name'
sandbox.source, sandbox.sources = source, sources

-- Return the line of the script, or of a file that it requires, that runs now, and the name of the file.
local function place_in_script()
  for level = 3, 250 do
    local info = getinfo(level, 'Sl')
    if not info then break end
    if sources[info.source] and info.currentline > 0 then return info.currentline, sources[info.source] end
  end
  return 0, sources[source]
end
sandbox.place_in_script = place_in_script

-- Stop the script; why is one of the numbers in state.py.
local function stop(why)
  stopped = why
  stopped_at, stopped_in = place_in_script()
  error('stopped', 0)
end
sandbox.stop = stop

local function hook()
  if not running then return end
  if stopped then error('stopped', 0) end
  local why = look()
  if why > 0 then stop(why) end
end
sethook(hook, '', INSTRUCTIONS)

-- Every coroutine has a hook of its own.
function sandbox.limit(thread)
  sethook(thread, hook, '', INSTRUCTIONS)
end

-- Hand on the results of a pcall or a resume, unless they are what a script may not catch: that it was stopped, or an
-- exception of Python's.
local function caught(ok, ...)
  if not ok and (stopped or type((...)) == 'userdata') then error((...), 0) end
  return ok, ...
end
sandbox.caught = caught

function sandbox.protected(f, ...)
  return caught(pcall(f, ...))
end

local function message_of(value)
  if type(value) == 'number' then return tostring(value) end
  if type(value) == 'string' then return sub(value, 1, bridge.longest_message) end
  return 'an error that is a ' .. type(value)
end

-- Call f within the limits. Return nothing where it returned nothing; or true and what it returned; or the number of
-- the limit, the line and the name of the file; or false and a message, which may begin with file and line.
function sandbox.within_limits(f, ...)
  running, stopped = true, false
  local ok, value = pcall(f, ...)
  running = false
  if stopped then return stopped, stopped_at, stopped_in end
  if ok and value == nil then return end
  if ok then return true, value end
  if type(value) == 'userdata' then error(value, 0) end
  return false, message_of(value)
end
