"""Diagnosis, which says why a vehicle does not fly as expected; ROS is not needed."""

import pytest

from drone_sim.files.resources import package_path
from drone_sim.forces.pushes import Push
from drone_sim.mechanics.frames import from_rpy, to_quaternion
from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.run import parameters
from drone_sim.run.diagnosis.command_log import CommandLog
from drone_sim.run.diagnosis.diagnosis import Diagnosis
from drone_sim.run.diagnosis.finding import ERROR, OK, WARN, Problem, finding
from drone_sim.run.pacing import Pacer
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError
from drone_sim.vehicles.situation import doing

FORWARD = Twist(Vector3(0.5, 0, 0), Vector3(0, 0, 0))
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
WALL = {"shape": "box", "name": "Wall", "size": [0.2, 4, 4], "position": [1.0, 0, 2]}
SCRIPT = package_path() / "src/drone_sim/child_scripts/tutorial.py"


class DiagnosedFlight:
    """A flight and its diagnosis, with a real time that the test sets."""

    def __init__(self, script):
        self.script = script
        self.script.write_text(SCRIPT.read_text())
        settings = {"script": str(script), "scene": {"objects": [WALL]}}
        self.simulation = Simulation(parameters.load(settings))
        self.now = 0.0
        self.player = Player(self.simulation, lambda _: None, False)
        self.pacer = Pacer(0.05, self.clock, lambda _: None)
        self.renew()

    def clock(self):
        return self.now

    def renew(self):
        """Restart the flight with its original script, an empty command log and a new diagnosis."""
        self.script.write_text(SCRIPT.read_text())
        self.player.restart()
        self.log = CommandLog(self.clock)
        self.log.senders = lambda: ["/pilot"]
        self.diagnosis = Diagnosis(self.player, self.pacer, lambda: {"drone": self.log}, False, self.clock)

    @property
    def drone(self):
        return self.simulation.drone

    def command(self, twist=FORWARD, sender="/pilot"):
        self.log.take("cmd_vel", sender, twist == Twist())
        self.drone.commands.receive(twist)

    def fly(self, steps, step=0.05):
        """Advance by `steps` steps, each of which takes `step` s of real time."""
        for _ in range(steps):
            self.player.step()
            self.now += step

    def look(self, subject="vehicle drone"):
        return next(one for one in self.diagnosis.look() if one.name == subject)


@pytest.fixture(name="flight", scope="module")
def _flight(tmp_path_factory):
    flight = DiagnosedFlight(tmp_path_factory.mktemp("scripts") / "script.py")
    yield flight
    flight.simulation.close()


@pytest.fixture(name="looked")
def _looked(flight):
    flight.renew()
    return flight


def test_a_normal_flight_is_ok(looked):
    looked.fly(2)
    entry = looked.look()
    assert (entry.level, entry.message) == (OK, "flying; no command has been received yet")
    looked.command()
    looked.fly(10)
    entry = looked.look()
    assert (entry.level, entry.message) == (OK, "flying as /pilot commands")
    assert entry.values["command came"] == "0.5 s ago"
    assert entry.values["propellers at a limit"] == "0 of the last 10 steps"
    assert looked.look("simulation").level == OK


def test_a_slow_simulation_gets_a_warning_with_its_pace(looked):
    looked.look()
    for level in (OK, OK, WARN):  # a single slow second is no problem yet
        looked.fly(10, step=0.1)
        entry = looked.look("simulation")
        assert entry.level == level
    assert "too slow: 0.50 times real time" in entry.message
    looked.fly(10)
    assert looked.look("simulation").message == "flying at 1.00 times real time"


def test_a_client_that_holds_up_the_steps_is_reported(looked):
    looked.diagnosis = Diagnosis(
        looked.player, looked.pacer, lambda: {"drone": looked.log}, False, looked.clock, held=lambda: True
    )
    looked.look("simulation")
    looked.fly(2)
    assert looked.look("simulation").level == OK, "every step was requested"
    looked.now += 1.0
    entry = looked.look("simulation")
    assert entry.level == WARN and "a client of the remote API" in entry.message


def test_an_old_measurement_gives_no_real_time_factor(looked):
    looked.look()
    looked.fly(1, step=100.0)
    assert looked.look("simulation").values["real-time factor"] == "not known"


def test_a_refused_command_is_reported_with_its_sender_until_a_valid_one_arrives(looked):
    looked.command()
    looked.now += 1
    looked.log.refuse("cmd_vel", "/child", "linear.x = nan: must lie within +-20 m/s")
    looked.log.refuse("cmd_vel", "/child", "linear.x = 50: must lie within +-20 m/s")
    entry = looked.look()
    assert entry.level == WARN
    assert entry.message.startswith("refused a message of /child on cmd_vel, and keeps the last valid one: linear.x")
    assert (entry.values["refused"], entry.values["command sender"]) == ("2", "/pilot")
    looked.now += 1
    looked.command()
    entry = looked.look()
    assert entry.level == OK
    assert entry.values["last refused"] == "cmd_vel of /child, 1.0 s ago"


def test_commands_during_a_pause_are_reported(looked):
    looked.fly(1)
    looked.player.pause(True)
    assert looked.look().message == "paused"
    looked.command()
    entry = looked.look()
    assert entry.level == WARN
    assert "/pilot sends commands, but the simulation is paused: `pause false`" in entry.message
    looked.now += 60
    assert looked.look().level == OK


def test_a_drone_that_still_obeys_a_vanished_sender_is_reported(looked):
    looked.command()
    looked.log.senders = list
    looked.fly(1)
    entry = looked.look()
    assert entry.level == WARN
    assert "still obeys the last command of /pilot" in entry.message
    looked.command(Twist())
    assert looked.look().level == OK


def test_a_script_without_a_subscription_to_commands_is_reported(looked):
    looked.script.write_text("def sysCall_init():\n    pass\n")
    looked.player.restart()
    hint = "this script does not subscribe to commands: the tutorial's scripts do from stage 6 on, and `pilot` does"
    entry = looked.look()
    assert (entry.level, entry.message) == (OK, f"flying; {hint}")
    assert entry.values["listens to commands"] == "no"
    looked.command()
    entry = looked.look()
    assert (entry.level, entry.message) == (WARN, hint)
    looked.now += 6
    assert looked.look().level == OK, "commands are no longer sent"
    looked.renew()
    assert looked.look().values["listens to commands"] == "yes"


@pytest.mark.parametrize(
    ("place", "turn", "word", "level"),
    [
        ((0, 0, 0.8), 0.0, "flying", OK),
        ((0, 0, 0.1), 0.0, "on the ground", WARN),
        ((1.0, 0, 4.1), 0.0, "on Wall", WARN),
        ((0, 0, 0.1), 3.1, "upside down", WARN),
        ((0, 0, 3.0), 3.1, "upside down", WARN),
    ],
)
def test_the_situation_of_the_body_is_reported_for_a_script_without_states(looked, place, turn, word, level):
    looked.script.write_text("def sysCall_init():\n    pass\n")
    looked.player.restart()
    looked.drone.body.move(Pose(place, to_quaternion(from_rpy((0, 0, 0), (turn, 0, 0)))))
    looked.fly(1 if level == OK or place[2] == 3.0 else 30)
    entry = looked.look()
    assert (entry.values["does"], entry.level) == (word, level)
    assert doing(looked.drone) == word
    assert word in entry.message or word == "upside down"


def test_a_drone_that_slides_or_touches_a_wall_is_reported(looked):
    looked.script.write_text("def sysCall_init():\n    pass\n")
    looked.player.restart()
    looked.drone.body.move(Pose((0, 0, 0.06), UPRIGHT))
    looked.fly(20)
    looked.drone.pushes.add(Push((6, 0, 0), (0, 0, 0), 0.2))
    looked.fly(3)
    assert looked.look().values["does"] == "slides on the ground"
    looked.renew()
    looked.command()
    looked.fly(120)
    assert looked.look().values["does"] == "touches Wall"


def test_the_states_of_the_pilot_script_are_reported(new_simulation):
    simulation = new_simulation({"start": "landed"})
    simulation.step()
    assert doing(simulation.drone) == "landed"
    simulation.drone.ask("takeoff")
    for _ in range(100):
        simulation.step()
    assert doing(simulation.drone) == "flying"
    simulation.drone.body.hold()
    assert doing(simulation.drone) == "held"


def test_a_script_error_is_reported_until_the_next_start(looked):
    looked.script.write_text("def sysCall_actuation():\n    1 / 0\n")
    looked.player.restart()
    looked.fly(1)
    for subject in ("vehicle drone", "simulation"):
        entry = looked.look(subject)
        assert entry.level == ERROR
        assert f"script error: [actuation] {looked.script}:2: ZeroDivisionError" in entry.message
    looked.script.write_text("def sysCall_init():\n    1 / 0\n")
    with pytest.raises(ScriptError):
        looked.player.start()
    assert "[init]" in looked.look().message
    looked.renew()
    assert looked.look().level == OK


def test_propellers_at_their_limit_are_counted(looked):
    looked.drone.body.move(Pose((0, 0, 900), UPRIGHT))
    script_body = "\n".join(
        f"    sim.setScriptSimulationParameter(sim.getScriptHandle('{name}'), 'particleVelocity', 100)"
        for name in (f"Quadricopter_propeller_respondable{number}" for number in (1, 2, 3, 4))
    )
    looked.script.write_text(f"def sysCall_actuation():\n{script_body}\n")
    looked.player.restart()
    looked.look()
    looked.fly(10)
    assert "propellers are at their limit in 10 of the last 10 steps" in looked.look().message


def test_an_obstacle_that_blocks_the_drone_is_named(looked):
    looked.drone.body.move(Pose((0.7, 0, 1), UPRIGHT))
    looked.command()
    looked.fly(60)
    looked.look()
    looked.fly(5)
    entry = looked.look()
    assert "blocked by Wall (" in entry.message
    assert entry.values["contacts"].startswith("Wall (")


def test_a_drone_on_its_back_gets_a_warning(looked):
    upside_down = to_quaternion(from_rpy((0, 0, 0), (3.1, 0, 0)))
    looked.drone.body.move(Pose((0, 0, 0.1), upside_down))
    looked.fly(20)
    entry = looked.look()
    assert entry.level == WARN
    assert "`restart` puts it upright" in entry.message
    assert entry.values["put elsewhere"] == "1 times"


def test_cameras_report_their_rate_and_the_renderer(looked):
    camera = looked.drone.cameras["front"]
    assert looked.look("cameras").message == "no camera is in use"
    camera.viewers.add(lambda: True)
    try:
        looked.fly(1)
        looked.look()
        looked.fly(8)
        entry = looked.look("cameras")
        assert entry.level == OK
        assert entry.values["drone/front"] == "20.0 of 20.0 Hz"
        assert entry.values["frame time"].endswith(" ms")
        assert "none yet" not in entry.values["renderer"]
        looked.fly(8, step=0.2)
        entry = looked.look("cameras")
        assert entry.level == WARN
        assert "drone/front publishes at 5.0" in entry.message
    finally:
        camera.viewers.clear()


def test_the_worst_problem_comes_first():
    entry = finding("x", "well", [Problem(WARN, "odd"), Problem(ERROR, "bad")], {})
    assert (entry.level, entry.message) == (ERROR, "bad; odd")
    assert finding("x", "well", [], {}).message == "well"


@pytest.mark.parametrize("where", ["def sysCall_init():", "def sysCall_actuation():"])
def test_a_failed_script_of_a_vehicle_is_reported_until_the_next_start(looked, where):
    looked.script.write_text(f"{where}\n    lost()\ndef sysCall_sensing(): pass\n")
    try:
        looked.player.start()
        looked.fly(1)
    except ScriptError as error:
        assert error.phase == "init"
    assert doing(looked.drone) == "script failed"
    entry = looked.look()
    assert entry.level == ERROR and "script.py:2: NameError" in entry.message
    looked.renew()
    assert doing(looked.drone) == "flying" and looked.look().level == OK


@pytest.mark.parametrize(("on", "is_part"), [("DronePosition", True), ("Wall", False)])
def test_a_failed_script_on_an_object_is_an_error_with_its_line(tmp_path, on, is_part, new_simulation):
    script = tmp_path / "attached.py"
    script.write_text("def sysCall_actuation():\n    if sim.getSimulationTime() > 0.08: lost()\n")
    scene = {"objects": [WALL], "scripts": [{"object": on, "script": str(script)}]}
    simulation = new_simulation({"scene": scene})
    player = Player(simulation, lambda _: None, False)
    diagnosis = Diagnosis(player, Pacer(0.05, lambda: 0.0, lambda _: None), dict, False, lambda: 0.0)
    before, levels = simulation.snapshot(), []
    for _ in range(2):
        levels.append({one.name: one.level for one in diagnosis.look()})
        for _ in range(3):
            player.step()
    assert player.playing and set(levels[0].values()) == {OK}
    assert levels[1]["simulation"] == ERROR and levels[1]["vehicle drone"] == (ERROR if is_part else OK)
    assert doing(simulation.drone) == ("script failed" if is_part else "flying")
    lines = [one.message for one in diagnosis.look() if one.level == ERROR]
    assert len(lines) == 1 + is_part and all("attached.py:2: NameError" in one for one in lines)
    simulation.restore(before)
    assert doing(simulation.drone) == "flying"


def test_two_senders_at_once_are_named_but_a_change_of_sender_is_no_problem(looked):
    for number in range(20):
        looked.command(sender="/old" if number < 10 else "/pilot")
        looked.fly(1)
    assert looked.look().level == OK
    for number in range(20):
        looked.command(FORWARD if number % 5 else Twist(), sender="/pilot" if number % 5 else "/zeros")
        looked.fly(1)
    entry = looked.look()
    assert entry.level == WARN and "/pilot and /zeros" in entry.message and "/zeros sends only zeros" in entry.message
    for _ in range(80):
        looked.command()
        looked.fly(1)
    assert "/zeros" not in looked.look().message


def test_the_command_log_forgets_senders_that_are_gone():
    now = 0.0
    log = CommandLog(lambda: now)
    for number in range(100):
        log.take("cmd_vel", f"/rostopic_{number}")
        now += 1.0
    assert len(log._moving) < 5


def test_a_twist_without_a_subscriber_is_reported_while_no_command_arrives(looked):
    looked.diagnosis = Diagnosis(
        looked.player,
        looked.pacer,
        lambda: {"drone": looked.log},
        False,
        looked.clock,
        unheard=lambda: {"/cmd_vel": ["/teleop"], "/bebop/cmd_vel": ["/node"]},
    )
    entry = looked.look()
    assert entry.level == WARN and "/teleop publishes /cmd_vel" in entry.message
    cure = "without a subscriber: publish to /drone/cmd_vel, or start with profile:=bebop"
    assert f"/node publishes /bebop/cmd_vel, {cure}" in entry.message
    looked.command()


# V-REP's tutorial adds these lines in "Removing existing control code", and no later step removes them.
ZEROS = """    -- update twist
    twist[1] = 0 -- front speed
    twist[2] = 0 -- lateral speed
    twist[3] = 0 -- absolute elevation request (if not null)
    twist[6] = 0 -- yaw speed.
"""


@pytest.mark.parametrize(("zeros", "follows"), [(ZEROS, False), ("", True)])
@pytest.mark.parametrize("twist", [FORWARD, Twist(Vector3(0, 0, 0), Vector3(0, 0, 0.5))])
def test_a_script_that_ignores_its_commands_is_reported(tmp_path, zeros, follows, twist, new_simulation):
    """V-REP's tutorial, pasted literally, subscribes to cmd_vel and ignores every command."""
    lua = SCRIPT.with_name("tutorial_v3.lua").read_text()
    elevation = "    -- Elevation control\n"
    assert lua.count(elevation) == 1
    seed = tmp_path / "seed.lua"
    seed.write_text(lua.replace(elevation, zeros + elevation))
    small = {"front": {"width": 16, "height": 12}}
    simulation = new_simulation({"script": str(seed), "cameras": small})
    player, log, now = Player(simulation, lambda _: None, False), CommandLog(lambda: now), 0.0
    diagnosis = Diagnosis(player, Pacer(0.05, lambda: now, lambda _: None), lambda: {"drone": log}, False, lambda: now)
    simulation.drone.commands.receive(twist)
    log.take("cmd_vel", "/pilot")
    log.senders = lambda: ["/pilot"]
    levels = []
    for step in range(100):
        player.step()
        now += 0.05
        if step % 20 == 19:
            (entry,) = (one for one in diagnosis.look() if one.name == "vehicle drone")
            levels.append(entry.level)
    moved = simulation.drone.body.state.position[0], simulation.drone.body.state.angular_velocity[2]
    assert (max(moved) > 0.1) == follows
    assert levels == ([OK] * 5 if follows else [OK, OK, OK, WARN, WARN])
    assert ("not followed" in entry.message) == (not follows)


def test_a_drone_gets_time_to_follow_its_first_command(looked):
    for _ in range(6):
        looked.fly(20)
        looked.look()
    looked.command()
    looked.fly(1)
    assert looked.look().level == OK
