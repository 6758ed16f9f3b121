-- Variables of the script in readable form, and breakpoints. No function of the script is called: no metamethod, no
-- __tostring. The size is limited.
--
-- Rows are passed to Python as one string: depth, name, type and value of each, separated by characters that no value has.
local bridge, sandbox = ...

local type, next, select, rawget = type, next, select, rawget
local rawlen = rawlen or function(t) return #t end
local tostring = tostring
local format, sub, gsub, concat = string.format, string.sub, sandbox.gsub, table.concat
local getinfo, getlocal, getupvalue = sandbox.debug.getinfo, sandbox.debug.getlocal, sandbox.debug.getupvalue
local env, sources, modules = sandbox.globals, sandbox.sources, sandbox.modules
local MOST, MOST_INSIDE, LONGEST = bridge.most_rows, bridge.most_inside, bridge.longest_value
local FEW, SEEN = 13, 20000 -- values in a line; entries that are examined
local FIELD, ROW = '\31', '\30'

local own, known = {sim_call_type = true}, nil -- names of Lua; names of the API, when they are needed first
for name in next, env do own[name] = true end

local function clean(text, longest)
  return (gsub(sub(text, 1, longest), '%c', ' '))
end

local function number_text(value, digits)
  return value % 1 == 0 and format('%.0f', value) or format(digits, value)
end

-- Return the numbers of a short list as text; nil for other tables.
local function vector(t)
  local length = rawlen(t)
  if length == 0 or length > FEW then return end
  local words, count = {}, 0
  for key, value in next, t do
    count = count + 1
    if count > length or type(key) ~= 'number' or type(value) ~= 'number' then return end
  end
  for index = 1, length do
    local value = rawget(t, index)
    if value == nil then return end
    words[index] = format('%.3f', value)
  end
  return '{' .. concat(words, ', ') .. '}'
end

local function counted(t)
  local count = 0
  for _ in next, t do
    count = count + 1
    if count >= 1000 then return '1000 entries or more' end
  end
  return count == 1 and '1 entry' or count .. ' entries'
end

local function shown(value)
  local kind = type(value)
  if kind == 'number' then return number_text(value, '%.6g') end
  if kind == 'boolean' or kind == 'nil' then return tostring(value) end
  if kind == 'string' then return "'" .. clean(value, LONGEST) .. "'" end
  if kind == 'table' then return vector(value) or counted(value) end
  return ''
end

local function key_text(key)
  if type(key) == 'string' then return clean(key, 60) end
  if type(key) == 'number' then return '[' .. number_text(key, '%.14g') .. ']' end
  return '[' .. type(key) .. ']'
end

local rows, count, taken

local function row(depth, name, value)
  rows[#rows + 1] = concat({depth, name, type(value), shown(value)}, FIELD)
end

local function add(name, value)
  if type(value) == 'function' or taken[name] or count >= MOST then return end
  taken[name], count = true, count + 1
  row('1', name, value)
  if type(value) ~= 'table' or vector(value) then return end
  local inside = 0
  local length = rawlen(value)
  for index = 1, length do
    if inside >= MOST_INSIDE then return end
    inside = inside + 1
    row('2', key_text(index), rawget(value, index))
  end
  for key, item in next, value do
    if inside >= MOST_INSIDE then return end
    if not (type(key) == 'number' and key >= 1 and key <= length and key % 1 == 0) then
      inside = inside + 1
      row('2', key_text(key), item)
    end
  end
end

local function scope(name)
  count, taken = 0, {}
  rows[#rows + 1] = concat({'0', name, '', ''}, FIELD)
end

local function is_api(value)
  for _, module in next, modules do
    if module == value then return true end
  end
  return value == env
end

local function add_upvalues(f)
  for index = 1, 60 do
    local name, value = getupvalue(f, index)
    if name == nil then return end
    if name ~= '' and name ~= '_ENV' and not is_api(value) then add(name, value) end
  end
end

local function add_globals()
  scope('globals')
  if not known then known = bridge.known() end
  local seen, functions = 0, 0
  for name, value in next, env do
    seen = seen + 1
    if seen > SEEN then break end
    if type(name) == 'string' and not (own[name] or known[name] or is_api(value)) then
      if type(value) ~= 'function' then
        add(clean(name, 60), value)
      elseif functions < MOST and sources[getinfo(value, 'S').source] then -- the file's locals that it uses
        functions = functions + 1
        add_upvalues(value)
      end
    end
  end
end

local function all_variables()
  rows = {}
  add_globals()
  local text = concat(rows, ROW)
  rows, taken = nil, nil
  return text
end

-- Return the variables of the script.
function sandbox.variables()
  return sandbox.run(all_variables)
end

---- breakpoints

local lines = {} -- sets of file names by line

-- Check a line for the hook; stack level 3 is the function with the line.
function sandbox.at_line(line)
  local files = lines[line]
  if not files then return end
  local info = getinfo(3, 'Sf')
  local file = sources[info.source]
  if not (file and files[file]) or not bridge.is_first() then return end
  rows = {}
  scope('locals')
  for index = 1, MOST do
    local name, value = getlocal(3, index)
    if name == nil then break end
    if sub(name, 1, 1) ~= '(' then
      taken[name] = nil
      add(name, value)
    end
  end
  add_upvalues(info.func)
  add_globals()
  bridge.reached(file, line, concat(rows, ROW))
  rows, taken = nil, nil
end

local function break_at(...)
  lines = {}
  for index = 1, select('#', ...), 2 do
    local file, line = select(index, ...)
    lines[line] = lines[line] or {}
    lines[line][file] = true
  end
  sandbox.watch_lines(next(lines) ~= nil)
end

-- Set the breakpoints, given as file, line, file, line and so on. Without breakpoints, the hook is not called for lines.
function sandbox.break_at(...)
  return sandbox.run(break_at, ...)
end
