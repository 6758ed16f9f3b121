"""Flight states of the script `pilot`: take-off, landing, goto, and bit-identical flights after a reset."""

import logging
import math
import re
from pathlib import Path

import pytest

from drone_sim.forces.pushes import Push
from drone_sim.mechanics.frames import to_rpy
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.offline import timeline
from drone_sim.run import parameters
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.vehicles import VehicleDiagnosis
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

FORWARD = Twist(Vector3(0.5, 0.2, 0.0))
ON_ITS_BACK = Pose((0.3, 0.2, 0.03), (1.0, 0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def flying(new_shared_simulation):
    return new_shared_simulation()


@pytest.fixture(scope="module")
def landed(new_shared_simulation):
    return new_shared_simulation({"start": "landed"})


def fly(simulation, seconds):
    """Return the state of the drone's body after each step."""
    states = []
    for _ in range(round(seconds / 0.05)):
        simulation.step()
        states.append(simulation.drone.body.state)
    return states


def fly_until(simulation, state, seconds=20.0):
    states = []
    while str(simulation.drone.flight_state) != state:
        states += fly(simulation, 0.05)
        assert len(states) * 0.05 < seconds, f"still {simulation.drone.flight_state}"
    return states


def warnings(caplog):
    """Return the topic and the reason in each warning."""
    reasons = ("stopped", "landed", "taking off", "crashed", "subscribe")
    texts = [one.getMessage() for one in caplog.records if one.levelno == logging.WARNING]
    return [(re.match(r"\w+", one)[0], next(reason for reason in reasons if reason in one)) for one in texts]


def reset(simulation):
    simulation.drone.ask("reset")
    fly(simulation, 0.05)


def test_drone_hovers_from_the_start(flying):
    reset(flying)
    assert str(flying.drone.flight_state) == "flying"
    flying.drone.ask("takeoff")  # ignored: it already flies
    assert fly(flying, 0.5)[-1].position[2] == pytest.approx(0.8, abs=0.02)


def test_landed_drone_stands_on_the_floor(landed):
    reset(landed)
    states = fly(landed, 1.0)
    assert str(landed.drone.flight_state) == "landed"
    assert landed.drone.propulsion.particle_velocities == (0, 0, 0, 0)
    assert all(0 < one.position[2] < 0.02 and math.hypot(*one.linear_velocity) < 0.1 for one in states)


def test_take_off_climbs_to_the_takeoff_height_and_holds_it(landed):
    reset(landed)
    fly(landed, 0.5)
    floor_height = landed.drone.body.state.position[2]
    landed.drone.ask("takeoff")
    climb_states = fly_until(landed, "flying", 3.0)
    hover_states = fly(landed, 2.0)
    assert max(one.position[2] for one in (*climb_states, *hover_states)) < floor_height + 0.82
    assert all(one.position[2] == pytest.approx(floor_height + 0.8, abs=0.02) for one in hover_states)


def test_twist_during_take_off_takes_effect_afterwards(landed):
    reset(landed)
    landed.drone.ask("takeoff")
    fly(landed, 0.5)
    landed.drone.commands.receive(FORWARD)
    assert fly_until(landed, "flying")[-1].position[0] == pytest.approx(0, abs=0.01)
    assert fly(landed, 2.0)[-1].position[0] > 0.3


@pytest.mark.parametrize("height", [0.8, 3.0])
def test_landing_touches_softly_and_stops_the_propellers(flying, height):
    reset(flying)
    flying.drone.body.move(Pose((0, 0, height)))
    flying.drone.commands.receive(FORWARD)
    fly(flying, 0.5)
    flying.drone.ask("land")
    states = fly_until(flying, "landed")
    touched = next(number for number, one in enumerate(states) if one.position[2] < 0.016)
    assert max(abs(one.linear_velocity[2]) for one in states[touched - 3 : touched + 1]) < 0.5
    assert max(one.position[2] for one in states[touched:]) - min(one.position[2] for one in states[touched:]) < 0.02
    fly(flying, 0.1)
    assert flying.drone.propulsion.particle_velocities == (0, 0, 0, 0)


def test_landing_ends_on_an_object_below(new_simulation):
    table = {"shape": "box", "size": [1, 1, 0.4], "position": [0, 0, 0.2]}
    simulation = new_simulation({"scene": {"objects": [table]}})
    simulation.drone.ask("land")
    assert fly_until(simulation, "landed")[-1].position[2] == pytest.approx(0.411, abs=0.01)


def test_drone_that_starts_landed_stands_on_the_object_below(caplog, new_simulation):
    table = {"shape": "box", "size": [1, 1, 0.4], "position": [0, 0, 0.2]}
    simulation = new_simulation({"start": "landed", "scene": {"objects": [table]}})
    simulation.drone.ask("takeoff")
    fly_until(simulation, "flying")
    simulation.drone.ask("reset")
    assert fly(simulation, 1.0)[-1].position[2] == pytest.approx(0.411, abs=0.01)
    simulation.stop()
    for topic in ("takeoff", "takeoff", "reset"):
        simulation.drone.ask(topic)
    assert warnings(caplog) == [("takeoff", "stopped"), ("reset", "stopped")]
    simulation.start()
    assert str(simulation.drone.flight_state) == "landed"


def test_takeoff_aborts_a_landing(flying):
    reset(flying)
    flying.drone.ask("land")
    fly(flying, 1.0)
    flying.drone.ask("takeoff")
    assert min(one.position[2] for one in fly_until(flying, "flying")) > 0.3


def test_twist_does_not_move_a_landed_drone_and_warns_once(landed, caplog):
    reset(landed)
    before = fly(landed, 0.5)[-1].position
    caplog.set_level(logging.WARNING)
    for _ in range(5):
        landed.drone.commands.receive(FORWARD)
        after = fly(landed, 0.2)[-1].position
    assert after == pytest.approx(before, abs=1e-3)
    assert warnings(caplog) == [("cmd_vel", "landed")]


def test_goto_and_home(flying):
    reset(flying)
    flying.drone.ask("goto", Pose((1.0, -0.5, 1.5), (0.0, 0.0, math.sin(0.6), math.cos(0.6))))
    arrival = fly(flying, 14.0)[-20:]
    assert all(one.position == pytest.approx((1.0, -0.5, 1.5), abs=0.05) for one in arrival)
    assert flying.drone.body.matrix[0] == pytest.approx(math.cos(1.2), abs=0.05)
    flying.drone.ask("home")
    assert fly(flying, 14.0)[-1].position == pytest.approx((0, 0, 0.8), abs=0.05)
    flying.drone.ask("goto", Pose((5.0, 0.0, 1.0)))
    fly(flying, 1.0)
    flying.drone.commands.receive(Twist())
    stop_position = fly(flying, 4.0)[-1].position
    assert fly(flying, 2.0)[-1].position == pytest.approx(stop_position, abs=0.1)
    assert stop_position[0] < 3


def test_goto_is_refused_on_the_ground(landed, caplog):
    reset(landed)
    for _ in range(3):
        landed.drone.ask("goto", Pose((1.0, 0.0, 1.0)))
        fly(landed, 3.0)
    assert warnings(caplog) == 2 * [("goto", "landed")]


def test_a_crash_stops_the_propellers_until_reset(flying, caplog):
    reset(flying)
    flying.drone.body.move(ON_ITS_BACK)
    fly_until(flying, "crashed", 3.0)
    fly(flying, 0.1)
    assert flying.drone.propulsion.particle_velocities == (0, 0, 0, 0)
    flying.drone.ask("takeoff")
    flying.drone.commands.receive(FORWARD)
    fly(flying, 0.5)
    assert str(flying.drone.flight_state) == "crashed"
    assert "`reset` puts it back" in caplog.text
    reset(flying)
    assert str(flying.drone.flight_state) == "flying"


@pytest.mark.parametrize("start", ["flying", "landed"])
def test_every_flight_after_a_reset_equals_the_first(start, new_simulation):
    simulation = new_simulation({"start": start})
    drone = simulation.drone

    def flight():
        drone.ask("takeoff")
        states = fly(simulation, 1.0)
        drone.commands.receive(FORWARD)
        return [*states, *fly(simulation, 0.5)]

    def upside_down():
        drone.body.move(ON_ITS_BACK)
        fly_until(simulation, "crashed")

    def half_landed():
        drone.ask("land")
        drone.pushes.add(Push((0.5, 0, 0), (0, 0.01, 0), 1.0))
        fly(simulation, 0.4)

    first = flight()
    for number in range(50):
        (lambda: None, upside_down, half_landed)[number % 3]()
        drone.ask("reset")
        assert flight() == first, f"after reset {number + 1}"


def test_reset_does_not_move_other_vehicles(new_simulation):
    simulation = new_simulation({"vehicles": 2})
    one, other = simulation.vehicles.values()
    for vehicle in (one, other):
        vehicle.commands.receive(FORWARD)
    fly(simulation, 1.0)
    before = other.body.state.position
    one.ask("reset")
    fly(simulation, 0.05)
    assert one.body.state.position == pytest.approx(one.parameters.position, abs=0.01)
    assert other.body.state.position == pytest.approx(before, abs=0.05)


def fleet_flights(resets):
    """Return 20 flights of the middle drone of three, one after each reset, and the states of its neighbours."""
    simulation = Simulation(parameters.load({"vehicles": 3}))
    left, one, right = simulation.vehicles.values()
    own, others = [], []

    def advance(steps):
        for _ in range(steps):
            simulation.step()
            others.append((left.body.state, right.body.state))
            yield one.body.state

    left.commands.receive(FORWARD)
    right.commands.receive(FORWARD)
    for number in range(20):
        crashes = number % 5 == 4
        if resets and crashes:
            one.body.move(Pose((one.parameters.position[0], 0.1, 0.03), ON_ITS_BACK.orientation))
        elif resets:
            one.commands.receive(FORWARD)
        list(advance(30 if crashes else 5))
        assert str(one.flight_state) == ("crashed" if resets and crashes else "flying")
        if resets:
            one.ask("reset")
        own.append(list(advance(10)))
    simulation.close()
    return own, others


def test_resets_of_one_drone_leave_all_flights_bit_identical():
    own, others = fleet_flights(resets=True)
    assert all(flight == own[0] for flight in own)
    assert others == fleet_flights(resets=False)[1]


def test_requests_at_the_wrong_moment(landed, caplog):
    reset(landed)
    landed.drone.ask("reset")
    landed.drone.ask("reset")
    landed.drone.ask("land")  # it has already landed
    fly(landed, 0.5)
    assert str(landed.drone.flight_state) == "landed"
    for _ in range(3):
        landed.drone.ask("takeoff")
        fly(landed, 0.3)
    landed.drone.ask("goto", Pose((1.0, 0.0, 1.0)))
    fly(landed, 0.1)
    assert str(landed.drone.flight_state) == "taking off"
    landed.drone.ask("land")
    assert max(one.position[2] for one in fly_until(landed, "landed")) < 0.6
    landed.drone.body.move(ON_ITS_BACK)
    fly_until(landed, "crashed")
    for topic in ("land", "takeoff", "home"):
        landed.drone.ask(topic)
    fly(landed, 0.1)
    assert warnings(caplog) == [("goto", "taking off"), *((topic, "crashed") for topic in ("takeoff", "land", "home"))]


def test_restore_includes_the_state_of_the_pilot(landed):
    reset(landed)
    landed.drone.ask("takeoff")
    fly(landed, 0.5)
    snapshot = landed.snapshot()
    expected = fly(landed, 3.0)
    landed.drone.ask("land")
    fly(landed, 0.5)
    landed.restore(snapshot)
    assert str(landed.drone.flight_state) == "taking off"
    assert fly(landed, 3.0) == expected
    landed.forget(snapshot)


def test_flight_state_of_a_script_without_states_is_unknown(caplog, new_simulation):
    simulation = new_simulation(script="tutorial")
    assert str(simulation.drone.flight_state) == "unknown"
    for topic in ("takeoff", "land", "reset", "land"):
        simulation.drone.ask(topic)
    assert str(simulation.drone.flight_state) == "unknown: the script does not subscribe to takeoff"
    assert warnings(caplog) == [(topic, "subscribe") for topic in ("takeoff", "land", "reset")]


def test_lua_script_may_publish_flight_states(new_simulation):
    simulation = new_simulation(
        lua="""
function sysCall_init()
    publisher = simROS.advertise('state', 'std_msgs/String', 1, true)
    simROS.publish(publisher, {data = 'waiting'})
    simROS.subscribe('land', 'std_msgs/Empty', 'on_land')
    simROS.subscribe('goto', 'geometry_msgs/PoseStamped', 'on_goto')
end
function on_land(message) simROS.publish(publisher, {data = 'landing'}) end
function on_goto(message) simROS.publish(publisher, {data = 'at ' .. message.pose.position.x}) end
function sysCall_actuation() end
"""
    )
    texts = [str(simulation.drone.flight_state)]
    for topic, pose in (("land", None), ("goto", Pose((1.5, 0, 1)))):
        simulation.drone.ask(topic, pose)
        simulation.step()
        texts.append(str(simulation.drone.flight_state))
    assert texts == ["waiting", "landing", "at 1.5"]


def test_timeline_can_request_takeoff_goto_and_land(tmp_path: Path, new_simulation):
    file = tmp_path / "flight.yaml"
    file.write_text("- {at: 0, takeoff: {}}\n- {at: 3, goto: {position: [0.5, 0, 1]}}\n- {at: 8, land: }\n")
    simulation = new_simulation({"start": "landed"})
    found = timeline.read(str(file), simulation.parameters)
    for step in range(14 * 20):
        found.apply(step, simulation.vehicles)
        simulation.step()
    assert str(simulation.drone.flight_state) == "landed"
    assert simulation.drone.body.state.position == pytest.approx((0.5, 0, 0.011), abs=0.05)


def test_timeline_request_with_an_unknown_key_is_refused(tmp_path: Path):
    file = tmp_path / "flight.yaml"
    file.write_text("- {at: 1, land: {x: 1}}\n")
    with pytest.raises(timeline.TimelineError, match=r"line 1: entry 1: land.x: unknown key; it takes none"):
        timeline.read(str(file), parameters.load())


def test_diagnosis_reports_the_flight_state(landed):
    reset(landed)
    player = Player(landed, lambda _: None, False)
    log = CommandLog()
    log.take("cmd_vel", "/pilot")
    landed.drone.commands.receive(FORWARD)
    found = VehicleDiagnosis(landed.drone, player, log, None).finding()
    assert found.values["flight state"] == "landed"
    assert found.message == "landed: commands of /pilot do not move it; send `takeoff` first"
    landed.drone.body.move(ON_ITS_BACK)
    fly_until(landed, "crashed")
    found = VehicleDiagnosis(landed.drone, player, log, None).finding()
    assert found.message.startswith("crashed: `reset` puts it back")


def test_an_emergency_stops_the_propellers(flying):
    reset(flying)
    flying.drone.ask("emergency")
    states = fly(flying, 0.3)
    assert states[-1].linear_velocity[2] < -1.5  # m/s: it falls
    fly_until(flying, "landed")
    flying.drone.ask("takeoff")
    fly_until(flying, "flying")


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_commanded_tilt_is_held_at_any_speed(yaw, new_simulation):
    simulation = new_simulation({"profile": "ardrone", "start": "flying", "drone": {"yaw": yaw}})
    drone = simulation.drone
    meaning = drone.parameters.cmd_vel_meaning
    drone.commands.receive(Twist(*(Vector3(*one) for one in meaning.converted((1.0, -0.5, 0.0), (0.0, 0.0, 0.0)))))
    fly(simulation, 2.0)
    roll, pitch, _ = to_rpy(fly(simulation, 0.05)[-1].matrix)
    assert (roll, pitch) == pytest.approx((0.105, 0.21), abs=0.015)  # to the right, forward
    last_states = fly(simulation, 8.0)
    speed = math.hypot(*last_states[-1].linear_velocity[:2])
    tilt = math.acos(last_states[-1].matrix[10])
    assert speed == pytest.approx(9.81 * math.tan(tilt) / 0.58, rel=0.1)  # as tum_ardrone measured
    drone.commands.receive(Twist())
    assert math.hypot(*fly(simulation, 6.0)[-1].linear_velocity) < 0.05  # it hovers


def test_upward_command_takes_off_only_with_a_profile_that_allows_it(landed, new_simulation):
    reset(landed)
    landed.drone.commands.receive(Twist(Vector3(0.0, 0.0, 0.5)))
    fly(landed, 1.0)
    assert str(landed.drone.flight_state) == "landed"
    simulation = new_simulation({"profile": "hector"})
    simulation.drone.commands.receive(Twist(Vector3(0.0, 0.0, 0.5)))
    assert fly(simulation, 3.0)[-1].position[2] > 0.8
