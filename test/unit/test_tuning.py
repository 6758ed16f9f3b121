"""Tuning in flight: changes take effect in the next step, all or none; a dump restores them."""

import math
import struct

import pytest
import yaml

from drone_sim.config.fields import comments
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError

SMALL = {name: {"width": 16, "height": 12} for name in ("front", "depth", "track", "floor")}
SENSORS = {"imu": {"kind": "imu", "rate": 20}, "fix": {"kind": "fix", "rate": 20, "noise": {"vertical": {"bias": 2.0}}}}
FORWARD = Twist(Vector3(0.5, 0.2, 0.0))
TUNED = {
    **{"Kzref": 2.0, "thrust_limits/highest": 7.0, "recovery_margin": 0.0, "cmd_vel_limits/linear": 1.0},
    **{"takeoff_height": 1.5, "cameras/front/every": 2, "sensors/imu/noise/orientation/deviation": 0.1},
}
PYTHON = """
def sysCall_init():
    sim.setScriptSimulationParameter(sim.handle_self, "speed", 0.5)
    sim.setScriptSimulationParameter(sim.handle_self, "careful", True)
    sim.setScriptSimulationParameter(sim.handle_self, "mood", "calm")
    sim.setScriptSimulationParameter(sim.handle_self, "way", [1, 2])
    sim.setScriptSimulationParameter(sim.handle_self, "tale", "and then " * 1000)
    self.seen = []
    simROS.subscribe("parameter_updates", "dynamic_reconfigure/Config", "on_parameters")

def on_parameters(msg):
    said = {one.name: one.value for one in [*msg.doubles, *msg.bools, *msg.strs, *msg.ints]}
    sim.setStringSignal("said", f"{said['script_parameters/speed']} {said['cameras/front/every']}")

def sysCall_actuation():
    sim.setStringSignal("speed", str(sim.getScriptSimulationParameter(sim.handle_self, "speed")))
"""


def tuning_of(simulation):
    return simulation.child_scripts["drone"].tuning


@pytest.fixture(name="simulate")
def _simulate(new_simulation):
    def simulate(script="", **overrides):
        return new_simulation({"cameras": SMALL, "sensors": SENSORS, **overrides}, script=script)

    return simulate


def fly(simulation, steps):
    """Return the states and readings of a flight in a bit-exact form."""
    flight = []
    for _ in range(steps):
        simulation.step()
        flight.append(struct.pack("13d", *(x for part in simulation.drone.body.state for x in part)))
        flight.append(repr([entry.latest for entry in simulation.drone.instruments.by_object.values()]))
    return flight


def thrust(drone):
    return sum(drone.propulsion.particle_velocities) / 4


def write_dump(values, path):
    """Write a file as `dynparam dump` does; return its path."""
    body = {"dictitems": values, "state": []}
    text = "!!python/object/new:dynamic_reconfigure.encoding.Config\n" + yaml.dump(body)
    path.write_text(text, encoding="utf-8")
    return str(path)


# ---- tunable parameters


def test_every_parameter_has_a_description_and_a_value_within_its_limits(simulate):
    tuning = tuning_of(simulate())
    assert not [name for name, entry in tuning.known.items() if not entry.description]
    assert tuning.known["Kzref"].description == comments()["control/Kzref"] == "(m/s) per m"
    assert [(entry.low, entry.high) for entry in (tuning.known["Kzref"], tuning.known["cmd_vel_timeout"])] == [
        (0, 1e4),
        (0, 1e6),
    ]
    values = tuning.values()
    for name, entry in tuning.known.items():
        fits = values[name] in entry.choices if entry.choices else entry.low <= values[name] <= entry.high
        assert type(values[name]) is entry.kind and fits, name
    expected = {"thrust_limits/lowest", "weather/wind/x", "weather/gusts/deviation/across", "faults/commands/loss"}
    expected |= {"faults/propellers/front_left", "faults/sensors/imu", "faults/sensors/floor", "push/force_limit"}
    assert expected | {"sensors/fix/noise/vertical/bias", "cameras/track/horizontal_fov"} <= set(values)
    assert not [name for name in values if name.endswith(("seed", "variance"))]


# ---- changing


def test_changed_gain_takes_effect_in_the_next_step(simulate):
    simulation = simulate()
    drone = simulation.drone
    fly(simulation, 3)
    for gain in (5.0, 2.0):
        tuning_of(simulation).change({"Kzref": gain})
        drone.body.move(Pose((0, 0, 0.9), (0, 0, 0, 1)))
        simulation.step()
        z = drone.body.state.position[2]
        simulation.step()
        expected = 5.33 + gain * (0.8 - z) - 3 * (z - 0.9) / 0.05  # the speed is the mean of the step
        assert thrust(drone) == pytest.approx(expected, abs=1e-3)


def test_command_timeout_and_cameras_can_be_changed(simulate):
    simulation = simulate()
    drone = simulation.drone
    camera = drone.cameras["front"]
    tuning_of(simulation).change(
        {"cmd_vel_timeout": 0.5, "cameras/front/horizontal_fov": 0.5, "cameras/front/every": 3}
    )
    assert camera.intrinsics == Intrinsics(16, 12, 0.5, 0.01, 100.0) and camera.period == 3
    assert drone.commands.timeout == 0.5 and drone.parameters.cmd_vel_timeout == 0.5


def test_changed_noise_applies_only_to_its_own_measurement(simulate):
    simulation = simulate()
    drone = simulation.drone
    imu, fix = drone.instruments.by_object["imu"], drone.instruments.by_object["fix"]
    fly(simulation, 2)
    before = fix.latest.value
    tuning_of(simulation).change(
        {"sensors/imu/noise/angular_velocity/quantisation": 100.0, "sensors/fix/noise/vertical/bias": 4.0}
    )
    tuning_of(simulation).change({"sensors/imu/noise/linear_acceleration/bias": 3.0})
    fly(simulation, 1)
    assert imu.latest.value.angular_velocity == (0, 0, 0) and abs(imu.latest.value.specific_force[0]) > 0.1
    assert fix.latest.value[2] - 488.8 == pytest.approx(2 * (before[2] - 488.8), abs=0.01)
    assert imu.latest.value.orientation == pytest.approx(drone.body.state.orientation, abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"Kzref": 2e4}, "parameter Kzref = 20000.0: input should be less than or equal to 10000"),
        ({"Kzref": math.nan}, "Kzref = nan: input should be a finite number"),
        ({"Kzref": "2"}, "Kzref = '2': must be a finite number"),
        ({"Kzreff": 2.0}, "'Kzreff': cannot be changed in flight; near names are Kzref"),
        ({"gravity": 0.0}, "'gravity': cannot be changed in flight"),
        ({"thrust_limits/lowest": 8.5}, "thrust_limits = [8.5, 8.0]: must be [lowest, highest] with lowest < highest"),
        ({"weather/wind/y": 101.0, "Kzref": 1.0}, "weather/wind/y = 101.0: input should be less than or equal to 100"),
        ({"faults/propellers/back_left": -1.0}, "faults/propellers/back_left = -1.0"),
        ({"faults/sensors/imu": "mad"}, "faults/sensors/imu = 'mad': input should be 'ok', 'silent' or 'frozen'"),
        ({"cameras/front/every": 0}, "cameras/front/every = 0"),
        ({"cameras/front/every": 1.5}, "cameras/front/every = 1.5"),
        ({"cmd_vel_timeout": 1e-9}, "cmd_vel_timeout = 1e-09: must be 0, or from 0.0001 to 1e+06"),
        ({"recovery_margin": 2.0}, "recovery_margin = 2.0"),
        ({"script_parameters/text": "x" * 2000}, "script_parameters/text = "),
        ({"script_parameters/rate": math.inf}, "script_parameters/rate = inf: must be a finite number"),
        ({"x" * 10_000: 1.0}, "cannot be changed in flight"),
    ],
)
def test_invalid_change_is_refused_with_the_reason_and_changes_nothing(simulate, changes, said):
    simulation = simulate(script_parameters={"text": "a", "rate": 1})
    drone = simulation.drone
    before = tuning_of(simulation).values(), drone.parameters
    with pytest.raises(ParameterError) as caught:
        tuning_of(simulation).change({"Dzref": 1.0, **changes})
    assert said in str(caught.value) and "\n" not in str(caught.value) and len(str(caught.value)) < 600
    assert (tuning_of(simulation).values(), drone.parameters) == before


def test_external_changes_are_visible_and_unchanged_values_are_ignored(simulate):
    simulation = simulate()
    drone, shared = simulation.drone, simulation.context
    tuning_of(simulation).change(tuning_of(simulation).values())
    assert not shared.weather.is_felt and not tuning_of(simulation).chosen
    count_before = shared.tunings
    drone.context.change_weather({"wind": [1, 2, 3]})
    drone.change_faults({"propellers": [1, 1, 0.5, 1]})
    assert shared.tunings == count_before + 2
    tuning_of(simulation).change({"weather/wind/z": 0.0, "weather/gusts/speed": 3.0})
    values = tuning_of(simulation).values()
    assert [values[f"weather/wind/{axis}"] for axis in "xyz"] == [1, 2, 0]
    assert values["faults/propellers/back_right"] == 0.5 and shared.weather.now.gusts.speed == 3


# ---- starts and snapshots


def test_tuned_values_survive_every_start_but_faults_do_not(simulate):
    simulation = simulate()
    begins = (simulation.start, 0), (simulation.stop, 0), (lambda: simulation.drone.ask("reset"), 1)
    for begin, wind in begins:  # only a start resets the wind
        simulation.start()
        tuning_of(simulation).change({**TUNED, "weather/wind/x": 1.0, "faults/propellers/front_left": 0.9})
        begin()
        values = tuning_of(simulation).values()
        assert {name: values[name] for name in TUNED} == TUNED
        assert (values["faults/propellers/front_left"], values["weather/wind/x"]) == (1, wind)
    assert simulation.drone.parameters.cmd_vel_limits.linear == 1 and simulation.drone.parameters.is_alone


def test_restore_brings_back_the_tuned_values(simulate):
    simulation = simulate()
    drone = simulation.drone
    drone.commands.receive(FORWARD)
    fly(simulation, 3)
    snapshot, before, initial = simulation.snapshot(), tuning_of(simulation).values(), drone.parameters
    flight = fly(simulation, 5)
    simulation.restore(snapshot)
    changes = {"Pangle": 0.1, "weather/wind/x": 2.0, "sensors/imu/noise/angular_velocity/bias": 1.0}
    tuning_of(simulation).change({**TUNED, **changes, "cmd_vel_timeout": 0.1})
    assert fly(simulation, 5) != flight
    simulation.restore(snapshot)
    assert (tuning_of(simulation).values(), drone.parameters, tuning_of(simulation).chosen) == (before, initial, {})
    assert drone.cameras["front"].period == 1
    assert fly(simulation, 5) == flight
    simulation.start()
    assert tuning_of(simulation).values()["Kzref"] == 5


# ---- scripts


def test_script_declares_parameters_and_is_notified_of_new_values(simulate, tmp_path):
    script = tmp_path / "own.py"
    script.write_text(PYTHON, encoding="utf-8")
    simulation = simulate(str(script), script_parameters={"mood": "bright", "rate": 3})
    names = {name for name in tuning_of(simulation).values() if name.startswith("script_parameters/")}
    assert names == {f"script_parameters/{name}" for name in ("speed", "careful", "mood", "rate")}
    tuning_of(simulation).change({"script_parameters/speed": 2.0, "script_parameters/careful": False})
    simulation.step()
    assert [simulation.context.signals.get(str, name) for name in ("speed", "said")] == ["2.0", "2.0 1"]
    simulation.start()
    own = simulation.child_scripts["drone"].parameters
    assert [own[name] for name in ("speed", "careful", "mood", "rate")] == [2.0, False, "bright", 3.0]
    script.write_text("def sysCall_actuation():\n    pass\n", encoding="utf-8")
    simulation.start()
    assert "script_parameters/speed" not in tuning_of(simulation).values()


DECLARES = """
def sysCall_init():
    sim.setScriptSimulationParameter(sim.handle_self, "Kzref", {Kzref})

def sysCall_actuation():
    sim.getScriptSimulationParameter(sim.handle_self, "Kzref")
"""
READ = {"takeoff_height", "Kzref", "Dzref", "thrust_gravity", "thrust_limits/lowest", "Pangle", "Precovery"}


def gains_of(simulation):
    """Return the gains that may be tuned, by name."""
    return {name: value for name, value in tuning_of(simulation).values().items() if name in READ}


def test_only_gains_that_the_script_reads_are_offered(simulate, tmp_path):
    script = tmp_path / "own.py"
    script.write_text(DECLARES.format(Kzref=4), encoding="utf-8")
    simulation = simulate(script_parameters={"of_the_file": 1})
    assert set(gains_of(simulation)) == READ
    simulation.script = str(script)
    simulation.start()
    assert set(gains_of(simulation)) == READ, "which gains a script reads is unknown before its first step"
    simulation.step()
    assert gains_of(simulation) == {"Kzref": 4}
    assert {"weather/wind/x", "script_parameters/of_the_file", "cmd_vel_limits/linear"} <= set(
        tuning_of(simulation).values()
    )
    simulation.stop()
    assert set(gains_of(simulation)) == {"Kzref"}


def test_all_gains_are_offered_before_the_first_flight(new_simulation):
    simulation = new_simulation({"cameras": SMALL}, started=False)
    assert set(gains_of(simulation)) == READ


def test_gain_that_a_script_reads_later_is_offered_then(simulate, tmp_path):
    script = tmp_path / "own.py"
    text = 'def sysCall_actuation():\n    if sim.getSimulationTime() > 0.1:\n        sim.{}(sim.handle_self, "Dzref")\n'
    script.write_text(text.format("getScriptSimulationParameter"), encoding="utf-8")
    simulation = simulate(str(script))
    simulation.step()
    asked = simulation.context.scripts.asked
    fly(simulation, 4)
    assert simulation.context.scripts.asked == asked + 1 and set(gains_of(simulation)) == {"Dzref"}


def test_precedence_of_gains_from_script_file_and_tuning(simulate, tmp_path):
    script = tmp_path / "own.py"

    def start_with(simulation, text):
        script.write_text(DECLARES.format(Kzref=text), encoding="utf-8")
        simulation.start()
        simulation.step()
        return simulation.child_scripts["drone"].parameters["Kzref"]

    script.write_text(DECLARES.format(Kzref=4), encoding="utf-8")
    simulation = simulate(str(script))
    tuning_of(simulation).change({"Kzref": 8.0})
    assert [start_with(simulation, text) for text in (4, 4, 6, 6)] == [8, 8, 6, 6]
    simulation = simulate(str(script), control={"Kzref": 2})
    assert [start_with(simulation, text) for text in (4, 6)] == [2, 2]


def test_invalid_gains_set_by_a_script_do_not_break_tuning(simulate):
    simulation = simulate()
    own = simulation.child_scripts["drone"].parameters
    own.update(Kzref="much", Dzref=7.0, thrust_limits=[1])
    values = tuning_of(simulation).values()
    assert [values["Kzref"], values["Dzref"], values["thrust_limits/lowest"]] == [5.0, 7.0, 1.0]
    tuning_of(simulation).change({"Kzref": 2.0})
    assert own["Kzref"] == 2 and own["Dzref"] == 7


# ---- dump


def test_flight_with_a_dump_equals_the_tuned_flight(simulate, tmp_path):
    before = tmp_path / "before.yaml"
    before.write_text(yaml.dump({"sensors": SENSORS, "control": {"Kzref": 9}}), encoding="utf-8")
    first = simulate(config=str(before))
    tuning_of(first).change({**TUNED, "thrust_limits/lowest": 1.0})
    first.start()
    file = write_dump(tuning_of(first).values(), tmp_path / "tuned.yaml")
    second = simulate(config=f"{before},{file}")
    flights = []
    for simulation in (first, second, simulate()):
        simulation.drone.commands.receive(FORWARD)
        flights.append(fly(simulation, 30))
    assert tuning_of(second).values() == tuning_of(first).values()
    assert flights[0] == flights[1] != flights[2]
    assert second.parameters.control.recovery_margin is None


def test_dump_of_a_hexacopter_has_six_propellers(simulate, tmp_path):
    type_of = "package://drone_sim/config/hexacopter.yaml"
    first = simulate(config=type_of, sensors={})
    tuning_of(first).change({"faults/propellers/right": 0.9})
    file = write_dump(tuning_of(first).values(), tmp_path / "six.yaml")
    second = simulate(config=f"{type_of},{file}", sensors={})
    assert second.drone.faults.now.propellers == (1, 1, 1, 1, 0.9, 1)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Kzref: 5.0", "Kzref: 20000", "dump.yaml: parameter control/Kzref = 20000: input should be less than"),
        ("Kzref: 5.0", "Kzreff: 5.0", "dump.yaml: parameter Kzreff: unknown key"),
        ("Kzref: 5.0", f"{'a/' * 400}b: 5.0", "dump.yaml: parameter a: unknown key"),
        ("Kzref: 5.0", "Kzref: [", "dump.yaml: not a valid dynparam dump"),
        ("Kzref: 5.0", "cmd_vel_limits: 5", "is also the prefix of other names"),
        ("Kzref: 5.0", "groups: !!python/object/new:os.system [ls]", "the tag 'tag:yaml.org,2002:python/object/new"),
        ("  weather/wind/y: 0.0\n", "", "dump.yaml: parameter weather/wind/y: missing"),
        ("Kzref: 5.0", "sensors/imu/noise/deviation: 1.0", "other sensors: 'imu'"),
        ("dictitems", "items", "`dictitems:`"),
        ("encoding.Config", "encoding.Else", "dump.yaml: the tag"),
    ],
)
def test_error_in_a_dump_is_reported_with_file_and_parameter(simulate, tmp_path, old, new, said):
    file = tmp_path / "dump.yaml"
    write_dump(tuning_of(simulate(sensors={})).values(), file)
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ParameterError) as caught:
        parameters.load({"config": str(file)})
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_gains_are_per_vehicle_and_the_weather_is_shared(simulate):
    simulation = simulate(vehicles={"a": {}, "b": {"position": [0, 2, 0.8]}}, sensors={})
    a, b = simulation.child_scripts.values()
    a.tuning.change({"Kzref": 1.0, "weather/wind/x": 3.0})
    assert [entry.tuning.values()["Kzref"] for entry in (a, b)] == [1, 5]
    assert b.tuning.values()["weather/wind/x"] == 3
    simulation.set_vehicles({"a": {}, "c": {"position": [0, 4, 0.8]}})
    simulation.start()
    assert [entry.tuning.values()["Kzref"] for entry in simulation.child_scripts.values()] == [1, 5]
