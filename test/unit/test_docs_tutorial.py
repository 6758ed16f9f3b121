"""docs/tutorial.md: the stages fly as described, the commands print what it shows, and the snippets are current."""

import ast
import json
import math
import re
import shlex
import textwrap
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from recorder import Recorder
from tutorial_flights import CONTROLLERS, DOCS, STAGES, TEXT, at, fly, fly_timeline, flying

from drone_sim.mechanics.state import Pose, Twist, Vector3
from drone_sim.offline.fly import main as fly_main
from drone_sim.sensors.truth import described
from drone_sim.vehicles.types import QUADRICOPTER

FORWARD_TURNING = Twist(Vector3(1, -0.3, 0.2), Vector3(0, 0, 0.5))
RIPPLE = 0.01  # m/s, amplitude in vz: the number of particles is whole


def blocks(language):
    return re.findall(rf"^ *```{language}\n(.*?)^ *```$", TEXT, re.MULTILINE | re.DOTALL)


# ---- the stages


def test_there_are_eight_stages():
    assert [name[0] for name in STAGES] == list("12345678")


@pytest.mark.parametrize("stage", CONTROLLERS)
def test_a_stage_has_the_phases_that_it_needs(stage):
    text = STAGES[stage].read_text()
    for phase in ("init", "actuation", "sensing"):
        assert f"def sysCall_{phase}():" in text
    assert ("def sysCall_cleanup():" in text) == (stage[0] in "67")


def test_constant_thrust_sinks_slowly_keeps_sliding_and_does_not_turn():
    flight = fly_timeline("1_thrust", "1_thrust.yaml", seconds=12)
    assert np.all(np.diff(flight.z[::20]) < 0)
    assert 0.55 < flight.z[-1] < 0.65
    assert at(flight.vx, 2.5) > 0.15
    assert flight.vx[-1] == pytest.approx(at(flight.vx, 2.5), abs=1e-9)
    assert np.allclose([flight.y, flight.yaw, flight.wz], 0, atol=1e-9)
    assert np.all(flight.propellers == 5.33)


def test_the_track_frame_follows_position_and_yaw_and_stays_level():
    with flying("1_thrust") as simulation:
        drone = simulation.drone
        drone.body.move(Pose((1, 2, 3), (0.0998334, 0, 0.4794255, 0.8)))
        simulation.step()
        base = simulation.context.objects.matrix(simulation.context.objects.handle("Quadricopter_base"))
        assert drone.track.matrix()[3::4] == pytest.approx(base[3::4])
        assert drone.track.matrix()[8:11] == pytest.approx((0, 0, 1))
        assert base[10] < 0.99
        assert math.atan2(drone.track.matrix()[4], drone.track.matrix()[0]) > 0.5


def test_elevation_climbs_holds_and_returns():
    flight = fly_timeline("2_elevation", "2_elevation.yaml")
    assert at(flight.vz, 3) == pytest.approx(0.5, abs=0.03)
    held = at(flight.z, 6)
    assert 1.4 < held < 1.6
    assert at(flight.z, 6.05) == pytest.approx(0.8, abs=0.01)
    assert at(flight.z, 8) == pytest.approx(held, abs=0.01)
    assert flight.z[-1] == pytest.approx(held, abs=1e-3)
    assert np.allclose([flight.x, flight.y, flight.yaw], 0, atol=1e-9)


def test_yaw_follows_its_command_while_the_position_stays():
    flight = fly_timeline("3_yaw", "3_yaw.yaml")
    assert at(flight.wz, 1.2) / 0.5 == pytest.approx(0.6, abs=0.01)  # three steps after the command
    assert at(flight.wz, 4) == pytest.approx(0.5, abs=0.005)
    assert at(flight.yaw, 6) == pytest.approx(1.5, abs=0.02)
    assert abs(flight.wz[-1]) < 1e-3
    assert flight.yaw[-1] > at(flight.yaw, 6) + 0.05  # the controller does not hold a heading
    assert np.allclose([flight.x, flight.y], 0, atol=1e-6)
    assert np.allclose(flight.z, 0.8, atol=2e-3)


@pytest.mark.parametrize("stage, along, across", [("4_pitch", "x", "y"), ("5_roll", "y", "x")])
def test_speed_is_reached_held_and_braked_and_recovers_from_a_gust(stage, along, across):
    flight = fly_timeline(stage, f"{stage}.yaml")
    speed = getattr(flight, f"v{along}")
    assert 1.3 < max(speed) < 1.7
    settling = speed[round(5 / 0.05) : round(7 / 0.05)]
    assert max(abs(settling - 1)) < (max(speed) - 1) / 4
    assert max(abs(speed[round(13 / 0.05) : round(14 / 0.05)])) < 0.05
    assert at(speed, 14.2) > 0.3
    assert abs(speed[-1]) < 0.05
    assert np.allclose([getattr(flight, across), flight.yaw], 0, atol=1e-6)
    assert np.allclose(flight.z, 0.8, atol=0.02)


def test_the_finished_controller_recovers_from_disturbances():
    flight = fly_timeline("5_roll", "stability.yaml", "drone.position=[0, 0, 5]", seconds=28)
    for rest in (13.9, 19.9, 28):
        assert at(flight.z, rest) == pytest.approx(5, abs=0.01)
        assert np.hypot(at(flight.vx, rest), at(flight.vy, rest)) < 0.05
        assert abs(at(flight.wz, rest)) < 0.01
        assert abs(at(flight.vz, rest)) < RIPPLE


def test_the_drone_falls_without_limits_and_recovers_with_them():
    unlimited = "propellers.velocity_limits=null"
    unlimited_flight = fly_timeline("5_roll", "fall.yaml", "drone.position=[0, 0, 5]", unlimited)
    assert unlimited_flight.propellers.min() < 0
    assert unlimited_flight.z[round(14 / 0.05) :].min() < 0.5
    held = fly_timeline("tutorial", "fall.yaml", "drone.position=[0, 0, 5]", seconds=26)
    assert held.z[round(14 / 0.05) :].min() > 4.98
    assert held.z[-1] == pytest.approx(5, abs=0.01)


@pytest.mark.parametrize("stage", ["2_elevation", "3_yaw", "4_pitch", "5_roll"])
def test_stages_without_ros_ignore_velocity_commands(stage):
    with flying(stage) as simulation:
        simulation.drone.commands.receive(FORWARD_TURNING)
        fly(simulation, 0.9)
        assert simulation.drone.body.state.position == pytest.approx((0, 0, 0.8), abs=2e-3)


@pytest.mark.parametrize("stage", ["6_ros", "7_camera"])
def test_stages_with_ros_follow_a_twist(stage):
    with flying(stage, "cameras.front.width=32", "cameras.front.height=24") as simulation:
        assert np.allclose(fly(simulation, 1).states[:, :2], 0)
        simulation.drone.bus.post("/drone/cmd_vel", FORWARD_TURNING)
        flight = fly(simulation, 6)
    assert flight.wz[-1] == pytest.approx(0.5, abs=0.01)
    assert flight.vz[-1] == pytest.approx(0.2, abs=0.02)
    assert np.hypot(flight.vx[-1], flight.vy[-1]) == pytest.approx(1.04, abs=0.15)


@pytest.mark.parametrize("stage", ["6_ros", "7_camera"])
def test_the_last_stages_fly_exactly_as_the_built_in_script(stage):
    small = ("control.thrust_limits=null", "cameras.front.width=32", "cameras.front.height=24")
    own = fly_timeline(stage, "6_ros.yaml", *small)
    built_in = fly_timeline("tutorial", "6_ros.yaml", *small)
    assert np.array_equal(own.states, built_in.states)
    assert np.array_equal(own.propellers, built_in.propellers)


def test_the_camera_stage_publishes_an_image_in_every_step():
    scene, backend = f"scene_file={DOCS / 'tutorial' / '7_scene.yaml'}", Recorder()
    with flying("7_camera", "cameras.front.width=64", scene, backend=backend) as simulation:
        fly(simulation, 0.15)
        seen = simulation.drone.cameras["front"].take()
    assert [one.topic for one in backend.published] == ["/drone/my_front"] * 3
    assert backend.published[-1].kind == "sensor_msgs/Image"
    picture = backend.published[-1].message
    assert (picture.pixels.shape, picture.frame_id) == ((480, 64, 3), "front_optical")
    assert np.array_equal(picture.pixels, seen)
    assert seen.reshape(-1, 3).std(axis=0).min() > 10  # the image is not uniform


def test_the_camera_stage_renders_nothing_without_a_subscriber(monkeypatch):
    with flying("7_camera") as simulation:
        monkeypatch.setattr(simulation.vision, "picture", lambda *_: pytest.fail("a picture was drawn"))
        fly(simulation, 0.15)


@pytest.mark.parametrize("way", ["mask", "box"])  # color: see test_the_commands_print_what_the_text_shows
def test_the_gate_stage_works_with_mask_and_box(tmp_path, way):
    script = tmp_path / "gate.py"
    script.write_text(STAGES["8_gate"].read_text().replace('FIND = "color"', f'FIND = "{way}"'))
    small = "cameras.front.width=160", "cameras.front.height=120"
    with flying(str(script), *small, f"scene_file={DOCS / 'tutorial' / '8_scene.yaml'}") as simulation:
        for _ in range(200):
            simulation.step()
            if way == "box":
                boxes = {"objects": described(simulation.drone.cameras["front"].truth().seen())}
                simulation.drone.bus.post("/drone/front/truth/boxes", SimpleNamespace(data=json.dumps(boxes)))
            if simulation.drone.body.state.position[0] > 4:
                break
        assert simulation.drone.body.state.position[:2] == pytest.approx((4, 2), abs=0.1)


PARAMETER_COUNTS = {"1": 1, "2": 4, "3": 5, "4": 10, "5": 10, "6": 10, "7": 10}  # number of tunable parameters by stage


@pytest.mark.parametrize("stage", CONTROLLERS)
def test_the_gains_of_a_stage_are_tunable_parameters(stage):
    with flying(stage, "cameras.front.width=32", "cameras.front.height=24") as simulation:
        fly(simulation, 4)
        tuning = simulation.child_scripts["drone"].tuning
        gains = {name: value for name, value in tuning.values().items() if name in vars(simulation.parameters.control)}
        assert len(gains) == PARAMETER_COUNTS[stage[0]]
        before = simulation.drone.body.state.position[2]
        tuning.change({"thrust_gravity": 5.0})
        assert fly(simulation, 2).z[-1] < before - 0.05


# ---- the text


def test_the_diagram_shows_the_propellers_of_the_quadricopter():
    source = (DOCS / "draw_diagrams.py").read_text()
    drawn = ast.literal_eval(re.search(r"^PROPELLERS = (\(.*?^\))", source, re.MULTILINE | re.DOTALL).group(1))
    script = STAGES["1_thrust"].read_text()
    for (_, name, _, _, clockwise, signs), (known, rotation) in zip(drawn, QUADRICOPTER.rotors):
        assert name == known.replace("_", " ")
        assert clockwise == (rotation > 0)  # the reaction torque is opposite to the blades' rotation
        mixing = " ".join(f"{sign} self.{what}_corr" for sign, what in zip(signs, ("pitch", "roll", "yaw")))
        assert f"prop_{known} = self.thrust * (1 {mixing})" in script


@pytest.mark.parametrize("stage", STAGES)
def test_the_text_links_every_stage(stage):
    assert f"(tutorial/{stage}.py)" in TEXT
    assert f"docs/tutorial/{stage}.py" in TEXT


@pytest.mark.parametrize("snippet", blocks("python"), ids=lambda snippet: snippet.strip().splitlines()[0])
def test_every_python_snippet_is_part_of_a_script(snippet):
    wanted = textwrap.dedent(snippet)
    assert any(wanted in textwrap.dedent(_with_margin(path, snippet)) for path in STAGES.values())


def _with_margin(path, snippet):
    """Return the text of a script with the indentation of `snippet` removed from the lines that have it."""
    margin = len(snippet) - len(snippet.lstrip(" "))
    return "".join(line[margin:] if not line[:margin].strip() else line for line in path.open())


def test_link_and_picture_targets_exist():
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert target.startswith("http") or (DOCS / target).exists(), target


def test_every_picture_is_made_by_a_command():
    code = "".join((DOCS / name).read_text() for name in ("make_pictures.sh", "take_pictures.py", "draw_diagrams.py"))
    plots = re.search(r"^plots\(\).*?^\}", code, re.MULTILINE | re.DOTALL).group()
    for name in re.findall(r"\(pictures/tutorial_([^)]+)\.png\)", TEXT):
        assert f"tutorial_{name}.png" in code or name in plots.split() or f" {name};" in plots, name


def test_the_commands_print_what_the_text_shows(tmp_path, monkeypatch, capsys):
    (tmp_path / "docs").symlink_to(DOCS)
    monkeypatch.chdir(tmp_path)  # the commands write CSV files into the working directory
    shown = [pair for block in blocks("console") for pair in commands_in(block)]
    assert len(shown) > 20
    for command, output in shown:
        was_run = run(command)
        printed = capsys.readouterr().out
        if was_run:
            assert comparable(printed) == comparable(output), command
        else:
            assert not output, f"{command}: no test runs it, so the text may not show what it prints"


def commands_in(block):
    """Return pairs of a command in a console block and the output shown below it."""
    parts = re.split(r"^[12]\$ ", textwrap.dedent(block), flags=re.MULTILINE)
    return [part.partition("\n")[::2] for part in parts[1:]]


def run(command):
    """Run a command of the text in this process if it needs no ROS; return whether it was run."""
    words = shlex.split(command)
    if words[:3] == ["rosrun", "drone_sim", "fly"]:
        drawn = words.index("--plot") if "--plot" in words else len(words)
        assert fly_main([*words[3:drawn], *words[drawn + 2 :]]) == 0
    elif words[:2] == ["python3", "-c"]:
        exec(words[2], {})
    elif words[0] in ("python3", ".venv/bin/python"):
        source = Path(words[1]).read_text()
        names = {"__name__": "imported"}
        exec(compile(source, words[1], "exec"), names)
        assert names["main"](words[2:]) == 0
    else:
        return False
    return True


def comparable(printed):
    """Return the printed lines without the elapsed time."""
    return re.sub(r" in [\d.]+ s \([\d.]+ times real time\)", "", printed).strip().splitlines()
