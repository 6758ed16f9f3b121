#!/usr/bin/env python3
"""Run the commands of README.md and docs/*.md as they are written: ./dev.sh docs-commands [--all] [PAGE...].

Each page runs in its own folder with its own ROS master, a few pages at a time. Each `roslaunch` ends before the next.
The commands must exit with 0 and print the lines of the page, apart from numbers; the simulator may refuse nothing.
Without --all, a simulator is started only if a command needs it, and commands that take minutes are skipped.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib
from commands import NOT_RUN, PAGES, ROOT, SHOWN_OTHERWISE, SLOW, Command, commands

sys.path.append(str(ROOT / "test" / "unit"))
import vrep_encoder
import vrep_quadricopter

PATIENCE = 120.0  # s, limit for each command
PARALLEL_PAGES = 4
ENDLESS = (
    *("rostopic echo ", "rosrun drone_sim view", "rosrun drone_sim record_truth"),
    "python3 $(rospack find drone_sim)/docs/fleet/follow.py",
    "python3 $(rospack find drone_sim)/docs/drivers/follow_ball.py",
)
FROM_A_BAG = " -b "
NO_SIMULATOR = ("rosrun drone_sim ", "cat ", "source ", "rosbag info", "python3 loop.py", "python3 -m ")
NEED_SIMULATOR = ("rosrun drone_sim view", "rosrun drone_sim record_truth", "rosrun drone_sim doctor")
WRONG = re.compile(r"Traceback|\[(?:ERROR|FATAL)\]|\bERROR:")
REFUSED = re.compile(rf"{WRONG.pattern}|refused")  # in the output of the simulator
READY = "commands on "
PUBLISH = ("rostopic", "pub", "-1", "/drone/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.5}}")  # recorded in a bag
FLIGHT = ("rosrun", "drone_sim", "fly", "--duration", "1", "--csv", "flight.csv")
DEFAULT_LAUNCH = "roslaunch drone_sim drone.launch"  # if a page starts no simulator


class Failed(Exception):
    """A command does not do what its page says."""


class Background:
    def __init__(self, command: Command, folder: Path, environment: dict[str, str]):
        self.command = command
        self._lines: list[str] = []
        self._changed = threading.Condition()
        self.process = subprocess.Popen(
            ["bash", "-c", f"exec {command.text}"],
            cwd=working_directory(command, folder),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # background processes ignore it
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            with self._changed:
                self._lines.append(line)
                self._changed.notify_all()
        with self._changed:
            self._lines.append("")
            self._changed.notify_all()

    @property
    def log(self) -> str:
        return "".join(self._lines)

    def wait_for(self, expected: str) -> None:
        """Wait until the output contains `expected`; raise Failed if the command ends before."""
        with self._changed:
            has_come = self._changed.wait_for(lambda: expected in self.log or "" in self._lines[-1:], PATIENCE)
        if not has_come or expected not in self.log:
            self.end()
            raise failure(self.command, f"did not say {expected!r}", self.log)

    def end(self) -> None:
        """Press Ctrl-C, and wait until the command has ended."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise failure(self.command, "does not end after Ctrl-C", self.log) from None


def needs_simulator(command: Command) -> bool:
    return command.text.startswith(NEED_SIMULATOR) or not command.text.startswith(NO_SIMULATOR)


def failure(command: Command, cause: str, log: str) -> Failed:
    place = f"{command.page.relative_to(ROOT)}:{command.line}"
    return Failed(f"{place}: $ {command.text}\n  {cause}\n" + "".join(f"  | {one}\n" for one in log.splitlines()[-30:]))


def working_directory(command: Command, folder: Path) -> Path:
    return ROOT if command.text.startswith(("./dev.sh", "source ")) else folder


class Page:
    def __init__(self, page: Path, folder: Path, port: int, everything: bool):
        self._commands = [one for one in commands(page) if one.text not in NOT_RUN]
        self._everything = everything
        self._folder, self._port = folder, port
        self._simulator: Background | None = None
        self.environment = {
            **{name: value for name, value in os.environ.items() if name not in ("DISPLAY", "ROS_IP")},
            "ROS_MASTER_URI": f"http://localhost:{port}",
            "ROS_HOSTNAME": "localhost",
            "HOME": str(folder),
            "MPLCONFIGDIR": matplotlib.get_configdir(),
            "PYTHONUNBUFFERED": "1",
        }
        self.run_commands: list[Command] = []

    def run(self) -> None:
        """Run the commands in order; raise Failed at the first one that does not do what the page says."""
        try:
            for number, command in enumerate(self._commands):
                if command.starts_simulator:
                    self._end_simulator()
                    if self._everything or self._is_needed(number):
                        self._start_simulator(command)
                elif self._everything or command.text not in SLOW:
                    if not number and needs_simulator(command):
                        self._start_simulator(Command(command.page, command.line, DEFAULT_LAUNCH, ()))
                    self._run(command)
            self._end_simulator()
        finally:
            if self._simulator is not None:
                self._simulator.end()

    def _is_needed(self, number: int) -> bool:
        for one in self._commands[number + 1 :]:
            if one.starts_simulator:
                break
            if needs_simulator(one):
                return True
        return "record_to:=." in self._commands[number].text

    def _start_simulator(self, command: Command) -> None:
        self.run_commands.append(command)
        self._simulator = Background(command, self._folder, self.environment)
        self._simulator.wait_for(READY)

    def _end_simulator(self) -> None:
        simulator, self._simulator = self._simulator, None
        if simulator is None:
            return
        if "record_to:=." in simulator.command.text:
            subprocess.run(PUBLISH, env=self.environment, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True)
        simulator.end()
        shown = [line for one in self.run_commands for line in one.shown]
        complaints = [
            one for one in simulator.log.splitlines() if REFUSED.search(one) and not any(matches(s, one) for s in shown)
        ]
        if complaints:
            raise failure(simulator.command, "the simulator complains", "\n".join(complaints))
        for bag in self._folder.glob("drone_sim_*.bag"):
            bag.rename(self._folder / "flight.bag")

    def _run(self, command: Command) -> None:
        if self._simulator is not None and "record_to:=." in self._simulator.command.text:
            self._end_simulator()  # this completes the bag
        self.run_commands.append(command)
        if command.text.startswith(ENDLESS) and FROM_A_BAG not in command.text:
            running = Background(command, self._folder, self.environment)
            running.wait_for("\n")
            running.end()
            log = running.log
        else:
            try:
                completed = subprocess.run(
                    ["bash", "-c", command.text],
                    cwd=working_directory(command, self._folder),
                    env=self.environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    timeout=PATIENCE,
                    check=False,
                )
            except subprocess.TimeoutExpired as timeout_error:
                raise failure(command, "does not end", (timeout_error.stdout or b"").decode(errors="replace")) from None
            log = completed.stdout.decode(errors="replace")
            if completed.returncode:
                raise failure(command, f"ends with {completed.returncode}", log)
        if WRONG.search(log):
            raise failure(command, "complains", log)
        all_lines = log.splitlines() + (self._simulator.log.splitlines() if self._simulator else [])
        for line in () if command.text in SHOWN_OTHERWISE else command.shown:
            if line.strip() not in ("", "...") and not any(matches(line, one) for one in all_lines):
                raise failure(command, f"does not show {line!r}", log)


def matches(shown: str, log: str) -> bool:
    """Return whether a line of a page is in the output, apart from numbers."""
    return mask_numbers(shown) in mask_numbers(log)


def mask_numbers(line: str) -> str:
    """Return the line with every number replaced by #."""
    return re.sub(r"\d+(?:\.\d+)?", "#", line.replace("[WARN] ", "")).strip()


def prepare(page: Path, folder: Path) -> None:
    """Write the files that the page mentions to the folder, from its code blocks if it has them."""
    text = page.read_text(encoding="utf-8")
    for name, content in blocks(text):
        (folder / name).write_text(content)
    for command in commands(page):
        if command.text.startswith("cat ") and command.text not in NOT_RUN:
            (folder / command.text.split()[1]).write_text("\n".join(command.shown) + "\n")
    built_in = ROOT / "src/drone_sim/child_scripts/tutorial.py"
    for name in ("my.py", "submissions/alice.py", "submissions/bob.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(built_in, folder / name)
    if "grade hover my.py" in text:  # the task needs a script that holds against the wind
        shutil.copy(ROOT / "tasks/hover/solution.py", folder / "my.py")
    with zipfile.ZipFile(folder / "class.zip", "w") as file:
        for number, name in enumerate(("Ada Lovelace", "Bo Ek")):
            file.write(ROOT / "tasks/hover/solution.py", f"{name}_{number}_assignsubmission_file_/my.py")
    if "plot_flight flight.csv" in text:
        subprocess.run(FLIGHT, cwd=folder, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True)
    (folder / "Drone.ttt").write_bytes(vrep_encoder.file(*vrep_quadricopter.quadricopter()))


def blocks(text: str) -> Iterator[tuple[str, str]]:
    """Yield names and contents of the files in a page: blocks that begin with a file name, or have known contents."""
    for language, block in re.findall(r"^```(yaml|python|lua)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        file_name = re.match(r"(?:#|--) ([\w.]+\.(?:yaml|py|lua))\b", block)
        if file_name:
            yield file_name[1], block
        elif language == "yaml" and "gusts" in block and "faults" in block:
            yield "storm.yaml", block
        elif language != "yaml" and "propeller_respondable" in block and "5.33" in block:
            yield f"climb.{'py' if language == 'python' else 'lua'}", block


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return int(probe.getsockname()[1])


def run(pages: Sequence[Path], everything: bool) -> list[str]:
    def one(page: Path) -> str:
        with tempfile.TemporaryDirectory(prefix="drone_sim_docs_") as name:
            folder = Path(name)
            prepare(page, folder)
            began = time.monotonic()
            try:
                Page(page, folder, free_port(), everything).run()
            except Failed as error:
                return str(error)
            finally:
                print(f"{page.relative_to(ROOT)}: {time.monotonic() - began:.1f} s", flush=True)
        return ""

    with ThreadPoolExecutor(PARALLEL_PAGES) as pool:
        return [log for log in pool.map(one, pages) if log]


def main() -> int:
    """Run the pages of the arguments; return 0 if every command succeeded."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--all", action="store_true", help="start every simulator, and do what takes minutes, too")
    parser.add_argument("pages", nargs="*", type=Path, metavar="PAGE")
    options = parser.parse_args()
    pages = [one.resolve() for one in options.pages] or [one for one in PAGES if commands(one)]
    complaints = run(pages, options.all)
    print("\n".join(complaints) or "every command does what its page says")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
