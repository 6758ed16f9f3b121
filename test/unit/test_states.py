"""Flight states: the script `pilot` takes off, lands, goes places, and begins anew, to the bit."""

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
    """Return the states after each step."""
    states = []
    for _ in range(round(seconds / 0.05)):
        simulation.step()
        states.append(simulation.drone.body.state)
    return states


def until(simulation, state, seconds=20.0):
    states = []
    while str(simulation.drone.flight_state) != state:
        states += fly(simulation, 0.05)
        assert len(states) * 0.05 < seconds, f"still {simulation.drone.flight_state}"
    return states


def warnings(caplog):
    """Return the topic that each warning begins with, and which reason it has in it."""
    reasons = ("stopped", "landed", "taking off", "crashed", "subscribe")
    said = [one.getMessage() for one in caplog.records if one.levelno == logging.WARNING]
    return [(re.match(r"\w+", one)[0], next(reason for reason in reasons if reason in one)) for one in said]


def again(simulation):
    simulation.drone.ask("reset")
    fly(simulation, 0.05)


def test_it_hovers_from_the_start(flying):
    again(flying)
    assert str(flying.drone.flight_state) == "flying"
    flying.drone.ask("takeoff")  # it flies already
    assert fly(flying, 0.5)[-1].position[2] == pytest.approx(0.8, abs=0.02)


def test_landed_stands_on_the_floor(landed):
    again(landed)
    states = fly(landed, 1.0)
    assert str(landed.drone.flight_state) == "landed"
    assert landed.drone.propulsion.particle_velocities == (0, 0, 0, 0)
    assert all(0 < one.position[2] < 0.02 and math.hypot(*one.linear_velocity) < 0.1 for one in states)


def test_take_off_climbs_to_its_height_and_holds(landed):
    again(landed)
    fly(landed, 0.5)
    stood = landed.drone.body.state.position[2]
    landed.drone.ask("takeoff")
    climbed = until(landed, "flying", 3.0)
    held = fly(landed, 2.0)
    assert max(one.position[2] for one in (*climbed, *held)) < stood + 0.82
    assert all(one.position[2] == pytest.approx(stood + 0.8, abs=0.02) for one in held)


def test_a_twist_during_take_off_counts_after_it(landed):
    again(landed)
    landed.drone.ask("takeoff")
    fly(landed, 0.5)
    landed.drone.commands.receive(FORWARD)
    assert until(landed, "flying")[-1].position[0] == pytest.approx(0, abs=0.01)
    assert fly(landed, 2.0)[-1].position[0] > 0.3


@pytest.mark.parametrize("height", [0.8, 3.0])
def test_landing_touches_softly_and_stops_the_propellers(flying, height):
    again(flying)
    flying.drone.body.move(Pose((0, 0, height)))
    flying.drone.commands.receive(FORWARD)
    fly(flying, 0.5)
    flying.drone.ask("land")
    states = until(flying, "landed")
    touched = next(number for number, one in enumerate(states) if one.position[2] < 0.016)
    assert max(abs(one.linear_velocity[2]) for one in states[touched - 3 : touched + 1]) < 0.5
    assert max(one.position[2] for one in states[touched:]) - min(one.position[2] for one in states[touched:]) < 0.02
    fly(flying, 0.1)
    assert flying.drone.propulsion.particle_velocities == (0, 0, 0, 0)


def test_landing_ends_on_what_it_meets(new_simulation):
    table = {"shape": "box", "size": [1, 1, 0.4], "position": [0, 0, 0.2]}
    simulation = new_simulation({"scene": {"objects": [table]}})
    simulation.drone.ask("land")
    assert until(simulation, "landed")[-1].position[2] == pytest.approx(0.411, abs=0.01)


def test_landed_stands_on_what_is_below(caplog, new_simulation):
    table = {"shape": "box", "size": [1, 1, 0.4], "position": [0, 0, 0.2]}
    simulation = new_simulation({"start": "landed", "scene": {"objects": [table]}})
    simulation.drone.ask("takeoff")
    until(simulation, "flying")
    simulation.drone.ask("reset")
    assert fly(simulation, 1.0)[-1].position[2] == pytest.approx(0.411, abs=0.01)
    simulation.stop()
    for topic in ("takeoff", "takeoff", "reset"):
        simulation.drone.ask(topic)
    assert warnings(caplog) == [("takeoff", "stopped"), ("reset", "stopped")]
    simulation.start()
    assert str(simulation.drone.flight_state) == "landed"


def test_a_landing_is_broken_off(flying):
    again(flying)
    flying.drone.ask("land")
    fly(flying, 1.0)
    flying.drone.ask("takeoff")
    assert min(one.position[2] for one in until(flying, "flying")) > 0.3


def test_a_twist_does_not_move_what_has_landed_and_says_why_once(landed, caplog):
    again(landed)
    before = fly(landed, 0.5)[-1].position
    caplog.set_level(logging.WARNING)
    for _ in range(5):
        landed.drone.commands.receive(FORWARD)
        after = fly(landed, 0.2)[-1].position
    assert after == pytest.approx(before, abs=1e-3)
    assert warnings(caplog) == [("cmd_vel", "landed")]


def test_goto_and_home(flying):
    again(flying)
    flying.drone.ask("goto", Pose((1.0, -0.5, 1.5), (0.0, 0.0, math.sin(0.6), math.cos(0.6))))
    there = fly(flying, 14.0)[-20:]
    assert all(one.position == pytest.approx((1.0, -0.5, 1.5), abs=0.05) for one in there)
    assert flying.drone.body.matrix[0] == pytest.approx(math.cos(1.2), abs=0.05)
    flying.drone.ask("home")
    assert fly(flying, 14.0)[-1].position == pytest.approx((0, 0, 0.8), abs=0.05)
    flying.drone.ask("goto", Pose((5.0, 0.0, 1.0)))
    fly(flying, 1.0)
    flying.drone.commands.receive(Twist())
    here = fly(flying, 4.0)[-1].position
    assert fly(flying, 2.0)[-1].position == pytest.approx(here, abs=0.1)
    assert here[0] < 3


def test_goto_is_refused_on_the_ground(landed, caplog):
    again(landed)
    for _ in range(3):
        landed.drone.ask("goto", Pose((1.0, 0.0, 1.0)))
        fly(landed, 3.0)
    assert warnings(caplog) == 2 * [("goto", "landed")]


def test_a_crash_stops_the_propellers_until_reset(flying, caplog):
    again(flying)
    flying.drone.body.move(ON_ITS_BACK)
    until(flying, "crashed", 3.0)
    fly(flying, 0.1)
    assert flying.drone.propulsion.particle_velocities == (0, 0, 0, 0)
    flying.drone.ask("takeoff")
    flying.drone.commands.receive(FORWARD)
    fly(flying, 0.5)
    assert str(flying.drone.flight_state) == "crashed"
    assert "`reset` puts it back" in caplog.text
    again(flying)
    assert str(flying.drone.flight_state) == "flying"


@pytest.mark.parametrize("start", ["flying", "landed"])
def test_every_flight_after_a_reset_is_the_first_one(start, new_simulation):
    simulation = new_simulation({"start": start})
    drone = simulation.drone

    def flight():
        drone.ask("takeoff")
        states = fly(simulation, 1.0)
        drone.commands.receive(FORWARD)
        return [*states, *fly(simulation, 0.5)]

    def upside_down():
        drone.body.move(ON_ITS_BACK)
        until(simulation, "crashed")

    def half_landed():
        drone.ask("land")
        drone.pushes.add(Push((0.5, 0, 0), (0, 0.01, 0), 1.0))
        fly(simulation, 0.4)

    first = flight()
    for number in range(50):
        (lambda: None, upside_down, half_landed)[number % 3]()
        drone.ask("reset")
        assert flight() == first, f"after reset {number + 1}"


def test_a_reset_leaves_others_where_they_are(new_simulation):
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
    """Return 20 flights of the middle one of three, each after a reset, and all that its neighbours fly meanwhile."""
    simulation = Simulation(parameters.load({"vehicles": 3}))
    left, one, right = simulation.vehicles.values()
    own, others = [], []

    def go(steps):
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
        list(go(30 if crashes else 5))
        assert str(one.flight_state) == ("crashed" if resets and crashes else "flying")
        if resets:
            one.ask("reset")
        own.append(list(go(10)))
    simulation.close()
    return own, others


def test_resets_of_one_of_three_disturb_no_flight_by_a_bit():
    own, others = fleet_flights(resets=True)
    assert all(flight == own[0] for flight in own)
    assert others == fleet_flights(resets=False)[1]


def test_requests_at_the_wrong_moment(landed, caplog):
    again(landed)
    landed.drone.ask("reset")
    landed.drone.ask("reset")
    landed.drone.ask("land")  # it has
    fly(landed, 0.5)
    assert str(landed.drone.flight_state) == "landed"
    for _ in range(3):
        landed.drone.ask("takeoff")
        fly(landed, 0.3)
    landed.drone.ask("goto", Pose((1.0, 0.0, 1.0)))
    fly(landed, 0.1)
    assert str(landed.drone.flight_state) == "taking off"
    landed.drone.ask("land")
    assert max(one.position[2] for one in until(landed, "landed")) < 0.6
    landed.drone.body.move(ON_ITS_BACK)
    until(landed, "crashed")
    for topic in ("land", "takeoff", "home"):
        landed.drone.ask(topic)
    fly(landed, 0.1)
    assert warnings(caplog) == [("goto", "taking off"), *((topic, "crashed") for topic in ("takeoff", "land", "home"))]


def test_a_snapshot_brings_back_the_pilot_too(landed):
    again(landed)
    landed.drone.ask("takeoff")
    fly(landed, 0.5)
    snapshot = landed.snapshot()
    flown = fly(landed, 3.0)
    landed.drone.ask("land")
    fly(landed, 0.5)
    landed.restore(snapshot)
    assert str(landed.drone.flight_state) == "taking off"
    assert fly(landed, 3.0) == flown
    landed.forget(snapshot)


def test_another_script_has_no_states_and_that_is_said(caplog, new_simulation):
    simulation = new_simulation(script="tutorial")
    assert str(simulation.drone.flight_state) == "unknown"
    for topic in ("takeoff", "land", "reset", "land"):
        simulation.drone.ask(topic)
    assert str(simulation.drone.flight_state) == "unknown: the script does not subscribe to takeoff"
    assert warnings(caplog) == [(topic, "subscribe") for topic in ("takeoff", "land", "reset")]


def test_a_lua_script_may_have_states(new_simulation):
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
    said = [str(simulation.drone.flight_state)]
    for topic, pose in (("land", None), ("goto", Pose((1.5, 0, 1)))):
        simulation.drone.ask(topic, pose)
        simulation.step()
        said.append(str(simulation.drone.flight_state))
    assert said == ["waiting", "landing", "at 1.5"]


def test_the_timeline_asks(tmp_path: Path, new_simulation):
    file = tmp_path / "flight.yaml"
    file.write_text("- {at: 0, takeoff: {}}\n- {at: 3, goto: {position: [0.5, 0, 1]}}\n- {at: 8, land: }\n")
    simulation = new_simulation({"start": "landed"})
    found = timeline.read(str(file), simulation.parameters)
    for step in range(14 * 20):
        found.apply(step, simulation.vehicles)
        simulation.step()
    assert str(simulation.drone.flight_state) == "landed"
    assert simulation.drone.body.state.position == pytest.approx((0.5, 0, 0.011), abs=0.05)


def test_a_timeline_with_more_than_it_takes(tmp_path: Path):
    file = tmp_path / "flight.yaml"
    file.write_text("- {at: 1, land: {x: 1}}\n")
    with pytest.raises(timeline.TimelineError, match=r"line 1: entry 1: land.x: unknown key; it takes none"):
        timeline.read(str(file), parameters.load())


def test_the_diagnosis_says_the_state(landed):
    again(landed)
    player = Player(landed, lambda _: None, False)
    log = CommandLog()
    log.take("cmd_vel", "/pilot")
    landed.drone.commands.receive(FORWARD)
    found = VehicleDiagnosis(landed.drone, player, log, None).finding()
    assert found.values["flight state"] == "landed"
    assert found.message == "landed: commands of /pilot do not move it; send `takeoff` first"
    landed.drone.body.move(ON_ITS_BACK)
    until(landed, "crashed")
    found = VehicleDiagnosis(landed.drone, player, log, None).finding()
    assert found.message.startswith("crashed: `reset` puts it back")


def test_an_emergency_stops_the_propellers(flying):
    again(flying)
    flying.drone.ask("emergency")
    states = fly(flying, 0.3)
    assert states[-1].linear_velocity[2] < -1.5  # m/s: it falls
    until(flying, "landed")
    flying.drone.ask("takeoff")
    until(flying, "flying")


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_tilt_is_held_whatever_the_speed(yaw, new_simulation):
    simulation = new_simulation({"profile": "ardrone", "start": "flying", "drone": {"yaw": yaw}})
    drone = simulation.drone
    meaning = drone.parameters.cmd_vel_meaning
    drone.commands.receive(Twist(*(Vector3(*one) for one in meaning.converted((1.0, -0.5, 0.0), (0.0, 0.0, 0.0)))))
    fly(simulation, 2.0)
    roll, pitch, _ = to_rpy(fly(simulation, 0.05)[-1].matrix)
    assert (roll, pitch) == pytest.approx((0.105, 0.21), abs=0.015)  # to the right, forward
    late = fly(simulation, 8.0)
    speed = math.hypot(*late[-1].linear_velocity[:2])
    tilt = math.acos(late[-1].matrix[10])
    assert speed == pytest.approx(9.81 * math.tan(tilt) / 0.58, rel=0.1)  # as tum_ardrone measured
    drone.commands.receive(Twist())
    assert math.hypot(*fly(simulation, 6.0)[-1].linear_velocity) < 0.05  # it hovers


def test_a_command_upwards_lifts_off_if_the_driver_does(landed, new_simulation):
    again(landed)
    landed.drone.commands.receive(Twist(Vector3(0.0, 0.0, 0.5)))
    fly(landed, 1.0)
    assert str(landed.drone.flight_state) == "landed"
    simulation = new_simulation({"profile": "hector"})
    simulation.drone.commands.receive(Twist(Vector3(0.0, 0.0, 0.5)))
    assert fly(simulation, 3.0)[-1].position[2] > 0.8
