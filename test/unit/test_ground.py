"""The ground around the floor, and the edge that a scene can have instead."""

import logging

import numpy as np
import pybullet
import pytest

from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.shapes.visual import GROUND

DOWN, FORWARD = Twist(Vector3(0, 0, -1)), Twist(Vector3(1, 0, 0))


@pytest.fixture
def simulation_at(new_simulation):
    def build(x, **floor):
        simulation = new_simulation({"scene": {"floor": floor}})
        simulation.drone.body.move(Pose((x, 0.0, 0.8)))
        return simulation

    return build


@pytest.mark.parametrize("x", [3.0, 5.0, 6.0, 300.0, -900.0])
def test_the_drone_lands_at_equal_height_on_floor_and_ground(x, simulation_at):
    simulation = simulation_at(x)
    simulation.drone.commands.receive(DOWN)
    for _ in range(200):
        simulation.step()
    assert simulation.drone.body.state.position[2] == pytest.approx(0.01, abs=0.003)


def test_a_ball_rolls_smoothly_over_the_rim_of_the_floor(new_simulation):
    simulation = new_simulation(
        {"scene": {"objects": [{"shape": "sphere", "size": [0.1], "mass": 1, "position": [4, 0, 0.1]}]}}
    )
    simulation.drone.body.move(Pose((0.0, 3.0, 0.8)))
    ball = simulation.scene.things()["Sphere"].body
    pybullet.resetBaseVelocity(ball.number, [2, 0, 0], [0, 20, 0], simulation.world._client)
    for _ in range(60):
        simulation.step()
        assert ball.state.position[2] == pytest.approx(0.1, abs=0.002)
    assert ball.state.position[0] > 6.0


def test_with_edge_the_drone_falls_and_the_log_reports_it_once(caplog, simulation_at):
    simulation = simulation_at(4.9, edge=True)
    with caplog.at_level(logging.WARNING):
        simulation.drone.commands.receive(FORWARD)
        for _ in range(60):
            simulation.step()
        simulation.drone.commands.receive(DOWN)
        for _ in range(100):
            simulation.step()
    assert simulation.drone.body.state.position[2] < -1.0
    assert [record.getMessage() for record in caplog.records if "left the floor" in record.getMessage()] == [
        caplog.records[0].getMessage()
    ]


def test_a_drone_that_starts_outside_of_the_floor_is_not_reported(caplog, simulation_at):
    simulation = simulation_at(8.0, edge=True)
    with caplog.at_level(logging.WARNING):
        simulation.step()
    assert not [record for record in caplog.records if "left the floor" in record.getMessage()]


def test_color_and_depth_images_show_the_ground(simulation_at):
    simulation = simulation_at(8.0)  # the drone faces away from the floor
    picture, depth = (simulation.drone.cameras[name].look() for name in ("front", "depth"))
    bottom = picture[-1].astype(float) / 255
    assert np.abs(bottom - GROUND).max() < 0.01
    assert np.isnan(depth[0]).all()


@pytest.mark.parametrize("x", [0.0, 4.0, 8.0, -1000.0], ids=["floor", "rim", "ground", "far ground"])
def test_cameras_see_floor_and_ground_at_height_zero(x, simulation_at):
    simulation = simulation_at(x)
    camera = simulation.drone.cameras["front"]
    eye = np.reshape((*camera.pose(), 0, 0, 0, 1), (4, 4))
    down = -(camera.intrinsics.rays / camera.intrinsics.rays[..., 2:]) @ eye[2, :3]
    near = down > eye[2, 3] / 50.0
    for outputs in (["depth", "instance"], ["depth", "instance", "color"]):  # different shader programs render them
        truth = camera.truth()
        truth.want(outputs)
        np.testing.assert_allclose(truth.output("depth")[near], eye[2, 3] / down[near], rtol=1e-5)
        assert (truth.output("instance")[near] == 1).all(), "floor and ground, without a gap at the rim"


def test_the_shadow_falls_on_the_ground(simulation_at):
    simulation = simulation_at(9.0)
    simulation.step()  # the tracking camera follows
    picture = simulation.drone.cameras["track"].look().astype(float) / 255
    dark = np.abs(picture - np.multiply(GROUND, 0.55)).max(axis=2) < 0.02
    assert 200 < dark.sum() < 20000
