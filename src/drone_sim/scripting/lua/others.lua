-- Other scripts' functions, as if they were a table's.
local _, sandbox = ...

local setmetatable = setmetatable
local api, own = sandbox.api, sandbox.own

local function functions_of(script)
  api['sim.getScriptName'](script) -- or there is none
  return setmetatable({}, {__index = function(functions, name)
    return function(first, ...)
      if first == functions then return api['sim.callScriptFunction'](name, script, ...) end
      return api['sim.callScriptFunction'](name, script, first, ...)
    end
  end})
end

own['sim.getScriptFunctions'], own.simGetScriptFunctions = functions_of, functions_of
