-- What passes between a script and Python, on Lua's side; values.py is the other one.
--
-- Values pass as plain numbers, strings, booleans and nil: no Lua table is touched from Python, since lupa does that
-- outside of any protected call. The commonest calls, with short lists of numbers, pass at once; everything else passes
-- as a stream of values and marks.
local bridge, sandbox = ...

local error, type, select, next, rawget, rawset = error, type, select, next, rawget, rawset
local tostring = tostring
local rawlen = rawlen or function(t) return #t end -- which knows no __len in 5.1
local unpack = table.unpack or unpack
local place_in_script, stop = sandbox.place_in_script, sandbox.stop
local shortcuts, wrappers = sandbox.shortcuts, sandbox.wrappers
local api, own, counted, waiting = sandbox.api, sandbox.own, sandbox.counted, sandbox.waiting
local fresh, put = bridge.fresh, bridge.put
local OPEN_LIST, OPEN_FIELDS, CLOSE = bridge.open_list, bridge.open_fields, bridge.close
local DEEPEST, MOST_VALUES, MOST_BYTES = bridge.deepest, bridge.most_values, bridge.most_bytes
local AT_ONCE = 200 -- values that one call hands over
local SHORT = 12 -- values of a list that has a form of its own
local LONG = 1000 -- bytes of a string that is counted

local callbacks, numbers_of = {}, {} -- functions that were handed over, and their numbers
sandbox.callbacks = callbacks

-- Return by what number to call a function back.
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

-- Return a function of the script's, by that number or the name of a global, which a function of the API asks for.
function sandbox.own_function(asks, number)
  local f = callbacks[number] or rawget(sandbox.globals, number)
  if type(f) ~= 'function' then fail(asks .. ": the script has no function '" .. tostring(number) .. "'") end
  return f
end

-- What Python gave: how to read it, and values.
local function results(how, ...)
  if how == 1 then return ... end
  if how == 2 then return {...} end
  if how == 3 then
    local a, b, c, d, e, f = ...
    return {a, b, c}, {d, e, f}
  end
  if how == 5 then stop(2) end -- for its memory
  fail((...))
end

-- Return a function that appends a value to a stream, and one that hands over what is left of it.
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
      for key, one in next, value do
        if type(key) == 'table' then fail(name .. ': a table cannot be a key') end
        write(key, depth + 1)
        write(one, depth + 1)
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

-- Hand values over, which nobody has to have asked for by a function of the API.
local function hand_back(name, ...)
  local write, flush = stream(name)
  fresh()
  for index = 1, select('#', ...) do write((select(index, ...)), 1) end
  flush()
  return true
end
sandbox.hand_back = hand_back

local function hand_over(f, name, ...)
  hand_back(name, ...)
  return results(f(5))
end

local SCALAR = {number = 1, boolean = 1, ['nil'] = 1, string = 2, table = 3}

-- Read an answer; where the lists are not of numbers alone, hand the values over once more, as a stream.
local function results_of_lists(f, name, a, b, c, how, ...)
  if how == 4 then return hand_over(f, name, a, b, c) end
  return results(how, ...)
end

local function is_short(list)
  local length = #list
  return 0 < length and length <= SHORT
end

-- Call a function with one to three values, one of which is a table; `place` counts from 0.
local function with_list(f, name, a, b, c, place, list, one, other)
  if not is_short(list) then return hand_over(f, name, a, b, c) end
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
  return hand_over(f, name, a, b, c)
end

local function as_it_is(f) return f end

-- Put a function of the API into a table; `name` is what messages call it.
function sandbox.define(place, key, name, f, waits)
  local shortcut = shortcuts[name]
  local wrapper = wrappers[name] or as_it_is
  api[name] = wrapper(function(a, b, c, ...)
    if shortcut and c == nil then
      local result = shortcut(a, b)
      if result then return result end
    end
    local kind_a, kind_b, kind_c = SCALAR[type(a)], 1, 1
    if b ~= nil or c ~= nil then kind_b, kind_c = SCALAR[type(b)], SCALAR[type(c)] end
    if not (kind_a and kind_b and kind_c) or select('#', ...) > 0 or (kind_a == 2 and #a > LONG)
        or (kind_b == 2 and #b > LONG) or (kind_c == 2 and #c > LONG) then
      return hand_over(f, name, a, b, c, ...)
    end
    if kind_a == 3 or kind_b == 3 or kind_c == 3 then
      return with_lists(f, name, kind_a, kind_b, kind_c, a, b, c)
    end
    local how = 0
    if kind_a == 2 or kind_b == 2 or kind_c == 2 then how = 1 end
    if c ~= nil then return results(f(how, a, b, c)) end
    if b ~= nil then return results(f(how, a, b)) end
    if a ~= nil then return results(f(how, a)) end
    return results(f(0))
  end)
  rawset(place, key, own[name] or (waits and waiting(name, api[name], results)) or counted(api[name]))
end
