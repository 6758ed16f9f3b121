"""`rosrun drone_sim sweep`: fly a plan with many values of parameters, or look for the best ones."""

from __future__ import annotations

import argparse
import csv
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from drone_sim.files import writing
from drone_sim.grading import plan as plans
from drone_sim.grading import ranges as ranges_module
from drone_sim.grading import tasks
from drone_sim.grading.arguments import WRONG, Runner, WrongArguments, add_to, all_done, on_standard_output, status_of
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.ranges import Range
from drone_sim.grading.result import Result
from drone_sim.run.guardian import Guardian
from drone_sim.scripting.load import script_path
from drone_sim.wording import near_names, shown

PROGRAM = "sweep"
MAX_FLIGHTS = 1_000_000
_LINES = 60  # of the table, the best first; --csv has all
_A_FIGURE = 1e-3  # points that the figure of --smallest may count at most: it decides among equals


@dataclass(frozen=True)
class Trial:
    """What came of one combination of values, over all seeds."""

    values: tuple[Any, ...]
    passed: int
    flights: int
    points: float  # mean
    of: float
    figures: dict[str, float | None]  # means, by the criteria's names; None where one flight had none

    def cost(self, smallest: str) -> float:
        """Return what the best trial has least of: points, and among equals the figure of a criterion, decide."""
        figure = self.figures[smallest] if smallest else 0.0
        return -self.points + _A_FIGURE * (2 / math.pi * math.atan(abs(figure)) if figure is not None else 1.0)


def main(arguments: Sequence[str] | None = None, guardian: Guardian | None = None) -> int:
    """Sweep; return 0, or 2 after a line for what cannot be done, or 130 after Ctrl-C: what was flown is kept."""
    options = _parser().parse_intermixed_args(arguments)
    return status_of(PROGRAM, lambda: _Sweep(options, guardian).run(), guardian)


class _Sweep:
    """One run of the program."""

    def __init__(self, options: argparse.Namespace, guardian: Guardian | None):
        """Read and check everything. Raises what status_of expects."""
        self._options = options
        self._guardian = guardian
        self._plan = plans.read(tasks.find(options.plan))
        self._script = script_path(self._plan.script_of(options.script))
        self._contents = contents_of(self._plan, self._script)
        self._seeds = options.seeds or self._plan.seeds
        self._ranges = ranges_module.read(options.param)
        self._check()
        self._runner = Runner(PROGRAM, options, self._plan)

    def run(self) -> int:
        """Fly, and tell."""
        with self._runner:
            trials = list(self._optimized() if self._options.optimize else self._all())
        if self._guardian is not None:
            self._guardian.stand_down()
        trials.sort(key=lambda one: one.cost(self._options.smallest))
        told = [lambda: self._show(trials)]
        if self._options.csv:
            told.append(lambda: _write(self._options.csv, self._ranges, trials))
        if self._options.plot:
            told.append(lambda: self._draw(trials))
        return 0 if all_done(PROGRAM, told) and self._runner.all_kept else WRONG

    def _show(self, trials: Sequence[Trial]) -> None:
        with on_standard_output():
            print("\n".join(_table(self._ranges, trials)))

    def _draw(self, trials: Sequence[Trial]) -> None:
        from drone_sim.grading import heat_map

        options, plan = self._options, self._plan
        heat_map.save(options.plot, plan.title or plan.name, self._ranges, trials, options.smallest)
        with on_standard_output():
            print(f"wrote {options.plot}")

    def _check(self) -> None:
        options, names = self._options, [one.name or one.kind for one in self._plan.criteria]
        if options.smallest and options.smallest not in names:
            raise ValueError(
                f"--smallest {shown(options.smallest)}: no such criterion; {near_names(options.smallest, names)}"
            )
        flights = options.evaluations if options.optimize else math.prod(len(one.values) for one in self._ranges)
        if flights * self._seeds > MAX_FLIGHTS:
            raise ValueError(f"--param: makes {flights * self._seeds} flights; at most {MAX_FLIGHTS} are allowed")
        for one in self._ranges:
            for value in dict.fromkeys(one.ends if options.optimize else one.values):
                self._plan.parameters(changes=ranges_module.changes([one], [value]))
        for path in filter(None, (options.csv, options.plot)):
            writing.check(path)
        if options.plot and not (options.plot.endswith((".png", ".svg", ".pdf"))):
            raise ValueError(f"--plot {shown(options.plot)}: must end in .png, .svg or .pdf")
        if options.plot and len(self._ranges) > 2:
            raise ValueError(f"--plot: shows one parameter or two; here are {len(self._ranges)}")

    def _all(self) -> Iterator[Trial]:
        return self._flown(list(ranges_module.combinations(self._ranges)))

    def _optimized(self) -> list[Trial]:
        from drone_sim.grading import optimizing  # scipy takes as long to import as ten flights

        trials: list[Trial] = []

        def costs(points: Sequence[tuple[float, ...]]) -> list[float]:
            flown = list(self._flown(points, quiet=True))
            trials.extend(flown)
            best = min(trials, key=lambda one: one.cost(self._options.smallest))
            print(f"{PROGRAM}: {len(trials)} tried; {_words(self._ranges, best)}", file=sys.stderr, flush=True)
            return [one.cost(self._options.smallest) for one in flown]

        optimizing.search(
            costs, [one.ends for one in self._ranges], self._options.evaluations, self._options.random_seed
        )
        return list({one.values: one for one in trials}.values())

    def _flown(self, points: Sequence[tuple[Any, ...]], quiet: bool = False) -> Iterator[Trial]:
        """Fly all seeds of all points; give a trial for each, in their order."""
        jobs = [[self._job(point, seed) for seed in range(self._seeds)] for point in points]
        results = {job.key: result for job, result in self._runner.fly([job for some in jobs for job in some], quiet)}
        for point, some in zip(points, jobs):
            yield _trial(tuple(point), [results[job.key] for job in some])

    def _job(self, point: Sequence[Any], seed: int) -> Job:
        changes = ranges_module.changes(self._ranges, point)
        return Job(str(self._plan.path), self._script, seed, changes, key_of(self._contents, seed, changes))


def _trial(values: tuple[Any, ...], results: Sequence[Result]) -> Trial:
    figures: dict[str, float | None] = {}
    for name in dict.fromkeys(outcome.name for outcome in results[0].outcomes):
        found = [outcome.value for result in results for outcome in result.outcomes if outcome.name == name]
        numbers = [one for one in found if one is not None]
        figures[name] = fmean(numbers) if len(numbers) == len(found) else None
    passed = sum(one.passed for one in results)
    return Trial(values, passed, len(results), fmean(one.points for one in results), results[0].of, figures)


# ---- what is told


def _words(ranges: Sequence[Range], trial: Trial) -> str:
    values = ", ".join(f"{one.name} = {_short(value)}" for one, value in zip(ranges, trial.values))
    return f"best so far {trial.points:.4g} of {trial.of:.4g} points with {values}"


def _rows(ranges: Sequence[Range], trials: Sequence[Trial]) -> Iterator[list[Any]]:
    yield [*(one.key for one in ranges), "passed", "flights", "points", "of", *trials[0].figures]
    for one in trials:
        yield [*one.values, one.passed, one.flights, one.points, one.of, *one.figures.values()]


def _table(ranges: Sequence[Range], trials: Sequence[Trial]) -> list[str]:
    """Return lines in columns, the best trials first."""
    rows = [[_short(cell) for cell in row] for row in _rows(ranges, trials[:_LINES])]
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths)) for row in rows]
    more = len(trials) - _LINES
    return [*lines, f"and {more} more: --csv OUT.csv writes all"] if more > 0 else lines


def _short(cell: Any) -> str:
    if cell is None:
        return "-"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _write(path: str, ranges: Sequence[Range], trials: Sequence[Trial]) -> None:
    with writing.replacing(path) as file:
        csv.writer(file, lineterminator="\n").writerows(_rows(ranges, trials))


def _parser() -> argparse.ArgumentParser:
    parser = WrongArguments(prog=PROGRAM, description="Fly a plan with every combination of values, and show a table.")
    add_to(parser)
    parser.add_argument(
        "script", metavar="SCRIPT", nargs="?", help="child script (default: the plan's, or the built-in one)"
    )
    parser.add_argument(
        "--param",
        metavar="KEY=VALUES",
        action="append",
        required=True,
        help="a key of config/drone.yaml, as Kzref or control.Kzref, with START:STOP:COUNT or A,B,...; again for more",
    )
    parser.add_argument(
        "--smallest", metavar="NAME", default="", help="among equal points the criterion whose figure decides"
    )
    parser.add_argument("--csv", metavar="OUT.csv", help="write all rows of the table")
    parser.add_argument(
        "--plot", metavar="OUT.png", help="draw points (or --smallest) as a curve, or as a heat map of two"
    )
    parser.add_argument("--optimize", action="store_true", help="look for the best between the ends of the ranges")
    parser.add_argument("--evaluations", metavar="N", type=int, default=200, help="of --optimize, about so many (200)")
    parser.add_argument("--random-seed", metavar="N", type=int, default=0, help="of --optimize (0)")
    return parser


if __name__ == "__main__":
    sys.exit(main(guardian=Guardian(PROGRAM)))
