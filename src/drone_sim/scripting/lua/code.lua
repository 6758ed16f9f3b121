-- Compilation of the script and its helpers, `require`, copies of tables, and calls of other scripts.
local bridge, sandbox = ...

local error, type, tostring, select, setmetatable = error, type, tostring, select, setmetatable
local next, rawset, getmetatable = next, rawset, sandbox.debug.getmetatable
local byte = string.byte
local load, loadstring, setfenv = load, loadstring, setfenv
local newer = _VERSION ~= 'Lua 5.1'
local sources, protected = sandbox.sources, sandbox.protected

local env = {} -- the script's globals
local modules, loaded = {}, {} -- of the API and of Lua; required by the script; both by name
local own_modules = {} -- of CoppeliaSim
local texts = {} -- of the script and its helpers
local chunk -- the file that is being required
local seen, created, LOADING = {}, {}, {} -- compiled texts; modules created by `module`; a mark
sandbox.globals, sandbox.modules, sandbox.loaded, sandbox.texts = env, modules, loaded, texts
sandbox.own_modules = own_modules

local function compile(text, name)
  if byte(text) == 27 then return nil, 'precompiled code' end
  if not seen[text] then -- the same text may be compiled in every step
    seen[text] = true
    texts[#texts + 1] = text
  end
  if newer then return load(text, name, 't', env) end
  local f, message = loadstring(text, name)
  if f then setfenv(f, env) end
  return f, message
end
sandbox.compile = compile

-- Compile a text while the script runs; if it is an expression, the function returns its value.
function sandbox.compile_once(text, name)
  if byte(text) == 27 then return nil, 'precompiled code' end
  local read, message
  for _, tried in next, {'return ' .. text, text} do
    if newer then
      read, message = load(tried, name, 't', env)
    else
      read, message = loadstring(tried, name)
      if read then setfenv(read, env) end
    end
    if read then return read end
  end
  return nil, message
end

local function load_module(name)
  if type(name) ~= 'string' then error("no module '" .. tostring(name) .. "'", 3) end
  local found, text, chunk_name = bridge.module(name)
  if not found and own_modules[name] then return own_modules[name] end
  if not found then error(text, 3) end
  if byte(text) == 27 then error('precompiled code: ' .. chunk_name, 3) end
  local f, message = compile(text, '=' .. chunk_name)
  if not f then error(message, 0) end
  sources['=' .. chunk_name] = chunk_name
  local outer = chunk
  loaded[name], chunk = LOADING, f
  local ok, value = protected(f, name)
  loaded[name], chunk = nil, outer
  if not ok then error(value, 0) end
  if value == nil then value = created[name] or true end
  loaded[name] = value
  return value
end

-- Lua 5.1's form of a module: definitions after this call are stored in a table, which also becomes a global.
function env.module(name, ...)
  if newer then error('module is of Lua 5.1: let the file return a table instead', 2) end
  if type(name) ~= 'string' or not chunk then error('module: only works in a file that `require` loads by its name', 2) end
  local module = type(env[name]) == 'table' and env[name] or {}
  module._NAME, module._M, env[name], created[name] = name, module, module, module
  for i = 1, select('#', ...) do (select(i, ...))(module) end
  setfenv(chunk, module)
end

function env.require(name)
  local module = modules[name]
  if module == nil then module = loaded[name] end
  if module == LOADING then error("module '" .. tostring(name) .. "' requires itself", 2) end
  if module == nil then module = load_module(name) end
  return module
end

---- copies of tables, which are made in Lua to keep functions, and references to the same table

local function copied(value, copies)
  if type(value) ~= 'table' then return value end
  local copy = copies[value]
  if not copy then
    copy = {}
    copies[value] = copy
    for key, item in next, value do rawset(copy, copied(key, copies), copied(item, copies)) end
    setmetatable(copy, getmetatable(value))
  end
  return copy
end

local function copy_table(value) return copied(value, {}) end

sandbox.own['sim.copyTable'], sandbox.own.simCopyTable = copy_table, copy_table

---- functions of other scripts, as fields of a table

local api, own = sandbox.api, sandbox.own

local function functions_of(script)
  api['sim.getScriptName'](script) -- raises an error if it does not exist
  return setmetatable({}, {__index = function(functions, name)
    return function(first, ...)
      if first == functions then return api['sim.callScriptFunction'](name, script, ...) end
      return api['sim.callScriptFunction'](name, script, first, ...)
    end
  end})
end

own['sim.getScriptFunctions'], own.simGetScriptFunctions = functions_of, functions_of
