"""simOMPL: paths around obstacles in Lua and Python, planned without any effect on the flight."""

import threading

import pytest

pytest.importorskip("ompl")

from remote_client import official_client

from drone_sim.remote.standalone import play
from drone_sim.run import parameters
from drone_sim.scripting.api.packing import Packing

WALL = {"name": "Wall", "shape": "box", "size": [0.1, 2.0, 4.0], "position": [0.0, 0.0, 2.0]}
PROBE = {"name": "Probe", "shape": "box", "size": [0.2, 0.2, 0.2], "position": [-1.0, 0.0, 1.0]}
BALL = {"name": "Ball", "shape": "sphere", "size": [0.1], "position": [-1.0, 0.5, 1.5], "mass": 0.5}
SLIDE = {"name": "Slide", "kind": "joint", "type": "prismatic", "limits": [-1.0, 1.0], "position": [3.0, 0.0, 1.0]}
SCENE = {"objects": [WALL, PROBE, BALL, SLIDE, {"name": "Way", "kind": "dummy"}]}

LUA = """
function sysCall_init()
    local robot = sim.getObject('/ROBOT')
    local task = simOMPL.createTask('around')
    local space = simOMPL.createStateSpace('p', simOMPL.StateSpaceType.KIND, robot, {-2, -2, -1}, {2, 2, 2}, 1)
    simOMPL.setStateSpace(task, {space})
    simOMPL.setAlgorithm(task, simOMPL.Algorithm.RRTConnect)
    simOMPL.setCollisionPairs(task, {robot, sim.getObject("/Wall")})
    local start = simOMPL.readState(task)
    local goal = {table.unpack(start)}
    goal[1] = 1
    simOMPL.setStartState(task, start)
    simOMPL.setGoalState(task, goal)
    simOMPL.setup(task)
    local solved, path = simOMPL.compute(task, 10, -1, 60)
    sim.setStringSignal('path', sim.packTable({solved, path, simOMPL.hasExactSolution(task)}))
    simOMPL.destroyTask(task)
end
function sysCall_actuation() end
"""
PYTHON = """
def sysCall_init():
    simOMPL = require("simOMPL")
    robot = sim.getObject("/Probe")
    task = simOMPL.createTask("around")
    space = simOMPL.createStateSpace("p", simOMPL.StateSpaceType.pose2d, robot, [-2, -2], [2, 2], 1)
    simOMPL.setStateSpace(task, [space])
    simOMPL.setAlgorithm(task, simOMPL.Algorithm.KPIECE1)
    simOMPL.setStateValidationCallback(task, is_free)
    simOMPL.setStartState(task, [-1, 0, 0])
    simOMPL.setGoalState(task, [1, 0, 1])
    self.checks = 0
    solved, path = simOMPL.compute(task, 5, -1, 40)
    states = [simOMPL.getPathState(task, path, index + 1) for index in range(simOMPL.getPathStateCount(task, path))]
    sim.setStringSignal("path", sim.packTable([solved, sum(states, []), self.checks > 0]))

def is_free(state):
    self.checks += 1
    return abs(state[0]) > 0.3 or abs(state[1]) > 1.2

def sysCall_actuation():
    pass
"""
V_REP_3 = """
if sim_call_type == sim_childscriptcall_initialization then
    local probe = simGetObjectHandle('Probe')
    local t = simExtOMPL_createTask('t')
    local space = simExtOMPL_createStateSpace('2d', sim_ompl_statespacetype_pose2d, probe, {-2, -2}, {2, 2}, 1)
    simExtOMPL_setStateSpace(t, {space})
    simExtOMPL_setAlgorithm(t, sim_ompl_algorithm_BiTRRT)
    simExtOMPL_setCollisionPairs(t, {probe, simGetObjectHandle('Wall')})
    simExtOMPL_setStartState(t, {-1, 0, 0})
    simExtOMPL_setGoalState(t, {1, 0, 0})
    local r, path = simExtOMPL_compute(t, 4, -1, 20)
    if r > 0 then simSetStringSignal('path', simPackTable({r == 1, path, true})) end
end
"""


@pytest.fixture(name="fly")
def _fly(tmp_path, new_simulation):
    """Return a function that runs some steps with a script on the dummy and returns the simulation."""

    def fly(text, steps=3, **overrides):
        path = tmp_path / ("own.py" if "def sysCall" in text else "own.lua")
        path.write_text(text)
        scripts = [{"object": "Way", "script": str(path)}] if text else []
        settings = {"drone": {"position": [-1.0, 0.0, 0.5]}, "scene": {**SCENE, "scripts": scripts}, **overrides}
        simulation = new_simulation(settings)
        for _ in range(steps):
            simulation.step()
        return simulation

    return fly


def planned(simulation, size):
    """Return whether a path was found, its states, and the third value that the script stored."""
    solved, path, third_value = Packing().unpackTable(simulation.context.signals.get(str, "path"))
    return solved, [path[index : index + size] for index in range(0, len(path), size)], third_value


def crosses(states):
    """Return whether a path goes through the wall."""
    return any(abs(x) < 0.14 and abs(y) < 1.09 for x, y, *_ in states)


@pytest.mark.parametrize(
    ("robot", "kind", "size"), [("Probe", "position3d", 3), ("Ball", "pose3d", 7), ("Quadcopter", "pose3d", 7)]
)
def test_planning_finds_a_path_around_the_wall_and_changes_no_state(fly, robot, kind, size):
    text = LUA.replace("ROBOT", robot).replace("KIND", kind)
    if robot != "Probe":
        text = text.replace("sysCall_init", "plan").replace(
            "sysCall_actuation() end", "sysCall_actuation() if not done then done = true plan() end end"
        )
    simulation, plain = fly(text, 60), fly("", 60)
    solved, states, exact = planned(simulation, size)
    assert solved and exact and len(states) >= 60 and not crosses(states)
    assert states[-1][0] == pytest.approx(1)
    for name in ("Probe", "Ball", "Wall"):
        assert simulation.context.objects.named(name).matrix() == plain.context.objects.named(name).matrix(), name
    assert simulation.drone.body.state == plain.drone.body.state
    assert simulation.drone.body.teleports == plain.drone.body.teleports


def test_a_python_callback_decides_which_states_are_valid(fly):
    solved, states, was_called = planned(fly(PYTHON), 3)
    assert solved and was_called and not crosses(states) and states[-1] == pytest.approx([1, 0, 1])


THREADS = {
    "python": """
def is_free(state):
    self.times.add(sim.getSimulationTime())
    saved = simOMPL.readState(self.task)
    simOMPL.writeState(self.task, state)
    hit, _ = sim.checkCollision(self.probe, sim.getObject("/Wall"))
    simOMPL.writeState(self.task, saved)
    return not hit

def sysCall_thread():
    self.times, self.probe, self.task = set(), sim.getObject("/Probe"), simOMPL.createTask("t")
    space = simOMPL.createStateSpace("p", 50003, self.probe, [-2, -2, 0], [2, 2, 2])
    simOMPL.setStateSpace(self.task, [space])
    simOMPL.setStateValidationCallback(self.task, is_free)
    simOMPL.setStartState(self.task, [-1, 0, 1])
    simOMPL.setGoalState(self.task, [1, 0, 1])
    solved, path = simOMPL.compute(self.task, 5, 0.1, 30)
    sim.setStringSignal("path", sim.packTable([solved, path, len(self.times)]))
""",
    "lua": """
function sysCall_thread()
    probe, task = sim.getObject('/Probe'), simOMPL.createTask('t')
    simOMPL.setStateSpace(task, {simOMPL.createStateSpace('p', 50003, probe, {-2, -2, 0}, {2, 2, 2})})
    local times, different = {}, 0
    simOMPL.setStateValidationCallback(task, function(state)
        local time = sim.getSimulationTime()
        if not times[time] then times[time], different = true, different + 1 end
        local saved = simOMPL.readState(task)
        simOMPL.writeState(task, state)
        local hit = sim.checkCollision(probe, sim.getObject('/Wall'))
        simOMPL.writeState(task, saved)
        return hit == 0
    end)
    simOMPL.setStartState(task, {-1, 0, 1})
    simOMPL.setGoalState(task, {1, 0, 1})
    local solved, path = simOMPL.compute(task, 5, 0.1, 30)
    sim.setStringSignal('path', sim.packTable({solved, path, different}))
end
""",
}


@pytest.mark.parametrize("language", THREADS)
def test_a_thread_is_not_switched_while_its_callback_checks_states(fly, language):
    solved, states, different_times = planned(fly(THREADS[language], 20), 3)
    assert solved and not crosses(states) and different_times == 1


def test_names_and_constants_of_v_rep_3_are_supported(fly, caplog):
    solved, states, _ = planned(fly(V_REP_3), 3)
    assert solved and not crosses(states)
    assert "simExtOMPL_setAlgorithm: the package ompl has no BiTRRT, RRTConnect plans instead" in caplog.text


def test_a_path_is_the_same_in_every_run(fly):
    text = LUA.replace("ROBOT", "Probe").replace("KIND", "position3d")
    assert planned(fly(text), 3) == planned(fly(text), 3)


JOINT = """
def sysCall_init():
    slide, dummy = sim.getObject("/Slide"), sim.getObject("/Way")
    task = simOMPL.createTask("t")
    both = [simOMPL.createStateSpaceForJoint("j", slide), simOMPL.createStateSpace("p", 50001, dummy, [-2, -2], [2, 2])]
    simOMPL.setStateSpace(task, both)
    simOMPL.setStateValidationCallback(task, lambda state: state[1] < 1)
    simOMPL.setStartState(task, simOMPL.readState(task))
    simOMPL.setGoalState(task, [0.6, 0.5, 0.5])
    simOMPL.addGoalState(task, [0.6, 0.7, 0.5])
    simOMPL.setAlgorithm(task, simOMPL.Algorithm.ALGORITHM)
    simOMPL.setup(task)
    solved = simOMPL.solve(task, 1)
    simOMPL.simplifyPath(task)
    simOMPL.interpolatePath(task, 10)
    path = simOMPL.getPath(task)
    simOMPL.writeState(task, simOMPL.getPathState(task, path, -1))
    sim.setStringSignal("path", sim.packTable([solved, path, sim.getJointPosition(slide)]))

def sysCall_actuation(): pass
"""


@pytest.mark.parametrize("algorithm", ["RRT", "KPIECE1", "RRTstar"])
def test_joints_and_objects_together_reach_one_of_two_goals(fly, algorithm):
    solved, states, reached = planned(fly(JOINT.replace("ALGORITHM", algorithm)), 3)
    assert solved and len(states) == 10 and reached == pytest.approx(0.6)


CALLS = """
def sysCall_init():
    probe, task = sim.getObject("/Probe"), simOMPL.createTask("t")
    space = simOMPL.createStateSpace("p", 50003, probe, [-2, -2, 0], [2, 2, 2])
    simOMPL.setStateSpace(task, [space])
    simOMPL.setStartState(task, [-1, 0, 1])
    simOMPL.setGoalState(task, [1, 0, 1])
    CALL

def is_free(state):
    BODY

def sysCall_actuation(): pass
"""


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("simOMPL.setAlgorithm(task, 3)", "expected a simOMPL.Algorithm"),
        ("simOMPL.solve(7, 1)", "there is no task with the handle 7"),
        ("simOMPL.setStartState(task, [1, 2])", "3 numbers are expected, not 2"),
        ("simOMPL.setGoalState(simOMPL.createTask('u'), [1, 2])", "task 'u' has no state space"),
        ("simOMPL.createStateSpace('q', 50001, probe, [1, 1], [1, 2])", "state space 'q': each lower bound must be"),
        ("simOMPL.createStateSpace('q', 50005, probe, [1], [2])", "'Probe' cannot be moved by a state space of type"),
        ("simOMPL.setStateSpace(task, [9])", "there is no state space with the handle 9"),
        ("simOMPL.getPath(task)", "there is no path yet"),
        ("simOMPL.setStateValidityCheckingResolution(task, 0)", "resolution must be from"),
        ("simOMPL.interpolatePath(task, 10**9)", "a path has at most"),
        ("simOMPL.solve(task, float('nan'))", "finite numbers are expected"),
        ("simOMPL.solve(task, 1e9)", "a search for 1e+09 s: must take more than 0 and at most 600 s"),
        ("simOMPL.solvE(task)", "simOMPL has no 'solvE'; near names are solve"),
        ("simOMPL.setStateValidationCallback(task, 'nothing'); simOMPL.solve(task, 60)", "no function 'nothing'"),
        ("simOMPL.setStateValidationCallback(task, is_free); simOMPL.solve(task, 60)", "division by zero"),
        ("simOMPL.setAlgorithm(task, 30014); simOMPL.setStateValidationCallback(task, is_free); simOMPL.setup(task)",
         "PRM cannot call a function of the script"),
    ],
)  # fmt: skip
def test_the_error_of_a_wrong_call_is_logged(fly, caplog, call, said):
    fly(CALLS.replace("CALL", call).replace("BODY", "1 / 0"))
    assert said in caplog.text


@pytest.mark.parametrize("algorithm", [30007, 30016, 30018])
def test_a_hanging_validation_callback_is_stopped(fly, caplog, algorithm):
    call = f"simOMPL.setAlgorithm(task, {algorithm}); simOMPL.setStateValidationCallback(task, is_free)"
    call += "; simOMPL.solve(task, 60)"
    simulation = fly(CALLS.replace("CALL", call).replace("BODY", "while True: pass"), script_time_limit=0.2)
    assert "stopped after 0.2 s without returning" in caplog.text
    assert simulation.context.objects.named("Probe").matrix()[3] == -1


def test_a_remote_client_plans_through_coppeliasims_client_library():
    finished, listening, ports = threading.Event(), threading.Event(), []

    def serve():
        values = {"real_time_factor": 0, "remote_api": {"serve": True, "port": 0}, "scene": SCENE}
        play(parameters.load(values), finished.is_set, lambda server: (ports.append(server.port), listening.set()))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        assert listening.wait(60)
        client = official_client(ports[0])
        sim, planner = client.require("sim"), client.require("simOMPL")
        probe, task = sim.getObject("/Probe"), planner.createTask("t")
        space = planner.createStateSpace("p", planner.StateSpaceType.position3d, probe, [-2, -2, 0], [2, 2, 3])
        planner.setStateSpace(task, [space])
        planner.setAlgorithm(task, planner.Algorithm.RRTConnect)
        planner.setCollisionPairs(task, [probe, sim.handle_all])
        planner.setStartState(task, planner.readState(task))
        planner.setGoalState(task, [1, 0, 1])
        solved, path = planner.compute(task, 10, -1, 60)
        assert solved and not crosses([path[index : index + 3] for index in range(0, len(path), 3)])
        planner.setStateValidationCallback(task, lambda state: True)
        with pytest.raises(Exception, match="a remote client has no functions that simOMPL can call"):
            planner.solve(task, 60)
    finally:
        finished.set()
        thread.join()
