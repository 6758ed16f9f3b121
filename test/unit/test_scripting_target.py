"""The stock target-following controller settles on its target, with the offset that its constants imply."""

import math

import pytest

from drone_sim.mechanics import frames

MASS, GRAVITY, STEP = 0.52, 9.81, 0.05
THRUST = {"3.x": 5.335, "4.x": 5.45}  # m/s, the controller's particle velocity for hovering
PARTICLES = {"3.x": 21.5, "4.x": 21}  # per step, on average


def hover_offset(law):
    """Return the height over the target (m) at which the particle velocity (5.335 or 5.45 + 2 e) carries the drone."""
    newtons_per_velocity = PARTICLES[law] * 8500 * math.pi * 0.005**3 / (6 * STEP)
    exact = MASS * GRAVITY / (4 * newtons_per_velocity)
    return -(exact - THRUST[law]) / 2


@pytest.mark.parametrize(
    "script, law", [("target", "3.x"), ("target", "4.x"), ("target_v3", "3.x"), ("target_v4", "4.x")]
)
def test_drone_settles_on_a_moved_and_rotated_target(script, law, new_simulation):
    simulation = new_simulation({"propellers": {"law": law}}, script=script)
    objects = simulation.context.objects
    target, base = objects.handle("Quadricopter_target"), objects.handle("Quadricopter_base")
    simulation.step()
    height = frames.position(objects.matrix(target))[2]
    objects.set_matrix(target, -1, frames.from_euler((0, 1, height), (0, 0, math.pi / 2)))
    for _ in range(1200):
        simulation.step()
    base_matrix = objects.matrix(base)
    speed = simulation.drone.body.state.linear_velocity
    x, y, z = frames.position(base_matrix)
    assert math.hypot(x, y - 1) < 2e-3
    assert z - height == pytest.approx(hover_offset(law), abs=3e-4)  # the 3.x law's carry ripples by 0.2 mm
    assert frames.to_euler(base_matrix)[2] == pytest.approx(math.pi / 2, abs=1e-4)
    assert max(map(abs, speed)) < 0.02


def test_hover_offsets_have_the_known_size():
    assert hover_offset("3.x") == pytest.approx(0.002, abs=5e-4)
    assert hover_offset("4.x") == pytest.approx(-0.004, abs=5e-4)


def test_scripted_forces_give_the_same_flight_as_particles(new_simulation):
    """addForceAndTorque with the numbers of the propeller law gives the same flight."""
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
