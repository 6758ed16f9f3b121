-- The products that controllers make in every step, in Lua: crossing over to Python takes five times as long.
-- They do what frames.py does, in the same order, so that flights are the same to the last bit.
local _, sandbox = ...

local type = type
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

-- 3.x inverts a matrix where it stands, in the script's own table, which Python does not see.
local function in_place(invert)
  return function(m, ...)
    local inverse = invert(m, ...)
    for index = 1, 12 do m[index] = inverse[index] end
    return m
  end
end
sandbox.wrappers = {['sim.invertMatrix'] = in_place, simInvertMatrix = in_place}

-- What returns a function's result, or nil where Python has to look at the values.
sandbox.shortcuts = {
  ['sim.multiplyVector'] = transformed, simMultiplyVector = transformed,
  ['sim.getMatrixInverse'] = inverted, simGetMatrixInverse = inverted,
  ['sim.getInvertedMatrix'] = inverted, simGetInvertedMatrix = inverted,
}
