import json
import pickle
from functools import cache

import numpy as np
import pytest

from drone_sim.files.resources import package_path
from drone_sim.grading import flight, plan
from drone_sim.grading.plan import PlanError
from drone_sim.grading.randomization import Randomization
from drone_sim.grading.result import Result
from drone_sim.offline import fly
from drone_sim.world import connect_ahead

STEP = """
duration: 3
scene: scene.yaml
spread: {position: [0.2, 0.2, 0.1], yaw: 0.3, objects: {Ball: [1, 1, 0]}}
config:
  weather: {gusts: {deviation: [1, 1, 1]}}
  sensors: {wind: {kind: wind, rate: 20, noise: {deviation: 1}}}
timeline:
  - {at: 0.5, twist: {linear: [1, 0, 0]}}
  - {at: 1.0, object: {name: Ball, position: [0, 3, 0.5]}}
criteria:
  - {kind: rise_time, of: vx, after: 0.5, from: 0, to: 1, at_most: 2}
"""
SCENE = """
drone: {position: [0, 0, 1]}
objects:
  - {name: Ball, shape: sphere, size: [0.2], position: [0, 2, 0.5]}
  - {name: Wall, shape: box, size: [0.2, 8, 8], position: [WALL, 0, 0]}
"""
COUNTING = """
def sysCall_init():
    self.seen = simROS.advertise("seen", "std_msgs/Int32")
    self.own = simROS.advertise("state", "std_msgs/String")

def sysCall_sensing():
    if sim.getSimulationTime() > 1:
        sim.setInt32Signal("counted", 3)
        message = {"data": 5}
        simROS.publish(self.seen, message)
        message["data"] = 6  # which has not been published
        simROS.publish(self.own, {"data": "searching"})
    import random
    sim.setFloatSignal("drawn", random.random())
    if sim.getSimulationTime() > 2:
        sim.stopSimulation()
"""


@pytest.fixture
def written(tmp_path):
    """Return a function that writes a plan, a scene with a wall at x = `wall` m and scripts, and reads the plan."""

    def write(text=STEP, wall=50.0, **scripts):
        (tmp_path / "scene.yaml").write_text(SCENE.replace("WALL", str(wall)))
        (tmp_path / "steps.yaml").write_text(text)
        for name, source in scripts.items():
            (tmp_path / f"{name}.py").write_text(source)
        return plan.read(tmp_path / "steps.yaml")

    return write


def said(result):
    return {one.name: one.said for one in result.outcomes}


def test_a_graded_flight_does_not_depend_on_earlier_flights(written):
    steps = written()
    first = [flight.grade(steps, seed=seed) for seed in (0, 1, 2)]
    connect_ahead()
    again = [flight.grade(pickle.loads(pickle.dumps(steps)), seed=seed) for seed in (2, 1, 0)]
    assert first == again[::-1]
    assert len({one.digest for one in first}) == 3
    assert all(one.passed and one.error is None for one in first)


def test_seed_0_applies_no_spread_and_gives_the_table_of_fly(written, tmp_path):
    steps = written(STEP.replace("spread:", "spread: {} #"))
    spread = written()
    result = flight.grade(spread, table=tmp_path / "graded.csv")
    assert result == flight.grade(steps)
    (tmp_path / "commands.yaml").write_text(json.dumps(spread.timeline))
    (tmp_path / "config.yaml").write_text(json.dumps(dict(spread.config)))
    files = {"--commands": "commands.yaml", "--config": "config.yaml", "--scene": "scene.yaml", "--csv": "flown.csv"}
    arguments = [one for option, name in files.items() for one in (option, str(tmp_path / name))]
    assert fly.main([*arguments, "--duration", "3"]) == 0
    assert (tmp_path / "graded.csv").read_text() == (tmp_path / "flown.csv").read_text()


def test_each_value_drawn_for_a_seed_is_independent_of_the_others(written):
    steps = written()
    start, other = steps.parameters(1), steps.model_copy(update={"spread": Randomization(position=(0.2, 0.2, 0.1))})
    (own,) = start.fleet
    assert own.position != steps.parameters(0).fleet[0].position
    assert own.position == other.parameters(1).fleet[0].position
    assert other.parameters(1).fleet[0].yaw == 0.0
    assert all(abs(one - middle) <= width for one, middle, width in zip(own.position, (0, 0, 1), (0.2, 0.2, 0.1)))
    ball, wall = start.scene.objects
    assert (ball.position[2], wall.position) == (0.5, (50.0, 0.0, 0.0))
    assert 0 < abs(ball.position[0]) <= 1
    seeds = {
        (one.weather.gusts.seed, *(own.sensors["wind"].seed, own.faults.seed))
        for one in map(steps.parameters, range(3))
        for own in one.fleet
    }
    assert len({seed for three in seeds for seed in three}) == 7  # 0 for seed 0, three each for 1 and 2


def test_seeds_spread_the_start_position_evenly(written):
    steps = written()
    drawn = np.array([steps.parameters(seed).fleet[0].position for seed in range(1, 201)])
    assert np.abs(drawn.mean(axis=0) - (0, 0, 1)).max() < 0.03
    assert drawn.max(axis=0) == pytest.approx([0.2, 0.2, 1.1], abs=0.01)


def test_a_plan_lists_its_files(written, tmp_path):
    scene = package_path() / "config" / "scenes" / "gates.yaml"
    (tmp_path / "other.yaml").write_text("script: target\n")
    steps = written(TALKING + "scene: package://drone_sim/config/scenes/gates.yaml\nconfig: other.yaml", counting="")
    assert steps.files == [tmp_path / "steps.yaml", scene, tmp_path / "other.yaml"]


ALONG = """
duration: 1
scene: scene.yaml
spread: {objects: {Way: [1, 1, 0]}}
criteria:
  - {kind: path, name: named, along: Way, at_most: 9}
  - {kind: path, name: said, along: [[2, 1, 1], [2, 4, 1], [0, 4, 1], [2, 1, 1]], at_most: 9}
"""


def test_a_path_criterion_can_name_a_path_of_the_scene(written, tmp_path, monkeypatch):
    way = "{name: Way, kind: path, closed: true, points: [[0, 0, 0], [3, 0, 0], [3, 2, 0]], parent: Frame}"
    frame = "{name: Frame, kind: dummy, position: [2, 1, 1], rpy: [0, 0, 1.5707963267948966]}"
    monkeypatch.setitem(globals(), "SCENE", f"{SCENE}  - {frame}\n  - {way}\n")
    steps = written(ALONG)
    named, unnamed = flight.grade(steps).outcomes
    assert named.value == pytest.approx(unnamed.value) and named.value > 1 and "is allowed" in named.said
    named, unnamed = flight.grade(steps, seed=1).outcomes
    assert abs(named.value - unnamed.value) > 0.01  # the seed has moved the named path
    with pytest.raises(PlanError, match=r"line 6: criteria/0/along = 'Wa': no such path; near names are Way"):
        written(ALONG.replace("Way, at", "Wa, at"))


def test_changes_override_values_of_the_plan(written):
    steps = written()
    lazy = flight.grade(steps, changes={"control": {"Kvcorr": 0.0}})
    assert (lazy.passed, lazy.changes) == (False, {"control": {"Kvcorr": 0.0}})
    wrong = flight.grade(steps, changes={"control": {"Kvcor": 1}})
    assert "control/Kvcor: unknown key; near names are Kvcorr" in wrong.error
    assert said(wrong) == {"rise_time": "nothing was flown"}


CONTACT = """
duration: 4
scene: scene.yaml
timeline:
  - {at: 0, twist: {linear: [1, 0, 0]}}
criteria:
  - {kind: no_contact}
  - {kind: stays, of: x, at_most: 1.4, name: wall}
"""


def test_recording_contacts_does_not_change_the_flight(written):
    with_contacts = flight.grade(written(CONTACT, wall=1.5))
    without_contacts = flight.grade(written(CONTACT.replace("  - {kind: no_contact}\n", ""), wall=1.5))
    assert with_contacts.digest == without_contacts.digest
    assert not with_contacts.outcomes[0].passed
    assert with_contacts.outcomes[0].said.startswith("touched Wall at ")
    assert with_contacts.outcomes[1].passed
    assert flight.grade(written(CONTACT, wall=50)).outcomes[0].passed


def test_a_contact_that_ends_within_the_step_counts(written):
    """An arm starts 5 mm inside the wall, which pushes it out within one sub-step."""
    result = flight.grade(written(CONTACT.replace("duration: 4", "duration: 0.2"), wall=0.245))
    assert said(result)["no_contact"] == "touched Wall at 0.05 s; it may touch nothing"


TALKING = """
duration: 4
script: counting.py
criteria:
  - {kind: signal, signal: counted, equals: 3, until: 2}
  - {kind: signal, topic: seen, equals: 5, until: 2, name: topic}
  - {kind: signal, topic: state, equals: searching, until: 2, name: state}
  - {kind: signal, signal: counter, equals: 3, until: 2, name: mute}
  - {kind: signal, signal: drawn, equals: 0.5, tolerance: 0.5, until: 1, name: drawn}
  - {kind: stays, of: z, at_most: 2, name: low}
"""


def test_signals_and_topics_of_a_script_are_graded_until_it_ends_the_flight(written):
    talking = written(TALKING, counting=COUNTING)
    result = flight.grade(talking)
    assert {one.name for one in result.outcomes if one.passed} == {"signal", "topic", "state", "drawn"}
    assert said(result)["topic"] == "seen was 5 from 1.10 s on; expected is 5"
    assert said(result)["mute"] == "counter has no value at 2.00 s"
    assert said(result)["low"] == "the flight was over at 2.10 s, too early for this"
    assert (result.error, round(result.flown, 9), result.points, result.of) == (None, 2.1, 4.0, 6.0)
    assert flight.grade(talking) == result  # random numbers of a script are the same again
    assert said(flight.grade(talking, seed=1))["drawn"] != said(result)["drawn"]
    assert Result.from_json(json.loads(json.dumps(result.to_json()))) == result


@pytest.mark.parametrize(
    ("source", "error", "flown"),
    [
        ("def sysCall_init(:", "[load] {}:1: SyntaxError", 0),
        ("def sysCall_init():\n    sim.getObjectHandel('x')", "[init] {}:2: ", 0),
        ("def sysCall_sensing():\n    if sim.getSimulationTime() > 1: raise ValueError('a\\nb')",
         "[sensing] {}:2: ValueError: a b", 1.05),
        ("def sysCall_sensing(): pass\ndef sysCall_cleanup():\n    1 / 0", "[cleanup] {}:3: ZeroDivisionError", 4.0),
    ],
)  # fmt: skip
def test_a_failing_script_is_reported_in_one_line(written, tmp_path, source, error, flown):
    result = flight.grade(written(TALKING, counting=COUNTING, mine=source), str(tmp_path / "mine.py"))
    assert result.error.startswith(error.format(tmp_path / "mine.py"))
    assert "\n" not in result.error
    assert not result.passed
    assert result.flown == pytest.approx(flown)
    assert result.script == str(tmp_path / "mine.py")


def test_the_submission_replaces_the_script_of_the_config(written, tmp_path):
    of_config = TALKING.replace("script: counting.py", "config: {script: counting.py}")
    plain, inside = written(of_config.replace("counting.py", "''"), counting=COUNTING), written(of_config)
    assert flight.grade(inside).flown == pytest.approx(2.1)
    assert flight.grade(inside).script == str(tmp_path / "counting.py")
    assert flight.grade(inside, "").digest == flight.grade(plain).digest
    assert flight.grade(plain, str(tmp_path / "counting.py")).digest == flight.grade(inside).digest


@pytest.mark.parametrize(("script", "falls"), [(None, True), ("", True), ("pilot", False)])
def test_a_scene_vehicle_without_script_falls_unless_a_script_is_given(written, tmp_path, script, falls):
    (tmp_path / "alone.yaml").write_text("vehicles: {drone: {position: [0, 0, 0.8], script: none}}\n")
    found = flight.Flight(
        written("{scene: alone.yaml, duration: 2, criteria: [{kind: rise_time, of: z, to: 2, at_most: 1}]}"), script
    )
    found.grade()
    assert (found.rows[-1, 3] < 0.2) == falls


def test_a_plan_with_two_vehicles_grades_the_named_vehicle(written):
    two = """
duration: 2
vehicle: wing
config: {vehicles: {lead: {position: [0, 0, 1]}, wing: {position: [0, 1, 1]}}}
timeline: [{at: 0, vehicle: lead, twist: {linear: [0.3, 0, 0]}}, {at: 0, vehicle: wing, twist: {linear: [0.3, 0, 0]}}]
criteria:
  - {kind: formation, to: lead, offset: [0, 1, 0], at_most: 0.01}
  - {kind: formation, to: Elsewhere, at_most: 0.01, name: no_object}
"""
    (first, *_) = flight.grade(written(two.replace("Elsewhere", "DronePosition"))).outcomes
    assert (first.passed, first.said[:6]) == (True, "was up")
    assert "no object named 'Elsewhere'" in flight.grade(written(two)).error


def test_a_landing_of_the_built_in_script_passes_landed(written):
    landing = """
duration: 8
timeline: [{at: 0.5, land: {}}]
criteria:
  - {kind: landed, at: [0, 0], softly: 1, stands_on: Floor}
  - {kind: landed, at: DronePosition, until: 1, name: early}
"""
    in_time, early = flight.grade(written(landing)).outcomes
    assert in_time.passed, in_time.said
    assert early.said.startswith("is in the air at 1.00 s")


MOVING_PLAN = """
duration: 1
timeline:
  - {at: 0.3, pose: {position: [0, 0, 1]}}
  - {at: 0.6, reset: {}}
  - {at: 0.6, push: {force: [1, 0, 0], duration: 0.1}}
criteria:
  - {kind: drift, at_most: 1}
  - {kind: reach, places: [[0, 0, 0.8], [5, 0, 2]], within: 0.5, partial: true}
"""
CHEATS = {  # the call in a phase of the script, and the verb in the error message
    "position.py": ("sim.setObjectPosition(self.d, -1, [5, 0, 2])", "moved"),
    "pose.py": ("sim.setObjectPose(self.d, -1, [5, 0, 2, 0, 0, 0, 1])", "moved"),
    "gate.py": ("sim.getSimulationTime() < 0.2 or sim.setObjectPosition(self.d, -1, [5, 0, 2])", "moved"),
    "carrier.py": ("sim.setObjectParent(self.d, self.t, True); sim.setObjectPosition(self.t, -1, [5, 0, 2])", "moved"),
    "torque.py": ("sim.addForceAndTorque(self.d, [0, 0, 2], [0, 0, 0])", "pushed"),
    "force.py": ("sim.addForce(self.d, [0, 0, 0], [0, 0, 2])", "pushed"),
    "floor.py": ("sim.createPureShape(0, 24, [1, 1, 0.1], 1)", "changed"),
    "floor.lua": ("sim.createPureShape(0, 24, {1, 1, 0.1}, 1)", "changed"),
    "position.lua": ("sim.setObjectPosition(d, -1, {5, 0, 2})", "moved"),
    "torque.lua": ("sim.addForceAndTorque(d, {0, 0, 2}, {0, 0, 0})", "pushed"),
}
PYTHON_CHEAT = """
def sysCall_init():
    self.d, self.t = sim.getObjectHandle("Quadricopter"), sim.getObjectHandle("Track_base")
    sim.setObjectParent(self.t, -1, True)

def sysCall_PHASE():
    DOES
"""
LUA_CHEAT = """
function sysCall_init()
    d = sim.getObjectHandle("Quadricopter")
end

function sysCall_PHASE()
    DOES
end
"""


@pytest.mark.parametrize("phase", ["actuation", "sensing"])
@pytest.mark.parametrize("name", CHEATS)
def test_a_script_that_moves_or_pushes_the_drone_ends_its_flight(written, tmp_path, name, phase):
    does, done = CHEATS[name]
    source = LUA_CHEAT if name.endswith(".lua") else PYTHON_CHEAT
    (tmp_path / name).write_text(source.replace("PHASE", phase).replace("DOES", does))
    action, whom = {"moved": ("move", "drone"), "pushed": ("push", "drone"), "changed": ("change", "the scene")}[done]
    result = flight.grade(written(MOVING_PLAN), str(tmp_path / name))
    assert result.error.startswith(f"a script {done} {whom} at 0.")
    assert result.error.endswith(f" s; the plan does not allow that (allowed: [{action}] would)")
    assert not result.passed
    assert [one.points for one in result.outcomes] in ([0.0, 0.5], [0.0, 0.0])  # at most the place where it started
    assert result.flown < 0.3

    allowed = flight.grade(written(MOVING_PLAN + f"allowed: [{action}]\n"), str(tmp_path / name))
    assert allowed.error is None
    assert allowed.flown == pytest.approx(1)


BUILDING_SCRIPT = """
def sysCall_sensing():
    sim.removeObject(sim.createPrimitiveShape(sim.primitiveshape_cuboid, [0.1, 0.1, 0.1]))
    sim.addForce(sim.getObject("/Quadcopter"), [0, 0, 0], [0, 0, 1e-3])
    sim.setObjectPosition(sim.getObject("/Goal"), -1, [0, 0, 0.8])
"""
BUILDING_PLAN = """
duration: 0.4
scene: built.yaml
criteria:
  - {kind: reach, places: [Goal], within: 0.1}
"""
BUILT_SCENE = """
drone: {position: [0, 0, 0.8]}
objects: [{name: Goal, kind: dummy, position: [3, 0, 1]}]
scripts: [{object: Goal, script: builds.py}]
"""


def test_scripts_of_the_scene_may_do_what_a_submission_may_not(written, tmp_path):
    (tmp_path / "built.yaml").write_text(BUILT_SCENE)
    (tmp_path / "builds.py").write_text(BUILDING_SCRIPT)
    plan = written(BUILDING_PLAN)
    scene_result = flight.grade(plan)
    assert scene_result.error is None and scene_result.passed, scene_result.outcomes  # the goal is moved
    for name in ("floor.lua", "force.py"):
        does, done = CHEATS[name]
        source = LUA_CHEAT if name.endswith(".lua") else PYTHON_CHEAT
        (tmp_path / name).write_text(source.replace("PHASE", "sensing").replace("DOES", does))
        assert flight.grade(plan, str(tmp_path / name)).error.startswith(f"a script {done} ")


def test_the_timeline_of_a_plan_may_move_and_push_the_drone(written):
    result = flight.grade(written(MOVING_PLAN))
    assert result.error is None
    assert result.flown == pytest.approx(1)


WRONG = {
    "": "must have `key: value` lines, one of them `criteria`, not None",
    "duration: 5": "criteria: missing",
    "duration: 5\ncriteria: []": "line 2: criteria = []: list should have at least 1 item",
    "duration: 5\ncriteria:\n- {kind: rise_tme}": "line 3: criteria/0/kind = 'rise_tme': must be one of 'rise_time', ",
    "duration: 5\ncriteria:\n- {kind: stays, of: vxx, at_most: 1}": "line 3: criteria/0/of = 'vxx': no such column of",
    "duration: 5\ncriteria:\n- {kind: stays, of: vx}": "line 3: criteria/0/at_most: missing; there must be",
    "duration: 5\ncriteria:\n- {kind: no_contact}\n- {kind: no_contact}": "criteria/1/name = 'no_contact': comes twice",
    "duration: 5\ncriteria:\n- {kind: no_contact, until: 9}": "line 3: criteria/0/until = 9: the flight lasts 5 s",
    "duration: 5\ncriteria:\n- {kind: landed, at: [1, 2, 3]}": "criteria/0/at = [1, 2, 3]: must be 2 numbers",
    "duration: 5\ncriteria:\n- {kind: rise_time, of: vx, from: 1, to: 1, at_most: 1}": "criteria/0/to = 1: is the same",
}
WRONG_LINES = {
    "duratoin: 5": "line 1: duratoin: unknown key; near names are duration",
    "name: a b": "line 1: name = 'a b': must begin with a letter",
    "calls: [sysCall_init]": "line 1: calls/0 = 'sysCall_init': must be a function that a script of the scene defines",
    "calls: [simRemoveObject]": "line 1: calls/0 = 'simRemoveObject': must be a function that a script",
    "scene: nix.yaml": "no such file: ",
    "vehicle: dron": "line 1: vehicle = 'dron': no such vehicle; near names are drone",
    "config: {control: {Kzre: 3}}": "line 1: config/control/Kzre: unknown key; near names are Kzref",
    "config: 3": "line 1: config = 3: must hold keys of config/drone.yaml, or be the name of a file",
    "timeline: [{at: 1, twst: {}}]": "line 1: entry 1: twst: unknown key",
    "timeline: 3": "line 1: timeline = 3: ",
    "spread: {objects: {Box: [1, 1, 1]}}": "line 1: spread/objects/Box: the scene has none",
    "spread: {position: [1, 1]}": "line 1: spread/position = [1, 1]: must be 3 numbers",
}


@cache
def _cases():
    fine = "duration: 5\ncriteria: [{kind: no_contact}]"
    return {**WRONG, **{f"{line}\n{fine}": text for line, text in WRONG_LINES.items() if "duratoin" not in line},
            f"duratoin: 5\n{fine}": WRONG_LINES["duratoin: 5"]}  # fmt: skip


@pytest.mark.parametrize("text", _cases())
def test_an_error_in_a_plan_is_reported_in_one_line(written, text):
    with pytest.raises(PlanError) as caught:
        written(text)
    assert _cases()[text] in str(caught.value)
    assert "steps.yaml: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_script_that_no_vehicle_would_run_is_not_graded(written):
    text = "duration: 1\nconfig: {vehicles: {drone: {script: target}}}\ncriteria: [{kind: no_contact}]\n"
    assert "the scene names vehicles/drone/script: target" in flight.grade(written(text), "pilot").error
    assert not flight.grade(written(text)).error, "the plan names no script, so the vehicle's script is graded"
