-- Snapshots of a script's variables.
local _, sandbox = ...

local type, next, rawset = type, next, rawset
local getinfo, getupvalue, setupvalue = sandbox.debug.getinfo, sandbox.debug.getupvalue, sandbox.debug.setupvalue
local getmeta, setmeta = sandbox.debug.getmetatable, sandbox.debug.setmetatable
local env, loaded, callbacks = sandbox.globals, sandbox.loaded, sandbox.callbacks

-- Return a function that restores the present values of all variables that the script can access: contents of tables,
-- metatables, and upvalues of functions. Coroutines are not restored.
function sandbox.take_snapshot()
  local tables, metatables, locals = {}, {}, {}
  local seen, waiting, count = {}, {}, 0

  local function visit(value)
    local kind = type(value)
    if (kind ~= 'table' and kind ~= 'function') or seen[value] then return end
    seen[value] = true
    count = count + 1
    waiting[count] = value
  end

  local function keep_table(t)
    local copy, meta = {}, getmeta(t)
    for key, value in next, t do
      copy[key] = value
      visit(key)
      visit(value)
    end
    visit(meta)
    tables[t], metatables[t] = copy, meta or false
  end

  local function keep_locals(f)
    if getinfo(f, 'S').what == 'C' then return end
    for index = 1, 255 do
      local name, value = getupvalue(f, index)
      if name == nil then return end
      locals[#locals + 1] = {f, index, value}
      visit(value)
    end
  end

  visit(env)
  visit(loaded)
  visit(getmeta(''))
  for _, f in next, callbacks do visit(f) end
  visit(sandbox.chunk)
  while count > 0 do
    local value = waiting[count]
    waiting[count] = nil
    count = count - 1
    if type(value) == 'table' then keep_table(value) else keep_locals(value) end
  end
  return function()
    for t, copy in next, tables do
      for key in next, t do
        if copy[key] == nil then rawset(t, key, nil) end
      end
      for key, value in next, copy do rawset(t, key, value) end
      setmeta(t, metatables[t] or nil)
    end
    for _, kept in next, locals do setupvalue(kept[1], kept[2], kept[3]) end
  end
end
