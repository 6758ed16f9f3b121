"""The Lua side of what a Lua child script requires, and of what functions it has."""

FUNCTIONS = r"""
---- modules

local modules, loaded = {}, {} -- the API's and Lua's own; what the script required, by name
local LOADING = {}

local function load_module(name)
  if type(name) ~= 'string' then error("no module '" .. tostring(name) .. "'", 3) end
  local found, text, chunk_name = bridge.module(name)
  if not found then error(text, 3) end
  if byte(text) == 27 then error('precompiled code: ' .. chunk_name, 3) end
  local f, message = compile(text, '=' .. chunk_name)
  if not f then error(message, 0) end
  sources['=' .. chunk_name] = chunk_name
  loaded[name] = LOADING
  local ok, value = protected(f, name)
  loaded[name] = nil
  if not ok then error(value, 0) end
  if value == nil then value = true end
  loaded[name] = value
  return value
end

local function require(name)
  local module = modules[name]
  if module == nil then module = loaded[name] end
  if module == LOADING then error("module '" .. tostring(name) .. "' requires itself", 2) end
  if module == nil then module = load_module(name) end
  return module
end

---- functions of the script

local function function_called(name)
  return callbacks[name] ~= nil or type(rawget(env, name)) == 'function'
end

local function has(name)
  return run(function_called, name)
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

local function functions()
  return run(list_functions)
end
"""
