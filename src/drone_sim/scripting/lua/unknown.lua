-- Names that the API does not have: reading one is an error that names near ones, as it is in Python.
--
-- In CoppeliaSim it is nil, and the script falls much later, or does the wrong thing without a word. Two ways of asking
-- stay: whether a plugin is there (`if simROS2 then`), and whether a global that the script itself sets has been set.
local _, sandbox = ...

local error, type, setmetatable = error, type, setmetatable
local find, gmatch = string.find, string.gmatch
local env, texts, place_in_script = sandbox.globals, sandbox.texts, sandbox.place_in_script
local own, read = {}, 0 -- names of globals that the script sets; how many of its texts have been read for them

-- Tell whether the script, or a file that it requires, gives a global of that name a value.
local function is_own(name)
  while read < #texts do
    read = read + 1
    -- Each piece of the text is read once, whatever stands there: no hook ends a search.
    for names, equals in gmatch(texts[read], '([%w_][%w_%.,%s]*)(=?=?)') do
      if equals == '=' then
        for one in gmatch(names .. ',', '%f[%w_](sim[A-Z_][%w_]*)%s*,') do own[one] = true end
      end
    end
    for one in gmatch(texts[read], '%f[%w_]function%s+(sim[A-Z_][%w_]*)') do own[one] = true end
  end
  return own[name]
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
