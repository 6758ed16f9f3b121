-- The script's globals: Lua's functions that it may use, and errors for unknown names.
--
-- They are a separate table; Lua's own globals, which lupa uses, do not change. No Python object is accessible: API functions
-- are Lua closures over Python functions, and a Python exception passes through every pcall. Finalizers and the handlers of
-- Lua's own xpcall run without hooks, so scripts cannot use them.
local bridge, sandbox = ...

local error, type, tostring, select, pairs = error, type, tostring, select, pairs
local rawget, setmetatable = rawget, setmetatable
local unpack = table.unpack or unpack
local concat, byte, sub = table.concat, string.byte, string.sub
local find, format, gmatch = string.find, string.format, string.gmatch
local load, loadstring, setfenv = load, loadstring, setfenv
local create, resume, close = coroutine.create, sandbox.resume, coroutine.close
local getmeta = sandbox.debug.getmetatable
local log, caught, protected, limit = bridge.log, sandbox.caught, sandbox.protected, sandbox.limit
local check, checked, tonumber = sandbox.check, sandbox.checked, tonumber
local env, modules = sandbox.globals, sandbox.modules
local texts, place_in_script = sandbox.texts, sandbox.place_in_script
local newer = _VERSION ~= 'Lua 5.1'
-- Only for patterns that end, because a script may not have these functions.
sandbox.find, sandbox.match, sandbox.gsub = find, string.match, string.gsub

local function pack(...)
  return {n = select('#', ...), ...}
end

for _, name in pairs{'_VERSION', 'assert', 'collectgarbage', 'error', 'getmetatable', 'ipairs', 'math', 'next', 'pairs',
    'rawequal', 'rawget', 'rawlen', 'rawset', 'select', 'string', 'table', 'tonumber', 'tostring', 'type', 'utf8',
    'coroutine', 'bit32'} do
  env[name] = _G[name]
end
env._G = env
env.package = {path = '', cpath = '', loaded = {}} -- without effect: required files are in the script's folder
function env.package.seeall(module) setmetatable(module, {__index = env}) end
env.debug = {traceback = sandbox.debug.traceback}
env.os = {time = os.time, clock = os.clock, date = os.date, difftime = os.difftime}
for _, name in pairs{'math', 'string', 'table', 'coroutine', 'os', 'utf8'} do modules[name] = env[name] end
string.dump = nil

-- uint8[] fields of messages are strings here. In V-REP they are tables, where data[1] is the first byte; here it would be nil.
setmetatable(string, {__index = function(_, key)
  if type(key) == 'number' then
    error('a string has no [' .. key .. ']: a uint8[] field is a string here; read its i-th byte with string.byte(data, i)', 2)
  end
end})

function env.print(...)
  local words = {}
  for i = 1, select('#', ...) do words[i] = tostring((select(i, ...))) end
  local line = sub(concat(words, '\t'), 1, bridge.longest_line)
  log(line)
end

function env.printf(text, ...)
  local values = pack(...)
  for i = 1, values.n do
    local kind = type(values[i])
    if kind ~= 'number' and kind ~= 'string' then values[i] = tostring(values[i]) end
  end
  env.print(format(text, unpack(values, 1, values.n)))
end

env.pcall = protected

function env.xpcall(f, handler, ...)
  local results = pack(protected(f, ...))
  if results[1] then return unpack(results, 1, results.n) end
  return false, handler(results[2])
end

function coroutine.create(f)
  local thread = create(f)
  limit(thread)
  return thread
end

function coroutine.resume(thread, ...)
  return caught(resume(thread, ...))
end

if close then
  function coroutine.close(thread)
    check() -- a coroutine that the hook has ended closes its variables without hooks
    return caught(close(thread))
  end
end

local function unwrapped(ok, ...)
  if ok then return ... end
  error((...), 0)
end

local new_thread = coroutine.create
function coroutine.wrap(f)
  local thread = new_thread(f)
  return function(...) return unwrapped(resume(thread, ...)) end
end

function env.setmetatable(t, meta)
  if type(meta) == 'table' and rawget(meta, '__gc') ~= nil then
    error('a child script has no finalizers (__gc)', 2)
  end
  return setmetatable(t, meta)
end

local function read_all(reader)
  if type(reader) == 'string' then return reader end
  local pieces = {}
  for piece in reader do
    if piece == '' then break end
    pieces[#pieces + 1] = piece
  end
  return concat(pieces)
end

function env.load(text, name, mode, ...)
  text = read_all(text)
  if byte(text) == 27 or mode == 'b' then return nil, 'only text can be loaded' end
  if newer then
    local environment = env
    if select('#', ...) > 0 then environment = ... end
    return load(text, name or '=(load)', 't', environment)
  end
  local f, message = loadstring(text, name or '=(load)')
  if f then setfenv(f, env) end
  return f, message
end
env.loadstring = env.load

---- differences between Lua 5.1 and newer versions

if not newer then -- its matcher uses some C stack for each item of a pattern
  for _, name in pairs{'find', 'match', 'gmatch', 'gsub'} do
    local f = string[name]
    string[name] = function(text, pattern, third, plain, ...)
      if type(pattern) == 'string' and #pattern > 10000 and not (name == 'find' and plain) then
        error('pattern too long: more than 10000 bytes', 2)
      end
      return f(text, pattern, third, plain, ...)
    end
  end
end
for _, name in pairs{'insert', 'remove', 'concat'} do
  local f = table[name]
  table[name] = function(t, ...)
    local meta = type(t) == 'table' and getmeta(t)
    if meta and rawget(meta, '__len') ~= nil then error('table.' .. name .. ': not with a table that has __len', 2) end
    return f(t, ...)
  end
end
local rep = string.rep
string.rep = checked(function(text, count, separator)
  if text == '' and (separator or '') == '' then return '' end -- Lua would join them one by one
  return rep(text, count, separator)
end, function(text, count)
  return (type(text) == 'string' and #text or 0) * (tonumber(count) or 0)
end)
for _, name in pairs{'upper', 'lower', 'reverse'} do
  string[name] = checked(string[name], function(text) return type(text) == 'string' and #text or 0 end)
end
if bridge.direct then -- see source.py
  for _, name in pairs{'find', 'match', 'gmatch', 'gfind', 'gsub'} do string[name] = nil end
  table.sort, table.move = nil, nil
  env.os.date, env.load, env.loadstring, env.collectgarbage, env.utf8, modules.utf8 = nil, nil, nil, nil, nil, nil
end
env.unpack, table.unpack = unpack, unpack
math.mod = math.mod or math.fmod
math.fmod = math.fmod or math.mod
math.pow = math.pow or function(x, y) return x ^ y end
math.atan2 = math.atan2 or math.atan
math.log10 = math.log10 or function(x) return math.log(x, 10) end
math.ldexp = math.ldexp or function(x, exponent) return x * 2.0 ^ exponent end
math.sinh = math.sinh or function(x) return (math.exp(x) - math.exp(-x)) / 2 end
math.cosh = math.cosh or function(x) return (math.exp(x) + math.exp(-x)) / 2 end
math.tanh = math.tanh or function(x) return 1 - 2 / (math.exp(2 * x) + 1) end
table.getn = table.getn or function(t) return #t end
string.gfind = string.gmatch and (string.gfind or string.gmatch)
local seed = math.randomseed
function math.randomseed(number) -- newer versions accept only integers, and use a random seed without one
  if number == nil then number = 1 end
  if type(number) == 'number' then number = math.floor(number % 1 == 0 and number or number % 2 ^ 53) end
  return seed(number)
end
math.randomseed(1) -- constant seed, so that every flight is the same

---- unknown names of the API: reading one is an error that lists similar names, as in Python

-- In CoppeliaSim, such a name is nil, and the script fails much later, or does something wrong silently. Two cases stay nil: a
-- plugin that does not exist (`if simROS2 then`), and a global that the script itself sets later.
local own, read = {}, 0 -- names that the script assigns; number of its texts that were searched for them

-- Return whether the script or a helper assigns a global with this name.
local function is_own(name)
  while read < #texts do
    read = read + 1
    -- Each part of the text is matched once, whatever it contains, because no hook can stop a search.
    for names, equals in gmatch(texts[read], '([%w_][%w_%.,%s]*)(=?=?)') do
      if equals == '=' then
        for assigned in gmatch(names .. ',', '%f[%w_](sim[A-Z_][%w_]*)%s*,') do own[assigned] = true end
      end
    end
    for defined in gmatch(texts[read], '%f[%w_]function%s+(sim[A-Z_][%w_]*)') do own[defined] = true end
  end
  return own[name]
end

-- Make unknown names in a table errors; `message` returns the text, or nil for a name that may be nil.
function sandbox.guard(guarded, message)
  setmetatable(guarded, {__index = function(_, name)
    if type(name) ~= 'string' or (guarded == env and (not find(name, '^sim[A-Z_][%w_]*$') or is_own(name))) then return end
    local why = message(name)
    if why == nil then return end
    local line, file = place_in_script()
    error(file .. ':' .. line .. ': ' .. why, 0)
  end})
end
