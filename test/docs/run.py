#!/usr/bin/env python3
"""Run the commands of README.md and docs/*.md as they stand there: ./dev.sh docs-commands [--all] [PAGE...].

Each page in a folder of its own, with a master of its own; some pages at a time. A `roslaunch` ends with the next one.
Its commands must end well and show what the page shows after them (whatever numbers are in it); nothing may be refused.
Without --all a simulator is started only where a command needs it, and what takes minutes is left out.
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

PATIENCE = 120.0  # s, for whatever does not end
AT_ONCE = 4
ENDLESS = (
    *("rostopic echo ", "rosrun drone_sim view", "rosrun drone_sim record_truth"),
    "python3 $(rospack find drone_sim)/docs/fleet/follow.py",
    "python3 $(rospack find drone_sim)/docs/drivers/follow_ball.py",
)
FROM_A_BAG = " -b "
NEEDS_NONE = ("rosrun drone_sim ", "cat ", "source ", "rosbag info", "python3 loop.py", "python3 -m ")  # a simulator
NEEDS_ONE = ("rosrun drone_sim view", "rosrun drone_sim record_truth", "rosrun drone_sim doctor")
WRONG = re.compile(r"Traceback|\[(?:ERROR|FATAL)\]|\bERROR:")
REFUSED = re.compile(rf"{WRONG.pattern}|refused")  # by the simulator, whatever the command has said
FLYING = "commands on "
FLOWN = ("rostopic", "pub", "-1", "/drone/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.5}}")  # into a bag
FLIGHT = ("rosrun", "drone_sim", "fly", "--duration", "1", "--csv", "flight.csv")
USUAL = "roslaunch drone_sim drone.launch"  # where a page does not say what runs


class Failed(Exception):
    """A command does something else than its page says."""


class Background:
    def __init__(self, command: Command, folder: Path, environment: dict[str, str]):
        self.command = command
        self._said: list[str] = []
        self._changed = threading.Condition()
        self.process = subprocess.Popen(
            ["bash", "-c", f"exec {command.text}"],
            cwd=where(command, folder),
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored in what runs in the background
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            with self._changed:
                self._said.append(line)
                self._changed.notify_all()
        with self._changed:
            self._said.append("")
            self._changed.notify_all()

    @property
    def said(self) -> str:
        return "".join(self._said)

    def wait_for(self, what: str) -> None:
        """Wait until it has said something with `what` in it; raise Failed where it ends before."""
        with self._changed:
            came = self._changed.wait_for(lambda: what in self.said or "" in self._said[-1:], PATIENCE)
        if not came or what not in self.said:
            self.end()
            raise failed(self.command, f"did not say {what!r}", self.said)

    def end(self) -> None:
        """Press Ctrl-C, and wait."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise failed(self.command, "does not end after Ctrl-C", self.said) from None


def needs_simulator(command: Command) -> bool:
    return command.text.startswith(NEEDS_ONE) or not command.text.startswith(NEEDS_NONE)


def failed(command: Command, why: str, said: str) -> Failed:
    place = f"{command.page.relative_to(ROOT)}:{command.line}"
    return Failed(f"{place}: $ {command.text}\n  {why}\n" + "".join(f"  | {one}\n" for one in said.splitlines()[-30:]))


def where(command: Command, folder: Path) -> Path:
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
        """Raise Failed for the first that does not do what it should."""
        try:
            for number, command in enumerate(self._commands):
                if command.begins_a_simulator:
                    self._end()
                    if self._everything or self._is_needed(number):
                        self._begin(command)
                elif self._everything or command.text not in SLOW:
                    if not number and needs_simulator(command):
                        self._begin(Command(command.page, command.line, USUAL, ()))
                    self._run(command)
            self._end()
        finally:
            if self._simulator is not None:
                self._simulator.end()

    def _is_needed(self, number: int) -> bool:
        for one in self._commands[number + 1 :]:
            if one.begins_a_simulator:
                break
            if needs_simulator(one):
                return True
        return "record_to:=." in self._commands[number].text

    def _begin(self, command: Command) -> None:
        self.run_commands.append(command)
        self._simulator = Background(command, self._folder, self.environment)
        self._simulator.wait_for(FLYING)

    def _end(self) -> None:
        simulator, self._simulator = self._simulator, None
        if simulator is None:
            return
        if "record_to:=." in simulator.command.text:
            subprocess.run(FLOWN, env=self.environment, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True)
        simulator.end()
        shown = [line for one in self.run_commands for line in one.shown]
        wrong = [
            one for one in simulator.said.splitlines() if REFUSED.search(one) and not any(like(s, one) for s in shown)
        ]
        if wrong:
            raise failed(simulator.command, "the simulator complains", "\n".join(wrong))
        for bag in self._folder.glob("drone_sim_*.bag"):
            bag.rename(self._folder / "flight.bag")

    def _run(self, command: Command) -> None:
        if self._simulator is not None and "record_to:=." in self._simulator.command.text:
            self._end()  # then the bag is whole
        self.run_commands.append(command)
        if command.text.startswith(ENDLESS) and FROM_A_BAG not in command.text:
            running = Background(command, self._folder, self.environment)
            running.wait_for("\n")
            running.end()
            said = running.said
        else:
            try:
                done = subprocess.run(
                    ["bash", "-c", command.text],
                    cwd=where(command, self._folder),
                    env=self.environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    timeout=PATIENCE,
                    check=False,
                )
            except subprocess.TimeoutExpired as late:
                raise failed(command, "does not end", (late.stdout or b"").decode(errors="replace")) from None
            said = done.stdout.decode(errors="replace")
            if done.returncode:
                raise failed(command, f"ends with {done.returncode}", said)
        if WRONG.search(said):
            raise failed(command, "complains", said)
        everywhere = said.splitlines() + (self._simulator.said.splitlines() if self._simulator else [])
        for line in () if command.text in SHOWN_OTHERWISE else command.shown:
            if line.strip() not in ("", "...") and not any(like(line, one) for one in everywhere):
                raise failed(command, f"does not show {line!r}", said)


def like(shown: str, said: str) -> bool:
    """Tell whether a line of a page is in what was said, whatever the numbers are."""
    return masked(shown) in masked(said)


def masked(line: str) -> str:
    """Return a line with # for every number."""
    return re.sub(r"\d+(?:\.\d+)?", "#", line.replace("[WARN] ", "")).strip()


def prepare(page: Path, folder: Path) -> None:
    """Put into the folder the files that the page speaks of: its own code blocks, where it has them."""
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
    if "grade hover my.py" in text:  # in which one has to hold against the wind
        shutil.copy(ROOT / "tasks/hover/solution.py", folder / "my.py")
    with zipfile.ZipFile(folder / "class.zip", "w") as file:
        for number, name in enumerate(("Ada Lovelace", "Bo Ek")):
            file.write(ROOT / "tasks/hover/solution.py", f"{name}_{number}_assignsubmission_file_/my.py")
    if "plot_flight flight.csv" in text:
        subprocess.run(FLIGHT, cwd=folder, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True)
    (folder / "Drone.ttt").write_bytes(vrep_encoder.file(*vrep_quadricopter.quadricopter()))


def blocks(text: str) -> Iterator[tuple[str, str]]:
    """Yield the files in a page: blocks that begin with their name, or have it from where they are used."""
    for kind, block in re.findall(r"^```(yaml|python|lua)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        named = re.match(r"(?:#|--) ([\w.]+\.(?:yaml|py|lua))\b", block)
        if named:
            yield named[1], block
        elif kind == "yaml" and "gusts" in block and "faults" in block:
            yield "storm.yaml", block
        elif kind != "yaml" and "propeller_respondable" in block and "5.33" in block:
            yield f"climb.{'py' if kind == 'python' else 'lua'}", block


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

    with ThreadPoolExecutor(AT_ONCE) as pool:
        return [said for said in pool.map(one, pages) if said]


def main() -> int:
    """Run what the arguments name; return 0 where all is well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--all", action="store_true", help="start every simulator, and do what takes minutes, too")
    parser.add_argument("pages", nargs="*", type=Path, metavar="PAGE")
    options = parser.parse_args()
    pages = [one.resolve() for one in options.pages] or [one for one in PAGES if commands(one)]
    wrong = run(pages, options.all)
    print("\n".join(wrong) or "every command does what its page says")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
