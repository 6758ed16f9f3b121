-- Files and programs: a Lua script reads what lies beside it, writes nothing, and starts nothing.
--
-- What it would write goes nowhere, which is said once: a script that keeps a record of its flight flies. Whatever else
-- it asks of io or os is refused in one line, with what to use instead.
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
    local said = where .. '.' .. name
    env[where][name] = function() error(said .. ': ' .. why, 2) end
  end
end

local function line_of(...)
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

local function a_file(methods)
  return setmetatable({}, {__index = methods, __name = 'FILE*'})
end

local nowhere, words = methods_of(function() end), methods_of(line_of)
local has_said = false

env.io = {stdout = a_file(words), stderr = a_file(words), write = line_of}
refuse('io', {'input', 'read'}, READING)
refuse('io', {'output', 'tmpfile'}, WRITING)
refuse('io', {'popen'}, STARTING)
refuse('os', {'execute'}, STARTING)
refuse('os', {'exit'}, 'sim.stopSimulation() ends a flight')
refuse('os', {'getenv', 'setlocale'}, ENVIRONMENT)
refuse('os', {'remove', 'rename', 'tmpname'}, WRITING)

-- Return the methods of a file with that text: one place in it, from which is read.
local function methods_of_text(text)
  local methods, here = {}, 1

  local function line(with_end)
    if here > #text then return nil end
    local last = find(text, '\n', here, true) or #text + 1
    local found = sub(text, here, with_end and last or last - 1)
    here = last + 1
    return found
  end

  local function one(format)
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
      found[i] = one((select(i, ...)))
      if found[i] == nil then return unpack(found, 1, i) end
    end
    return unpack(found, 1, count)
  end

  function methods.lines(_, format) return function() return one(format or 'l') end end

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

local function read_file(asked_by, name)
  local found, text, why = bridge.data(name)
  if found then return a_file(methods_of_text(text)) end
  if why == 'refused' then error(asked_by .. ': ' .. text, 3) end
  return nil, text
end

function env.io.open(name, mode)
  if type(name) ~= 'string' then error('io.open: the name of a file is expected', 2) end
  local first = type(mode) == 'string' and sub(mode, 1, 1)
  if first ~= 'w' and first ~= 'a' then
    local file, message = read_file('io.open', name) -- no tail call, or the error would not know the script's line
    return file, message
  end
  if not has_said then
    has_said = true
    log("io.open: '" .. sub(name, 1, LONGEST) .. "' is not written: " .. WRITING .. ' (accepted and ignored)')
  end
  return a_file(nowhere)
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

---- code beside the script

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
