"""Hexacopter: a vehicle type with six propellers that uses the same script API."""

import math

import pytest

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.mechanics.urdf import UrdfError
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

HEXACOPTER = "package://drone_sim/config/hexacopter.yaml"


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    return lambda **overrides: new_simulation({"config": HEXACOPTER, **overrides})


def fly(simulation, seconds):
    for _ in range(round(seconds / 0.05)):
        simulation.step()
    return simulation.drone.body.state


def test_the_hexacopter_takes_off_and_hovers(simulate):
    simulation = simulate(start="landed")
    assert len(simulation.drone.propulsion.particle_velocities) == 6
    assert str(simulation.drone.flight_state) == "landed" and simulation.drone.body.state.position[2] < 0.1
    simulation.drone.ask("takeoff")
    state = fly(simulation, 6.0)
    assert str(simulation.drone.flight_state) == "flying"
    assert state.position == pytest.approx((0, 0, 0.8), abs=0.05)
    assert math.hypot(*state.linear_velocity) < 0.02


@pytest.mark.parametrize("x, y, turn", [(0.5, 0, 0), (-0.3, 0.3, 0), (0, -0.5, 0), (0, 0, 0.5)])
def test_the_hexacopter_follows_a_velocity_command(simulate, x, y, turn):
    simulation = simulate()
    simulation.drone.commands.receive(Twist(Vector3(x, y, 0), Vector3(0, 0, turn)))
    state = fly(simulation, 4.0)
    assert state.linear_velocity == pytest.approx((x, y, 0), abs=0.1)
    assert state.angular_velocity[2] == pytest.approx(turn, abs=0.05)
    assert state.position[2] == pytest.approx(0.8, abs=0.1)


def test_each_propeller_has_a_script_and_blades(simulate):
    simulation = simulate()
    fly(simulation, 0.5)
    objects, propulsion = simulation.context.objects, simulation.drone.propulsion
    for number in range(1, 7):
        name = f"Quadricopter_propeller_respondable{number}"
        assert simulation.context.scripts.attached_to(name).parameters["particleVelocity"] > 4
        assert name in objects and objects.path(objects.handle(name)).endswith(f"propeller[{number - 1}]/respondable")
    assert list(propulsion.blades.angles) == [
        f"blades_{place}_joint" for place in ("front_left", "left", "back_left", "back_right", "right", "front_right")
    ]
    assert sum(propulsion.law.thrusts) == pytest.approx(0.72 * 9.81, rel=0.05)


def test_a_hexacopter_and_a_quadricopter_fly_in_one_world(simulate):
    simulation = simulate(
        config="",
        vehicles={
            "four": {},
            "six": {
                "type": "hexacopter",
                "urdf": "package://drone_sim/urdf/hexacopter.urdf",
                "script": "hexacopter",
                "control": {"thrust_gravity": 4.92},
                "position": [0, 1.5, 0.8],
            },
        },
    )
    fly(simulation, 3.0)
    assert [len(one.propulsion.particle_velocities) for one in simulation.vehicles.values()] == [4, 6]
    assert [one.body.state.position[2] for one in simulation.vehicles.values()] == pytest.approx([0.8, 0.8], abs=0.05)


def test_four_fault_values_apply_to_the_first_four_propellers(simulate):
    simulation = simulate(faults={"propellers": [1, 0.5, 1, 1]})
    assert simulation.drone.faults.now.propellers == (1, 0.5, 1, 1, 1, 1)


def test_the_body_turns_towards_a_failed_propeller(simulate):
    """A failed propeller has no thrust and no reaction torque. Propeller 6 is the mirror image of propeller 1."""
    intact, first, sixth = simulate(), simulate(), simulate(faults={"propellers": [1, 1, 1, 1, 1, 0]})
    first.child_scripts["drone"].tuning.change({"faults/propellers/front_left": 0.0})
    motion = {}
    for one in (intact, first, sixth):
        one.step()
        motion[one] = [*one.drone.body.state.angular_velocity, *one.drone.body.state.linear_velocity]
    roll, pitch, yaw, _, _, climb = (ours - its for ours, its in zip(motion[sixth], motion[intact]))
    thrust = intact.drone.propulsion.law.thrusts[5]
    assert sixth.drone.propulsion.law.thrusts[:] == [*intact.drone.propulsion.law.thrusts[:5], 0]
    assert climb == pytest.approx(-thrust * 0.05 / intact.drone.body.mass, rel=1e-3)
    assert roll > 0.1 and pitch > 0.1 and yaw < -0.001, "right side and nose go down; a positive torque is lost"
    mirrored = [ours - its for ours, its in zip(motion[first], motion[intact])][:3]
    assert mirrored == pytest.approx([-roll, pitch, -yaw], rel=0.02)


def test_propellers_5_and_6_can_be_named_in_files_and_tuned(simulate):
    six = {"drone": {"objects": {"Quadricopter_propeller_respondable6": {"alias": "sixth"}}}}
    simulation = simulate(**six)
    objects = simulation.context.objects
    assert objects.path(objects.handle("Quadricopter_propeller_respondable6")).endswith("/sixth")
    tuning = simulation.child_scripts["drone"].tuning
    assert sum(name.startswith("faults/propellers/") for name in tuning.values()) == 6
    tuning.change({"faults/propellers/right": 0.5})
    assert simulation.drone.faults.now.propellers == (1, 1, 1, 1, 0.5, 1)
    with pytest.raises(ParameterError, match="respondable6"):
        parameters.load(six)


@pytest.mark.parametrize("count", [3, 5, 7])
def test_a_wrong_number_of_propeller_faults_is_refused(simulate, count):
    with pytest.raises(ParameterError, match=r"faults/propellers = \[1, .*must be 6 numbers"):
        simulate(faults={"propellers": [1] * count})
    with pytest.raises(ParameterError, match=r"faults/propellers = \[1, .*must be 6 numbers"):
        simulate().drone.change_faults({"propellers": [1] * count})


def test_a_restored_snapshot_repeats_the_flight_exactly(simulate):
    simulation = simulate()
    fly(simulation, 0.5)
    simulation.drone.commands.receive(Twist(Vector3(1, 0, 0)))
    snapshot = simulation.snapshot()
    first = fly(simulation, 1.0)
    simulation.restore(snapshot)
    assert fly(simulation, 1.0) == first


def test_an_unknown_type_and_a_urdf_of_another_type_are_refused():
    with pytest.raises(ParameterError, match=r"drone/type = .*hexacopte.*: no such type; .*hexacopter"):
        parameters.load({"drone": {"type": "hexacopte"}})
    with pytest.raises(UrdfError, match=r"drone\.urdf: no link propeller_left"):
        Simulation(parameters.load({"drone": {"type": "hexacopter"}}))
