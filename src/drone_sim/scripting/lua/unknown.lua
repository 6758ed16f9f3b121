-- Names that the API does not have: reading one is an error that names near ones, as it is in Python.
--
-- In CoppeliaSim it is nil, and the script falls much later, or does the wrong thing without a word. Two ways of asking
-- stay: whether a plugin is there (`if simROS2 then`), and whether a global that the script itself sets has been set.
local _, sandbox = ...

local error, type, next, setmetatable, find = error, type, next, setmetatable, string.find
local env, texts, place_in_script = sandbox.globals, sandbox.texts, sandbox.place_in_script
local own = {} -- names of globals that the script sets

-- Tell whether the script, or a file that it requires, gives a global of that name a value.
local function is_own(name)
  if own[name] then return true end
  for _, text in next, texts do
    if find(text, '%f[%w_]' .. name .. '%s*=[^=]') or find(text, '%f[%w_]' .. name .. '%s*,[%w_%.,%s]*=[^=]')
        or find(text, '%f[%w_]function%s+' .. name .. '%f[^%w_]') then
      own[name] = true
      return true
    end
  end
  return false
end

-- Let a table refuse what it does not have; `message` returns why, or nil for a name that may be nil.
function sandbox.guard(guarded, message)
  setmetatable(guarded, {__index = function(_, name)
    if type(name) ~= 'string' or (guarded == env and (not find(name, '^sim[A-Z_][%w_]*$') or is_own(name))) then return end
    local why = message(name)
    if why == nil then return end
    local line, file = place_in_script()
    error(file .. ':' .. line .. ': ' .. why, 0)
  end})
end
