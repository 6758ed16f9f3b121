"""The stock target-following controller settles where it should, with the offset that its numbers imply."""

import math

import pytest

from drone_sim.mechanics import frames

MASS, GRAVITY, STEP = 0.52, 9.81, 0.05
THRUST = {"3.x": 5.335, "4.x": 5.45}  # m/s, what the controller takes for hovering
PARTICLES = {"3.x": 21.5, "4.x": 21}  # a step, in the mean


def hover_offset(law):
    """Height over the target (m) at which 5.335 or 5.45 + 2 e is the particle velocity that carries the drone."""
    newtons_per_velocity = PARTICLES[law] * 8500 * math.pi * 0.005**3 / (6 * STEP)
    exact = MASS * GRAVITY / (4 * newtons_per_velocity)
    return -(exact - THRUST[law]) / 2


@pytest.mark.parametrize(
    "script, law", [("target", "3.x"), ("target", "4.x"), ("target_v3", "3.x"), ("target_v4", "4.x")]
)
def test_settles_on_a_target_moved_aside_and_turned(script, law, new_simulation):
    simulation = new_simulation({"propellers": {"law": law}}, script=script)
    objects = simulation.context.objects
    target, base = objects.handle("Quadricopter_target"), objects.handle("Quadricopter_base")
    simulation.step()
    height = frames.position(objects.matrix(target))[2]
    objects.set_matrix(target, -1, frames.from_euler((0, 1, height), (0, 0, math.pi / 2)))
    for _ in range(1200):
        simulation.step()
    there = objects.matrix(base)
    speed = simulation.drone.body.state.linear_velocity
    x, y, z = frames.position(there)
    assert math.hypot(x, y - 1) < 2e-3
    assert z - height == pytest.approx(hover_offset(law), abs=3e-4)  # the 3.x law's carry ripples by 0.2 mm
    assert frames.to_euler(there)[2] == pytest.approx(math.pi / 2, abs=1e-4)
    assert max(map(abs, speed)) < 0.02


def test_the_offsets_have_the_known_size():
    assert hover_offset("3.x") == pytest.approx(0.002, abs=5e-4)
    assert hover_offset("4.x") == pytest.approx(-0.004, abs=5e-4)


def test_scripted_forces_fly_as_particles_do(new_simulation):
    """addForceAndTorque with the law's own numbers is the law."""
    flights = []
    for script in ("target", "target_v4"):
        simulation = new_simulation({"propellers": {"law": "4.x"}}, script=script)
        objects = simulation.context.objects
        objects.set_matrix(objects.handle("target"), -1, frames.from_euler((0.5, 0.5, 1), (0, 0, 1)))
        for _ in range(200):
            simulation.step()
        flights.append(simulation.drone.body.state.position)
        angles = simulation.drone.propulsion.blades.angles
    assert flights[0] == pytest.approx(flights[1], abs=1e-9)
    assert set(angles.values()) == {199 * STEP * 10 % (2 * math.pi)}, "setJointPosition turns the blades"
