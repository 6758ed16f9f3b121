import math
import re

import numpy as np
import pytest
from flown_signals import first_order, flown, judged, second_order, times
from pydantic import ValidationError

from drone_sim.files.resources import package_path
from drone_sim.grading.criteria import KINDS
from drone_sim.grading.flight_record import UNITS, ContactEvent, ValueChange

T = times()
STEP = {"of": "vx", "after": 0.0, "from": 0.0, "to": 1.0}


def numbers(said):
    return re.findall(r"\d[\d.]*", said)


@pytest.mark.parametrize("lag", [0.2, 1.0])
def test_the_rise_time_of_a_first_order_lag_is_ln_9_time_constants(lag):
    outcome = judged(flown(T, vx=first_order(T, lag)), "rise_time", **STEP, at_most=2.5)
    assert outcome.value == pytest.approx(lag * math.log(9), abs=1e-3)
    assert outcome.passed
    assert (outcome.points, outcome.of, outcome.unit) == (1.0, 1.0, "s")


def test_rise_time_interpolates_between_rows_and_starts_at_the_step():
    flight = flown(T, vx=-0.5 * first_order(T, 0.5, begins=3.0) + 2.0)
    outcome = judged(flight, "rise_time", of="vx", after=3.0, to=1.5, at_most=1.0)
    assert outcome.value == pytest.approx(0.5 * math.log(9), abs=1e-3)
    assert not outcome.passed
    assert numbers(outcome.said) == [f"{outcome.value:.4g}", "1"]
    assert outcome.at == pytest.approx(3.0 + 0.5 * math.log(10), abs=1e-3)


def test_a_failed_rise_reports_how_far_the_value_came():
    outcome = judged(flown(T, vx=0.8 * first_order(T, 0.1)), "rise_time", **STEP, at_most=9)
    assert not outcome.passed
    assert outcome.value is None
    assert "never rose" in outcome.said and numbers(outcome.said) == ["90", "80"]


@pytest.mark.parametrize("damping", [0.2, 0.5, 0.7])
def test_the_overshoot_of_a_second_order_system_matches_theory(damping):
    outcome = judged(flown(T, vx=second_order(T, 4.0, damping)), "overshoot", **STEP, at_most=100)
    assert outcome.value == pytest.approx(100 * math.exp(-math.pi * damping / math.sqrt(1 - damping**2)), abs=0.02)
    assert outcome.at == pytest.approx(math.pi / (4.0 * math.sqrt(1 - damping**2)), abs=0.01)


def test_a_lag_does_not_overshoot_and_a_constant_value_fails():
    assert judged(flown(T, vx=first_order(T, 0.5)), "overshoot", **STEP, at_most=0).passed
    nothing = judged(flown(T, vx=0.0 * T), "overshoot", **STEP, at_most=50)
    assert not nothing.passed
    assert "came to 0 % of the step" in nothing.said


@pytest.mark.parametrize("band", [0.02, 0.05])
def test_the_settling_time_of_a_first_order_lag_matches_theory(band):
    flight = flown(T, vx=first_order(T, 0.5, begins=2.0))
    outcome = judged(flight, "settling_time", **{**STEP, "after": 2.0}, at_most=3, band=band)
    assert outcome.value == pytest.approx(-0.5 * math.log(band), abs=1e-3)


def test_the_settling_time_of_a_second_order_system_is_its_last_entry_into_the_band():
    fine = times(step=1e-4)
    outside = np.abs(second_order(fine, 4.0, 0.3) - 1) > 0.02
    last = fine[np.flatnonzero(outside)[-1]]
    outcome = judged(flown(T, vx=second_order(T, 4.0, 0.3)), "settling_time", **STEP, at_most=5)
    assert outcome.value == pytest.approx(last, abs=2e-3)


def test_a_value_that_oscillates_at_the_end_has_not_settled():
    outcome = judged(flown(T, vx=1 + 0.1 * np.cos(T * math.pi)), "settling_time", **STEP, at_most=9)
    assert not outcome.passed
    assert "did not settle" in outcome.said and numbers(outcome.said) == ["2", "10"]


def test_steady_error_uses_the_mean_of_the_last_second():
    flight = flown(T, z=np.where(T < 8.99, 5.0, 1.2 + 0.3 * np.sin(2 * math.pi * T)))
    assert judged(flight, "steady_error", of="z", to=1.0, at_most=0.25).value == pytest.approx(0.2, abs=1e-3)
    assert not judged(flight, "steady_error", of="z", to=1.0, at_most=0.25, until=8.0).passed


def test_stays_checks_the_bounds_only_between_after_and_until():
    flight = flown(T, z=T)
    assert judged(flight, "stays", of="z", at_least=2, at_most=4, after=2, until=4).passed
    high = judged(flight, "stays", of="z", at_least=2, at_most=4, after=2, until=5)
    assert (high.passed, high.value, high.at) == (False, 5.0, 5.0)
    assert high.said.startswith("z ") and numbers(high.said) == ["2", "5", "2", "4"]


def test_velocities_are_in_the_track_frame():
    """They use the frame of the commands: a drone that faces left and flies left flies forward."""
    left = math.sqrt(0.5)
    flight = flown(T, vy=0 * T + 2.0, qz=left, qw=left)
    assert judged(flight, "stays", of="vx", at_least=2 - 1e-9, at_most=2 + 1e-9).passed
    assert judged(flight, "stays", of="world_vy", at_least=2, at_most=2).passed
    assert judged(flight, "stays", of="yaw", at_least=1.57, at_most=1.58).passed


def test_yaw_is_unwrapped_beyond_a_full_turn():
    flight = flown(T, qz=np.sin(T / 2), qw=np.cos(T / 2))  # the yaw rate is 1 rad/s
    assert judged(flight, "steady_error", of="yaw", to=9.5, at_most=1e-9, over=1.0).passed


def test_attitude_is_the_tilt_in_any_direction():
    half = 0.3 * np.sin(math.pi * T / 10) / 2
    outcome = judged(flown(T, qx=np.sin(half), qw=np.cos(half)), "attitude", at_most=0.25)
    assert (outcome.passed, round(outcome.value, 6), outcome.at) == (False, 0.3, 5.0)


def test_drift_is_measured_from_the_start_or_from_a_given_position():
    flight = flown(T, x=3 + 0.1 * T, z=1.0)
    assert judged(flight, "drift", at_most=0.51, after=5).value == pytest.approx(0.5)
    from_place = judged(flight, "drift", **{"from": [3, 0, 0]}, at_most=2, axes="xy", measure="mean")
    assert from_place.value == pytest.approx(0.5)


# ---- places


def test_places_are_reached_between_the_rows_and_in_order():
    coarse = times(step=0.5)
    ahead = flown(coarse, x=coarse, vx=1.0, z=1.0)
    gates = [[1.25, 0, 1], [4.75, 0.1, 1]]
    passed = judged(ahead, "reach", places=gates, within=0.12)
    assert (passed.passed, passed.value) == (True, 2.0)
    assert passed.at == pytest.approx(4.75)
    backwards = judged(ahead, "reach", places=gates[::-1], within=0.12, partial=True, points=4)
    assert (backwards.passed, backwards.points) == (False, 2.0)
    assert numbers(backwards.said) == ["1", "2", "3.5", "2", "0.12"]
    assert not judged(ahead, "reach", places=gates, within=0.12, until=4.0).passed


def test_an_object_path_stands_for_all_objects_it_matches():
    at = times(step=0.5)
    poses = {name: np.tile([x, 0, 1, 0, 0, 0, 1], (len(at), 1)) for name, x in (("Red", 2.0), ("Blue", 6.0))}
    more = {"object_poses": poses, "objects_by_path": {"/Gate": ["Red", "Blue"]}}
    ahead = flown(at, x=at, vx=1.0, z=1.0, more=more)
    assert numbers(judged(ahead, "reach", places=["/Gate", [9, 0, 1]], within=0.1).said) == ["3", "9.00"]
    back = judged(ahead, "reach", places=[[9, 0, 1], "/Gate"], within=0.1, partial=True, points=3)
    assert (back.value, back.points) == (1.0, 1.0)
    assert judged(ahead, "formation", to="/Gate", offset=[1, 0, 0], axes="yz", at_most=0.01).passed, "first match"


def test_a_teleported_vehicle_reaches_no_place():
    at = times(2.0, 0.05)
    jumping = flown(at, x=np.where(at < 1, 0.0, 4.0))
    assert not judged(jumping, "reach", places=[[2, 0, 0]], within=0.5).passed
    teleported = judged(jumping, "reach", places=[[4, 0, 0]], within=0.5)
    assert not teleported.passed and teleported.value == 0  # being teleported to a place does not count


def test_the_distance_from_a_path():
    round_corner = flown(T, x=np.minimum(T, 5), y=np.maximum(T - 5, 0) + 0.2)
    corner = [[0, 0, 0], [5, 0, 0], [5, 5, 0]]
    assert judged(round_corner, "path", along=corner, at_most=0.2 + 1e-9).value == pytest.approx(0.2)
    straight = judged(round_corner, "path", along=corner[:2], at_most=1)
    assert (straight.passed, straight.value) == (False, pytest.approx(5.2))
    assert straight.at == pytest.approx(5.8, abs=0.02), "when the limit was first exceeded"
    assert "5.2 m from the path at 10.00 s" in straight.said
    assert judged(round_corner, "path", along=corner[:2], at_most=6).at == 10.0
    assert judged(round_corner, "path", along=corner, at_most=0.3, covers=0.95).passed


def test_a_closed_path_includes_the_segment_back_to_its_start():
    home = flown(T, x=4 - 0.4 * T)
    corner = {"along": [[0, 0, 0], [0, 3, 0], [4, 3, 0], [4, 0, 0]], "at_most": 0.1}
    assert not judged(home, "path", **corner).passed
    assert judged(home, "path", **corner, closed=True).passed


def test_hovering_at_the_start_of_a_path_does_not_cover_it():
    waiting = judged(flown(T), "path", along=[[0, 0, 0], [4, 0, 0]], closed=True, at_most=0.2, covers=0.9)
    assert not waiting.passed
    assert waiting.said.startswith("flew 5")  # percent of the path: the part within 0.2 m of the start
    assert waiting.said.endswith("at least 90 % is wanted")


def test_a_formation_offset_turns_with_the_leader_if_turns_is_set():
    left = math.sqrt(0.5)
    leader = np.column_stack((T, 0 * T, 0 * T, 0 * T, 0 * T, left + 0 * T, left + 0 * T))
    behind = {"more": {"object_poses": {"lead": leader}}}
    assert judged(flown(T, x=T - 1, **behind), "formation", to="lead", offset=[-1, 0, 0], at_most=1e-9).passed
    turned = judged(flown(T, x=T, y=-1, **behind), "formation", to="lead", offset=[-1, 0, 0], turns=True, at_most=1e-9)
    assert turned.passed
    assert "no such" not in turned.said
    assert (
        "the flight has no 'led'; near names are lead"
        in judged(flown(T, **behind), "formation", to="led", at_most=1).said
    )


# ---- contacts, states, signals and topics


def _landing(speed=0.5, until=10.0, x=0.0, first=4.0, **more):
    """Return a flight that touches down at 4 s and then stands."""
    touches = [ContactEvent(at, "Floor") for at in T if first <= at <= until]
    return flown(
        T, x=x, z=np.maximum(2 - speed * T, 0), vz=np.where(T < 4, -speed, 0), more={"contacts": touches, **more}
    )


def test_landed_checks_position_touchdown_speed_and_ground():
    outcome = judged(_landing(x=0.2), "landed", at=[0, 0], within=0.3, softly=0.6, stands_on="Floor")
    assert (outcome.passed, outcome.at) == (True, 4.0)
    assert outcome.value == pytest.approx(0.2)
    assert numbers(outcome.said) == ["4.00", "0.2", "0.5"]
    assert not judged(_landing(x=0.4), "landed", at=[0, 0], within=0.3).passed
    assert "at most 0.4 m/s is allowed" in judged(_landing(), "landed", softly=0.4).said
    assert judged(_landing(), "landed", stands_on="Pad").said == "stands on Floor, not on Pad"


@pytest.mark.parametrize(
    ("flight", "said"),
    [
        (_landing(until=3.0), "is in the air at 10.00 s"),
        (_landing(first=0.0), "never took off"),
        (_landing(states=(ValueChange(0, "flying"), ValueChange(5, "crashed"))), "it has crashed, as its script says"),
        (
            flown(T, vx=1.0, more={"contacts": [ContactEvent(at, "Floor") for at in T[400:]]}),
            "still moves with 1 m/s at 10.00 s",
        ),
    ],
)
def test_landed_fails_in_the_air_without_takeoff_crashed_or_moving(flight, said):
    outcome = judged(flight, "landed")
    assert not outcome.passed
    assert outcome.said.startswith(said)


def test_no_contact_ignores_allowed_objects():
    contacts = [ContactEvent(1.0, "Floor"), ContactEvent(2.5, "Pole"), ContactEvent(2.5, "Tree")]
    flight = flown(T, more={"contacts": contacts})
    outcome = judged(flight, "no_contact", allow=["Floor"])
    assert (outcome.passed, outcome.value, outcome.at) == (False, 2.0, 2.5)
    assert re.findall(r"[A-Z]\w+", outcome.said) == ["Pole", "Tree", "Floor"] and numbers(outcome.said) == ["2.50"]
    assert judged(flight, "no_contact", after=3).passed
    assert judged(flight, "no_contact", after=2, until=2.49).passed


@pytest.mark.parametrize(
    ("said", "equals", "tolerance", "passes"),
    [
        (3, 3, 0, True),
        (3, 4, 0, False),
        (2.9, 3, 0.2, True),
        ("red", "red", 0, True),
        (b"red", "red", 0, True),
        ("red", 3, 9, False),
        ((1.0, 2.0), [1, 2.05], 0.1, True),
        ((1.0, 2.0), [1], 9, False),
        (math.nan, 3, 9, False),
    ],
)
def test_signal_compares_the_value_within_its_tolerance(said, equals, tolerance, passes):
    flight = flown(T, more={"values": {"count": [ValueChange(1.0, 0), ValueChange(2.0, said)]}})
    assert judged(flight, "signal", signal="count", equals=equals, tolerance=tolerance).passed == passes


def test_signal_uses_the_value_at_the_end_of_its_interval():
    flight = flown(T, more={"values": {"count": [ValueChange(1.0, 3), ValueChange(6.0, None)]}})
    assert judged(flight, "signal", signal="count", equals=3, until=5).passed
    assert judged(flight, "signal", signal="count", equals=3).said.startswith("count has no value")


def test_signal_reads_a_field_of_a_message():
    message = {"pose": {"position": {"x": 1.5}}}
    flight = flown(T, more={"values": {"goal": [ValueChange(1.0, message)]}})
    assert judged(flight, "signal", topic="goal", field="pose.position.x", equals=1.5).passed
    assert "has no field pose.x" in judged(flight, "signal", topic="goal", field="pose.x", equals=1.5).said


# ---- behaviour common to all criteria


def test_criteria_over_the_whole_flight_fail_if_it_ends_early():
    short = flown(times(3.0), is_whole=False, z=1.0)
    assert judged(short, "stays", of="z", at_most=2, until=2).passed
    lasting = judged(short, "stays", of="z", at_most=2)
    assert (lasting.passed, lasting.points) == (False, 0.0)
    assert "too early" in lasting.said and numbers(lasting.said) == ["3.00"]
    assert judged(short, "stays", of="z", at_most=2, after=4).said.endswith("before this began")
    assert judged(short, "reach", places=[[0, 0, 1]], within=0.1).passed  # it was reached before the early end


def test_non_finite_values_in_the_table_are_reported():
    broken = flown(T, z=np.where(T < 5, 1.0, np.nan), x=np.where(T < 7, 1.0, np.inf))
    for kind, values in (
        ("stays", {"of": "z", "at_most": 3}),
        ("steady_error", {"of": "z", "to": 1, "at_most": 3, "over": 5}),
        ("rise_time", {"of": "z", "to": 3, "at_most": 3}),
    ):
        said = judged(broken, kind, **values).said
        assert said.startswith("z ") and "finite" in said and numbers(said) == ["5.00"]
    for kind, values in (("drift", {"at_most": 9}), ("path", {"along": [[0, 0, 0], [1, 0, 0]], "at_most": 9})):
        assert not judged(broken, kind, **values).passed


def test_an_empty_time_interval_is_refused():
    with pytest.raises(ValidationError, match="until = 2: must be later than after = 3"):
        judged(flown(T), "no_contact", after=3, until=2)


def test_the_documentation_has_every_kind_with_its_keys_and_every_column():
    text = (package_path() / "docs" / "grading.md").read_text()
    common = {"kind", "name", "points", "after", "until", "hint"}
    for model in KINDS:
        (kind,) = model.model_fields["kind"].annotation.__args__
        rows = [line for line in text.splitlines() if line.startswith(f"| `{kind}` |")]
        keys = {field.alias or name for name, field in model.model_fields.items()} - common
        assert any(all(f"`{key}`" in row for key in keys) for row in rows), kind
    assert {column for column in UNITS if f"`{column}`" not in text} - {"propeller2", "propeller3"} == set()
