"""The `fly` command: flights, CSV files, plots, errors and signals."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from drone_sim.mechanics.state import Twist, Vector3
from drone_sim.offline.fly import main, settings
from drone_sim.offline.recording import COLUMNS
from drone_sim.run.parameters import ParameterError

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = """
- {at: 0.15, twist: {linear: [1, 0, 0.2], angular: [0, 0, 0.5]}}
- {at: 1.0, push: {force: [0, 1, 0], torque: [0, 0, 0.01], duration: 0.2}}
- {at: 1.5, pose: {position: [1, 2, 3], rpy: [0.1, 0, 0.7]}}
"""


@pytest.fixture(name="commands")
def _commands(tmp_path):
    path = tmp_path / "commands.yaml"
    path.write_text(COMMANDS)
    return str(path)


@pytest.fixture(name="script")
def _script(tmp_path):
    def write(text):
        path = tmp_path / "script.py"
        path.write_text(text)
        return str(path)

    return write


def read_csv(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return header, [[float(value) for value in row] for row in rows]


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT / "src"), **more}


# ---- CSV


def test_csv_holds_exactly_the_states_of_the_flight(tmp_path, commands, new_simulation):
    out = tmp_path / "out.csv"
    assert main(["--commands", commands, "--duration", "1", "--csv", str(out)]) == 0
    header, rows = read_csv(out)
    assert header == list(COLUMNS)
    assert len(rows) == 21

    simulation = new_simulation()
    for step, row in enumerate(rows):
        drone, state = simulation.drone, simulation.drone.body.state
        assert row[:14] == [simulation.time, *(number for part in state for number in part)]
        assert row[14:] == [
            *drone.commands.now.linear,
            drone.commands.now.angular.z,
            *drone.propulsion.particle_velocities,
        ]
        if step == 3:
            drone.commands.receive(Twist(Vector3(1, 0, 0.2), Vector3(0, 0, 0.5)))
        simulation.step()


def test_csv_numbers_are_at_most_as_long_as_their_repr(tmp_path):
    out = tmp_path / "out.csv"
    assert main(["--duration", "0.1", "--set", "drone.position=[0.1, 0, 0.8]", "--csv", str(out)]) == 0
    first, second, _ = out.read_text().splitlines()[1:]
    assert first == "0,0.1,0,0.8,0,0,0,1" + ",0" * 14
    for field in second.split(","):
        assert len(field) <= len(repr(float(field)))


def test_header_names_every_column_once():
    assert len(set(COLUMNS)) == len(COLUMNS) == 22
    assert " ".join(name.split()[0] for name in COLUMNS[:14]) == "t x y z qx qy qz qw vx vy vz wx wy wz"


def test_entries_take_effect_in_the_step_that_begins_at_their_time(tmp_path, commands):
    out = tmp_path / "out.csv"
    assert main(["--commands", commands, "--csv", str(out)]) == 0
    _, rows = read_csv(out)
    assert [row[14] for row in rows[:6]] == [0, 0, 0, 0, 1, 1]  # the step that begins at 0.15 s ends at 0.20 s
    assert rows[30][3] < 2 < rows[31][3]  # moved to z = 3 m at 1.5 s


def test_two_processes_write_identical_csv_files(tmp_path, commands):
    written = []
    for seed in ("1", "2"):
        out = tmp_path / f"{seed}.csv"
        command = [sys.executable, str(ROOT / "scripts" / "fly"), "--commands", commands, "--csv", str(out)]
        ended = subprocess.run(
            command, env=environment(PYTHONHASHSEED=seed), cwd=tmp_path, stdout=subprocess.PIPE, check=True, text=True
        )
        assert "flew 6.50 s in" in ended.stdout
        written.append(out.read_bytes())
    assert written[0] == written[1]


# ---- duration, script, --set


@pytest.mark.parametrize(
    "arguments, last",
    [
        (["--duration", "2"], 2.0),
        (["--duration", "0"], 0.0),
        (["--duration", "0.15"], 0.15),
        (["--set", "time_step=0.1", "sub_step=0.01"], 10.0),
        (["--commands", "COMMANDS"], 6.5),
    ],
)
def test_the_flight_lasts_as_long_as_requested_or_as_its_commands(tmp_path, commands, arguments, last):
    out = tmp_path / "out.csv"
    arguments = [commands if argument == "COMMANDS" else argument for argument in arguments]
    assert main([*arguments, "--csv", str(out)]) == 0
    assert read_csv(out)[1][-1][0] == pytest.approx(last, abs=1e-9)


def test_a_script_receives_the_twists_as_messages(script, commands, capsys):
    path = script(
        """
def sysCall_init():
    simROS.subscribe("/drone/cmd_vel", "geometry_msgs/Twist", "on_twist")

def on_twist(msg):
    print("heard", round(sim.getSimulationTime(), 9), msg.linear.x, msg.linear.z, msg.angular.z)
"""
    )
    assert main(["--script", path, "--commands", commands]) == 0
    heard = [line for line in capsys.readouterr().out.splitlines() if line.startswith("heard")]
    assert heard == ["heard 0.15 1.0 0.2 0.5"]


def test_settings_are_nested_by_dots_and_read_as_yaml():
    assert settings(["control.thrust_limits=null", "drone.position=[0, 0, 5]", "drone.yaw=1", "script=a=b"]) == {
        "control": {"thrust_limits": None},
        "drone": {"position": [0, 0, 5], "yaw": 1},
        "script": "a=b",
    }
    assert settings(["gravity=1", "gravity=2"]) == {"gravity": 2}


@pytest.mark.parametrize("assignment", ["gravity", "=3", "control.=3", "control..Kzref=3", "gravity=["])
def test_an_invalid_setting_is_refused(assignment):
    with pytest.raises(ParameterError, match="--set"):
        settings([assignment])


def test_settings_take_effect_in_the_flight(tmp_path):
    out = tmp_path / "out.csv"
    assert main(["--duration", "1", "--set", "drone.position=[1, 2, 5]", "--set", "gravity=0", "--csv", str(out)]) == 0
    _, rows = read_csv(out)
    assert rows[0][1:4] == [1, 2, 5]
    assert rows[-1][3] > 5.1  # nothing holds it down


# ---- errors, signals and exit


@pytest.mark.parametrize(
    "arguments, says",
    [
        (["--set", "control.Kzre=3"], "parameter control/Kzre: unknown key"),
        (["--set", "gravity"], "--set gravity: must be KEY=VALUE"),
        (["--duration", "nan"], "nan: must be a number of seconds, from 0 to 1e+06"),
        (["--duration", "-1"], "-1: must be a number of seconds, from 0 to 1e+06"),
        (["--duration", "long"], "long: must be a number of seconds, from 0 to 1e+06"),
        (["--commands", "nowhere.yaml"], "nowhere.yaml"),
        (["--csv", "nowhere/out.csv"], "nowhere/out.csv"),
        (["--plot", "nowhere/out.png"], "nowhere/out.png"),
        (["--plot", "out.wrong"], "wrong"),
        (["--sped", "2"], "unrecognized arguments: --sped 2"),
        (["--script", "nowhere.py"], "nowhere.py"),
        (["--script", "script.txt"], "must end in .py or .lua"),
        (["--plot", "out.txt"], "out.txt: matplotlib does not write .txt; it writes "),
        (["--plot", "."], ".: is a folder"),
        (["--csv", "."], ".: is a folder"),
        (["--csv", "out.png"], "--csv out.png: must end in .csv or .txt"),
        (["--commands", "climb.py"], "--commands climb.py: must end in .yaml or .yml"),
        (["--scene", "room.png"], "--scene room.png: must end in .yaml or .yml"),
        (["--config", "room"], "--config room: must end in .yaml or .yml"),
        (["--scene", "nowhere.yaml"], "parameter scene_file = 'nowhere.yaml': no such file: nowhere.yaml"),
        (["--config", "nowhere.yaml"], "parameter config = 'nowhere.yaml': no such file: nowhere.yaml"),
        (["--video", "out.avi"], "--video out.avi: must end in .mp4"),
        (["--video", "nowhere/out.mp4"], "nowhere/out.mp4"),
        (["--video", "out.mp4", "--camera", "trak"], "--camera 'trak': no such camera; near names are track"),
        (["--video", "out.mp4", "--set", "time_step=0.001", "sub_step=0.001"], "1000 pictures a second; at most 240"),
        (["--camera", "track"], "--camera track: only works with --video or --truth"),
        (["--truth", "nowhere/out"], "nowhere/out: no such folder"),
        (["--csv", "a.txt", "--plot", "./a.txt"], "--csv a.txt: must not be the same file"),
    ],
)
def test_a_wrong_argument_gives_one_line_and_status_1(tmp_path, monkeypatch, capsys, arguments, says):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(arguments)
    except SystemExit as ended:  # argparse exits
        status = ended.code
    lines = capsys.readouterr().err.splitlines()
    assert status == 1
    assert len(lines) == 1
    assert lines[0].startswith("fly: ")
    assert says in lines[0]


@pytest.mark.parametrize(
    "arguments",
    [
        ["--scene", "scene.yaml"],
        ["--script", "no.py"],
        ["--script", "bad.py"],
        ["--plot", "out.wrong"],
        ["--commands", "scene.yaml"],
    ],
)
def test_a_flight_that_cannot_start_keeps_the_previous_csv_file(tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text("boxes: []\n")
    (tmp_path / "bad.py").write_text("x = = 1\n")
    (tmp_path / "flight.csv").write_text("the last flight")
    assert main([*arguments, "--csv", "flight.csv"]) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert (tmp_path / "flight.csv").read_text() == "the last flight"


def test_scene_values_override_config_values_as_in_the_launch_file(tmp_path):
    (tmp_path / "scene.yaml").write_text("drone: {position: [1, 2, 3], yaw: 1}\n")
    (tmp_path / "config.yaml").write_text("gravity: 0.0\ndrone: {position: [7, 7, 7]}\n")
    files = ["--scene", str(tmp_path / "scene.yaml"), "--config", str(tmp_path / "config.yaml")]
    assert main([*files, "--duration", "1", "--csv", str(tmp_path / "out.csv")]) == 0
    _, rows = read_csv(tmp_path / "out.csv")
    assert rows[0][1:4] == [1, 2, 3]
    assert rows[-1][3] > 3.1  # nothing holds it down


def test_a_script_error_keeps_the_rows_until_then_and_runs_cleanup(tmp_path, script, capsys):
    out = tmp_path / "out.csv"
    path = script(
        """
def sysCall_actuation():
    if sim.getSimulationTime() > 0.49:
        undefined

def sysCall_cleanup():
    print("cleaned up")
"""
    )
    assert main(["--script", path, "--csv", str(out)]) == 1
    captured = capsys.readouterr()
    assert "cleaned up" in captured.out
    assert "flew 0.50 s" in captured.out
    assert len(captured.err.splitlines()) == 1
    assert f"{path}:4: NameError" in captured.err
    assert [row[0] for row in read_csv(out)[1]] == pytest.approx([step * 0.05 for step in range(11)])


def test_an_error_in_init_is_not_hidden_by_an_error_in_cleanup(script, capsys):
    file = script("def sysCall_init():\n    first\n\ndef sysCall_cleanup():\n    second\n")
    assert main(["--script", file, "--duration", "1"]) == 1
    said = capsys.readouterr()
    assert "[init]" in said.err and "'first'" in said.err
    assert "[cleanup]" in said.out and "'second'" in said.out


def test_an_error_in_cleanup_is_reported(script, capsys):
    assert main(["--script", script("def sysCall_cleanup():\n    undefined\n"), "--duration", "1"]) == 1
    assert "NameError" in capsys.readouterr().err


def test_ctrl_c_stops_the_flight_and_keeps_its_rows(tmp_path, script):
    out = tmp_path / "out.csv"
    path = script(
        """
def sysCall_sensing():
    if abs(sim.getSimulationTime() - 1) < 0.01:
        print("flying", flush=True)

def sysCall_cleanup():
    print("cleaned up", flush=True)
"""
    )
    process = subprocess.Popen(
        [sys.executable, str(ROOT / "scripts" / "fly"), "--script", path, "--duration", "1e6", "--csv", str(out)],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A test run in the background may have SIGINT ignored, which a child inherits.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    while "flying" not in process.stdout.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    printed, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert "cleaned up" in printed
    header, rows = read_csv(out)
    assert len(rows) >= 20
    assert {len(row) for row in rows} == {len(header)}


HANG = """
import ctypes, time

def hang():  # in a call that holds Python's lock, and that no signal ends
    mutex = ctypes.create_string_buffer(64)
    while True:
        ctypes.PyDLL(None).pthread_mutex_lock(mutex)

"""


@pytest.mark.parametrize(
    ("does", "number", "status", "killed"),
    [
        ("try: time.sleep(0.01)\n    except KeyboardInterrupt: raise SystemExit", signal.SIGINT, 130, False),
        ("pass", signal.SIGTERM, 143, False),
        ("hang()", signal.SIGINT, -signal.SIGKILL, True),
    ],
    ids=["a script that would catch it", "SIGTERM", "a script that does not return"],
)
def test_a_signal_ends_the_flight_whatever_a_script_does(script, does, number, status, killed):
    path = script(f"{HANG}def sysCall_actuation():\n    print('flying', flush=True)\n    {does}\n")
    process = subprocess.Popen(
        [sys.executable, str(ROOT / "scripts" / "fly"), "--script", path, "--duration", "1e6"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while "flying" not in process.stdout.readline():
        assert process.poll() is None
    process.send_signal(number)
    printed, errors = process.communicate(timeout=60)
    assert process.returncode == status, errors
    assert errors.startswith("fly: killed: ") == killed
    assert ("ended at" in printed) == (not killed)
    assert "Traceback" not in errors


def test_threads_and_exit_handlers_of_a_script_do_not_delay_the_end(script):
    leftovers = "threading.Thread(target=time.sleep, args=(1000,)).start(); atexit.register(time.sleep, 1000)"
    path = script(f"import atexit, threading, time\n\ndef sysCall_init():\n    {leftovers}\n")
    completed = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "fly"), "--script", path, "--duration", "0.1"],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert completed.stdout.startswith("flew 0.10 s in")
    assert completed.stderr.startswith("fly: ended without waiting for ") and completed.stderr.count("\n") == 1


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_output_of_a_script_that_cannot_be_encoded_is_shown_escaped(script, encoding):
    """The text has a lone surrogate, which UTF-8 cannot encode, and an umlaut, which ASCII cannot encode."""
    said = "\n    ".join(
        f"{say}('\\ud800 \u00e4')" for say in ("print", "self.x =", "sim.addStatusbarMessage", "raise ValueError")
    )
    path = script(f"def sysCall_actuation():\n    {said}\n")
    completed = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "fly"), "--script", path, "--duration", "0.1"],
        env={**environment(), "PYTHONIOENCODING": encoding},
        capture_output=True,
        check=False,
    )
    shown = "\\ud800 \u00e4".encode(encoding, "backslashreplace")
    assert completed.stdout.splitlines()[:2] == [shown, shown]
    assert completed.stderr.splitlines() == [f"fly: [actuation] {path}:5: ValueError: ".encode() + shown]


def test_fly_works_without_ros(tmp_path):
    program = (
        "import sys\n"
        "for name in ('rospy', 'rospkg', 'roslib', 'genpy', 'geometry_msgs'): sys.modules[name] = None\n"
        "from drone_sim.offline.fly import main\n"
        "sys.exit(main(['--duration', '1', '--plot', 'out.png']))\n"
    )
    variables = {name: value for name, value in environment().items() if not name.startswith("ROS")}
    subprocess.run([sys.executable, "-c", program], env=variables, cwd=tmp_path, check=True)


# ---- plot


@pytest.mark.parametrize("option, module", [("--plot", "matplotlib.axes"), ("--video", "av")])
def test_a_missing_optional_package_is_reported_before_the_flight(tmp_path, monkeypatch, capsys, option, module):
    for ours in ("plot", "video"):
        monkeypatch.delitem(sys.modules, f"drone_sim.offline.{ours}", raising=False)
        monkeypatch.delattr(f"drone_sim.offline.{ours}", raising=False)
    monkeypatch.setitem(sys.modules, module, None)
    table = tmp_path / "out.csv"
    ending = {"--plot": "png", "--video": "mp4"}[option]
    assert main(["--duration", "1", "--csv", str(table), option, f"{tmp_path}/out.{ending}"]) == 1
    name = module.partition(".")[0]
    said = f"fly: this needs the Python package {name}: `./dev.sh setup --all` installs it\n"
    assert capsys.readouterr().err == said and not table.exists()


def test_plot_writes_a_png_file(tmp_path, commands):
    out = tmp_path / "out.png"
    assert main(["--commands", commands, "--plot", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.fixture(name="drawn")
def _drawn(monkeypatch, tmp_path):
    drawn = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    return drawn


def test_plot_shows_velocities_in_the_track_frame(tmp_path, drawn):
    commands = tmp_path / "forward.yaml"
    commands.write_text("[{at: 0, twist: {linear: [1, 0, 0]}}]")
    turned = ["--set", "drone.yaw=1.5707963267948966"]
    assert main([*turned, "--commands", str(commands), "--duration", "5", "--plot", "out.png"]) == 0
    axes = {ax.get_ylabel(): ax for ax in drawn[0].axes}
    commanded, flown = axes["forward $v_x$ [m/s]"].get_lines()[:2]
    assert commanded.get_ydata()[-1] == 1.0
    assert flown.get_ydata()[-1] == pytest.approx(0.911, rel=0.02)  # the drone flies along the world's y axis
    pitch, roll = axes["attitude [rad]"].get_lines()[:2]
    assert max(pitch.get_ydata()) > 0.1  # the nose is down in forward flight
    assert max(abs(roll.get_ydata())) < 0.01
    assert axes["yaw [rad]"].get_lines()[0].get_ydata()[-1] == pytest.approx(1.5708, abs=1e-3)


def test_plot_shows_the_path_from_above_with_a_gap_at_a_pose(tmp_path, drawn):
    commands = tmp_path / "pose.yaml"
    commands.write_text("[{at: 0, twist: {linear: [1, 0, 0]}}, {at: 2, pose: {position: [5, 5, 1]}}]")
    assert main(["--commands", str(commands), "--duration", "3", "--plot", "out.png"]) == 0
    (path,) = (ax for ax in drawn[0].axes if ax.get_xlabel() == "$x$ [m]")
    line, start, end = path.get_lines()
    x, y = line.get_data()
    gap = np.flatnonzero(np.isnan(x))
    assert list(gap) == [41]  # rows for 0 s to 2 s, and one for the step with the pose command
    assert max(y[:41]) < 0.1 and min(y[42:]) > 4.9
    assert (*start.get_data(), *end.get_data()) == (0, 0, x[-1], y[-1])
    assert path.get_aspect() == 1


@pytest.mark.parametrize(
    "commands, low, high, cut",
    [
        ("[]", 4.5, 6, False),  # without the 0 before the first step
        ("[{at: 2, pose: {position: [0, 0, 2], rpy: [0.3, 0, 0]}}]", 1, 8, True),
    ],
)
def test_the_propeller_axis_is_scaled_without_outliers(tmp_path, drawn, commands, low, high, cut):
    (tmp_path / "commands.yaml").write_text(commands)
    assert main(["--commands", "commands.yaml", "--duration", "17", "--plot", "out.png"]) == 0
    (ax,) = (ax for ax in drawn[0].axes if ax.get_ylabel() == "propellers [m/s]")
    assert low < ax.get_ylim()[0] < 5.3 < ax.get_ylim()[1] < high
    assert any(text.get_text().startswith("goes from") for text in ax.texts) == cut


# ---- forks


@pytest.mark.parametrize(
    "where", ["", "def sysCall_init():\n    ", "def sysCall_actuation():\n    ", "def sysCall_thread():\n    "]
)
def test_a_script_that_forks_flies_once(script, where, tmp_path):
    """The forked copy ends before it returns to the simulator. Pools and subprocesses of a script work."""
    before = "import multiprocessing, os, subprocess, sys\nself.pid = os.getpid()\n"
    forking = """
def begun():
    if os.getpid() == self.pid and not hasattr(self, "child"):
        with multiprocessing.get_context("fork").Pool(1) as pool:
            print("pool", pool.map(abs, [-1]))
        print(subprocess.run([sys.executable, "-c", "print(7)"], stdout=-1, preexec_fn=lambda: None).stdout)
        self.child = os.fork()
"""
    path = script(
        f"{before}{forking}{where}begun()\ndef sysCall_cleanup():\n    print('ended', os.waitpid(self.child, 0)[1])\n"
    )
    arguments = ["--script", path, "--duration", "0.2", "--csv", str(tmp_path / "o.csv")]
    flown = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "fly"), *arguments],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
    )
    said = (flown.stdout + flown.stderr).splitlines()
    assert flown.returncode == 0 and sum("flew 0.20 s" in line for line in said) == 1, said
    assert sum("os.fork()" in line for line in said) == 1 and "ended 256" in said
    assert "pool [1]" in said and "7" in said
    assert len(read_csv(tmp_path / "o.csv")[1]) == 5
