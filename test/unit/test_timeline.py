"""Timelines: the step in which an entry takes effect, and the messages for errors in the file."""

import random
import re
from contextlib import closing

import pytest

from drone_sim.files import yaml_files
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.offline import timeline
from drone_sim.offline.timeline import Entry, Push, Timeline, TimelineError, first_step
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

PARAMETERS = parameters.load()

KINDS = "twist, pose, push, goto, object, reset, takeoff, land, emergency, home, weather, faults"


class DroneLog:
    """A test double of a drone that records its calls."""

    def __init__(self):
        self.calls = []
        self.commands = self.body = self.pushes = self

    def receive(self, twist):
        self.calls.append(("receive", twist))

    def move(self, pose):
        self.calls.append(("move", pose))

    def add(self, push):
        self.calls.append(("push", *push))


def read(folder, text):
    path = folder / "commands.yaml"
    path.write_text(text)
    return timeline.read(str(path), PARAMETERS)


@pytest.mark.parametrize("time_step", [0.05, 0.01, 0.03, 1 / 240])
def test_entry_at_a_steps_own_time_belongs_to_that_step(time_step):
    for step in range(50_000):
        assert first_step(step * time_step, time_step) == step
        assert first_step(round(step * time_step, 9), time_step) == step  # rounded, as in a file


@pytest.mark.parametrize("time, step", [(0.0, 0), (0.001, 1), (0.049, 1), (0.051, 2), (0.0999, 2), (3599.96, 72000)])
def test_entry_between_steps_waits_for_the_next_one(time, step):
    assert first_step(time, 0.05) == step


@pytest.mark.parametrize(
    "text, why",
    [
        ("- {at: 0.1, object: {name: Bal, position: [1, 0, 2]}}", "entry at 0.1 s: no object named 'Bal'"),
        ("- {at: 0.1, vehicle: drone, land: {}}", "entry at 0.1 s: there is no vehicle drone"),
        ("- {at: 0.1, land: {}}", "entry at 0.1 s: there is no vehicle"),
    ],
)
def test_entry_that_cannot_be_executed_is_reported_with_the_reason(tmp_path, text, why):
    commands = read(tmp_path, text)
    with closing(Simulation(PARAMETERS, started=False)) as simulation:
        commands.apply(0, simulation.vehicles)
        vehicles = simulation.vehicles if "object" in text else {}
        with pytest.raises(TimelineError, match=why):
            commands.apply(2, vehicles)


def test_different_timelines_have_different_digests(tmp_path):
    rows = [
        "- {at: 1, push: {force: [0, 0, 1], duration: 0.2}}",
        "- {at: 1, weather: {wind: [0, 1, 0], gusts: {deviation: [0.1, 0, 0]}}}",
        "- {at: 1, land: {}}",
        "- {at: 1, twist: {linear: [1, 0, 0]}}",
        "- {at: 1, twist: {linear: [1, 0, 0]}}\n- {at: 2, goto: {position: [1, 2, 3]}}",
        "- {at: 1, object: {name: Ball, position: [1, 2, 3]}}",
        "- {at: 1, faults: {propellers: [1, 1, 0, 1]}}",
    ]
    digests = [read(tmp_path, text).digest for text in rows]
    assert len(set(digests)) == len(rows)
    assert digests == [timeline.of_rows(yaml_files.parse(text), PARAMETERS, "plan.yaml").digest for text in rows]
    assert Timeline((), 0.05).digest == ""


def test_each_kind_of_entry_is_applied_once_in_its_step(tmp_path):
    commands = read(
        tmp_path,
        """
        - {at: 0.1, twist: {linear: [1, 2, 3], angular: [0, 0, 0.5]}}
        - {at: 0.15, pose: {position: [4, 5, 6], rpy: [0, 0, 3.141592653589793]}}
        - {at: 0.3, push: {force: [1, 0, 0], torque: [0, 2, 0], duration: 0.2}}
        """,
    )
    calls_by_step = {}
    for step in range(20):
        drone = DroneLog()
        commands.apply(step, {"drone": drone})
        if drone.calls:
            calls_by_step[step] = drone.calls
    assert calls_by_step == {
        2: [("receive", Twist(Vector3(1, 2, 3), Vector3(0, 0, 0.5)))],
        3: [("move", Pose((4, 5, 6), pytest.approx((0, 0, 1, 0), abs=1e-12)))],
        6: [("push", (1, 0, 0), (0, 2, 0), 0.2)],
    }


def test_omitted_parts_are_zero(tmp_path):
    commands = read(tmp_path, "[{at: 0, twist: {}}, {at: 1, pose: {}}, {at: 2, push: {duration: 1}}]")
    zero = (0, 0, 0)
    assert [entry.action for entry in commands.entries] == [Twist(), Pose(zero), Push(zero, zero, 1)]


def test_entries_are_sorted_by_time_and_keep_their_order_at_equal_times():
    entries = [Entry(at, Twist(Vector3(number))) for number, at in enumerate([0.3, 0.1, 0.3, 0.2, 0.1])]
    assert [entry.action.linear.x for entry in Timeline(entries, 0.05).entries] == [1, 4, 3, 0, 2]

    numbered = [Entry(random.Random(number).choice([0.0, 0.5]), Twist(Vector3(number))) for number in range(100)]
    drone = DroneLog()
    Timeline(numbered, 0.05).apply(10, {"drone": drone})
    applied = [twist.linear.x for _, twist in drone.calls]
    assert applied == sorted(applied)
    assert len(applied) == sum(entry.at == 0.5 for entry in numbered)


def test_end_includes_the_longest_push():
    push = Push((1, 0, 0), (0, 0, 0), 4.0)
    assert Timeline([Entry(1.0, push), Entry(3.0, Twist())], 0.05).end == 5.0
    assert Timeline([Entry(1.0, push), Entry(6.0, Twist())], 0.05).end == 6.0
    assert Timeline([], 0.05).end == 0.0


@pytest.mark.parametrize(
    "text, says",
    [
        ("", "must be a list"),
        ("{at: 1, twist: {}}", "must be a list"),
        ("[{at: 1, twist: ", "while parsing"),
        ("[{at: 0, twist: {}}, 3]", "entry 2: 3: must be a mapping"),
        ("[{twist: {}}]", "entry 1: at: missing"),
        ("[{at: 1}]", f"entry 1: must hold one of {KINDS}; it holds none"),
        ("[{at: 1, twist: {}, pose: {}}]", f"entry 1: must hold one of {KINDS}; it holds twist and pose"),
        ("[{at: 1, twsit: {}}]", f"entry 1: twsit: unknown key; known are at, vehicle, {KINDS}"),
        ("[{at: 1, twist: }]", "entry 1: twist = None: must be a mapping of linear, angular"),
        ("[{at: -0.1, twist: {}}]", "entry 1: at = -0.1: input should be greater than or equal to 0"),
        ("[{at: .nan, twist: {}}]", "entry 1: at = nan: input should be a finite number"),
        ("[{at: soon, twist: {}}]", "entry 1: at = 'soon': input should be a valid number"),
        ("[{at: 1, twist: {liner: [1, 0, 0]}}]", "entry 1: twist.liner: unknown key; known are linear, angular"),
        ("[{at: 1, twist: {linear: [1, 0]}}]", "entry 1: twist.linear = [1, 0]: must be three finite numbers"),
        ("[{at: 1, twist: {linear: [.nan, 0, 0]}}]", "entry 1: twist.linear = [nan, 0, 0]: must be three finite"),
        ("[{at: 1, twist: {linear: 5}}]", "entry 1: twist.linear = 5: must be three finite numbers"),
        ("[{at: 1, twist: {linear: [0, 21, 0]}}]", "entry 1: twist.linear.y = 21.0: must lie within +-20.0 m/s"),
        ("[{at: 1, twist: {angular: [0, 0, 11]}}]", "entry 1: twist.angular.z = 11.0: must lie within +-10.0 rad/s"),
        (
            "[{at: 1, pose: {position: [0, 0, -1]}}]",
            "entry 1: pose.position.z = -1.0: must lie between 0.0 and 1000.0 m",
        ),
        ("[{at: 1, push: {force: [1, 0, 0]}}]", "entry 1: push.duration: missing"),
        (
            "[{at: 1, push: {duration: 0}}]",
            "entry 1: push.duration = 0: input should be greater than or equal to 0.0001",
        ),
        ("[{at: 1, push: {duration: 1, torque: [0, .inf, 0]}}]", "entry 1: push.torque = [0, inf, 0]: must be three"),
    ],
)
def test_invalid_timeline_is_reported_in_one_line(tmp_path, text, says):
    with pytest.raises(TimelineError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path}/commands.yaml: ")
    assert says in message
    assert "\n" not in message


def test_every_wrong_key_is_named_with_its_line(tmp_path):
    text = """
- {at: 1, twist: {liner: [1, 0, 0], angular: 3}}
- at: soon
  push: {force: [1, 0, 0]}
- {at: 2, twist: {}}
- at: 3
  pose:
    position: [0, 0, -1]
- {at: 4, push: {duration: 1}, pusch: 5}
"""
    with pytest.raises(TimelineError) as caught:
        read(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path}/commands.yaml: line 2: ")
    assert re.findall(r"line (\d+): entry (\d+): ([\w.]+)", str(caught.value)) == [
        ("2", "1", "twist.angular"),
        ("2", "1", "twist.liner"),
        ("3", "2", "at"),
        ("4", "2", "push.duration"),
        ("8", "4", "pose.position.z"),
        ("9", "5", "pusch"),
    ]


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(TimelineError, match=r"nowhere\.yaml"):
        timeline.read(str(tmp_path / "nowhere.yaml"), PARAMETERS)
