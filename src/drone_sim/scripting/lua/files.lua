-- `io`: a child script has no files. What it would write into one, such as a log, is accepted and ignored, said once;
-- reading one is an error.
local bridge, sandbox = ...

local error, setmetatable, tostring = error, setmetatable, tostring
local log, has_said = bridge.log, false
local writing = {w = true, a = true, wb = true, ab = true}
local sink = {}
sink.__index = sink

function sink:write() return self end
function sink:flush() return self end
function sink:setvbuf() return true end
function sink:seek() return 0 end
function sink:close() return true end

local function open(name, mode)
  if not writing[mode or 'r'] then
    error('io.open: ' .. tostring(name) .. ': a child script reads no files; parameters: and require bring values in', 2)
  end
  if not has_said then
    has_said = true
    log('io.open: a child script writes no files; accepted and ignored: print writes into the log')
  end
  return setmetatable({}, sink)
end

sandbox.globals.io = setmetatable({open = open, close = function() return true end}, {__index = function(_, name)
  error('io.' .. tostring(name) .. ': a child script has no files; of io there is io.open, to write', 2)
end})
