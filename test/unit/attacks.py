"""Flights of scripts that attack the process, each in a fork of a server process that has imported all modules.

Run as a program, it is this server: it reads one JSON request per line and writes one JSON reply per line.
"""

import gc
import importlib
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "src"
EVERYTHING = ("drone_sim.run.simulation", "drone_sim.scripting.lua.script")
HANGS = 100  # s, long enough for a busy machine; most flights take less than 1 s


class Attacker:
    """A server process that flies scripts in its forks."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={"PYTHONPATH": str(SOURCE), "PATH": "/usr/bin:/bin"},
        )

    def fly(self, path, limit, where="main"):
        """Return the errors of a flight with the script and of a flight after it, and how much was logged."""
        print(json.dumps([str(path), limit, where]), file=self._process.stdin, flush=True)
        status, text = json.loads(self._process.stdout.readline())
        assert status == 0, f"the process ended with {status}"
        return json.loads(text)

    def close(self):
        self._process.stdin.close()
        self._process.wait(HANGS)


def flight(path, limit, snapshots=3):
    """Fly a script with a command for one step, and for `snapshots` steps after a snapshot each; return the errors."""
    from drone_sim.mechanics.state import Twist
    from drone_sim.run import parameters
    from drone_sim.run.simulation import Simulation
    from drone_sim.scripting.errors import ScriptError

    messages = []
    simulation = None
    try:
        simulation = Simulation(parameters.load({"script_time_limit": limit}), script=path)
        simulation.drone.commands.receive(Twist())
        simulation.step()
        for _ in range(snapshots):
            simulation.restore(simulation.snapshot())
            simulation.step()
    except ScriptError as error:
        messages.append(str(error))
    try:
        if simulation is not None:
            simulation.close()
    except ScriptError as error:
        messages.append(str(error))
    return messages


def _attack(path, limit, where, answer):
    lines = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())
    logging.getLogger("drone_sim.script").addHandler(handler)

    def attack():
        report = {"first": flight(path, limit)}
        Path(path).write_text("", encoding="utf-8")
        report.update(second=flight(path, 20, snapshots=0), lines=len(lines), bytes=sum(map(len, lines)))
        os.write(answer, json.dumps(report).encode())

    if where == "main":
        attack()
    else:
        thread = threading.Thread(target=attack)
        thread.start()
        thread.join()


def _serve():
    for module in EVERYTHING:
        importlib.import_module(module)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("empty.py", "empty.lua"):
            path = Path(folder, name)
            path.write_text("", encoding="utf-8")
            flight(str(path), 20)  # forks inherit the files that this reads and compiles
    gc.freeze()  # else each fork would scan these objects at its exit, which takes longer than most flights
    for line in sys.stdin:
        read, write = os.pipe()
        child = os.fork()
        if not child:
            os.dup2(os.open(os.devnull, os.O_RDWR), 0)
            os.dup2(2, 1)
            _attack(*json.loads(line), write)
            sys.exit(0)
        os.close(write)
        status = _wait(child)
        print(json.dumps([status, os.read(read, 60000).decode()]), flush=True)
        os.close(read)


def _wait(child):
    end = time.monotonic() + HANGS
    while time.monotonic() < end:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return status
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "a hang"


if __name__ == "__main__":
    _serve()
