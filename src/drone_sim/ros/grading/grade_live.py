"""`rosrun drone_sim grade_live PLAN`: grade the script or the node that flies on a running simulator.

The program restarts the simulation, sends the plan's timeline by topics, records the vehicle's topics, and judges the
flight by the same criteria as `grade`. As a <test> of rostest it writes the result for rostest. See docs/grading.md.
"""

from __future__ import annotations

import argparse
import copy
import os
import re
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import rosgraph
import rospy

from drone_sim.command_line import FAILED, Parser, status_of
from drone_sim.files import writing
from drone_sim.files.yaml_writing import dump
from drone_sim.grading import flight
from drone_sim.grading import plan as plans
from drone_sim.grading.flight_record import FlightRecord
from drone_sim.grading.outputs import as_json, gradescope, junit, table
from drone_sim.grading.outputs.html import report
from drone_sim.grading.permissions import CHANGE, MOVE
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.shutdown import end_on_signals
from drone_sim.ros.core.startup import init_node, status_of_node
from drone_sim.ros.grading.flight_listener import FlightListener, LiveRules
from drone_sim.ros.grading.simulator import GradedSimulator, Mismatch, lookup, scene_file, timeline_file
from drone_sim.ros.grading.timeline_sender import TimelineSender, moves_vehicle, steps_late
from drone_sim.run.parameters import Parameters
from drone_sim.scene.scene_parameters import find_files_beside

_NAME = "grade_live"
_ROSTEST_OUTPUT = "--gtest_output=xml:"  # prefix of rostest's argument for the file of the result
_STOPPED_TIMEOUT, _STALLED_TIMEOUT = 1.0, 10.0  # s of real time without a step after which a flight has ended
_POLL_INTERVAL = 0.05  # s of real time
_LAST_MESSAGES = 0.3  # s of real time until the last messages have arrived
_RESTARTED = "another client has restarted the simulation"
_PATIENCE = 30.0  # s of real time
_EARLY, _LATE = 1e-6, 2.0  # s of simulated time by which a move of the timeline may differ, on a busy machine


def main() -> int:
    """Grade; return 0 if the flight passes, else 1, after the table or one line for a user's mistake."""
    words = [word for word in rosgraph.myargv(sys.argv)[1:] if word != "--text"]  # which rostest adds
    options = _parser().parse_args([re.sub(f"^{re.escape(_ROSTEST_OUTPUT)}", "--rostest=", word) for word in words])
    if options.write_config:
        return status_of(_NAME, lambda: _write_config(options.plan, options.write_config))
    if not init_node(_NAME, anonymous=True, disable_signals=True):
        return FAILED
    end_on_signals()
    results: list[Result] = []
    status = status_of_node(_NAME, lambda: results.append(_grade_and_write(options)))
    return status or (0 if results[0].passed else FAILED)


def _write_config(file: str, path: str) -> None:
    """Write the file for the launch argument `config`. Raises ValueError and OSError, in one line."""
    plan = plans.read(from_shell(file))
    if isinstance(plan.config, str):
        raise ValueError(f"{file}: its config is a file already: {plan.config}")
    config = copy.deepcopy(dict(plan.config))
    find_files_beside(plan.folder, config)
    writing.write(path, dump(config))


def _grade_and_write(options: argparse.Namespace) -> Result:
    """Grade, write the outputs, and return the result. Raises ValueError and OSError, in one line."""
    plan = plans.read(from_shell(options.plan))
    if options.html:
        report.check(options.html)
    for file in filter(None, (options.csv, options.json, options.junit, options.gradescope)):
        writing.check_writable(file)
    result, record = grade(plan, options.seed, options.node, options.simulator, options.patience)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(options.csv or f"{folder}/flight.csv")
        if record is not None:
            with writing.replacing(str(file)) as opened:
                flight.write_table(record.rows, opened)
        for write, path in (
            (as_json.write, options.json),
            (gradescope.write, options.gradescope),
            (junit.write, options.junit),
            (junit.write, options.rostest),
        ):
            if path:
                write(plan, [result], path)
        if options.html:
            report.write(plan, [result], lambda _: file if record is not None else None, options.html)
    table.show(plan, [result])
    return result


def grade(plan: Plan, seed: int, node: str, simulator: str, patience: float) -> tuple[Result, FlightRecord | None]:
    """Fly once, and return the result and the record of the flight.

    `node` is the name of the node that flies, '' if the simulator's script does. Raises Mismatch and ParameterError if
    the plan cannot be graded on this simulator; later errors are in the result.
    """
    running = GradedSimulator(simulator, patience)
    parameters = running.fit(plan)
    live = _LiveFlight(plan, seed, running, parameters)
    running.wait(
        live.is_connected, f"{running.node} lacks topics of the plan's vehicles: launch it in the plan's scene"
    )
    if node:
        running.wait(lambda: lookup("lookupNode", rospy.resolve_name(f"/{node.strip('/')}")), f"no node {node}")
    error = live.fly()
    script = node or parameters.script
    record = live.listener.record(plan.duration)
    if record is None:
        return flight.result_of(plan, script, seed, {}, error or "nothing was heard of the flight"), None
    late = steps_late(plan.timeline_of(parameters).of(plan.vehicle_of(parameters)), record.rows, parameters.time_step)
    if late and not plan.lockstep:
        rospy.logwarn(f"the timeline came up to {late} steps late: a lower real_time_factor gives it more time")
    missed = missed_steps(record.times, parameters.time_step)
    if missed and plan.lockstep:
        rospy.logwarn(f"grade_live has missed {missed} steps, as on a busy machine: the digest is that of the others")
    # After a restart the record has steps of two flights, between which the vehicle seems to jump.
    record, broken_rule = (record, "") if error == _RESTARTED else live.cut_at_broken_rule(record)
    tried = [*live.rules.tried, *live.listener.forged]
    return flight.result_of(plan, script, seed, {}, broken_rule or error or None, record, tried), record


def missed_steps(times: np.ndarray, time_step: float) -> int:
    """Return how many steps are missing between the first and the last one of a flight; `times` in s."""
    return round((times[-1] - times[0]) / time_step) + 1 - len(times)


class _LiveFlight:
    """A flight that is controlled and recorded by topics."""

    def __init__(self, plan: Plan, seed: int, simulator: GradedSimulator, parameters: Parameters):
        """Advertise and subscribe. Raises Mismatch."""
        self._simulator, self._plan = simulator, plan
        self._duration, self._scene = plan.duration, scene_file(plan, seed)
        self._over = threading.Event()
        lockstep = parameters.lockstep
        wait = max(lockstep.timeout, lockstep.start_timeout) if plan.lockstep else 0.0
        self._stalled_timeout = _STALLED_TIMEOUT + wait  # s of real time
        self._started = False
        wanted = plan.parameters(seed)
        simulator.check_seed(wanted, self._scene)
        self._start_position = next(
            vehicle.position for vehicle in wanted.fleet if vehicle.name == plan.vehicle_of(wanted)
        )
        self._timeline = plan.timeline_of(wanted)
        self._timeline_file = timeline_file(plan) if plan.lockstep else ""
        self._digest = self._timeline.digest if plan.lockstep else ""
        # In lockstep the simulator itself executes the timeline, because a message could arrive a step later.
        self._sender = TimelineSender([] if plan.lockstep else self._timeline.entries, parameters, simulator.node)
        self.listener = FlightListener(plan, parameters, simulator.node, self._after_step)
        self.rules = LiveRules(plan, simulator.node)

    def is_connected(self) -> bool:
        """Return whether all topics from and to the simulator are connected."""
        return self._sender.is_heard and self.listener.is_connected() and self.rules.is_connected()

    def _after_step(self, now: float) -> None:
        """Send the messages that are due after a step that ended at the simulated time `now` (s)."""
        if self._started and not self._over.is_set():
            self._sender.send(now)
            if now >= self._duration - 1e-6:
                self._over.set()

    @property
    def _is_restarted(self) -> bool:
        return self.listener.went_back or self._simulator.starts > 1

    def fly(self) -> str:
        """Fly, and return an error in one line, or ''."""
        try:
            self._simulator.stop()
            time.sleep(_LAST_MESSAGES)  # so that clear() discards all messages from before the flight
            self.listener.clear()
            self.rules.clear()
            self._started = True
            self._simulator.start(self._scene, self._timeline_file, self._digest)
            error = self._wait()
            self._over.set()
            if rospy.is_shutdown():
                return error
            time.sleep(_LAST_MESSAGES)
            error = error or (_RESTARTED if self._is_restarted else "")
            self._simulator.stop()
        except Mismatch as mismatch:
            return str(mismatch)
        return error or self._simulator.error

    def _wait(self) -> str:
        """Wait for the end of the flight; return the reason of an early end, or ''."""
        last, since = -1.0, time.monotonic()
        while not self._over.wait(_POLL_INTERVAL):
            now = self.listener.time
            self.listener.find_topics()
            if now != last:
                last, since = now, time.monotonic()
            waited = time.monotonic() - since
            if rospy.is_shutdown():
                return f"grade_live was ended at {now:.2f} s"
            if self._is_restarted:
                return _RESTARTED
            if self._simulator.state == "stopped" and waited > _STOPPED_TIMEOUT:  # the topic `state` may be late
                return self._simulator.error or f"the simulation was stopped at {now:.2f} s"
            if self._simulator.state == "paused" and CHANGE not in self._plan.allowed:
                return f"somebody has paused the simulation at {now:.2f} s; the plan does not allow that"
            if waited > self._stalled_timeout:
                return f"the simulation stands still at {now:.2f} s, {self._simulator.state}"
        return ""

    def cut_at_broken_rule(self, record: FlightRecord) -> tuple[FlightRecord | None, str]:
        """Return the flight until somebody moved the vehicle against the rules, and an error in one line, or ''.

        The record is None if that was before the first step.
        """
        if MOVE in self._plan.allowed:
            return record, ""
        message = "somebody moved the vehicle {} s; the plan does not allow that (allowed: [move] would)"
        if not record.begins_at(self._start_position):
            return None, message.format(f"before {record.times[0]:.2f}")
        own = [entry.at for entry in self._timeline.entries if moves_vehicle(entry)]
        for row in record.teleports:
            at = record.times[row]
            if not any(-_EARLY <= at - due <= _LATE for due in own):
                return record.until(int(row)), message.format(f"at {at:.2f}")
        return record, ""


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise argparse.ArgumentTypeError(f"{text:.60}: must be a whole number from 0 on")
    return int(text)


def _absolute_path(name: str) -> str:
    """Return the path of a file relative to the user's working directory, because roslaunch runs nodes in ~/.ros."""
    return str(Path(os.environ.get("PWD") or os.getcwd()) / name)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog=_NAME, description="Grade a node or a script on a running simulator, with a plan.")
    parser.add_argument("plan", metavar="PLAN.yaml", help="the plan, as for `grade`")
    parser.add_argument("--seed", metavar="N", type=_seed, default=0, help="start and wind of this seed (default: 0)")
    parser.add_argument("--node", metavar="NAME", default="", help="the node that flies; grade_live waits for it")
    parser.add_argument("--simulator", metavar="NODE", default="drone_sim", help="(default: %(default)s)")
    parser.add_argument(
        "--patience", metavar="S", type=float, default=_PATIENCE, help="real seconds to wait for both (default: 30)"
    )
    for option, metavar, description in (
        ("--write-config", "OUT.yaml", "write the plan's config, for config:= of drone.launch, and end"),
        ("--csv", "OUT.csv", "write the flight's table, as `fly --csv`"),
        ("--json", "OUT.json", "write everything, for programs"),
        ("--junit", "OUT.xml", "write JUnit XML"),
        ("--gradescope", "results.json", "write the results for Gradescope"),
        ("--html", "DIR", "write a report for the browser"),
    ):
        parser.add_argument(option, type=_absolute_path, metavar=metavar, help=description)
    parser.add_argument("--rostest", metavar="OUT.xml", help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
