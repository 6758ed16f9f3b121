"""Motions with limited velocity, acceleration and jerk: closed forms, and the API names of all V-REP generations."""

import itertools
import math
import random

import pytest
from pytest import approx

from drone_sim.mechanics import frames
from drone_sim.mechanics.trajectory import NONE, PHASE, TIME, Limits, State, Trajectory
from drone_sim.scripting.errors import ScriptError

STEP = 0.05
SCENE = {
    "objects": [
        {"name": "Hinge", "kind": "joint", "type": "revolute"},
        {"name": "Lift", "kind": "joint", "type": "prismatic", "limits": [0, 2]},
        {"name": "Ball", "kind": "joint", "type": "spherical"},
        {"name": "Box", "kind": "dummy"},
        {"name": "Line", "kind": "path", "points": [[0, 0, 0], [2, 0, 0], [2, 1, 0]]},
        # a weight on a motor that the dynamics drives
        {"name": "Motor", "kind": "joint", "type": "prismatic", "mode": "position", "limits": [0, 2], "max_force": 100,
         "position": [8, 0, 1]},
        {"name": "Weight", "shape": "box", "size": [0.2, 0.2, 0.2], "mass": 1, "parent": "Motor",
         "position": [0, 0, 0]},
    ]
}  # fmt: skip


def minimum_duration(way, velocity, acceleration, jerk):
    """Return the minimum duration of a motion from rest to rest that reaches its velocity and acceleration limits."""
    assert velocity * jerk >= acceleration**2 and way >= velocity * (velocity / acceleration + acceleration / jerk)
    return way / velocity + velocity / acceleration + acceleration / jerk


def trajectory(way=1.0, velocity=1.0, acceleration=2.0, jerk=10.0, **more):
    start = State([0.0], [0.0], [0.0])
    return Trajectory(start, [way], [0.0], Limits([velocity], [acceleration], [jerk]), **more)


@pytest.mark.parametrize(
    ("limits", "takes"),
    [
        ((1.0, 1.0, 2.0, 10.0), minimum_duration(1.0, 1.0, 2.0, 10.0)),
        ((-3.0, 0.5, 1.0, 4.0), minimum_duration(3.0, 0.5, 1.0, 4.0)),
        ((1.0, 1.0, 2.0, math.inf), 1.0 + 1.0 / 2.0),  # a trapezium
        ((1.0, 1.0, math.inf, math.inf), 1.0),
        ((0.032, 1.0, 2.0, 2.0), 4 * (0.032 / 2 / 2.0) ** (1 / 3)),  # limited by jerk alone: up, down, down, up
    ],
)
def test_a_trajectory_has_the_minimum_duration(limits, takes):
    assert trajectory(*limits).duration == approx(takes, abs=1e-9)


def test_a_trajectory_keeps_its_limits_and_ends_exactly_at_the_goal():
    rng = random.Random(1)
    for _ in range(200):
        count = rng.randint(1, 6)
        maxima = [[rng.uniform(0.2, 3) for _ in range(count)] for _ in range(3)]
        goal = [rng.uniform(-4, 4) for _ in range(count)]
        way = rng.choice([PHASE, TIME, NONE])
        motion = Trajectory(State(*([[0.0] * count] * 3)), goal, [0.0] * count, Limits(*maxima), way)
        before = State(*([[0.0] * count] * 3))
        while not motion.is_over:
            state = motion.advance(0.01)
            for kind, limit in ((state.velocity, maxima[0]), (state.acceleration, maxima[1])):
                assert all(abs(one) <= top + 1e-9 for one, top in zip(kind, limit))
            jerks = [(a - b) / 0.01 for a, b in zip(state.acceleration, before.acceleration)]
            assert motion.is_over or all(abs(one) <= top + 1e-6 for one, top in zip(jerks, maxima[2]))
            before = state
        assert state == State(goal, [0.0] * count, [0.0] * count)


def test_a_phase_synchronized_trajectory_is_straight():
    goal, still = [3.0, -1.0, 0.5], [0.0] * 3
    motion = Trajectory(State(*([still] * 3)), goal, still, Limits([1.0] * 3, [2.0] * 3, [10.0] * 3), PHASE)
    while not motion.is_over:
        position = motion.advance(0.01).position
        assert position == approx([position[0] / 3 * whole for whole in goal], abs=1e-12)


def test_a_joint_that_is_not_selected_keeps_its_velocity():
    start = State([0.0, 0.0], [0.0, 0.5], [0.0, 0.0])
    motion = Trajectory(start, [1.0, 9.0], [0.0, 0.0], Limits([1.0] * 2, [2.0] * 2, [10.0] * 2), PHASE, [True, False])
    assert motion.advance(10.0).position == [1.0, approx(0.5 * 1.7)]


def test_a_trajectory_to_a_target_velocity():
    motion = Trajectory(State([0.0], [1.0], [0.0]), None, [3.0], Limits([math.inf], [2.0], [10.0]))
    assert motion.duration == approx(2.0 / 2.0 + 2.0 / 10.0)
    assert motion.advance(9.0).velocity == [3.0]


@pytest.mark.parametrize("limits", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 0.0)])
def test_limits_must_be_greater_than_zero(limits):
    with pytest.raises(ValueError, match="must be greater than 0"):
        trajectory(1.0, *limits)


# ---- calls by scripts


@pytest.fixture(name="fly")
def _fly(new_simulation):
    """Return a function that runs a script until its signal `end` and returns simulation and values per step."""

    def fly(text, steps=400):
        simulation = new_simulation({"scene": SCENE}, **{"python" if "def " in text else "lua": text})
        values = []
        for _ in range(steps):
            simulation.step()
            hinge, lift = (scene_object(simulation, name).value for name in ("Hinge", "Lift"))
            values.append((hinge, lift, scene_object(simulation, "Box").matrix()))
            if simulation.context.signals.get(int, "end"):
                return simulation, values
        raise AssertionError("it has not ended")

    return fly


def scene_object(simulation, name):
    objects = simulation.context.objects
    return objects[objects.handle(name)]


FIND = """
hinge, lift, box, line = sim.getObject('/Hinge'), sim.getObject('/Lift'), sim.getObject('/Box'), sim.getObject('/Line')
"""
LUA = "function sysCall_thread()" + FIND + "{}\nsim.setInt32Signal('end', 1)\nend"
V3 = (
    FIND.replace("sim.getObject('/", "simGetObjectHandle('")
    + """{}
simSetIntegerSignal('end', 1)
"""
)
PYTHON = "def sysCall_thread():\n    " + FIND.strip() + "\n    {}\n    sim.setInt32Signal('end', 1)\n"
LISTS = "{1, 1, 1, 1}, {2, 2, 2, 2}, {10, 10, 10, 10}"  # velocity, acceleration, jerk
KEYS = "maxVel={1, 1}, maxAccel={2, 2}, maxJerk={10, 10}"
JOINTS = {
    "4.6": LUA.replace("{}", f"sim.moveToConfig{{joints={{hinge, lift}}, targetPos={{1, 0.5}}, {KEYS}}}"),
    "4.3": LUA.replace(
        "{}",
        "sim.moveToConfig(-1, {0, 0}, nil, nil, "
        + LISTS
        + """, {1, 0.5}, nil, function(pos, vel, accel, handles)
  for i = 1, #pos do sim.setJointPosition(handles[i], pos[i]) end
end, {hinge, lift})""",
    ),
    "by name": "function put(data) for i = 1, 2 do sim.setJointPosition(data.auxData[i], data.pos[i]) end end\n"
    + LUA.replace(
        "{}", f"sim.moveToConfig{{pos={{0, 0}}, targetPos={{1, 0.5}}, {KEYS}, callback='put', auxData={{hinge, lift}}}}"
    ),
    "by steps": LUA.replace(
        "{}",
        f"""local data = sim.moveToConfig_init{{joints={{hinge, lift}}, targetPos={{1, 0.5}}, {KEYS}}}
repeat
  local result = sim.moveToConfig_step(data)
  sim.step()
until result ~= 0
sim.moveToConfig_cleanup(data)""",
    ),
    "4.2": LUA.replace("sim.getObject('/", "sim.getObjectHandle('").replace(
        "{}", f"sim.rmlMoveToJointPositions({{hinge, lift}}, -1, {{0, 0, 0}}, {{0, 0}}, {LISTS}, {{1, 0.5}}, {{0, 0}})"
    ),
    "3.2": V3.replace(
        "{}", f"simRMLMoveToJointPositions({{hinge, lift}}, -1, nil, {{0, 0}}, {LISTS}, {{1, 0.5}}, {{0, 0}})"
    ),
    "3.2 by steps": V3.replace(
        "{}",
        """local rml = simRMLPos(2, 0.001, -1, {0,0, 0,0, 0,0}, {1,1, 2,2, 10,10}, {1,1}, {1,0.5, 0,0})
local result, state = 0
while result == 0 do
  result, state = simRMLStep(rml, simGetSimulationTimeStep())
  simSetJointPosition(hinge, state[1])
  simSetJointPosition(lift, state[2])
  simSwitchThread()
end
simRMLRemove(rml)""",
    ),
    "Python": PYTHON.replace(
        "{}",
        "sim.moveToConfig({'joints': [hinge, lift], 'targetPos': [1, 0.5], "
        "'maxVel': [1, 1], 'maxAccel': [2, 2], 'maxJerk': [10, 10]})",
    ),
    "Python's function": "def put(pos, vel, accel, lift):\n    sim.setJointPosition(lift, pos[1])\n"
    "    sim.setJointPosition(sim.getObject('/Hinge'), pos[0])\n"
    + PYTHON.replace(
        "{}", "sim.moveToConfig(-1, [0, 0], None, None, [1, 1], [2, 2], [10, 10], [1, 0.5], None, put, lift)"
    ),
}


@pytest.mark.parametrize("text", JOINTS.values(), ids=JOINTS)
def test_joints_move_within_their_limits(fly, text):
    _, values = fly(text)
    hinges = [0.0, *(hinge for hinge, _, _ in values)]
    closed = trajectory()
    assert hinges[1:35] == approx([closed.advance(STEP).position[0] for _ in range(34)], abs=1e-9)
    assert values[-1][:2] == (1.0, 0.5)
    assert len(values) == 35, "1.7 s, and the step in which the script continues"


def test_joints_driven_by_the_dynamics_get_target_positions(fly):
    motor = f"sim.moveToConfig{{joints={{sim.getObject('/Motor')}}, targetPos={{1}}, {KEYS}}}".replace(", 1}", "}")
    motor = motor.replace(", 2}", "}").replace(", 10}", "}") + "\nsim.wait(1)"
    simulation, _ = fly(LUA.replace("{}", motor))
    assert scene_object(simulation, "Motor").control.position == 1.0
    assert scene_object(simulation, "Motor").value == approx(1.0, abs=1e-3)


def test_a_callback_that_returns_true_ends_the_motion(fly):
    text = "sim.moveToConfig{pos={0}, targetPos={1}, maxVel={1}, maxAccel={2}, maxJerk={10}, callback=function(data)\n"
    text += "sim.setJointPosition(hinge, data.pos[1]) return data.pos[1] > 0.5 end}"
    _, values = fly(LUA.replace("{}", text))
    assert 0.5 < values[-1][0] < 0.56


def test_a_motion_without_limits_reaches_its_target_at_once(fly):
    _, values = fly(LUA.replace("{}", "sim.moveToConfig{joints={hinge}, targetPos={3}}"))
    assert [hinge for hinge, _, _ in values] == [3.0, 3.0]


def test_a_joint_without_end_stops_turns_the_shorter_way(fly):
    text = f"sim.rmlMoveToJointPositions({{hinge}}, -1, nil, nil, {LISTS}, {{4}}, nil{{}})"
    _, values = fly(LUA.replace("{}", text.replace("{}", "")))
    assert values[-1][0] == approx(4 - math.tau)
    assert min(hinge for hinge, _, _ in values) < -1
    _, values = fly(LUA.replace("{}", text.replace("{}", ", {1}")))
    assert math.remainder(values[-1][0] - 4, math.tau) == approx(0)
    assert all(hinge > 0 for hinge, _, _ in values[:30])


GOAL = frames.from_euler((1.0, 2.0, 3.0), (0.0, 0.0, 1.0))
QUATERNION = f"{{0, 0, {math.sin(0.5)}, {math.cos(0.5)}}}"
LIMITS = KEYS.replace("1, 1}", "1, 1, 1, 1}").replace("2, 2}", "2, 2, 2, 2}").replace("10, 10}", "10, 10, 10, 10}")
POSES = {
    "4.6": LUA.replace("{}", f"sim.moveToPose{{object=box, targetPose={{1, 2, 3, {QUATERNION[1:]}, {LIMITS}}}"),
    "4.3": LUA.replace(
        "{}",
        f"sim.moveToPose(-1, sim.getObjectPose(box), {LISTS}, {{1, 2, 3, {QUATERNION[1:]}, "
        "function(pose, vel, accel, h)\nassert(#vel == 4) sim.setObjectPose(h, pose) end, box)",
    ),
    "metric": LUA.replace(
        "{}",
        f"sim.moveToPose(-1, sim.getObjectMatrix(box), {LISTS}, sim.buildMatrixQ({{1, 2, 3}}, {QUATERNION}), "
        "function(m, vel, accel, h)\nassert(#vel == 1) sim.setObjectMatrix(h, m) end, box, {1, 1, 1, 0})",
    ),
    "4.2": LUA.replace("{}", f"sim.rmlMoveToPosition(box, -1, -1, nil, nil, {LISTS}, {{1, 2, 3}}, {QUATERNION}, nil)"),
    "3.2": V3.replace("{}", f"simRMLMoveToPosition(box, -1, -1, nil, nil, {LISTS}, {{1, 2, 3}}, {QUATERNION}, nil)"),
    "3.0": V3.replace("{}", "simMoveToPosition(box, -1, {1, 2, 3}, {0, 0, 1}, 1, 2)"),
    "to an object": V3.replace(
        "{}", "simSetObjectPosition(line, -1, {1, 2, 3})\nsimSetObjectOrientation(line, -1, {0, 0, 1})\n"
        "simMoveToObject(box, line, 3, nil, 0.5, 0.5)"
    ),
    "Python": PYTHON.replace(
        "{}",
        f"sim.moveToPose({{'object': box, 'targetPose': [1, 2, 3, {QUATERNION[1:-1]}], 'maxVel': [1] * 4, "
        "'maxAccel': [2] * 4, 'maxJerk': [10] * 4})",
    ),
}  # fmt: skip


@pytest.mark.parametrize("text", POSES.values(), ids=POSES)
def test_an_object_is_moved_in_a_straight_line(fly, text):
    _, values = fly(text)
    places = [frames.position(m) for _, _, m in values]
    assert values[-1][2] == approx(GOAL, abs=1e-12)
    for one, other in itertools.pairwise(places):
        assert math.dist(one, other) <= math.sqrt(14) / 3 * STEP + 1e-9 or "Object" in text
    assert all((y, z) == approx((2 * x, 3 * x), abs=1e-9) for x, y, z in places)


def test_an_orientation_without_a_position_is_reached(fly):
    _, values = fly(V3.replace("{}", "simMoveToPosition(box, -1, nil, {0, 0, 1}, 0.1, 0.1)"))
    assert values[-1][2] == approx(frames.from_euler((0, 0, 0), (0, 0, 1)), abs=1e-9)
    assert len(values) > 10, "without a translation the rotation determines the duration"


def test_an_object_follows_a_path(fly):
    _, values = fly(V3.replace("{}", "simFollowPath(box, line, 1, 0.25, 1, nil)"))
    places = [frames.position(m) for _, _, m in values]
    assert places[0] == approx((0.8, 0, 0))
    assert places[-1] == approx((2, 1, 0))
    assert len(values) == 46, "2.25 m at 1 m/s"


def test_joints_of_v_rep_3_arrive_together_or_independently(fly):
    _, values = fly(V3.replace("{}", "simMoveToJointPositions({hinge, lift}, {1, 0.5}, 0.5, nil)"))
    assert values[19][:2] == approx((0.5, 0.25))
    _, values = fly(V3.replace("{}", "simMoveToJointPositions({hinge, lift}, {1, 0.5}, {0.5, 0.5}, nil)"))
    assert values[19][:2] == approx((0.5, 0.5))
    assert values[-1][:2] == (1.0, 0.5)


def test_a_snapshot_restores_a_running_trajectory(new_simulation):
    simulation = new_simulation(
        {"scene": SCENE},
        lua="function sysCall_init() r = sim.ruckigPos(1, 0.0001, -1, {0,0,0}, {1,2,10}, {1}, {1,0})\n"
        "h = sim.getObject('/Hinge') end\nfunction sysCall_actuation()\n"
        "local _, state = sim.ruckigStep(r, 0.05) sim.setJointPosition(h, state[1]) end",
    )

    def values(steps):
        positions = []
        for _ in range(steps):
            simulation.step()
            positions.append(scene_object(simulation, "Hinge").value)
        return positions

    values(10)
    snapshot = simulation.snapshot()
    first = values(10)
    simulation.restore(snapshot)
    assert values(10) == first


WRONG = {
    "sim.moveToConfig{joints={hinge}, targetPos={1}, maxVel={1}}": "`maxAccel`: a list of 1 numbers",
    "sim.moveToConfig{joints={hinge}, targetPos={1, 2}}": "`targetPos`: a number is expected, not 2",
    "sim.moveToConfig{joints={box}, targetPos={1}}": "'Box' is not a joint of the scene; there are: Hinge, Lift",
    "sim.moveToConfig{joints={sim.getObject('/Ball')}, targetPos={1}}": "'Ball' is spherical",
    "sim.moveToConfig{joints={hinge}, targetPos={1}, maxVel={0}, maxAccel={1}, maxJerk={1}}": "greater than 0",
    "sim.moveToConfig('fast')": "expected a table of parameters",
    "sim.moveToConfig{pos={0}, targetPos={1}, callback='none'}": "the script has no function 'none'",
    "sim.moveToConfig_step{}": "expected the value that moveToConfig_init",
    "sim.moveToPose{ik={tip=1, target=2}, targetPose={1}}": "inverse kinematics is not supported",
    "sim.moveToPose{object=box, targetPose={1}}": "a pose of 7 numbers or a matrix of 12",
    "sim.moveToPosition(box, -1, nil, nil, 1)": "a position or an orientation",
    "sim.moveToPosition(box, -1, {1, 2, 3}, nil, 0)": "greater than 0",
    "sim.followPath(box, hinge, 3, 0, 1)": "'Hinge' is not a path; there are: Line",
    "sim.ruckigPos(2, 0.001, -1, {0}, {1}, {1}, {1})": "maxVelAccelJerk must have 6 numbers",
    "sim.ruckigStep(9, 0.05)": "no trajectory with the handle 9",
}


def test_errors_are_reported_in_one_line(fly):
    tries = (f"do local _, why = pcall(function() {call} end) put({n}, why) end" for n, call in enumerate(WRONG))
    put = "local function put(n, why) sim.setStringSignal(tostring(n), why) end"
    simulation, _ = fly(LUA.replace("{}", "\n".join([put, *tries])))
    for number, (call, expected_text) in enumerate(WRONG.items()):
        message = simulation.context.signals.get(str, str(number))
        assert expected_text in message and "\n" not in message, call


def test_a_motion_outside_a_thread_is_refused(fly):
    with pytest.raises(ScriptError, match="moveToConfig: only in a thread"):
        fly("function sysCall_actuation() sim.moveToConfig{pos={0}, targetPos={1}} end")


def created_path(fly, call):
    """Return the points of the path that a call creates."""
    return scene_object(fly(LUA.replace("{}", call))[0], "Path").points


SQUARE = "{0,0,0, 0,0,0,1, 2,0,0, 0,0,0,1, 2,2,0, 0,0,0,1, 0,2,0, 0,0,0,1}"


def test_a_smooth_path_rounds_its_corners_with_parabolas(fly):
    corner = SQUARE.replace(", 0,2,0, 0,0,0,1", "")
    points = created_path(fly, f"sim.createPath({corner}, 0, 101, 1)")
    assert [points[0], points[-1]] == [approx((0, 0, 0)), approx((2, 2, 0))]
    parabola = [one for one in points if 1 < one[0] < 2 and one[1] < 1]
    assert len(parabola) > 20
    for x, y, _ in parabola:  # tangents at (1, 0) and (2, 1): sqrt(1 - (x - 1)) + sqrt(y) = 1
        assert math.sqrt(2 - x) + math.sqrt(y) == approx(1)
    straight = created_path(fly, f"sim.createPath({corner}, 0, 5, 0)")
    assert straight == [approx(one) for one in [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 2, 0)]]


def test_a_closed_path_is_smooth_at_its_start(fly):
    points = created_path(fly, f"sim.createPath({SQUARE}, 2, 401, 1)")
    assert [points[0], points[-1]] == [approx((0.25, 0.25, 0))] * 2
    assert max(math.dist(one, other) for one, other in itertools.pairwise(points)) < 0.021


def test_the_closest_position_on_a_path(fly):
    call = "sim.setFloatSignal('near', sim.getClosestPositionOnPath(line, {1.8, 0.5, 9}))"
    simulation, _ = fly(LUA.replace("{}", call))
    assert simulation.context.signals.get(float, "near") == approx(2.5 / 3)
