"""`rosrun drone_sim grade_live PLAN`: the plan on a running simulator, flown by whatever flies there.

It starts the simulation anew, sends the plan's timeline by topics, hears what the vehicle does, and judges that by the
same criteria as `grade`. As a <test> of rostest it writes the result that rostest reads. See docs/grading.md.
"""

from __future__ import annotations

import argparse
import copy
import os
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

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
from drone_sim.grading.result import Result, result_of
from drone_sim.ros.core.launch_parameters import from_shell
from drone_sim.ros.core.shutdown import end_on_signals
from drone_sim.ros.core.startup import init_node, status_of_node
from drone_sim.ros.grading import seeds
from drone_sim.ros.grading.flight_listener import FlightListener
from drone_sim.ros.grading.rules import LiveRules
from drone_sim.ros.grading.simulator import GradedSimulator, Mismatch, lookup
from drone_sim.ros.grading.timeline_sender import TimelineSender, is_put, steps_late
from drone_sim.run.parameters import Parameters
from drone_sim.scene.scene_parameters import find_files_beside

_NAME = "grade_live"
_XML = "--gtest_output=xml:"  # by which rostest says where it looks for the result
_SILENT, _STANDS = 1.0, 10.0  # s of real time without a step: what is stopped has ended, whatever else waits longer
_STANDS_IN_LOCKSTEP = 90.0  # s: more than lockstep/start_timeout and lockstep/timeout usually are
_LOOK, _LAST = 0.05, 0.3  # s of real time, between two looks; for the last messages to come
_PATIENCE = 30.0  # s of real time
_IN_TIME, _LATE = 1e-6, 2.0  # s of simulated time: the timeline's own puts come some steps late on a busy machine


def main() -> int:
    """Grade; return 0 where all is passed, and 1 after the table, or one line for what cannot be graded."""
    options = _parser().parse_args(_arguments(rosgraph.myargv(sys.argv)[1:]))
    if options.write_config:
        return status_of(_NAME, lambda: _write_config(options.plan, options.write_config))
    if not init_node(_NAME, anonymous=True, disable_signals=True):
        return FAILED
    end_on_signals()
    results: list[Result] = []
    status = status_of_node(_NAME, lambda: results.append(_graded(options)))
    return status or (0 if results[0].passed else FAILED)


def _write_config(file: str, path: str) -> None:
    """Write what the simulator is to be launched with. Raises ValueError and OSError, in one line."""
    plan = plans.read(from_shell(file))
    if isinstance(plan.config, str):
        raise ValueError(f"{file}: its config is a file already: {plan.config}")
    config = copy.deepcopy(dict(plan.config))
    find_files_beside(plan.folder, config)
    writing.write(path, dump(config))


def _graded(options: argparse.Namespace) -> Result:
    """Raises ValueError and OSError, in one line."""
    plan = plans.read(from_shell(options.plan))
    if options.html:
        report.check(options.html)
    for file in filter(None, (options.csv, options.json, options.junit, options.gradescope)):
        writing.check_writable(file)
    result, flown = grade(plan, options.seed, options.node, options.simulator, options.patience)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(options.csv or f"{folder}/flight.csv")
        if flown is not None:
            flight.write(flown.rows, file)
        for write, path in (
            (as_json.write, options.json),
            (gradescope.write, options.gradescope),
            (junit.write, options.junit),
            (junit.write, options.rostest),
        ):
            if path:
                write(plan, [result], path)
        if options.html:
            report.write(plan, [result], lambda _: file if flown is not None else None, options.html)
    table.show(plan, [result])
    return result


def grade(plan: Plan, seed: int, node: str, simulator: str, patience: float) -> tuple[Result, FlightRecord | None]:
    """Fly once, and return the result and the flight.

    `node` is the one that flies, which is waited for, '' where the simulator's script does. Raises Mismatch and
    ParameterError where the plan cannot be graded on this simulator; what goes wrong later is in the result.
    """
    there = GradedSimulator(simulator, patience)
    parameters = there.fit(plan)
    live = _Live(plan, seed, there, parameters)  # which is heard from now on
    there.wait(live.is_connected, f"{there.node} lacks topics of the plan's vehicles: launch it in the plan's scene")
    if node:
        there.wait(lambda: lookup("lookupNode", rospy.resolve_name(f"/{node.strip('/')}")), f"no node {node}")
    error = live.fly()
    script = node or parameters.script
    flown = live.listener.flown(plan.duration)
    if flown is None:
        return flight.ungraded(plan, script, seed, {}, error or "nothing was heard of the flight"), None
    late = steps_late(plan.timeline_of(parameters).of(plan.vehicle_of(parameters)), flown.rows, parameters.time_step)
    if late and not plan.lockstep:
        rospy.logwarn(f"the timeline came up to {late} steps late: a lower real_time_factor gives it more time")
    flown, put = live.within_rules(flown)
    if flown is None:
        return flight.ungraded(plan, script, seed, {}, put).with_tried([*live.rules.tried, *live.listener.forged]), None
    outcomes = tuple(one.judge(flown) for one in plan.criteria)
    digest = flight.digest_of(flown.rows)
    result = result_of(plan.name, script, seed, {}, outcomes, flown.end, put or error or None, digest)
    return result.with_tried([*live.rules.tried, *live.listener.forged]), flown


class _Live:
    """One flight through topics."""

    def __init__(self, plan: Plan, seed: int, simulator: GradedSimulator, parameters: Parameters):
        """Advertise and subscribe. Raises Mismatch."""
        self._simulator, self._plan = simulator, plan
        self._duration, self._scene = plan.duration, seeds.scene_file(plan, seed)
        self._over = threading.Event()
        self._started = False
        wanted = plan.parameters(seed)
        simulator.check_seed(wanted, self._scene)
        self._begin = next(one.position for one in wanted.fleet if one.name == plan.vehicle_of(wanted))
        self._timeline = plan.timeline_of(wanted)
        self._timeline_file = seeds.timeline_file(plan) if plan.lockstep else ""
        # In lockstep no message may come by chance a step later: the simulator itself executes the timeline.
        self._sender = TimelineSender([] if plan.lockstep else self._timeline.entries, parameters, simulator.node)
        self.listener = FlightListener(plan, parameters, simulator.node, self._follow)
        self.rules = LiveRules(plan, simulator.node)

    def is_connected(self) -> bool:
        """Whether all topics from and to the simulator are connected."""
        return self._sender.is_heard and self.listener.is_connected() and self.rules.is_connected()

    def _follow(self, now: float) -> None:
        """Send what is due after a step that ended at this time (s)."""
        if self._started and not self._over.is_set():
            self._sender.send(now)
            if now >= self._duration - 1e-6:
                self._over.set()

    def fly(self) -> str:
        """Fly, and return what went wrong, in one line."""
        try:
            self._simulator.stop()
            time.sleep(_LAST)  # what was sent before is not of this flight
            self.listener.clear()
            self.rules.clear()
            self._started = True
            self._simulator.start(self._scene, self._timeline_file)
            ended = self._wait()
            self._over.set()
            if rospy.is_shutdown():
                return ended
            time.sleep(_LAST)
            self._simulator.stop()
        except Mismatch as error:
            return str(error)
        return ended or self._simulator.error

    def _wait(self) -> str:
        """Wait for the end of the flight; return what ended it too early, '' for nothing."""
        last, since = -1.0, time.monotonic()
        while not self._over.wait(_LOOK):
            now = self.listener.time
            self.listener.look_for_topics()
            if now != last:
                last, since = now, time.monotonic()
            waited = time.monotonic() - since
            if rospy.is_shutdown():
                return f"ended from outside at {now:.2f} s"
            if self.listener.went_back:
                return "somebody else has started the simulation anew"
            if self._simulator.state == "stopped" and waited > _SILENT:  # it may be told late that it flies
                return self._simulator.error or f"the simulation was stopped at {now:.2f} s"
            if self._simulator.state == "paused" and CHANGE not in self._plan.allowed:
                return f"somebody has paused the simulation at {now:.2f} s; the plan does not allow that"
            if waited > (_STANDS_IN_LOCKSTEP if self._plan.lockstep else _STANDS):
                return f"the simulation stands still at {now:.2f} s, {self._simulator.state}"
        return ""

    def within_rules(self, flown: FlightRecord) -> tuple[FlightRecord | None, str]:
        """Return a flight, cut off where somebody has moved the vehicle against the rules, and what to report of that.

        The flight is None if that was before the first step.
        """
        if MOVE in self._plan.allowed:
            return flown, ""
        if not flown.begins_at(self._begin):
            said = f"somebody moved the vehicle before {flown.times[0]:.2f} s; the plan does not allow that"
            return None, f"{said} (allowed: [move] would)"
        own = [one.at for one in self._timeline.entries if is_put(one)]
        for row in flown.puts:
            at = flown.times[row]
            if not any(-_IN_TIME <= at - one <= _LATE for one in own):
                said = f"somebody moved the vehicle at {at:.2f} s; the plan does not allow that"
                return flown.until(int(row)), f"{said} (allowed: [move] would)"
        return flown, ""


# ---- arguments


def _arguments(given: Sequence[str]) -> list[str]:
    """Return the arguments, those that rostest adds as options of ours."""
    return [f"--rostest={one.removeprefix(_XML)}" if one.startswith(_XML) else one for one in given if one != "--text"]


def _seed(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise argparse.ArgumentTypeError(f"{text:.60}: must be a whole number from 0 on")
    return int(text)


def _from_here(name: str) -> str:
    """Return a file's name from where the user stands, although roslaunch runs nodes in ~/.ros."""
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
    for option, metavar, said in (
        ("--write-config", "OUT.yaml", "write the plan's config, for config:= of drone.launch, and end"),
        ("--csv", "OUT.csv", "write the flight's table, as `fly --csv`"),
        ("--json", "OUT.json", "write everything, for programs"),
        ("--junit", "OUT.xml", "write JUnit XML"),
        ("--gradescope", "results.json", "write the results for Gradescope"),
        ("--html", "DIR", "write a report for the browser"),
    ):
        parser.add_argument(option, type=_from_here, metavar=metavar, help=said)
    parser.add_argument("--rostest", metavar="OUT.xml", help=argparse.SUPPRESS)
    return parser


if __name__ == "__main__":
    sys.exit(main())
