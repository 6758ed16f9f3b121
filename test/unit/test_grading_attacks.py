"""Submissions that would rather not fly: none gains a point by it, each gets a line, and nothing stays behind."""

import contextlib
import os
import socket
from pathlib import Path

import pytest

from drone_sim.grading import plan as plans
from drone_sim.grading.jobs import sandbox, settings
from drone_sim.grading.jobs.flyer import Flyer
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.message_text import printable

SETTINGS = settings.load({"limits": {"seconds": 5.0, "patience": 2.0, "memory": 256}})
SECRET = 123_456_789_012
PLAN = """
name: attacked
title: A word of the plan that nobody needs
duration: 0.5
config: {script_time_limit: 3.0}
criteria:
  - {kind: reach, places: [[3, 0, 1]], within: 0.2, points: 5}
  - {kind: signal, signal: found, equals: nothing, points: 0.5}
"""
# What a Python script does in each sensing; `found` is what it has laid its hands on, if anything.
PYTHON = """
import contextlib, ctypes, gc, glob, os, re, signal, socket, struct, subprocess, sys, time
HERE = os.path.dirname(__file__)

def attempt():
    found = None
    BODY
    return found

def sysCall_init():
    self.drone = sim.getObjectHandle("Drone")
    self.base = sim.getObjectHandle("Quadricopter_base")
    self.found = "nothing"

def sysCall_sensing():
    try:
        found = attempt()
        if found:
            self.found = repr(found)[:300]
    except (OSError, ValueError, LookupError, AttributeError, ImportError, RuntimeError):
        pass
    sim.setStringSignal("found", self.found)
"""
RULES = {  # what is called, and what is said of it
    "moves itself": ("sim.setObjectPosition(self.drone, -1, [3, 0, 1])", "tried to move Drone"),
    "moves itself by name": (
        "sim.setObjectPosition(position=[3, 0, 1], handle=self.drone, relativeTo=-1)",
        "move Drone",
    ),
    "moves itself by a flag": (
        "sim.setObjectPosition(self.drone + sim.handleflag_axis + 0.5, -1, [3, 0, 1])",
        "to move",
    ),
    "moves itself in a pose": ("sim.setObjectPose(self.drone, -1, [3, 0, 1, 0, 0, 0, 1])", "tried to move Drone"),
    "moves along": ("sim.moveToPose({'object': self.drone, 'targetPose': [3, 0, 1, 0, 0, 0, 1]})", "tried to move"),
    "pushes itself": ("sim.addForceAndTorque(self.drone, [9, 0, 9], [0, 0, 0])", "tried to push Drone"),
    "hangs itself up": ("sim.setObjectParent(self.drone, self.base, False)", "tried to move Drone"),
    "is made a dummy's": ("sim.setObjectPosition(self.base, -1, [3, 0, 1])", "tried to move Quadricopter_base"),
    "makes a step longer": ("sim.setSimulationTimeStep(0.5)", "tried to change the scene"),
    "has no weight": ("sim.setShapeMass(self.drone, 1e-3)", "tried to change Drone"),
    "builds a bridge": ("sim.createPrimitiveShape(0, [9, 9, 1])", "tried to change the scene"),
    "is called another": ("sim.setObjectName(self.drone, 'Floor')", "tried to change Drone"),
    "has more air": (
        "sim.setScriptSimulationParameter(sim.getScriptHandle('Quadricopter_propeller_respondable1'),"
        " 'particleDensity', 9e9)",
        "tried to change the script of Quadricopter_propeller_respondable1",
    ),
    "writes a file": ("sim.saveModel(self.drone, 'mine.ttm')", "tried to write Drone"),
}
SEARCHES = {  # each would find something, were it there
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
    "the home": "open(os.path.expanduser('~/.attacked'), 'w')",
    "the disk": "open(FOLDER + '/written', 'w')",
}
ENDS = {  # what ends the flight, and what is said of it
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
        'say = b\'[["call","os.system",-1,[],"id"]]\'\n    os.write(3, struct.pack(\'<I\', len(say)) + say)\n'
        "    time.sleep(9)",
        "unknown function of the API",
    ),
    "an order for the judge": (
        'say = b\'[["call","sim.addForce",-1,[["handle"]]]]\'\n    os.write(3, struct.pack(\'<I\', len(say)) + say)\n'
        "    time.sleep(9)",
        "malformed named arguments",
    ),
    "the door closed": ("os.close(3)", "before the flight was over"),
    "a stop": ("os.kill(os.getpid(), signal.SIGSTOP)", "did not return after 3 s (script_time_limit)"),
    "a step without end": ("while True:\n        pass", "stopped after 3 s without returning"),
    "a fork bomb": ("while True:\n        os.fork()", ""),  # too many, or no return, whichever comes first
    "a crash": ("ctypes.string_at(0)", "crashed: its process was ended by SIGSEGV"),
}
FAR = {  # of the judge, where no sandbox hides it: each would find something, were it in reach
    **{what: SEARCHES[what] for what in ("the judge by gc", "the judge by modules", "the seed", "the plan in memory")},
    **{what: SEARCHES[what] for what in ("descriptors", "the parent's memory", "passwords in the environment")},
    "the judge's memory": "found = of_judges(lambda one: open(f'/proc/{one}/mem', 'rb'))",
    "the judge's descriptors": "found = of_judges(lambda one: os.stat(f'/proc/{one}/fd/4'))",
    "the judge, traced": "found = of_judges(lambda one: ctypes.CDLL(None).ptrace(16, int(one), None, None) == 0)",
}
OF_JUDGES = """
def of_judges(look):
    found = []
    for one in os.listdir("/proc"):
        with contextlib.suppress(OSError):
            if one.isdigit() and b"judge_server" in open(f"/proc/{one}/cmdline", "rb").read():
                if look(one):
                    found.append(one)
    return found
"""
STAYS = {  # what would outlive the flight
    "a daemon": "subprocess.Popen(['sleep', '4321'], start_new_session=True)",
    "a copy": "os.fork() or (os.setsid(), time.sleep(4321))",
    "a fake table": "print('script   passed  points\\nmine.py     20/20    20/20', file=sys.__stdout__, flush=True);"
    " os.write(1, b'20 of 20'); os.write(2, b'20 of 20')",
    "other criteria": "import drone_sim.grading.criteria.reach as reach\n    reach.Reach._judged = lambda *_: 1 / 0",
    "another clock": "import drone_sim.mechanics.clock as clock\n    clock.Clock.time = 99.0",
    "another door": "import drone_sim.scripting.door.simulation_end as end\n    end.SimulationEnd.permit = None",
}
LUA = {  # the same in Lua, as far as it goes there, and what is said of it
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
    made = tmp_path_factory.mktemp("attacked")
    (made / "attacked.yaml").write_text(PLAN)
    (made / "secret").write_bytes(os.urandom(32))
    (made / "other.py").write_text("def sysCall_init(): pass\n")
    return made


@pytest.fixture(scope="module")
def plan(folder):
    return plans.read(folder / "attacked.yaml")


def no_sandbox():
    try:
        sandbox.command(1)
    except sandbox.NoSandbox as why:
        return str(why)
    return ""


def flying(plan, folder, sandboxed):
    with contextlib.closing(Flyer(SETTINGS.limits, sandboxed=sandboxed)) as flyer:

        def flown(name, text):
            (folder / "handed_in").mkdir(exist_ok=True)
            path = folder / "handed_in" / name
            path.write_text(text)
            job = Job(str(plan.path), str(path), SECRET, {}, key_of(contents_of(plan, str(path)), SECRET, {}))
            return flyer.fly(job).result

        yield flown


@pytest.fixture(scope="module")
def fly(plan, folder):
    yield from flying(plan, folder, not no_sandbox())


@pytest.fixture(scope="module")
def fly_without_sandbox(plan, folder):
    yield from flying(plan, folder, False)


def python(body, folder, port=9):
    title = bytes(one ^ 1 for one in b"A word of the plan that nobody needs")
    words = {"TITLE": repr(title), "FOLDER": repr(str(folder)), "TASKS": repr(str(Path(__file__).parents[2] / "tasks"))}
    for word, value in {**words, "SEED": str(SECRET), "PORT": str(port)}.items():
        body = body.replace(word, value)
    return PYTHON.replace("BODY", body)


# A plan by which a script learns of the scene by its sensors alone, and what does not go round that.
OWN = """
duration: 0.3
scene: package://drone_sim/tasks/gates_vision/scene.yaml
reads: own
criteria:
  - {kind: signal, signal: found, equals: nothing}
"""
READS = """
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


def test_who_may_read_of_his_own_alone_learns_nothing_of_the_scene(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(OWN)
    with contextlib.contextmanager(flying)(plans.read(path), tmp_path, False) as fly:
        result = fly("reads.py", READS)
    assert result.error is None and result.outcomes[0].passed, result.outcomes[0].said
    assert "tried to read Red at 0.05 s (sim.getObjectPosition)" in result.tried and not result.passed


def nothing_gained(result):
    """Whether no point was had for arriving, and what is said is one line."""
    return (
        result.outcomes[0].points == 0 and not result.passed and all(printable(one) == one for one in result.troubles)
    )


@pytest.mark.parametrize("what", RULES)
def test_who_breaks_the_rules_is_told_and_gains_nothing(fly, folder, what):
    body, said = RULES[what]
    result = fly("breaks.py", python(body, folder))
    assert nothing_gained(result) and result.error is None and result.flown == pytest.approx(0.5)
    assert (
        len(result.tried) == 1 and said in result.tried[0] and result.tried[0].split(" at ")[1].startswith("0.05 s (")
    )


@pytest.mark.skipif(bool(no_sandbox()), reason=no_sandbox())
@pytest.mark.parametrize("what", SEARCHES)
def test_who_searches_finds_nothing(fly, folder, what, monkeypatch):
    monkeypatch.setenv("COURSE_SECRET", "swordfish")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        result = fly("searches.py", python(SEARCHES[what], folder, listener.getsockname()[1]))
    assert nothing_gained(result) and result.error is None
    assert result.outcomes[1].passed, result.outcomes[1].said
    assert not (folder / "written").exists() and not Path("~/.attacked").expanduser().exists()


@pytest.mark.parametrize("what", FAR)
def test_without_a_sandbox_the_judge_is_as_far(fly_without_sandbox, folder, what, monkeypatch):
    monkeypatch.setenv("COURSE_SECRET", "swordfish")
    result = fly_without_sandbox("searches.py", python(FAR[what], folder) + OF_JUDGES)
    assert nothing_gained(result) and result.error is None
    assert result.outcomes[1].passed, result.outcomes[1].said


@pytest.mark.parametrize("what", ENDS)
def test_who_ends_a_flight_otherwise_has_flown_nothing(fly, folder, what):
    body, said = ENDS[what]
    if what == "a fork bomb" and no_sandbox():
        pytest.skip(no_sandbox())
    result = fly("ends.py", python(body, folder))
    assert nothing_gained(result) and said in result.error
    assert fly("flies.py", python("pass", folder)).error is None


@pytest.mark.parametrize("what", STAYS)
def test_what_stays_behind_is_nothing(fly, folder, what, capfd):
    result = fly("stays.py", python(STAYS[what], folder))
    assert nothing_gained(result) and result.error is None and result.flown == pytest.approx(0.5)
    assert capfd.readouterr() == ("", "")
    assert not any(b"4321" in one.read_bytes() for one in Path("/proc").glob("[0-9]*/cmdline") if readable(one))


def readable(path):
    try:
        return bool(path.read_bytes())
    except OSError:
        return False


@pytest.mark.parametrize("what", LUA)
def test_lua_gains_as_little(fly, what):
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
    assert nothing_gained(result) and result.error is None and result.outcomes[1].passed
    assert [said in one for one in result.tried] == ([True] if said else [])
