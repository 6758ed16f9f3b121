-- Products that controllers compute in every step, in Lua, because a call into Python takes five times as long.
-- They have the same order of operations as frames.py, so that flights are identical to the last bit.
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

-- In 3.x, a matrix is inverted in place, in the script's table, which Python does not have.
local function in_place(invert)
  return function(m, ...)
    local inverse = invert(m, ...)
    for index = 1, 12 do m[index] = inverse[index] end
    return m
  end
end
sandbox.wrappers = {['sim.invertMatrix'] = in_place, simInvertMatrix = in_place}

-- Functions that return a result, or nil if Python has to check the values.
sandbox.shortcuts = {
  ['sim.multiplyVector'] = transformed, simMultiplyVector = transformed,
  ['sim.getMatrixInverse'] = inverted, simGetMatrixInverse = inverted,
  ['sim.getInvertedMatrix'] = inverted, simGetInvertedMatrix = inverted,
}
