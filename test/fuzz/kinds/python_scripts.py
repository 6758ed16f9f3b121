"""Python child scripts. They are trusted code: calls that end the process (os._exit, ctypes) are not tried."""

import textwrap

from hypothesis import strategies as st

from kinds.scripts import FUNCTIONS, OBJECTS, ROS_FUNCTIONS, scripts
from kinds.values import one_of_words

_VALUES = st.recursive(
    st.one_of(
        one_of_words("None True -1 0 1 2.5 float('inf') float('nan') 2**53 1e308 5e-324 10**400 '' 'x'"),
        st.sampled_from([r"'\0'", r"'\ud800'", r"b'\xff'", "'x' * 10**5", "lambda: 0", "iter(int, 1)"]),
        one_of_words("deep ring Angry() range(10**9) {} set() globals() type print sim self object()"),
        st.sampled_from([f"sim.getObjectHandle('{name}')" for name in OBJECTS]),
        st.sampled_from(["'std_msgs/Float64'", "'/x'", "'odd'", "'on_message'", "'geometry_msgs/Twist'"]),
        st.integers(-100, 2**40).map(str),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=7).map(lambda items: "[" + ", ".join(items) + "]"),
        st.builds("{{'x': {}, 'data': {}}}".format, inner, inner),
    ),
    max_leaves=6,
)
_FUNCTION = st.sampled_from([*(f"sim.{f}" for f in FUNCTIONS), *(f"simROS.{f}" for f in ROS_FUNCTIONS)])
_CALLS = st.builds("x = {}({})".format, _FUNCTION, st.lists(_VALUES, max_size=5).map(", ".join))
_LOOPS = st.sampled_from(
    [
        "while True: pass",
        "while True:\n    try:\n        while True: pass\n    except BaseException: pass",
        "while True:\n    try: x = 1 / 0\n    except Exception: continue",
        "try:\n    while True: pass\nfinally:\n    x = 1",
        "def f(): f()\nf()",
        "def f():\n    try: f()\n    finally: f()\nf()",
        "class A:\n    def __del__(self):\n        while True: pass\nA()",
        "for i in iter(int, 1): pass",
        "def g():\n    while True: yield\nfor i in g(): pass",
        "while True: sim.getSimulationTime()",
        "while True: sim.addLog(1, 'x')",
        "while True: print('x')",
        "while True: simROS.advertise('/x', 'std_msgs/Float64')",
        "import time\nwhile True: time.sleep(0.01)",
        "import signal\nsignal.signal(signal.SIGALRM, signal.SIG_IGN)\nwhile True: pass",
        "import signal\nsignal.setitimer(signal.ITIMER_REAL, 0)\nwhile True: pass",
        "import signal\nsignal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())\nwhile True: pass",
        "import sys\ndef t(*_):\n    while True: pass\nsys.settrace(t)",
        "import sys\ndef t(*_):\n    while True: pass\nsys.setprofile(t)",
        "exec('while True:\\n try:\\n  while True: pass\\n except: pass')",
        "def g():\n    try: yield\n    finally:\n        while True: pass\nx = g()\nnext(x)\nx.close()",
    ]
)
_HOGS = st.sampled_from(
    [
        "x = 'x' * 10**10",
        "x = [0] * 10**10",
        "x = bytearray(10**11)",
        "x = []\nwhile True: x.append('x' * 10**6)",
        "sim.setStringSignal('a', 'x' * 10**8)",
        "x = 10**10**5",
        "x = str(10**5000)",
        "import numpy\nx = numpy.zeros(10**11)",
    ]
)
_ERRORS = st.sampled_from(
    [
        "raise KeyboardInterrupt",
        "raise SystemExit",
        "raise GeneratorExit",
        "raise BaseException('x')",
        "raise MemoryError",
        "raise RecursionError('x')",
        "raise StopIteration",
        "raise TimeoutError",
        "raise OSError(2, 'no')",
        "raise Angry()",
        "raise Angry",
        "raise ValueError('a\\nb\\nc')",
        "raise ValueError('x' * 10**6)",
        "raise ValueError('\\ud800')",
        "raise UnicodeDecodeError('x', b'', 0, 1, 'y')",
        "raise ExceptionGroup('x', [ValueError(1)])",
        "raise ValueError from Angry()",
        "import sys\nsys.exit(3)",
        "exit()",
        "assert False",
        "assert 0, Angry()",
        "1 / 0",
        "import no_such_module",
        "from drone_sim import nothing",
        "x = y_that_is_not_there",
        "sim.no()",
        "self.no",
        "return",
        "yield 1",
        "await 1",
    ]
)
_META = st.sampled_from(
    [
        "globals().clear()",
        "globals()[Angry] = 1",
        "class D:\n    def __deepcopy__(self, memo): raise KeyboardInterrupt\nself.d = D()",
        "print('\\ud800')",
        "simROS.publish(simROS.advertise('a', 'std_msgs/String'), {'data': '\\ud800'})",
        "del sim, simROS",
        "self = None",
        "print = None",
        "sysCall_actuation = 5",
        "class C:\n    def __call__(self): raise Angry\nsysCall_sensing = C()",
        "async def sysCall_actuation(): pass",
        "def sysCall_actuation(a, b): pass",
        "def sysCall_sensing():\n    yield 1",
        "def odd(m):\n    m.linear = m\n    raise Angry\nsimROS.subscribe('cmd_vel', 'geometry_msgs/Twist', 'odd')",
        "simROS.subscribe('cmd_vel', 'geometry_msgs/Twist', lambda m: [0 for _ in iter(int, 1)])",
        "import sys\nsys.setrecursionlimit(10**6)",
        "import warnings\nwarnings.warn('x')",
        "self.lock = __import__('threading').Lock()",
        "self.file = open(__file__)",
        "self.generator = (x for x in [1])",
        "self.me = self\nself.angry = Angry()",
        "__builtins__ = {}",
        "x = eval('(' * 500 + ')' * 500)",
    ]
)
_ANY = st.one_of(_CALLS, _CALLS, _CALLS, _LOOPS, _HOGS, _ERRORS, _META)
_WRAPPED = st.one_of(
    _ANY,
    _ANY,
    _ANY.map(lambda part: "try:\n" + textwrap.indent(part, "    ") + "\nexcept Exception: pass"),
    _ANY.map(lambda part: "for i in range(3):\n" + textwrap.indent(part, "    ")),
    _ANY.map(lambda part: "def f():\n" + textwrap.indent(part, "    ") + "\nf()"),
    st.text(max_size=30),
)
_HEAD = """
deep = []
for _ in range(300):
    deep = [deep]
ring = []
ring.append(ring)
class Angry(Exception):
    def __str__(self): raise ValueError('no')
    __repr__ = __float__ = __len__ = __iter__ = __getitem__ = __bool__ = __hash__ = __str__
"""


def _put(placed):
    text = _HEAD if any(word in part for _, part in placed for word in ("deep", "ring", "Angry")) else ""
    for phase, part in placed:
        text += f"def sysCall_{phase}():\n{textwrap.indent(part, '    ')}\n" if phase else part + "\n"
    return text


CASES = scripts("py", _WRAPPED, _put)
