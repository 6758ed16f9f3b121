-- `io` and `os`: a Lua script may read files in its folder, but write no files and start no programs.
--
-- Writing is ignored, with one log line, so that a script that records its flight can fly. Other functions of io and os raise
-- an error that says what to use instead.
local bridge, sandbox = ...

local error, type, tostring, select, pairs = error, type, tostring, select, pairs
local concat, sub, setmetatable = table.concat, string.sub, setmetatable
local find, match = sandbox.find, sandbox.match
local tonumber, floor, unpack = tonumber, math.floor, table.unpack or unpack
local env, modules, sources = sandbox.globals, sandbox.modules, sandbox.sources
local log, compile, protected = bridge.log, sandbox.compile, sandbox.protected

local READING = 'a Lua script can only read files in its own folder, by io.open or io.lines with a name'
local WRITING = 'a Lua script cannot write files: use print or simROS.publish'
local STARTING = 'a child script cannot start programs: use a launch file'
local ENVIRONMENT = 'a Lua script sees no environment: use script_parameters'
local LONGEST = 80 -- characters of a name in a message

local function refuse(where, names, why)
  for _, name in pairs(names) do
    local message = where .. '.' .. name .. ': ' .. why
    env[where][name] = function() error(message, 2) end
  end
end

local function log_line(...)
  local words = {}
  for i = 1, select('#', ...) do words[i] = tostring((select(i, ...))) end
  local line = sub(concat(words), 1, bridge.longest_line)
  if sub(line, -1) == '\n' then line = sub(line, 1, -2) end
  log(line)
end

local function methods_of(write)
  local methods = {}
  methods.write = function(file, ...)
    write(...)
    return file
  end
  methods.close = function() return true end
  methods.flush = function(file) return file end
  methods.setvbuf, methods.seek = methods.close, function() return 0 end
  methods.read = function() error('read: this file is open for writing', 2) end
  methods.lines = methods.read
  return methods
end

local function new_file(methods)
  return setmetatable({}, {__index = methods, __name = 'FILE*'})
end

local nowhere, words = methods_of(function() end), methods_of(log_line)
local is_logged = false

env.io = {stdout = new_file(words), stderr = new_file(words), write = log_line}
refuse('io', {'input', 'read'}, READING)
refuse('io', {'output', 'tmpfile'}, WRITING)
refuse('io', {'popen'}, STARTING)
refuse('os', {'execute'}, STARTING)
refuse('os', {'exit'}, 'sim.stopSimulation() ends a flight')
refuse('os', {'getenv', 'setlocale'}, ENVIRONMENT)
refuse('os', {'remove', 'rename', 'tmpname'}, WRITING)

-- Return the methods of a file with this text, and a position for reading.
local function methods_of_text(text)
  local methods, here = {}, 1

  local function line(with_end)
    if here > #text then return nil end
    local last = find(text, '\n', here, true) or #text + 1
    local found = sub(text, here, with_end and last or last - 1)
    here = last + 1
    return found
  end

  local function read_item(format)
    if type(format) == 'number' then
      if here > #text and format > 0 then return nil end
      here = here + floor(format)
      return sub(text, here - floor(format), here - 1)
    end
    local letter = match(tostring(format), '^%*?([aAlLnN])')
    if letter == 'a' or letter == 'A' then
      local rest = sub(text, here)
      here = #text + 1
      return rest
    elseif letter == 'n' or letter == 'N' then
      local _, last, number = find(text, '^%s*([%w%.+-]+)', here)
      if tonumber(number) then here = last + 1 end
      return tonumber(number)
    elseif letter then
      return line(letter == 'L')
    end
    error("read: a number of bytes, 'a', 'l', 'L' or 'n' is expected", 3)
  end

  function methods.read(_, ...)
    local found, count = {}, select('#', ...)
    if count == 0 then return line() end
    for i = 1, count do
      found[i] = read_item((select(i, ...)))
      if found[i] == nil then return unpack(found, 1, i) end
    end
    return unpack(found, 1, count)
  end

  function methods.lines(_, format) return function() return read_item(format or 'l') end end

  function methods.seek(_, whence, offset)
    local from = {set = 0, ['end'] = #text, cur = here - 1}
    local place = (from[whence or 'cur'] or 0) + (offset or 0)
    if place < 0 then return nil, 'Invalid argument' end
    here = floor(place) + 1
    return here - 1
  end

  function methods.close() return true end
  function methods.write() error('write: ' .. WRITING, 2) end
  methods.flush, methods.setvbuf = methods.close, methods.close
  return methods
end

local function read_file(caller, name)
  local found, text, why = bridge.data(name)
  if found then return new_file(methods_of_text(text)) end
  if why == 'refused' then error(caller .. ': ' .. text, 3) end
  return nil, text
end

function env.io.open(name, mode)
  if type(name) ~= 'string' then error('io.open: the name of a file is expected', 2) end
  local first = type(mode) == 'string' and sub(mode, 1, 1)
  if first ~= 'w' and first ~= 'a' then
    local file, message = read_file('io.open', name) -- not a tail call, or the error would not have the script's line
    return file, message
  end
  if not is_logged then
    is_logged = true
    log("io.open: '" .. sub(name, 1, LONGEST) .. "' is not written: " .. WRITING .. ' (accepted and ignored)')
  end
  return new_file(nowhere)
end

function env.io.lines(name, format)
  if type(name) ~= 'string' then error('io.lines: ' .. READING, 2) end
  local file, message = read_file('io.lines', name)
  if not file then error('io.lines: ' .. message, 2) end
  return file:lines(format)
end

function env.io.close() return true end

function env.io.type(file)
  return type(file) == 'table' and (type(file.write) == 'function' and 'file') or nil
end

modules.io = env.io

---- .lua files in the script's folder

local function load_file(name)
  if type(name) ~= 'string' then return nil, 'the name of a .lua file beside the script is expected' end
  local found, text, chunk_name = bridge.file(name)
  if not found then return nil, text end
  local f, message = compile(text, '=' .. chunk_name)
  if f then sources['=' .. chunk_name] = chunk_name end
  return f, message
end

function env.loadfile(name)
  return load_file(name)
end

local function results(ok, ...)
  if not ok then error((...), 0) end
  return ...
end

function env.dofile(name)
  local f, message = load_file(name)
  if not f then error(message, 0) end
  return results(protected(f))
end
