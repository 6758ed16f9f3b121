"""docs/tutorial.md: actions in rviz have the described effect."""

import re

import numpy as np
import pytest
from tutorial_flights import DOCS, TEXT, at, fly, flying, push

from drone_sim.mechanics.state import Pose, Twist, Vector3


def test_every_stage_describes_what_rviz_shows():
    markdown_text = re.sub(r"<!-- browser:.*?-->", "", TEXT, flags=re.DOTALL)
    stages = re.findall(r"^## Stage \d.*?(?=^## )", markdown_text, re.MULTILINE | re.DOTALL)
    assert len(stages) == 8
    for stage in stages:
        watch = stage[stage.index("*Now watch it") :]
        assert "1$ roslaunch drone_sim drone.launch script:=" in watch
        assert "ou should see" in watch


def test_constant_thrust_lies_on_the_floor_after_25_s():
    with flying("1_thrust") as simulation:
        flight = fly(simulation, 30)
    assert at(flight.z, 22) > 0.1
    assert np.allclose(flight.z[round(26 / 0.05) :], 0.01, atol=0.02)


def test_pushed_constant_thrust_keeps_sliding_without_pitch():
    with flying("1_thrust") as simulation:
        push(simulation.drone, (1, 0, 0))
        flight = fly(simulation, 20)
    assert np.allclose(flight.vx[round(0.2 / 0.05) :], 0.385, atol=0.001)
    assert np.allclose(flight.qy, 0, atol=1e-9)


def test_elevation_climbs_back_from_half_a_metre_and_slides_after_a_push():
    with flying("2_elevation") as simulation:
        fly(simulation, 8)
        simulation.drone.body.move(Pose((0, 0, 0.5)))
        flight = fly(simulation, 2)
        assert flight.z[0] == pytest.approx(0.5, abs=0.02)
        assert flight.z[-1] == pytest.approx(1.531 - 0.011, abs=0.005)  # 1 % of the metre is left
        push(simulation.drone, (0, 1, 0))
        flight = fly(simulation, 5)
    assert at(flight.vy, 5) == pytest.approx(0.385, abs=0.001)
    assert np.allclose(flight.z, 1.531, atol=0.01)


def test_a_spin_is_stopped_within_a_second_and_leaves_a_new_heading():
    with flying("3_yaw") as simulation:
        before = fly(simulation, 7).yaw[-1]
        push(simulation.drone, torque=(0, 0, 0.05))
        flight = fly(simulation, 2)
    assert abs(at(flight.wz, 1.2)) < 0.01
    assert flight.yaw[-1] - before == pytest.approx(0.234, abs=0.002)


def test_pitch_counteracts_a_push_from_behind_and_not_from_the_side():
    with flying("4_pitch") as simulation:
        before = fly(simulation, 16)
        push(simulation.drone, (1, 0, 0))
        flight = fly(simulation, 8)
        assert flight.qy.min() < -0.03  # the nose is up
        assert 0.05 < flight.x[-1] - before.x[-1] < 0.15
        assert abs(flight.vx[-1]) < 0.02
        push(simulation.drone, (0, 1, 0))
        assert fly(simulation, 8).vy[-1] == pytest.approx(0.385, abs=0.01)


def test_roll_counteracts_a_push_from_the_right():
    with flying("5_roll") as simulation:
        before = fly(simulation, 16)
        push(simulation.drone, (0, 2, 0))
        flight = fly(simulation, 8)
    assert flight.qx.max() > 0.05  # it rolls to the right
    assert abs(flight.vy[-1]) < 0.05
    assert flight.y[-1] - before.y[-1] > 0.1


def test_a_turn_to_the_left_moves_the_posts_to_the_right():
    scene = f"scene_file={DOCS / 'tutorial' / '7_scene.yaml'}"
    with flying("7_camera", "cameras.front.width=160", "cameras.front.height=120", scene) as simulation:
        fly(simulation, 0.5)
        before = mean_post_column(simulation.drone.cameras["front"].take())
        simulation.drone.bus.post("/drone/cmd_vel", Twist(Vector3(), Vector3(0, 0, 0.3)))
        fly(simulation, 0.8)
        assert mean_post_column(simulation.drone.cameras["front"].take()) > before + 10


def mean_post_column(picture):
    """Return the mean column (px) of the orange posts."""
    red, _, blue = np.moveaxis(picture.astype(int), -1, 0)
    return np.nonzero(red > blue + 80)[1].mean()
