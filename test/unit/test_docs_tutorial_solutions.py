"""docs/tutorial/solutions: each solves its exercise and differs from its stage in a few lines."""

import difflib
import math
import re

import numpy as np
import pytest
from recorder import Recorder
from tutorial_flights import DOCS, STAGES, TEXT, at, fly, fly_timeline, flying, push

from drone_sim.offline import timeline

SOLUTIONS = {path.stem: path for path in sorted((DOCS / "tutorial" / "solutions").glob("*.py"))}
STAGE_OF = {name: next(stage for stage in STAGES if stage[0] == name[0]) for name in SOLUTIONS}


def fly_solution(name, commands=None, *assignments, seconds=None):
    with flying(str(SOLUTIONS[name]), *assignments) as simulation:
        if commands is None:
            return fly(simulation, seconds)
        planned = timeline.read(str(DOCS / "tutorial" / commands), simulation.parameters)
        return fly(simulation, seconds or planned.end + 5, planned)


def test_every_exercise_links_its_solution():
    linked = re.findall(r"\(tutorial/solutions/(\w+)\.py\)", TEXT)
    assert sorted(linked) == sorted(SOLUTIONS)
    exercises = re.findall(r"^> \*\*Exercise\.\*\*.*?(?:\n(?!>)|\Z)", TEXT, re.MULTILINE | re.DOTALL)
    assert len(exercises) >= 9
    assert all("tutorial/solutions/" in exercise for exercise in exercises)


@pytest.mark.parametrize("name", SOLUTIONS)
def test_a_solution_is_its_stage_with_a_few_lines_changed(name):
    stage, solution = (path.read_text().splitlines() for path in (STAGES[STAGE_OF[name]], SOLUTIONS[name]))
    changes = [line for line in difflib.ndiff(stage, solution) if line[0] in "+-"]
    assert 3 <= len(changes) <= 30


def test_solution_the_track_frame_stays_if_the_script_does_not_move_it():
    with flying(str(SOLUTIONS["1_frame"])) as simulation:
        fly(simulation, 0.05)
        before = simulation.drone.track.matrix()
        push(simulation.drone, (1, 0, 0))
        assert fly(simulation, 5).x[-1] > 1.5
        assert simulation.drone.track.matrix() == before


def test_solution_the_thrust_holds_the_height_for_a_minute():
    assert fly_solution("1_thrust", seconds=60).z[-1] == pytest.approx(0.8, abs=0.01)


def test_solution_half_the_damping_overshoots():
    half_damping = fly_solution("2_elevation", "2_elevation.yaml").z[round(6.1 / 0.05) :]
    assert half_damping.max() - half_damping[-1] == pytest.approx(0.152, abs=0.01)
    full_damping = fly_timeline("2_elevation", "2_elevation.yaml").z[round(6.1 / 0.05) :]
    assert full_damping.max() - full_damping[-1] < 0.01


@pytest.mark.parametrize("start", [0, 1.7])  # 1.7: the spin goes past pi
def test_solution_the_heading_is_held_by_the_shorter_turn(start):
    flight = fly_solution("3_yaw", "3_yaw.yaml", f"drone.yaw={start}", seconds=16)
    yaw = np.unwrap(flight.yaw)
    assert at(yaw, 5.9) - start == pytest.approx(1.395, abs=0.02)
    assert at(yaw, 6.4) - start > 1.395 + 0.07
    assert yaw[-1] - start == pytest.approx(1.395, abs=0.002)
    assert (flight.yaw.min() < 0) == (start > 0)


def test_solution_a_gentler_outer_loop_overshoots_less_and_needs_longer():
    gentle, original = fly_solution("4_pitch", "4_pitch.yaml"), fly_timeline("4_pitch", "4_pitch.yaml")
    assert gentle.vx.max() == pytest.approx(1.28, abs=0.01) and original.vx.max() == pytest.approx(1.59, abs=0.01)
    assert np.argmax(gentle.vx > 0.9) > np.argmax(original.vx > 0.9) + 8


@pytest.mark.parametrize(
    "name, rests", [("5_square", (10.9, 20.9, 30.9, 40.9)), ("5_square_turning", (10.2, 28.6, 46.9, 65.3))]
)
def test_solution_the_square_is_flown_through_its_corners(name, rests):
    flight = fly_solution(name, seconds=75)
    corners = [(at(flight.x, rest), at(flight.y, rest)) for rest in rests]
    assert np.allclose(corners, [(4, 0), (4, 4), (0, 4), (0, 0)], atol=0.06)
    turned = np.unwrap(flight.yaw)[-1]
    assert turned == pytest.approx(2 * math.pi if "turning" in name else 0, abs=0.01)


def test_solution_the_green_gate_is_flown_through():
    small = "cameras.front.width=160", "cameras.front.height=120"
    flight = fly_solution("8_gate", None, *small, f"scene_file={DOCS / 'tutorial' / '8_scene.yaml'}", seconds=11)
    assert np.hypot(flight.x - 4.5, flight.y + 1.5).min() < 0.1 and flight.x[-1] > 4.7


def test_solution_the_guard_catches_the_fall():
    flight = fly_solution("5_guard", "fall.yaml", "drone.position=[0, 0, 5]", seconds=26)
    assert flight.z[-1] == pytest.approx(5, abs=0.01)
    assert np.hypot(flight.vx[-1], flight.vy[-1]) < 0.05


def test_solution_the_turn_has_no_slip():
    with_slip, without = fly_timeline("6_ros", "6_ros.yaml"), fly_solution("6_ros", "6_ros.yaml")
    delay_slip = 0.5 * 0.0225  # yaw rate times the age of a measured speed, a mean over ten sub-steps of 5 ms
    assert slip(with_slip) == pytest.approx(-1 * 0.5 / 9.81 / 0.5 + 1 * delay_slip, abs=0.003)  # -v w / g / Kvcorr
    assert slip(without) == pytest.approx(1 * delay_slip, abs=0.003)


def slip(flight):
    """Return the mean speed to the left (m/s) over the last 3 s of the turn, since it oscillates."""
    return np.mean(
        (np.cos(flight.yaw) * flight.vy - np.sin(flight.yaw) * flight.vx)[round(17 / 0.05) : round(20 / 0.05)]
    )


def test_solution_every_fourth_image_is_published_without_red():
    small, backend = ("cameras.front.width=64", "cameras.front.height=48"), Recorder()
    with flying(str(SOLUTIONS["7_camera"]), *small, backend=backend) as simulation:
        fly(simulation, 0.6)
        camera_image = simulation.drone.cameras["front"].take()
    assert len(backend.published) == 3
    picture = backend.published[-1].message.pixels
    assert not picture[..., 0].any()
    assert np.array_equal(picture[..., 1:], camera_image[..., 1:])


def test_solution_with_a_gram_more_the_drone_is_on_the_floor_after_nine_seconds():
    with flying(str(SOLUTIONS["1_thrust"])) as simulation:
        push(simulation.drone, (0, 0, -9.81e-3), seconds=12)
        flight = fly(simulation, 12)
    assert at(flight.z, 8.5) > 0.05
    assert at(flight.z, 9.5) < 0.03
