-- `Matrix`: matrices of numbers, which scripts since CoppeliaSim 4.4 have as a global, and as `require 'matrix'`; `Vector` is a
-- matrix with a single column.
--
-- Matrix(rows, cols, data): data are the numbers row by row, a function of row and column, or nil for zeros; -1 for rows or
-- cols means as many as the data need. Rows and columns count from 1. Methods return new matrices, except set, setrow, setcol
-- and assign.
local _, sandbox = ...

local error, select, setmetatable, tostring, type = error, select, setmetatable, tostring, type
local abs, floor, getmetatable = math.abs, math.floor, sandbox.debug.getmetatable
local concat, ipairs, pairs, unpack = table.concat, ipairs, pairs, table.unpack or unpack
local env = sandbox.globals
local methods = {}
local meta = {}

-- m:method(), and m[row][column]
function meta.__index(matrix, key)
  if type(key) ~= 'number' then return methods[key] end
  return setmetatable({}, {
    __index = function(_, j) return matrix:get(key, j) end,
    __newindex = function(_, j, value) matrix:set(key, j, value) end,
    __len = function() return matrix._cols end,
  })
end

local function fail(message)
  local line, file = sandbox.place_in_script()
  error(file .. ':' .. line .. ': ' .. message, 0)
end

local function whole(value, least, what)
  if type(value) ~= 'number' or value < least or value % 1 ~= 0 then
    fail('Matrix: ' .. what .. ' = ' .. tostring(value) .. ': a whole number from ' .. least .. ' on is expected')
  end
  return floor(value)
end

local function filled(rows, cols, number_at)
  local numbers = {}
  for i = 1, rows do
    for j = 1, cols do numbers[#numbers + 1] = number_at(i, j) end
  end
  return setmetatable({_rows = rows, _cols = cols, _data = numbers}, meta)
end

local function place(matrix, i, j)
  if whole(i, 1, 'row') > matrix._rows or whole(j, 1, 'column') > matrix._cols then
    fail('Matrix: there is no [' .. i .. ', ' .. j .. '] in ' .. matrix._rows .. ' x ' .. matrix._cols)
  end
  return (i - 1) * matrix._cols + j
end

local function new(rows, cols, data)
  if type(data) == 'table' and rows == -1 then rows = #data / whole(cols, 1, 'cols') end
  if type(data) == 'table' and cols == -1 then cols = #data / whole(rows, 1, 'rows') end
  rows, cols = whole(rows, 0, 'rows'), whole(cols, 0, 'cols')
  if type(data) == 'function' then return filled(rows, cols, data) end
  if data ~= nil and (type(data) ~= 'table' or #data ~= rows * cols) then
    fail('Matrix: ' .. rows .. ' x ' .. cols .. ' numbers are expected')
  end
  return filled(rows, cols, function(i, j) return data and data[(i - 1) * cols + j] or 0 end)
end

function methods:rows() return self._rows end
function methods:cols() return self._cols end
function methods:count() return #self._data end
function methods:data() return self._data end
function methods:get(i, j) return self._data[place(self, i, j)] end
function methods:set(i, j, value)
  self._data[place(self, i, j)] = value
  return self
end
function methods:row(i) return self:slice(i, 1, i, self._cols) end
function methods:col(j) return self:slice(1, j, self._rows, j) end
function methods:t() return filled(self._cols, self._rows, function(i, j) return self:get(j, i) end) end

function methods:slice(top, left, bottom, right)
  place(self, top, left)
  place(self, bottom, right)
  return filled(bottom - top + 1, right - left + 1, function(i, j) return self:get(top + i - 1, left + j - 1) end)
end

function methods:copy() return filled(self._rows, self._cols, function(i, j) return self:get(i, j) end) end

function methods:totable()
  local rows = {}
  for i = 1, self._rows do rows[i] = self:row(i)._data end
  return rows
end

local function is_matrix(value) return getmetatable(value) == meta end

local function data_of(value) return is_matrix(value) and value._data or value end

function methods:assign(top, left, other)
  for i = 1, other._rows do
    for j = 1, other._cols do self:set(top + i - 1, left + j - 1, other:get(i, j)) end
  end
  return self
end

function methods:setrow(i, row) return self:assign(i, 1, new(1, self._cols, data_of(row))) end
function methods:setcol(j, col) return self:assign(1, j, new(self._rows, 1, data_of(col))) end

---- element-wise operations

local function each(one, other, result)
  if type(one) == 'number' then
    return filled(other._rows, other._cols, function(i, j) return result(one, other:get(i, j)) end)
  elseif type(other) == 'number' then
    return filled(one._rows, one._cols, function(i, j) return result(one:get(i, j), other) end)
  elseif not (is_matrix(one) and is_matrix(other) and one._rows == other._rows and one._cols == other._cols) then
    fail('Matrix: two of the same size are expected')
  end
  return filled(one._rows, one._cols, function(i, j) return result(one:get(i, j), other:get(i, j)) end)
end

local BY_TWO = {
  add = function(a, b) return a + b end,
  sub = function(a, b) return a - b end,
  times = function(a, b) return a * b end,
  div = function(a, b) return a / b end,
  pow = function(a, b) return a ^ b end,
}
for name, f in pairs(BY_TWO) do methods[name] = function(one, other) return each(one, other, f) end end
for _, name in ipairs{'abs', 'acos', 'asin', 'ceil', 'cos', 'deg', 'exp', 'floor', 'rad', 'sin', 'sqrt', 'tan'} do
  local f = math[name]
  methods[name] = function(self) return self:applyfunc(f) end
end
function methods:applyfunc(f) return filled(self._rows, self._cols, function(i, j) return f(self:get(i, j)) end) end
meta.__add, meta.__sub, meta.__div = methods.add, methods.sub, methods.div
function meta.__unm(one) return one:times(-1) end

---- products

function methods.mul(one, other)
  if type(one) == 'number' or type(other) == 'number' then return methods.times(one, other) end
  if one._cols ~= other._rows then fail('Matrix: columns of the first and rows of the second differ') end
  return filled(one._rows, other._cols, function(i, j)
    local sum = 0
    for k = 1, one._cols do sum = sum + one:get(i, k) * other:get(k, j) end
    return sum
  end)
end
meta.__mul = methods.mul

function methods:dot(other) return each(self, other, BY_TWO.times):sum() end
function methods:norm() return self:dot(self) ^ 0.5 end
function methods:normalized() return self:div(self:norm()) end

function methods:cross(other)
  local a, b = self._data, data_of(other)
  return new(3, 1, {a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1]})
end

---- reductions of all elements, or over the rows (1) or columns (2)

local FOLDED = {
  sum = function(a, b) return a + b end,
  prod = function(a, b) return a * b end,
  max = function(a, b) return a < b and b or a end,
  min = function(a, b) return b < a and b or a end,
}
for name, f in pairs(FOLDED) do
  methods[name] = function(self, along)
    if along == 1 then return filled(1, self._cols, function(_, j) return self:col(j)[name](self:col(j)) end) end
    if along == 2 then return filled(self._rows, 1, function(i) return self:row(i)[name](self:row(i)) end) end
    local result = self._data[1]
    for k = 2, #self._data do result = f(result, self._data[k]) end
    return result or 0
  end
end

function methods:mean(along)
  local count = along == 1 and self._rows or along == 2 and self._cols or #self._data
  local sum = self:sum(along)
  return type(sum) == 'number' and sum / count or sum:div(count)
end

function methods:trace()
  local sum = 0
  for i = 1, self._rows do sum = sum + self:get(i, i) end
  return sum
end

---- Gauss-Jordan elimination: the inverse of `left` times `right`, and the determinant

local function eliminated(left, right)
  if left._rows ~= left._cols then fail('Matrix: a square one is expected') end
  local a, b, det, size = left:totable(), right:totable(), 1, left._rows
  for k = 1, size do
    local best = k
    for i = k + 1, size do if abs(a[i][k]) > abs(a[best][k]) then best = i end end
    if a[best][k] == 0 then return nil, 0 end
    if best ~= k then a[k], a[best], b[k], b[best], det = a[best], a[k], b[best], b[k], -det end
    local pivot = a[k][k]
    det = det * pivot
    for j = 1, size do a[k][j] = a[k][j] / pivot end
    for j = 1, right._cols do b[k][j] = b[k][j] / pivot end
    for i = 1, size do
      local factor = a[i][k]
      if i ~= k and factor ~= 0 then
        for j = 1, size do a[i][j] = a[i][j] - factor * a[k][j] end
        for j = 1, right._cols do b[i][j] = b[i][j] - factor * b[k][j] end
      end
    end
  end
  return filled(size, right._cols, function(i, j) return b[i][j] end), det
end

local function eye(size) return filled(size, size, function(i, j) return i == j and 1 or 0 end) end

function methods:det() return (select(2, eliminated(self, eye(self._rows)))) end

function methods:inv()
  local inverse = eliminated(self, eye(self._rows))
  if not inverse then fail('Matrix: it has no inverse') end
  return inverse
end

function methods:power(exponent)
  local base, result = exponent < 0 and self:inv() or self, eye(self._rows)
  for _ = 1, whole(abs(exponent), 0, 'exponent') do result = result * base end
  return result
end
meta.__pow = methods.power

---- concatenation, and homogeneous coordinates

function methods:vertcat(...)
  local result = self
  for k = 1, select('#', ...) do
    local above, below = result, (select(k, ...))
    if above._cols ~= below._cols then fail('Matrix: as many columns are expected') end
    result = filled(above._rows + below._rows, above._cols, function(i, j)
      if i <= above._rows then return above:get(i, j) end
      return below:get(i - above._rows, j)
    end)
  end
  return result
end

function methods:horzcat(...)
  local turned = {}
  for k = 1, select('#', ...) do turned[k] = (select(k, ...)):t() end
  return self:t():vertcat(unpack(turned)):t()
end

function methods:hom() return self._rows == 3 and self:vertcat(filled(1, self._cols, function() return 1 end)) or self end

function methods:nonhom()
  return filled(self._rows - 1, self._cols, function(i, j) return self:get(i, j) / self:get(self._rows, j) end)
end

---- text and comparison

local function text_of(matrix)
  return 'Matrix(' .. matrix._rows .. ',' .. matrix._cols .. ',{' .. concat(matrix._data, ',') .. '})'
end
meta.__tostring = text_of
function meta.__len(matrix) return matrix._rows end

function meta.__eq(one, other)
  return one._rows == other._rows and text_of(one) == text_of(other)
end

function methods:print()
  for i = 1, self._rows do env.print(concat(self:row(i)._data, ' ')) end
end

---- constructors

local function constructor(create, functions)
  return setmetatable(functions or {}, {__index = methods, __call = function(_, ...) return create(...) end})
end

env.Matrix = constructor(new, {
  eye = function(_, size) return eye(size) end,
  ones = function(_, rows, cols) return filled(rows, cols, function() return 1 end) end,
  zeros = function(_, rows, cols) return new(rows, cols) end,
  fromtable = function(_, rows) return filled(#rows, #rows[1] or 0, function(i, j) return rows[i][j] end) end,
  diag = function(_, values)
    local data = data_of(values)
    return filled(#data, #data, function(i, j) return i == j and data[i] or 0 end)
  end,
})

local function vector(size, data)
  if type(size) == 'table' then size, data = #size, size end
  return new(size, 1, data)
end
env.Vector = constructor(vector)
for _, size in ipairs{3, 4, 7} do env['Vector' .. size] = constructor(function(data) return vector(size, data) end) end

-- Return a 4 x 4 matrix; a transform of 12 numbers gets the last row 0 0 0 1.
local function with_last_row(data)
  if type(data) ~= 'table' or #data ~= 12 then return new(4, 4, data) end
  return new(3, 4, data):vertcat(new(1, 4, {0, 0, 0, 1}))
end

local function about(axis)
  local first, second = axis % 3 + 1, (axis + 1) % 3 + 1
  return function(_, angle)
    local turn = eye(3)
    turn:set(first, first, math.cos(angle)):set(first, second, -math.sin(angle))
    return turn:set(second, first, math.sin(angle)):set(second, second, math.cos(angle))
  end
end
env.Matrix3x3 = constructor(function(data) return new(3, 3, data) end, {rotx = about(1), roty = about(2), rotz = about(3)})
env.Matrix4x4 = constructor(with_last_row, {
  fromposition = function(_, place) return eye(4):assign(1, 4, new(3, 1, data_of(place))) end,
  fromrotation = function(_, turn) return eye(4):assign(1, 1, turn) end,
  fromrt = function(_, turn, place) return eye(4):assign(1, 1, turn):assign(1, 4, new(3, 1, data_of(place))) end,
  toposition = function(_, matrix) return matrix:slice(1, 4, 3, 4)._data end,
  torotation = function(_, matrix) return matrix:slice(1, 1, 3, 3) end,
})
sandbox.own_modules.matrix = env.Matrix -- unless a file in the script's folder has this name
