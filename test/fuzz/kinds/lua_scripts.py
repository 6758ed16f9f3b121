"""Lua child scripts: calls with odd values, loops in Lua and in C, memory, coroutines, metatables, odd errors."""

from hypothesis import strategies as st

from kinds.scripts import FUNCTIONS, OBJECTS, ROS_FUNCTIONS, scripts
from kinds.values import one_of_words

_VALUES = st.recursive(
    st.one_of(
        one_of_words("nil true -1 0 1 2.5 1/0 -1/0 0/0 2^53 1e308 5e-324 math.huge '' 'x' print sim _G _ENV"),
        st.sampled_from([r"'\0'", r"'\255\254'", "('x'):rep(1e5)", "function() end"]),
        st.sampled_from(["coroutine.create(print)", "setmetatable({}, {})", "io", "string", "deep", "ring", "angry"]),
        st.sampled_from([f"sim.getObjectHandle('{name}')" for name in OBJECTS]),
        st.sampled_from(["'std_msgs/Float64'", "'/x'", "'odd'", "'on_message'", "'geometry_msgs/Twist'"]),
        st.integers(-100, 2**40).map(str),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=7).map(lambda items: "{" + ", ".join(items) + "}"),
        st.builds("{{[{}]={}, x={}}}".format, inner.filter(lambda x: x not in ("nil", "0/0")), inner, inner),
    ),
    max_leaves=6,
)
_FUNCTION = st.sampled_from([*(f"sim.{f}" for f in FUNCTIONS), *(f"simROS.{f}" for f in ROS_FUNCTIONS)])
_CALLS = st.builds("x = {}({})".format, _FUNCTION, st.lists(_VALUES, max_size=5).map(", ".join))
_PATTERN = one_of_words(".-.-.-.-.-y (.-)(.-)(.-)%1y .*.*.*.*y [^x]*[^x]*y %b() %f[y] (((( % [ x*x*x*y")
_SIZE = one_of_words("10 1e3 1e5 250000 1e7 2^31 2^53 -1 0")
_LIBRARY = st.one_of(
    st.builds("x = ('x'):rep({}):find('{}')".format, _SIZE, _PATTERN),
    st.builds("x = ('x'):rep({}):gsub('{}', {})".format, _SIZE, _PATTERN, one_of_words("'%1' '%9' print {} x")),
    st.builds("for a in ('x'):rep({}):gmatch('{}') do x = a end".format, _SIZE, _PATTERN),
    st.builds("table.move({}, {}, {}, {})".format, _VALUES, _SIZE, _SIZE, _VALUES),
    st.builds("x = table.{}({}, {}, {})".format, one_of_words("concat unpack insert remove"), _VALUES, _SIZE, _SIZE),
    st.builds("table.sort({}, {})".format, _VALUES, one_of_words("nil error print select")),
    st.builds("x = string.format('{}', {})".format, one_of_words("%d %s %99.99f %q % %5000d %c %x"), _VALUES),
    st.builds("x = {}({})".format, one_of_words("load require tonumber tostring select type next"), _VALUES),
    st.builds("x = {}({}, {})".format, one_of_words("setmetatable rawset rawget pcall xpcall"), _VALUES, _VALUES),
    st.builds("x = {}".format, one_of_words("os.exit() io.open('/etc/passwd') debug.sethook() collectgarbage('stop')")),
    st.builds(
        "x = {}".format, one_of_words("package.loadlib('x','y') python.eval('1') os.getenv('HOME') string.dump(print)")
    ),
)
_LOOPS = st.sampled_from(
    [
        "while true do end",
        "while true do pcall(error) end",
        "repeat local ok = pcall(function() while true do end end) until false",
        "goto top ::top:: goto top",
        "local function f() return f() end f()",
        "local function f() f() end f()",
        "local function f() return 1 + f() end pcall(f)",
        "local c = coroutine.wrap(function() while true do end end) c()",
        "local c = coroutine.wrap(function() while true do coroutine.yield() end end) while true do c() end",
        "coroutine.yield(1)",
        "while true do sim.switchThread() end",
        "while true do pcall(sim.wait, 0.1) end",
        "sim.callScriptFunction('sysCall_thread', sim.handle_self)",
        "local function f() coroutine.wrap(f)() end f()",
        "local function f() xpcall(f, f) end f()",
        "local function f() pcall(f) pcall(f) end f()",
        "local function f() pcall(f) pcall(f) end coroutine.wrap(f)()",
        "local function f() pcall(coroutine.wrap(f)) pcall(coroutine.wrap(f)) end f()",
        "local m = {} m.__index = function(t, k) pcall(error) return t[k], t[k] end x = setmetatable({}, m).y",
        f"local m = {{}} m.__close = function() {'local x <close> = setmetatable({}, m) ' * 2} end m.__close()",
        "for i = 1, math.huge do end",
        "while true do sim.getSimulationTime() end",
        "while true do sim.addLog(1, 'x') end",
        "while true do sim.addDrawingObject(1, 2, 0, -1, 100, {1, 0, 0}) end",
        "while true do simROS.advertise('/x', 'std_msgs/Float64') end",
        "setmetatable({}, {__gc = function() while true do end end}) collectgarbage()",
        "local t <close> = setmetatable({}, {__close = function() while true do end end}) error('x')",
    ]
)
_HOGS = st.sampled_from(
    [
        "local t = {} while true do t[#t + 1] = {} end",
        "local s = 'x' while true do s = s .. s end",
        "local t = {} for i = 1, 1e9 do t[i] = ('x'):rep(1e6) .. i end",
        "x = ('x'):rep(2^40)",
        "x = ('x'):rep(1e9)",
        "x = table.concat({('x'):rep(1e8), ('y'):rep(1e8), ('z'):rep(1e8)})",
        "while true do sim.setStringSignal('a' .. math.random(), ('x'):rep(1e6)) end",
        "sim.setStringSignal('a', ('x'):rep(1e8))",
        "local t = {} for i = 1, 1e7 do t[i] = i end table.unpack(t)",
        "local t = {} while true do t[#t + 1] = coroutine.create(function() end) end",
    ]
)
_ERRORS = st.sampled_from(
    [
        "error()",
        "error(nil)",
        "error({})",
        "error(print)",
        "error('a\\nb\\nc')",
        "error(('x'):rep(1e6))",
        "error('\\0\\255')",
        "error(setmetatable({}, {__tostring = function() error('again') end}))",
        "error(setmetatable({}, {__tostring = function() while true do end end}))",
        "error(coroutine.create(print))",
        "error(1/0)",
        "error('x', 2^31)",
        "assert(false)",
        "assert(nil, {})",
        "x = nil + 1",
        "x = x.y.z",
        "x = #nil",
        "x()",
        "sim.no()",
        "return",
        "return error",
    ]
)
_META = st.sampled_from(
    [
        "setmetatable(_G, {__index = function(_, n) error(n) end})",
        "setmetatable(_G, {__index = function(_, n) while true do end end})",
        "setmetatable(_G, {__newindex = function() error('no') end}) y = 1",
        "setmetatable(_G, {__index = _G}) x = nothing",
        "setmetatable(_G, {__metatable = false})",
        "setmetatable(_G, {__gc = error, __mode = 'kv', __len = error, __pairs = error})",
        "for k in pairs(_G) do _G[k] = nil end",
        "for k in pairs(sim) do sim[k] = nil end",
        "for _, k in ipairs({'pcall', 'error', 'type', 'tostring', 'string', 'table', 'debug'}) do _G[k] = error end",
        "getmetatable('').__index = function() error('x') end",
        "getmetatable('').__index = nil",
        "_ENV = {}",
        "_G = nil sim = nil simROS = nil",
        "debug = {traceback = function() while true do end end}",
        "sysCall_actuation = 5",
        "sysCall_sensing = setmetatable({}, {__call = function() error('x') end})",
        "sysCall_cleanup = function() sysCall_cleanup() end",
        "function odd(m) m.linear = m error(m) end simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'odd')",
        "simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', function(m) while true do end end)",
        "string.rep = error tostring = error",
        "x = function() end string = x",
    ]
)
_ANY = st.one_of(_CALLS, _CALLS, _CALLS, _LIBRARY, _LIBRARY, _LOOPS, _HOGS, _ERRORS, _META)
_WRAPPED = st.one_of(
    _ANY,
    _ANY,
    st.builds("pcall(function() {} end)".format, _ANY),
    st.builds("coroutine.wrap(function() {} end)()".format, _ANY),
    st.builds("for i = 1, 3 do {} end".format, _ANY.filter(lambda text: not text.startswith("return"))),
    st.builds("xpcall(function() {} end, function(e) {} end)".format, _ANY, _ANY),
    st.text(max_size=30),
)
_HEAD = """
deep = {} do local t = deep for i = 1, 300 do t[1] = {} t = t[1] end end
ring = {} ring[1] = ring ring.x = ring
angry = setmetatable({}, {__index = error, __len = error, __tostring = error, __call = error, __pairs = error})
"""


def _put(placed):
    text = _HEAD if any(word in part for _, part in placed for word in ("deep", "ring", "angry")) else ""
    for phase, part in placed:
        text += f"function sysCall_{phase}()\n  {part}\nend\n" if phase else part + "\n"
    return text


CASES = scripts("lua", _WRAPPED, _put)
