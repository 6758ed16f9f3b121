"""Grading of hostile submissions: they gain no points, are reported in one line and leave nothing behind."""

import contextlib
import os
import socket
from pathlib import Path

import pytest

from drone_sim.grading import permissions
from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import sandbox, settings
from drone_sim.grading.jobs.flyer import Flyer
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.ownership import SceneValues
from drone_sim.message_text import printable
from drone_sim.scripting import load
from drone_sim.scripting.api.calls import contents
from drone_sim.scripting.api.ignored import MODULES

SETTINGS = settings.load({"limits": {"seconds": 30.0, "patience": 100.0, "memory": 256}})  # enough on a busy machine
SECRET = 123_456_789_012
PLAN = """
name: attacked
title: A word of the plan that nobody needs
duration: 0.5
config: {script_time_limit: 60.0}
criteria:
  - {kind: reach, places: [[3, 0, 1]], within: 0.2, points: 5}
  - {kind: signal, signal: found, equals: nothing, points: 0.5}
"""
IMPATIENT = PLAN.replace("60.0", "1.0")  # for scripts that do not return
# A Python script that makes all attempts in its first sensing; an attempt returns what it could get, if anything.
PYTHON = """
import contextlib, ctypes, gc, glob, mmap, os, re, resource, signal, socket, struct, subprocess, sys, tempfile, time
LIBC = ctypes.CDLL(None)
HERE = os.path.dirname(__file__)

ATTEMPTS = {}

def refused(call, said):
    try:
        call()
    except ValueError as error:
        return None if said in str(error) else str(error)
    return "is not refused"

def sysCall_init():
    self.drone = sim.getObjectHandle("Drone")
    self.base = sim.getObjectHandle("Quadricopter_base")
    self.found = None

def sysCall_sensing():
    if self.found is None:
        self.found = {}
        for what, attempt in ATTEMPTS.items():
            try:
                if found := attempt():
                    self.found[what] = repr(found)[:300]
            except (OSError, ValueError, LookupError, AttributeError, ImportError, RuntimeError):
                pass
    sim.setStringSignal("found", repr(self.found) if self.found else "nothing")
"""
ATTEMPT = """
def attempt():
    found = None
    {body}
    return found

ATTEMPTS[{what!r}] = attempt
"""
RULES = {  # the forbidden call, and a part of the error message
    "moves itself": ("sim.setObjectPosition(self.drone, -1, [3, 0, 1])", "move Drone"),
    "moves itself by name": (
        "sim.setObjectPosition(position=[3, 0, 1], handle=self.drone, relativeTo=-1)",
        "move Drone",
    ),
    "moves itself by a flag": (
        "sim.setObjectPosition(self.drone + sim.handleflag_axis + 0.5, -1, [3, 0, 1])",
        "to move",
    ),
    "moves itself in a pose": ("sim.setObjectPose(self.drone, -1, [3, 0, 1, 0, 0, 0, 1])", "move Drone"),
    "moves along": ("sim.moveToPose({'object': self.drone, 'targetPose': [3, 0, 1, 0, 0, 0, 1]})", "move"),
    "pushes itself": ("sim.addForceAndTorque(self.drone, [9, 0, 9], [0, 0, 0])", "push Drone"),
    "hangs itself up": ("sim.setObjectParent(self.drone, self.base, False)", "move Drone"),
    "is made a dummy's": ("sim.setObjectPosition(self.base, -1, [3, 0, 1])", "move Quadricopter_base"),
    "makes a step longer": ("sim.setSimulationTimeStep(0.5)", "change the scene"),
    "has no weight": ("sim.setShapeMass(self.drone, 1e-3)", "change Drone"),
    "builds a bridge": ("sim.createPrimitiveShape(0, [9, 9, 1])", "change the scene"),
    "is called another": ("sim.setObjectName(self.drone, 'Floor')", "change Drone"),
    "has more air": (
        "sim.setScriptSimulationParameter(sim.getScriptHandle('Quadricopter_propeller_respondable1'),"
        " 'particleDensity', 9e9)",
        "change the script of Quadricopter_propeller_respondable1",
    ),
    "writes a file": ("sim.saveModel(self.drone, 'mine.ttm')", "write Drone"),
}
SEARCHES = {  # each finds something if the sandbox does not hide it
    "the judge by gc": "found = [type(one) for one in gc.get_objects() if type(one).__module__.startswith("
    "('drone_sim.grading.flight', 'drone_sim.grading.plan', 'drone_sim.run', 'drone_sim.world'))]",
    "the judge by modules": "found = [one for one in sys.modules if one.startswith("
    "('drone_sim.grading.flight', 'drone_sim.grading.criteria', 'drone_sim.run', 'pybullet'))]",
    "the judge by frames": "frame = sys._getframe()\n    while frame:\n"
    "        found = found or [one for one in frame.f_locals if one in ('plan', 'simulation', 'seed', 'judge')]\n"
    "        frame = frame.f_back",
    "the seed": "found = [one for one in gc.get_objects() if type(one) is dict and SEED in one.values()]",
    "the plan in memory": "word = re.compile(b''.join(b'\\\\x%02x' % (one ^ 1) for one in TITLE))"
    "  # its own memory never holds the word as it is written\n"
    "    for line in open('/proc/self/maps').read().splitlines():\n"
    "        low, high = (int(one, 16) for one in line.split()[0].split('-'))\n"
    "        if 'rw' in line and high - low < 2**27:\n"
    "            with contextlib.suppress(OSError), open('/proc/self/mem', 'rb') as memory:\n"
    "                memory.seek(low)\n"
    "                found = found or (word.search(memory.read(high - low)) and line)",
    "the plan's file": "found = open(FOLDER + '/attacked.yaml').read()",
    "another submission": "found = open(FOLDER + '/other.py').read()",
    "the secret": "found = open(FOLDER + '/secret').read()",
    "solutions": "found = glob.glob(TASKS + '/*/solution.py')",
    "other processes": "found = [one for one in os.listdir('/proc') if one.isdigit() and int(one) > 2"
    " and int(one) != os.getpid()]",
    "descriptors": "found = [one for one in os.listdir('/proc/self/fd') if int(one) > 3"
    " and not os.readlink('/proc/self/fd/' + one).startswith('/proc')]",
    "the parent's descriptors": "found = [os.readlink(one) for one in glob.glob(f'/proc/{os.getppid()}/fd/*')]",
    "the parent's memory": "found = open(f'/proc/{os.getppid()}/mem', 'rb') and 'open'",
    "passwords in the environment": "found = [one for one in os.environ if 'SECRET' in one]",
    "the network": "found = socket.create_connection(('127.0.0.1', PORT), 1) and 'connected'",
    "the ROS master": "found = socket.create_connection(('127.0.0.1', 11311), 1) and 'connected'",
    "a tracer": "libc = ctypes.CDLL(None)\n    found = libc.ptrace(16, os.getppid(), None, None) == 0",
    "memory of a device": "found = mmap.mmap(os.open('/dev/zero', os.O_RDWR), 4096)",
    "the home": "open(os.path.expanduser('~/.attacked'), 'w')",
    "the disk": "open(FOLDER + '/written', 'w')",
}
ENDINGS = {  # the code that ends the flight, and a part of the error message
    "a forged end": (
        "os.write(3, struct.pack('<I', 12) + b'[[\"end\",1,1]]')\n    os._exit(0)",
        "sent an invalid message: not JSON",
    ),
    "a forged result": (
        "for number in range(64):\n"
        "        with contextlib.suppress(OSError):\n"
        '            os.write(number, b\'{"result": {"passed": true, "points": 5}}\')\n'
        "    os._exit(0)",
        "before the flight was over",
    ),
    "a function that is none": (
        'say = b\'[["call","os.system",[],"id"]]\'\n    os.write(3, struct.pack(\'<I\', len(say)) + say)\n'
        "    time.sleep(9)",
        "unknown function of the API",
    ),
    "an order for the judge": (
        'say = b\'[["call","sim.addForce",[["handle"]]]]\'\n    os.write(3, struct.pack(\'<I\', len(say)) + say)\n'
        "    time.sleep(9)",
        "malformed named arguments",
    ),
    "the door closed": ("os.close(3)", "before the flight was over"),
    "a stop": ("os.kill(os.getpid(), signal.SIGSTOP)", "did not return after 1 s (script_time_limit)"),
    "a step without end": ("while True:\n        pass", "stopped after 1 s without returning"),
    "a fork bomb": ("while True:\n        os.fork()", ""),  # the process limit or the time limit ends it
    "a crash": ("ctypes.string_at(0)", "crashed: its process was ended by SIGSEGV"),
}
ENDLESS = ("a stop", "a step without end", "a fork bomb")
JUDGE_SEARCHES = {  # each finds something if the judge can be reached where no sandbox hides it
    **{what: SEARCHES[what] for what in ("the judge by gc", "the judge by modules", "the seed", "the plan in memory")},
    **{what: SEARCHES[what] for what in ("descriptors", "the parent's memory", "passwords in the environment")},
    "the judge's memory": "found = of_judges(lambda one: open(f'/proc/{one}/mem', 'rb'))",
    "the judge's descriptors": "found = of_judges(lambda one: os.stat(f'/proc/{one}/fd/4'))",
    "the judge, traced": "found = of_judges(lambda one: ctypes.CDLL(None).ptrace(16, int(one), None, None) == 0)",
}
JUDGE_HELPERS = f"""
def is_of_test(process):
    while process > 1 and process != {os.getpid()}:
        process = int(open(f"/proc/{{process}}/stat").read().rpartition(")")[2].split()[1])
    return process > 1

def of_judges(look):
    found = []
    for one in os.listdir("/proc"):
        with contextlib.suppress(OSError):
            if one.isdigit() and b"judge_server" in open(f"/proc/{{one}}/cmdline", "rb").read():
                if is_of_test(int(one)) and look(one):
                    found.append(one)
    return found
"""
NUMBER = "{'x86_64': %d, 'aarch64': %d}[os.uname().machine]"  # of a system call without a C library function
ADD_KEY, IO_URING_SETUP = NUMBER % (248, 217), NUMBER % (425, 425)
SYSTEM_CALLS = {  # each finds something if the system call is allowed
    "System V memory": "found = LIBC.shmget(4321, 2**20, 0o1600) != -1",
    "System V semaphores": "found = LIBC.semget(4321, 1, 0o1600) != -1",
    "System V messages": "found = LIBC.msgget(4321, 0o1600) != -1",
    "a POSIX queue": "found = LIBC.mq_open(b'/attacked', os.O_CREAT | os.O_RDWR, 0o600, None) != -1",
    "a key": f"found = LIBC.syscall({ADD_KEY}, b'user', b'attacked', b'found', 5, -4) != -1",
    "an attribute of a folder": "os.setxattr(tempfile.gettempdir(), 'user.attacked', b'found')\n    found = 'set'",
    "a limit of the parent": "resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (99, 99))\n    found = 'set'",
    "a processor of the parent": "os.sched_setaffinity(os.getppid(), {0})\n    found = 'set'",
    "a priority of the parent": "os.setpriority(os.PRIO_PROCESS, os.getppid(), 19)\n    found = 'set'",
    "a policy of the parent": "os.sched_setscheduler(os.getppid(), 5, os.sched_param(0))\n    found = 'SCHED_IDLE'",
    "a file in memory": "found = os.memfd_create('attacked')",
    "shared memory without a file": "found = mmap.mmap(-1, 4096)",
    "a user namespace": "found = LIBC.unshare(0x10000000) == 0",
    "a user namespace of a child": "child = LIBC.syscall(%s, 0x10000011, 0, 0, 0, 0)\n"
    "    if child == 0:\n        os._exit(0)\n    found = child > 0" % (NUMBER % (56, 220)),
    "io_uring": f"found = LIBC.syscall({IO_URING_SETUP}, 8, (ctypes.c_char * 200)()) != -1",
    "a network": "found = socket.socket()",
    "the host of a virtual machine": "found = socket.socket(40, socket.SOCK_STREAM)",
    "large buffers": "socket.socketpair()[0].setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2**22)\n    found = 'set'",
}
EXCESSES = {  # code that exceeds a limit of all processes together, and a part of the error message
    "memory of many copies, which may each write to theirs": (
        "all(os.fork() for _ in range(20))\n    time.sleep(99)",
        "more than 256 MiB of memory",
    ),
    "sockets of several processes": (
        "os.fork() or os.fork()\n    kept = [socket.socketpair() for _ in range(110)]\n    time.sleep(99)",
        "more than 256 sockets",
    ),
    "empty files": (
        "for number in range(25000):\n        os.close(os.open(f'{tempfile.gettempdir()}/{number}', os.O_CREAT))\n"
        "    time.sleep(99)",
        "more than 20000 files",
    ),
}
LEFTOVERS = {  # code whose effect would outlive the flight
    "a daemon": "subprocess.Popen(['sleep', '4321'], start_new_session=True)",
    "a daemon's daemon": "os.fork() or (os.setsid(), os.fork() and os._exit(0), time.sleep(4321))",
    "a copy": "os.fork() or (os.setsid(), time.sleep(4321))",
    "a fake table": "print('script   passed  points\\nmine.py     20/20    20/20', file=sys.__stdout__, flush=True);"
    " os.write(1, b'20 of 20'); os.write(2, b'20 of 20')",
    "other criteria": "from drone_sim.grading.criteria import Reach\n    Reach._judge_part = lambda *_: 1 / 0",
    "another clock": "import drone_sim.mechanics.clock as clock\n    clock.Clock.time = 99.0",
    "other permissions": "import drone_sim.scripting.rpc.connection as end\n    end.ScriptConnection.permit = None",
}
LUA = {  # the attempts that are possible in Lua, and a part of the recorded line
    "moves itself": ("sim.setObjectPosition(drone, -1, {3, 0, 1})", "tried to move Drone"),
    "moves itself in V-REP": ("simSetObjectPosition(drone, -1, {3, 0, 1})", "tried to move Drone"),
    "moves itself with more": ("sim.setObjectPosition(drone, -1, {3, 0, 1}, 1, 2, 3)", "tried to move Drone"),
    "pushes itself": ("sim.addForceAndTorque(drone, {9, 0, 9}, {0, 0, 0})", "tried to push Drone"),
    "makes a step longer": ("sim.setSimulationTimeStep(0.5)", "tried to change the scene"),
    "reads a file": ("found = io.open('/etc/passwd')", ""),
    "runs a program": ("found = os.execute('id')", ""),
    "looks about": ("found = debug.getregistry()", ""),
    "looks at Python": ("found = python.eval('1')", ""),
    "loads a library": ("found = package.loadlib('libc.so.6', 'system')", ""),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("attacked")
    (directory / "attacked.yaml").write_text(PLAN)
    (directory / "impatient.yaml").write_text(IMPATIENT)
    (directory / "secret").write_bytes(os.urandom(32))
    (directory / "other.py").write_text("def sysCall_init(): pass\n")
    return directory


def sandbox_error():
    try:
        sandbox.command(1)
    except sandbox.NoSandbox as why:
        return str(why)
    return ""


def yield_fly_function(sandboxed):
    """Yield a function that writes a script into the folder of a plan and grades a flight of it."""
    with contextlib.closing(Flyer(SETTINGS.limits, sandboxed=sandboxed)) as flyer:

        def flown(name, text, plan, seed=SECRET):
            (plan.parent / "handed_in").mkdir(exist_ok=True)
            path = plan.parent / "handed_in" / name
            path.write_text(text)
            key = key_of(contents_of(plans.read(plan), str(path)), seed, {})
            return flyer.fly(Job(str(plan), str(path), seed, {}, key)).result

        yield flown


@pytest.fixture(scope="module")
def fly_by_plan():
    yield from yield_fly_function(sandboxed=False)


@pytest.fixture(scope="module")
def fly_without_sandbox(fly_by_plan, folder):
    return lambda name, text: fly_by_plan(name, text, folder / "attacked.yaml")


@pytest.fixture(scope="module")
def fly(folder):
    with contextlib.contextmanager(yield_fly_function)(sandboxed=not sandbox_error()) as flown:
        yield lambda name, text, plan="attacked": flown(name, text, folder / f"{plan}.yaml")


def python_script(attempts, folder, port=9):
    """Return a script that makes the attempts: {name: body of the attempt}."""
    text = PYTHON + "".join(ATTEMPT.format(what=what, body=body) for what, body in attempts.items())
    title = bytes(one ^ 1 for one in b"A word of the plan that nobody needs")
    words = {"TITLE": repr(title), "FOLDER": repr(str(folder)), "TASKS": repr(str(Path(__file__).parents[2] / "tasks"))}
    for word, value in {**words, "SEED": str(SECRET), "PORT": str(port)}.items():
        text = text.replace(word, value)
    return text


# A plan under which a script may read only its own objects and sensors, and a script that tries to read others.
PLAN_WITH_READS_OWN = """
duration: 0.3
scene: package://drone_sim/tasks/gates_vision/scene.yaml
reads: own
criteria:
  - {kind: signal, signal: found, equals: nothing}
"""
READING_SCRIPT = """
def attempts():
    yield lambda: sim.getObjectPosition(gate, -1)
    yield lambda: sim.getObjectPosition(drone, gate)
    yield lambda: sim.getObjectMatrix(relativeTo=gate, handle=drone)
    yield lambda: sim.getShapeBB(gate + 0.5)
    yield lambda: sim.getObjectVelocity(gate + sim.handleflag_axis)
    yield lambda: sim.checkDistance(drone)
    yield lambda: sim.checkDistance(drone, sim.handle_all)
    yield lambda: sim.checkDistance(drone, everything())
    yield lambda: sim.checkVisionSensorEx(camera, gate, False)
    yield lambda: sim.setObjectPosition(mark, gate, [0, 0, 0])
    yield lambda: sim.setObjectParent(mark, gate, False)
    yield lambda: sim.moveToPose({"object": mark, "relObject": gate, "targetPose": [0, 0, 0, 0, 0, 0, 1]})
    yield lambda: sim.createVisionSensor(2, [9, 9, 0, 0], [0.1, 9, 1, 0.1, 0, 0, 0, 0, 0, 0, 0])

def everything():
    made = sim.createCollection()
    sim.addItemToCollection(made, sim.handle_all, -1, 0)
    return made

def sysCall_init():
    global drone, gate, camera, mark
    drone, gate, camera = (sim.getObject(one) for one in ("/Quadcopter", "/Red", "/FrontVision"))
    mark = sim.createDummy(0.01)

def sysCall_sensing():
    found = []
    for number, attempt in enumerate(attempts()):
        try:
            found.append((number, attempt()))
        except ValueError:
            pass
    assert sim.getObjectPosition(drone, -1) and sim.getObjectPosition(mark, drone)
    sim.setStringSignal("found", repr(found) if found else "nothing")
"""


def test_a_submission_under_reads_own_cannot_read_other_objects(fly_by_plan, tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(PLAN_WITH_READS_OWN)
    result = fly_by_plan("reads.py", READING_SCRIPT, path)
    assert result.error is None and result.outcomes[0].passed, result.outcomes[0].said
    assert "tried to read Red at 0.05 s (sim.getObjectPosition)" in result.tried and not result.passed


def gained_nothing(result):
    """Return whether the goal criterion gave no points and every reported trouble is one printable line."""
    return (
        result.outcomes[0].points == 0 and not result.passed and all(printable(one) == one for one in result.troubles)
    )


def assert_nothing_found(result):
    assert gained_nothing(result) and result.error is None, result.error
    assert result.outcomes[1].passed, result.outcomes[1].said


def test_forbidden_calls_are_refused_reported_and_earn_no_points(fly, folder):
    calls = {what: f"found = refused(lambda: {call}, {said!r})" for what, (call, said) in RULES.items()}
    result = fly("breaks.py", python_script(calls, folder))
    assert_nothing_found(result)
    assert result.flown == pytest.approx(0.5)
    expected = {said for _, said in RULES.values()}
    assert all(" at 0.05 s (" in one and any(said in one for said in expected) for one in result.tried)
    assert all(any(said in one for one in result.tried) for said in expected)


def test_an_attempt_that_finds_something_appears_in_the_outcome(fly_without_sandbox, folder):
    result = fly_without_sandbox("finds.py", python_script({"a treasure": "found = 'gold'"}, folder))
    assert all(word in result.outcomes[1].said for word in ("a treasure", "gold")) and not result.passed


@pytest.mark.skipif(bool(sandbox_error()), reason=sandbox_error())
def test_searches_in_the_sandbox_find_nothing(fly, folder, monkeypatch):
    monkeypatch.setenv("COURSE_SECRET", "swordfish")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        assert_nothing_found(fly("searches.py", python_script(SEARCHES, folder, listener.getsockname()[1])))
    assert not (folder / "written").exists() and not Path("~/.attacked").expanduser().exists()


def test_without_a_sandbox_the_judge_is_still_out_of_reach(fly_without_sandbox, folder, monkeypatch):
    monkeypatch.setenv("COURSE_SECRET", "swordfish")
    assert_nothing_found(fly_without_sandbox("searches.py", python_script(JUDGE_SEARCHES, folder) + JUDGE_HELPERS))


@pytest.mark.parametrize("what", ENDINGS)
def test_a_submission_that_breaks_off_its_flight_gets_no_points(fly, folder, what):
    body, said = ENDINGS[what]
    if what == "a fork bomb" and sandbox_error():
        pytest.skip(sandbox_error())
    result = fly("ends.py", python_script({what: body}, folder), "impatient" if what in ENDLESS else "attacked")
    assert gained_nothing(result) and said in result.error
    assert fly("flies.py", python_script({}, folder)).error is None


@pytest.mark.parametrize("what", LEFTOVERS)
def test_a_submission_leaves_no_processes_and_no_output_behind(fly, folder, what, capfd):
    fly("flies.py", python_script({}, folder))
    before = descendants()
    result = fly("stays.py", python_script({what: LEFTOVERS[what]}, folder))
    assert gained_nothing(result) and result.error is None and result.flown == pytest.approx(0.5)
    assert capfd.readouterr() == ("", "")
    assert descendants() <= before


def descendants():
    """Return the ids of all descendants of this process."""
    children = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            parent = int(path.read_text().rpartition(")")[2].split()[1])
            children.setdefault(parent, []).append(int(path.parent.name))
    found, waiting = set(), [os.getpid()]
    while waiting:
        child_processes = children.get(waiting.pop(), [])
        found.update(child_processes)
        waiting += child_processes
    return found


@pytest.mark.parametrize("where", ["fly", "fly_without_sandbox"])
def test_system_calls_with_lasting_or_uncounted_effects_are_refused(where, folder, request):
    assert_nothing_found(request.getfixturevalue(where)("calls.py", python_script(SYSTEM_CALLS, folder)))


@pytest.mark.skipif(bool(sandbox_error()), reason=sandbox_error())
@pytest.mark.parametrize("what", EXCESSES)
def test_all_processes_of_a_submission_are_counted_together(fly, folder, what):
    body, said = EXCESSES[what]
    result = fly("takes.py", python_script({what: body}, folder))
    assert gained_nothing(result) and said in result.error


@pytest.mark.parametrize("what", LUA)
def test_attacks_in_lua_gain_nothing(fly, what):
    body, said = LUA[what]
    result = fly(
        "attacks.lua",
        f"""
        function sysCall_init() drone = sim.getObjectHandle('Drone') end
        function sysCall_sensing()
            local found
            pcall(function() {body} end)
            sim.setStringSignal('found', found and 'something' or 'nothing')
        end""",
    )
    assert gained_nothing(result) and result.error is None and result.outcomes[1].passed
    assert [said in one for one in result.tried] == ([True] if said else [])


# A scene whose scripts have more permissions than a submission, and submissions that try to make use of them.
SCENE = """
drone: {position: [0, 0, 1]}
objects:
  - {name: Lamp, kind: dummy}
  - {name: Post, kind: dummy}
  - {name: Goal, kind: dummy, position: [3, 0, 1]}
  - {name: Board, kind: dummy, position: [3, 0, 0]}
  - {name: Flag, kind: dummy, parent: Board}
  - {name: Box, shape: box, size: [0.2, 0.2, 0.2], position: [5, 0, 1]}
scripts:
  - {object: Lamp, script: lamp.lua}
  - {object: Post, script: post.py}
  - {object: Drone, customization: lamp.lua}
"""
POST = """
from helper import run as helper

def sysCall_init():
    sim.setIntegerSignal("score", 0)
    sim.writeCustomDataBlock(sim.getObject("/Post"), "key", "kept")
    sim.persistentDataWrite("key", "kept")
    simROS.setParamString("/rule", "kept")
    simROS.publish(simROS.advertise("/verdict", "std_msgs/Int32"), {"data": 0})
    self.tube = sim.tubeOpen(0, "secret", 1)
    self.crowd = sim.createCollection()
    sim.addItemToCollection(self.crowd, sim.handle_single, sim.getObject("/Box"), 0)

def sysCall_sensing():
    if sim.getStringSignal("asked"):
        sim.setStringSignal("answered", "yes")

def door(value):
    return 2 * value
"""
LAMP = "function shine(value) return value + 1 end function sysCall_actuation() end"
IN_SCENE = """
duration: 0.3
scene: scene.yaml
MORE
criteria:
  - {kind: reach, places: [Goal, Flag], within: 0.2}
  - {kind: signal, signal: found, equals: nothing}
  - {kind: signal, name: score, signal: score, equals: 0}
  - {kind: signal, name: verdict, topic: /verdict, equals: 0}
"""
SCENE_ATTACKS = {  # the call, and a part of the error message
    "the API of a Lua script": ("sim.callScriptFunction('simRemoveObject', lamp, box)", "call simRemoveObject of the"),
    "a phase": ("sim.callScriptFunction('sysCall_init', post)", "call sysCall_init of the script of Post"),
    "a phase at an object": ("sim.callScriptFunction('sysCall_cleanup@Lamp', 1)", "call sysCall_cleanup of the"),
    "a phase by attributes": ("sim.getScriptFunctions(lamp).sysCall_actuation()", "call sysCall_actuation of the"),
    "what a script imports": ("sim.callScriptFunction('helper', post, ['touch', 'x'])", "call helper of the script"),
    "a function that is not listed": ("sim.callScriptFunction('door', post, 3)", "call door of the script of Post"),
    "a text in Python": ("sim.executeScriptString('1 + 1', post)", "run a text in the script of Post"),
    "a text in Lua": ("sim.executeScriptString('return 1@Lamp', 1)", "run a text in the script of Lamp"),
    "a customization script": (
        "sim.callScriptFunction('shine', sim.getScript(sim.scripttype_customizationscript, drone), 1)",
        "call shine of the script of Drone",
    ),
    "its parameter": (
        "sim.setScriptSimulationParameter(sim.getScript(sim.scripttype_customizationscript, drone), 'x', 1)",
        "change",
    ),
    "a text in a customization script": (
        "sim.executeScriptString('return 1@/Quadcopter', sim.scripttype_customizationscript)",
        "run a text in the script of Drone",
    ),
    "its parameters": ("sim.setUserParameter(sim.getObject('/Post'), 'x', 1)", "change"),
    "a signal": ("sim.setIntegerSignal('score', 5)", "change the signal score"),
    "a signal of another kind": ("sim.setStringSignal('score', 'x')", "change the signal score"),
    "a signal, cleared": ("sim.clearIntegerSignal('score')", "change the signal score"),
    "all signals, cleared": ("sim.clearFloatSignal()", "change the signal score"),
    "custom data": ("sim.writeCustomDataBlock(sim.getObject('/Post'), 'key', 'x')", "customData.key of Post"),
    "a property": ("sim.setStringProperty(sim.getObject('/Post'), 'customData.key', 'x')", "customData.key of Post"),
    "persistent data": ("sim.persistentDataWrite('key', 'x')", "customData.key of the scene"),
    "a ROS parameter": ("simROS.setParamString('/rule', 'x')", "change the parameter /rule"),
    "a tube": ("sim.tubeWrite(1, 'x')", "change a tube of another script"),
    "a tube, closed": ("sim.tubeClose(1)", "change a tube of another script"),
    "a collection": ("sim.emptyCollection(sim.handle_all)", "change a collection of another script"),
    "a dummy": ("sim.setObjectPosition(sim.getObject('/Lamp'), -1, [3, 0, 1])", "move Lamp"),
    "the goal": ("sim.setObjectPosition(goal, -1, here())", "move Goal"),
    "the goal's parent": ("sim.setObjectParent(goal, drone, False)", "move Goal"),
    "the goal in a motion": ("sim.moveToPose({'object': goal, 'targetPose': here() + [0, 0, 0, 1]})", "move Goal"),
    "what the goal is on": ("sim.setObjectPosition(sim.getObject('/Board'), -1, here())", "move Flag"),
}
ALL_ALLOWED = "allowed: [move, push, change]"
NEVER_ALLOWED = {  # calls that no plan can allow
    **{what: one for what, one in SCENE_ATTACKS.items() if "call " in one[1] or "run " in one[1] or "the goal" in what},
    "the goal's name": ("sim.setObjectName(goal, 'Goal2')", "change Goal"),
    "the goal, removed": ("sim.removeObjects([box, goal])", "change Goal"),
    "the goal's copy": ("sim.removeObject(sim.getObject('/Board'))", "change Flag"),
    "a model": ("sim.loadModel('model.yaml')", "load a model"),
    "a port": ("simRemoteApi.start(19999)", "open a port"),
    "a path": ("simOMPL.createTask('t')", "plan a path in the judge's process"),
    "a file": ("sim.saveModel(box, 'mine.yaml')", "write Box"),
}
CALLING_SCRIPT = """
ATTEMPTS = {}
found = {}

def sysCall_init():
    global lamp, post, box, goal, drone
    box, goal, drone = (sim.getObject(one) for one in ("/Box", "/Goal", "/Quadcopter"))
    lamp, post = (sim.getScript(sim.scripttype_childscript, one) for one in ("/Lamp", "/Post"))

def here():
    return sim.getObjectPosition(drone, -1)

def sysCall_sensing():
    for what, (attempt, said) in ATTEMPTS.items():
        try:
            found.setdefault(what, repr(attempt()))
        except ValueError as error:
            if said not in str(error):
                found.setdefault(what, str(error))
    sim.setStringSignal("found", repr(found) if found else "nothing")
"""


def script_of_calls(attempts):
    """Return a script that makes the calls: {name: (call, a part of the expected error message)}."""
    return CALLING_SCRIPT + "".join(
        f"ATTEMPTS[{what!r}] = lambda: {call}, {said!r}\n" for what, (call, said) in attempts.items()
    )


@pytest.fixture(scope="module")
def fly_in_scene(fly_by_plan, tmp_path_factory):
    """Return a function that flies a submission in the scene with scripts, under a plan with `more` keys."""
    folder = tmp_path_factory.mktemp("scene")
    files = {"scene.yaml": SCENE, "post.py": POST, "lamp.lua": LAMP, "helper.py": "def run(*words): return words"}
    files["model.yaml"] = "objects: [{name: Loaded, kind: dummy}]"
    for name, text in files.items():
        (folder / name).write_text(text)

    def fly(script, more=""):
        (folder / "plan.yaml").write_text(IN_SCENE.replace("MORE", more))
        return fly_by_plan("tries.py", script, folder / "plan.yaml", seed=0)

    return fly


@pytest.mark.parametrize("half", [0, 1])  # a result lists at most MAX_TRIED calls
def test_a_submission_cannot_change_the_scene_s_objects_data_or_scripts(fly_in_scene, half):
    attempts = dict(list(SCENE_ATTACKS.items())[half::2])
    result = fly_in_scene(script_of_calls(attempts))
    assert result.error is None and not result.passed
    assert [one.passed for one in result.outcomes] == [False, True, True, True], result.outcomes
    assert are_all_recorded(result.tried, attempts)


def are_all_recorded(tried, attempts):
    """Return whether each attempt is in `tried`, and nothing else is."""
    texts = {text for _, text in attempts.values()}
    each_is_recorded = all(any(text in line for line in tried) for text in texts)
    return each_is_recorded and all(any(text in line for text in texts) for line in tried)


def test_no_plan_can_allow_calling_scene_scripts_or_moving_goals(fly_in_scene):
    result = fly_in_scene(script_of_calls(NEVER_ALLOWED), ALL_ALLOWED)
    assert result.error is None and result.outcomes[1].passed, result.outcomes
    assert are_all_recorded(result.tried, NEVER_ALLOWED)


def test_a_submission_cannot_publish_on_a_topic_of_the_scene(fly_in_scene):
    publish = "simROS.publish(simROS.advertise('/verdict', 'std_msgs/Int32'), {'data': 5})"
    result = fly_in_scene(script_of_calls({"a topic": (publish, "scripts of the scene publish on this topic")}))
    assert [one.passed for one in result.outcomes] == [False, True, True, True], result.outcomes


CALLS_OF_LISTED_FUNCTIONS = "(sim.callScriptFunction('door', post, 3), sim.callScriptFunction('shine@Lamp', 1, 1))"


def test_a_plan_lists_the_functions_that_a_submission_may_call(fly_in_scene):
    calls = "calls: [door, shine, helper]"
    result = fly_in_scene(script_of_calls({"listed": (CALLS_OF_LISTED_FUNCTIONS, "")}), calls)
    assert result.error is None and result.tried == (), result.error
    assert "(6, 2)" in result.outcomes[1].said
    imported = ("sim.callScriptFunction('helper', post, 'x')", "call helper of the script of Post")
    result = fly_in_scene(script_of_calls({"imported": imported}), calls)
    assert "tried to call helper of the script of Post" in result.tried[0] and result.outcomes[1].passed


SCRIPT_WITH_OWN_DATA = """
def sysCall_init():
    self.mark, self.drone = sim.createDummy(0.01), sim.getObject("/Quadcopter")
    self.tube, self.mine = sim.tubeOpen(0, "mine", 1), sim.createCollection()
    self.track = sim.getObjectHandle("Track_base")

def sysCall_sensing():
    sim.setStringSignal("asked", "yes")
    sim.setIntegerSignal("counted", 3)
    sim.clearIntegerSignal("counted")
    sim.writeCustomDataBlock(sim.getObject("/Box"), "mine", "x")
    sim.tubeWrite(self.tube, "x")
    sim.emptyCollection(self.mine)
    sim.setObjectPosition(self.mark, self.drone, [0, 0, 1])
    sim.setObjectPosition(self.track, -1, [0, 0, 1])
    sim.callScriptFunction("twice", sim.handle_self, 2)
    sim.executeScriptString("twice(2)", sim.handle_self)
    assert sim.readCustomDataBlock(sim.getObject("/Post"), "key") == "kept"
    if sim.getStringSignal("answered") == "yes":
        sim.setStringSignal("found", "nothing")

def twice(value):
    return 2 * value
"""


def test_a_submission_may_use_its_own_objects_data_and_functions(fly_in_scene):
    result = fly_in_scene(SCRIPT_WITH_OWN_DATA)
    assert result.error is None and result.tried == ()
    assert [one.passed for one in result.outcomes] == [False, True, True, True], result.outcomes


# The effect that a submission can have by each function of the API. Each new function must be entered here.
REACHES = {
    "nothing but answers": """
        sim: boolAnd32 boolOr32 boolXor32 getCollectionHandle getCollectionName getCollectionObjects
        getPersistentDataTags getProperty persistentDataRead
        readCustomDataBlock readCustomDataBlockTags readCustomTableData checkCollision
        checkDistance getObjectFloatParam getObjectFloatParameter getObjectInt32Param getObjectInt32Parameter
        getShapeInertia getShapeMass getShapeMassAndInertia isDynamicallyEnabled getJointForce getJointInterval
        getJointMatrix getJointMaxForce getJointMode getJointPosition getJointTargetForce getJointTargetPosition
        getJointTargetVelocity getJointType getJointVelocity getObjectChildPose alphaBetaGammaToYawPitchRoll
        buildIdentityMatrix buildMatrix buildMatrixQ copyMatrix getEulerAnglesFromMatrix getMatrixInverse
        getQuaternionFromMatrix getRotationAxis interpolateMatrices invertMatrix multiplyMatrices multiplyVector
        rotateAroundAxis yawPitchRollToAlphaBetaGamma getNameSuffix getObject getObjectAlias getObjectHandle
        getObjectName setNameSuffix getObjectChild getObjectType getObjectUid getObjects getObjectsInTree isHandle
        isHandleValid getObjectMatrix getObjectOrientation getObjectParent getObjectPose getObjectPosition
        getObjectQuaternion getObjectVelocity getVelocity packDoubleTable packFloatTable packInt32Table packTable
        packUInt16Table packUInt32Table packUInt8Table transformBuffer unpackDoubleTable unpackFloatTable
        unpackInt32Table unpackTable unpackUInt16Table unpackUInt32Table unpackUInt8Table getClosestPosOnPath
        getClosestPositionOnPath getDataOnPath getOrientationOnPath getPathInterpolatedConfig getPathLength
        getPathLengths getPathPosition getPositionOnPath resamplePath buildPose interpolatePoses invertPose
        matrixToPose multiplyPoses poseToMatrix checkProximitySensor checkProximitySensorEx handleProximitySensor
        readProximitySensor resetProximitySensor getCustomizationScriptAssociatedWithObject getScript
        getScriptAssociatedWithObject getScriptExecutionCount getScriptFunctions getScriptName
        getObjectAssociatedWithScript getScriptHandle getScriptSimulationParameter getUserParameter readForceSensor
        readSensor getShapeGeomInfo getObjectSizeFactor getObjectSizeValues getShapeBB getShapeColor getFloatSignal
        getInt32Signal getStringSignal getArrayParam getBoolParam getFloatParam getInt32Param getModuleName getRandom
        getSimulationState getSimulationStopping getSimulationTime getSimulationTimeStep getStringParam getSystemTime
        getSystemTimeInMs startSimulation copyTable tubeStatus checkVisionSensor checkVisionSensorEx
        getVisionSensorCharImage getVisionSensorDepth getVisionSensorDepthBuffer getVisionSensorImage
        getVisionSensorImg getVisionSensorResolution handleVisionSensor readVisionSensor receiveData
        simROS: getNumSubscribers getParamBool getParamDouble getParamInt getParamString getTime hasParam
        searchParam
        sim: getLinkDummy""",
    "its own log, drawings, windows, threads and pictures": """
        sim: addLog addStatusbarMessage auxiliaryConsoleClose auxiliaryConsoleOpen auxiliaryConsolePrint
        auxiliaryConsoleShow displayDialog endDialog getDialogInput getDialogResult addDrawingObject
        addDrawingObjectItem removeDrawingObject addGraphStream destroyGraphCurve resetGraph setGraphStreamValue
        setGraphUserData acquireLock delegateChildScriptExecution getThreadAutomaticSwitch getThreadExitRequest
        getThreadId releaseLock setStepping setThreadAutomaticSwitch setThreadResumeLocation setThreadSwitchTiming
        step switchThread wait waitForSignal ruckigPos ruckigRemove ruckigStep ruckigVel adjustView floatingViewAdd
        floatingViewRemove createDummy createPath stopSimulation sendData createCollection tubeOpen
        simROS: advertise advertiseService call imageTransportAdvertise imageTransportPublish
        imageTransportShutdownPublisher publish publisherTreatUInt8ArrayAsString sendTransform sendTransforms
        serviceClient serviceClientTreatUInt8ArrayAsString serviceServerTreatUInt8ArrayAsString shutdownPublisher
        shutdownServiceClient shutdownServiceServer shutdownSubscriber subscribe subscriberTreatUInt8ArrayAsString
        simVision: addBuffer1ToWorkImg addWorkImgToBuffer1 binaryWorkImg blobDetectionOnWorkImg buffer1ToWorkImg
        buffer2ToWorkImg changedPixelsOnWorkImg coordinatesFromWorkImg edgeDetectionOnWorkImg horizontalFlipWorkImg
        intensityScaleOnWorkImg multiplyWorkImgWithBuffer1 normalizeWorkImg selectiveColorOnWorkImg
        sensorDepthMapToWorkImg sensorImgToWorkImg subtractBuffer1FromWorkImg subtractWorkImgFromBuffer1 swapBuffers
        swapWorkImgWithBuffer1 uniformImgToWorkImg verticalFlipWorkImg workImgToBuffer1 workImgToBuffer2
        workImgToSensorImg""",
    "values that the scene's scripts have not set": """
        sim: addItemToCollection addObjectToCollection destroyCollection emptyCollection persistentDataWrite
        removeProperty setProperty writeCustomDataBlock writeCustomTableData clearFloatSignal clearInt32Signal
        clearStringSignal setFloatSignal setInt32Signal setStringSignal tubeClose tubeRead tubeWrite
        simROS: deleteParam setParamBool setParamDouble setParamInt setParamString""",
    "its own parameters": "sim: setScriptSimulationParameter setUserParameter",
    "its own blades": "sim: setJointPosition",
    "its own frames": """
        sim: moveToConfig moveToConfig_cleanup moveToConfig_init moveToConfig_step moveToPose moveToPose_init
        setObjectMatrix setObjectOrientation setObjectParent setObjectPose setObjectPosition setObjectQuaternion
        followPath moveToObject moveToPosition rmlMoveToPosition""",
    "move": """
        sim: resetDynamicObject setJointForce setJointInterval setJointMode setJointTargetForce
        setJointTargetPosition setJointTargetVelocity setSphericalJointMatrix moveToJointPositions
        rmlMoveToJointPositions setPathPosition""",
    "push": "sim: addForce addForceAndTorque",
    "change": """
        sim: setObjectFloatParam setObjectInt32Param cutPathCtrlPoints insertPathCtrlPoints copyPasteObjects
        createForceSensor createJoint createMeshShape createPrimitiveShape createProximitySensor createPureShape
        createVisionSensor removeModel removeObject removeObjects setObjectAlias setObjectName setShapeInertia
        setShapeMassAndInertia groupShapes scaleObject scaleObjects setShapeBB setShapeColor setShapeMass ungroupShape
        setLinkDummy
        pauseSimulation setArrayParam setBoolParam setFloatParam setInt32Param setSimulationTimeStep setStringParam""",
    "call": "sim: callScriptFunction",
    "run": "sim: executeScriptString",
    "load": "sim: loadModel",
    "write": "sim: saveModel",
    "open": """
        sim: extRemoteApiReset extRemoteApiStart extRemoteApiStatus extRemoteApiStop
        simRemoteApi: reset start status stop""",
    "plan": """
        simOMPL: addGoalState compute createStateSpace createStateSpaceForJoint createTask destroyStateSpace destroyTask
        drawPath printTaskInfo removeDrawingObjects getPath getPathState getPathStateCount getStateSpaceDimension
        hasApproximateSolution hasExactSolution interpolatePath isStateValid isStateWithinBounds readState setAlgorithm
        setCollisionPairs setDubinsParams setGoalState setGoalStates setStartState setStateSpace setStateSpaceForJoints
        setStateValidationCallback setStateValidityCheckingResolution setVerboseLevel setup simplifyPath solve
        writeState""",
}


def reached_functions():
    """Yield (module.name, effect) of each function in REACHES."""
    for reached, text in REACHES.items():
        module = ""
        for word in text.split():
            module = word if word.endswith(":") else module
            if word != module:
                yield f"{module[:-1]}.{word}", reached


def test_every_api_function_is_entered_in_reaches_and_checked_as_entered(new_simulation):
    found = {}

    def note(path, modules, *others):
        found.update({f"{name}.{key}": one for name, api in modules.items() for key, one in contents(api)[1].items()})
        return load.load(path, modules, *others)

    simulation = new_simulation(load_script=note)
    drone = simulation.drone
    actions = permissions.Actions(simulation, [drone], {drone.object_name})
    values = SceneValues(simulation, set())
    members = {
        "values that the scene's scripts have not set": {*values.checks},
        "its own parameters": {"sim.setScriptSimulationParameter", "sim.setUserParameter"},
        "its own blades": {"sim.setJointPosition"},
    }
    ignored = {f"{name}.{key}" for name, groups in MODULES.items() for one in groups for key in one.functions}
    reached = dict(reached_functions())
    assert len(reached) == sum(1 for _ in reached_functions())
    for name, function in found.items():
        if name in ignored:
            continue  # it does nothing
        own = f"{name.partition('.')[0]}.{function.__name__}"
        assert own in reached, f"{own}: enter in REACHES the effect that a submission can have by it"
        what, needs = reached[own], actions.action_of(name, [])
        assert (name in values.checks) == (own in members["values that the scene's scripts have not set"])
        if what in ("move", "push", "change", "call", "run", "load", "write", "open", "plan"):
            assert needs == what, name
        elif what == "its own frames":
            assert actions.action_of(name, [simulation.context.objects.handle_of(drone.object)]) in ("move", None), name
            assert name not in permissions.free_functions(), name
        elif what in members:
            assert own in members[what] and (name in permissions.free_functions()) == (name in values.checks), name
        else:
            assert needs is None and name not in values.checks, name
    assert {*reached} <= {*found}
