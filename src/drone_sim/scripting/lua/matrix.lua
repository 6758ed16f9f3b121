-- `Matrix`: tables of numbers with rows and columns, which CoppeliaSim's scripts since 4.4 have without `require`.
--
-- Matrix(rows, cols, data): data are the numbers row by row, a function of row and column, or nothing: all zero; -1 for
-- rows or cols is as many as the data need. Rows and columns count from 1.
local _, sandbox = ...

local error, setmetatable, tostring, type = error, setmetatable, tostring, type
local floor, getmetatable = math.floor, sandbox.debug.getmetatable
local methods = {}
local meta = {__index = methods}

local function whole(value, least, what)
  if type(value) ~= 'number' or value < least or value % 1 ~= 0 then
    error('Matrix: ' .. what .. ' = ' .. tostring(value) .. ': a whole number from ' .. least .. ' on is expected', 3)
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
    error('Matrix: there is no [' .. i .. ', ' .. j .. '] in ' .. matrix._rows .. ' x ' .. matrix._cols, 3)
  end
  return (i - 1) * matrix._cols + j
end

function sandbox.globals.Matrix(rows, cols, data)
  if type(data) == 'table' and rows == -1 then rows = #data / whole(cols, 1, 'cols') end
  if type(data) == 'table' and cols == -1 then cols = #data / whole(rows, 1, 'rows') end
  rows, cols = whole(rows, 0, 'rows'), whole(cols, 0, 'cols')
  if type(data) == 'function' then return filled(rows, cols, data) end
  if data ~= nil and (type(data) ~= 'table' or #data ~= rows * cols) then
    error('Matrix: ' .. rows .. ' x ' .. cols .. ' numbers are expected', 2)
  end
  return filled(rows, cols, function(i, j) return data and data[(i - 1) * cols + j] or 0 end)
end

function methods:rows() return self._rows end
function methods:cols() return self._cols end
function methods:count() return #self._data end
function methods:data() return self._data end
function methods:get(i, j) return self._data[place(self, i, j)] end
function methods:set(i, j, value) self._data[place(self, i, j)] = value end
function methods:row(i) return self:slice(i, 1, i, self._cols) end
function methods:col(j) return self:slice(1, j, self._rows, j) end
function methods:t() return filled(self._cols, self._rows, function(i, j) return self:get(j, i) end) end

function methods:slice(top, left, bottom, right)
  place(self, top, left)
  place(self, bottom, right)
  return filled(bottom - top + 1, right - left + 1, function(i, j) return self:get(top + i - 1, left + j - 1) end)
end

local function is_matrix(value) return getmetatable(value) == meta end

local function each(one, other, result)
  if not (is_matrix(one) and is_matrix(other) and one._rows == other._rows and one._cols == other._cols) then
    error('Matrix: two of the same size are expected', 3)
  end
  return filled(one._rows, one._cols, function(i, j) return result(one:get(i, j), other:get(i, j)) end)
end

function meta.__add(one, other) return each(one, other, function(a, b) return a + b end) end
function meta.__sub(one, other) return each(one, other, function(a, b) return a - b end) end

function meta.__mul(one, other)
  if type(one) == 'number' then one, other = other, one end
  if type(other) == 'number' then
    return filled(one._rows, one._cols, function(i, j) return one:get(i, j) * other end)
  end
  if one._cols ~= other._rows then error('Matrix: columns of the first and rows of the second differ', 2) end
  return filled(one._rows, other._cols, function(i, j)
    local sum = 0
    for k = 1, one._cols do sum = sum + one:get(i, k) * other:get(k, j) end
    return sum
  end)
end
