-- Conversion of values between a script and Python, in Lua; values.py is the other side.
--
-- Values are passed as numbers, strings, booleans and nil. Python does not access Lua tables, because lupa would do this
-- outside of a protected call. The most frequent calls, with short lists of numbers, are passed directly; all others as a stream
-- of values and marks.
local bridge, sandbox = ...

local error, type, select, next, rawget, rawset = error, type, select, next, rawget, rawset
local tostring = tostring
local rawlen = rawlen or function(t) return #t end -- # ignores __len in 5.1
local unpack = table.unpack or unpack
local place_in_script, stop = sandbox.place_in_script, sandbox.stop
local api, own, counted, waiting = sandbox.api, sandbox.own, sandbox.counted, sandbox.waiting
local fresh, put = bridge.fresh, bridge.put
local OPEN_LIST, OPEN_FIELDS, CLOSE = bridge.open_list, bridge.open_fields, bridge.close
local DEEPEST, MOST_VALUES, MOST_BYTES = bridge.deepest, bridge.most_values, bridge.most_bytes
local AT_ONCE = 200 -- values passed in one call
local SHORT = 12 -- values of a list that is passed directly
local LONG = 1000 -- bytes of a string that is counted for the limit

local callbacks, numbers_of = {}, {} -- functions that were passed to Python, and their numbers
sandbox.callbacks = callbacks

-- Return the number of a function for callbacks.
local function callback_number(f)
  if not numbers_of[f] then
    callbacks[#callbacks + 1] = f
    numbers_of[f] = #callbacks
  end
  return numbers_of[f]
end

local function fail(message)
  local line, name = place_in_script()
  error(name .. ':' .. line .. ': ' .. message, 0)
end

-- Return a function of the script by its number or the name of a global; `caller` is the API function, for messages.
function sandbox.own_function(caller, number)
  local f = callbacks[number] or rawget(sandbox.globals, number)
  if type(f) ~= 'function' then fail(caller .. ": the script has no function '" .. tostring(number) .. "'") end
  return f
end

-- Return the results from Python; `form` is how the values are encoded.
local function results(form, ...)
  if form == 1 then return ... end
  if form == 2 then return {...} end
  if form == 3 then
    local a, b, c, d, e, f = ...
    return {a, b, c}, {d, e, f}
  end
  if form == 5 then stop(2) end -- too much memory
  fail((...))
end

-- Return a function that appends a value to a stream, and a function that passes the rest of the stream to Python.
local function stream(name)
  local values, count, total, bytes = {}, 0, 0, 0

  local function append(value)
    count, total = count + 1, total + 1
    if total > MOST_VALUES then fail(name .. ': more than ' .. MOST_VALUES .. ' values are too many') end
    values[count] = value
    if count == AT_ONCE then
      put(unpack(values, 1, count))
      count = 0
    end
  end

  local write

  local function write_table(value, depth)
    if depth > DEEPEST then fail(name .. ': a table is nested too deeply, at most ' .. DEEPEST .. ' levels') end
    local length = rawlen(value)
    append(length > 0 and OPEN_LIST or OPEN_FIELDS)
    for index = 1, length do write(rawget(value, index), depth + 1) end
    if length == 0 then
      for key, item in next, value do
        if type(key) == 'table' then fail(name .. ': a table cannot be a key') end
        write(key, depth + 1)
        write(item, depth + 1)
      end
    end
    append(CLOSE)
  end

  function write(value, depth)
    local kind = type(value)
    if kind == 'table' then return write_table(value, depth) end
    if kind == 'string' then
      bytes = bytes + #value
      if bytes > MOST_BYTES then fail(name .. ': more than ' .. MOST_BYTES .. ' bytes are too many') end
    elseif kind == 'function' then
      value = callback_number(value)
    elseif kind == 'userdata' or kind == 'thread' then
      fail(name .. ': a ' .. kind .. ' cannot be handed over')
    end
    append(value)
  end

  return write, function() put(unpack(values, 1, count)) end
end

-- Pass values to Python as a stream.
local function pass(name, ...)
  local write, flush = stream(name)
  fresh()
  for index = 1, select('#', ...) do write((select(index, ...)), 1) end
  flush()
  return true
end
sandbox.pass = pass

local function call_with_stream(f, name, ...)
  pass(name, ...)
  return results(f(5))
end

local SCALAR = {number = 1, boolean = 1, ['nil'] = 1, string = 2, table = 3}

-- Return the results; if the lists contain other values than numbers, repeat the call with a stream.
local function results_of_lists(f, name, a, b, c, form, ...)
  if form == 4 then return call_with_stream(f, name, a, b, c) end
  return results(form, ...)
end

local function is_short(list)
  local length = #list
  return 0 < length and length <= SHORT
end

-- Call a function with one to three values, one of which is a table; `place` counts from 0.
local function with_list(f, name, a, b, c, place, list, one, other)
  if not is_short(list) then return call_with_stream(f, name, a, b, c) end
  return results_of_lists(f, name, a, b, c, f(2, place, one, other, unpack(list, 1, #list)))
end

-- Call a function with one to three values, some of which are tables.
local function with_lists(f, name, kind_a, kind_b, kind_c, a, b, c)
  if kind_a == 1 and kind_b == 1 then return with_list(f, name, a, b, c, 2, c, a, b) end
  if kind_a == 1 and kind_c == 1 then return with_list(f, name, a, b, c, 1, b, a, c) end
  if kind_b == 1 and kind_c == 1 then return with_list(f, name, a, b, c, 0, a, b, c) end
  if kind_a == 3 and kind_b == 3 and c == nil and #b == 3 and is_short(a) then
    return results_of_lists(f, name, a, b, c, f(3, b[1], b[2], b[3], unpack(a, 1, #a)))
  end
  if kind_a == 1 and kind_b == 3 and kind_c == 3 and #b == 3 and is_short(c) then
    return results_of_lists(f, name, a, b, c, f(4, a, b[1], b[2], b[3], unpack(c, 1, #c)))
  end
  return call_with_stream(f, name, a, b, c)
end

---- products that controllers compute in every step, in Lua, because a call into Python takes five times as long
-- They have the same order of operations as frames.py, so that flights are identical to the last bit.

local kind_of, FLOAT = math.type or type, math.type and 'float' or 'number'

local function are_numbers(t, count)
  if type(t) ~= 'table' or #t ~= count then return false end
  local sum = 0
  for index = 1, count do
    local value = t[index]
    if kind_of(value) ~= FLOAT then return false end
    sum = sum + value
  end
  return sum - sum == 0 -- all finite
end

local function transformed(m, v)
  if not (are_numbers(m, 12) and are_numbers(v, 3)) then return nil end
  local x, y, z = v[1], v[2], v[3]
  return {
    m[1] * x + m[2] * y + m[3] * z + m[4],
    m[5] * x + m[6] * y + m[7] * z + m[8],
    m[9] * x + m[10] * y + m[11] * z + m[12],
  }
end

local function inverted(m, more)
  if more ~= nil or not are_numbers(m, 12) then return nil end
  local x, y, z = m[4], m[8], m[12]
  return {
    m[1], m[5], m[9], -(m[1] * x + m[5] * y + m[9] * z),
    m[2], m[6], m[10], -(m[2] * x + m[6] * y + m[10] * z),
    m[3], m[7], m[11], -(m[3] * x + m[7] * y + m[11] * z),
  }
end

-- In 3.x, a matrix is inverted in place, in the script's table, which Python does not have.
local function in_place(invert)
  return function(m, ...)
    local inverse = invert(m, ...)
    for index = 1, 12 do m[index] = inverse[index] end
    return m
  end
end
local wrappers = {['sim.invertMatrix'] = in_place, simInvertMatrix = in_place}

-- Functions that return a result, or nil if Python has to check the values.
local shortcuts = {
  ['sim.multiplyVector'] = transformed, simMultiplyVector = transformed,
  ['sim.getMatrixInverse'] = inverted, simGetMatrixInverse = inverted,
  ['sim.getInvertedMatrix'] = inverted, simGetInvertedMatrix = inverted,
}

---- definition of the API

local function unchanged(f) return f end

-- Define an API function in a table; `name` is its name for messages.
function sandbox.define(place, key, name, f, waits)
  local shortcut = shortcuts[name]
  local wrapper = wrappers[name] or unchanged
  api[name] = wrapper(function(a, b, c, ...)
    if shortcut and c == nil then
      local result = shortcut(a, b)
      if result then return result end
    end
    local kind_a, kind_b, kind_c = SCALAR[type(a)], 1, 1
    if b ~= nil or c ~= nil then kind_b, kind_c = SCALAR[type(b)], SCALAR[type(c)] end
    if not (kind_a and kind_b and kind_c) or select('#', ...) > 0 or (kind_a == 2 and #a > LONG)
        or (kind_b == 2 and #b > LONG) or (kind_c == 2 and #c > LONG) then
      return call_with_stream(f, name, a, b, c, ...)
    end
    if kind_a == 3 or kind_b == 3 or kind_c == 3 then
      return with_lists(f, name, kind_a, kind_b, kind_c, a, b, c)
    end
    local form = 0
    if kind_a == 2 or kind_b == 2 or kind_c == 2 then form = 1 end
    if c ~= nil then return results(f(form, a, b, c)) end
    if b ~= nil then return results(f(form, a, b)) end
    if a ~= nil then return results(f(form, a)) end
    return results(f(0))
  end)
  rawset(place, key, own[name] or (waits and waiting(name, api[name], results)) or counted(api[name]))
end
