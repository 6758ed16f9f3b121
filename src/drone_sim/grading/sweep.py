"""`rosrun drone_sim sweep`: fly a plan with many values of parameters, or look for the best ones."""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

import numpy as np

from drone_sim.config.types import flattened, nested, read_yaml
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import package_path
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.grading.arguments import WRONG, GradingParser, Runner, add_to, all_done, on_standard_output, status_of
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.outputs.by_script import in_columns
from drone_sim.grading.result import Result
from drone_sim.message_text import near_names, shown
from drone_sim.run.watchdog import Watchdog
from drone_sim.scripting.load import script_path

PROGRAM = "sweep"
MAX_FLIGHTS = 1_000_000
_LINES = 60  # of the table, the best first; --csv has all
_A_FIGURE = 1e-3  # points that the figure of --smallest may count at most: it decides among equals
_OF_A_PARAMETER = 5  # members of the population
_FEWEST = 5  # of all, which the method needs
_DIGITS = 6  # of a value: what nobody would type decides nothing
_MOST_VALUES = 10_000  # of one parameter
_FREE = "script_parameters."  # whatever a script's own are called
_FORM = "must be KEY=START:STOP:COUNT or KEY=A,B,..., such as Kzref=1:10:10"
_Costs = Callable[[Sequence[tuple[float, ...]]], Sequence[float]]


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
        """Return the cost, lowest for the best trial: by points, then by the figure of the criterion `smallest`."""
        figure = self.figures[smallest] if smallest else 0.0
        return -self.points + _A_FIGURE * (2 / math.pi * math.atan(abs(figure)) if figure is not None else 1.0)


def main(arguments: Sequence[str] | None = None, watchdog: Watchdog | None = None) -> int:
    """Sweep; return 0, or 2 after a line for what cannot be done, or 130 after Ctrl-C: what was flown is kept."""
    options = _parser().parse_intermixed_args(arguments)
    return status_of(PROGRAM, lambda: _Sweep(options, watchdog).run(), watchdog)


class _Sweep:
    """One run of the program."""

    def __init__(self, options: argparse.Namespace, watchdog: Watchdog | None):
        """Read and check what `options` say; a `watchdog` stands by. Raises what status_of expects."""
        self._options = options
        self._watchdog = watchdog
        self._plan = plans.read(tasks.find(options.plan))
        script = self._plan.default_script if options.script is None else options.script
        self._script = script and script_path(script)
        self._contents = contents_of(self._plan, self._script)
        self._seeds = options.seeds or self._plan.seeds
        self._ranges = ranges_of(options.param)
        self._check()
        self._runner = Runner(PROGRAM, options, self._plan)

    def run(self) -> int:
        """Fly, and tell."""
        with self._runner:
            trials = list(self._optimized() if self._options.optimize else self._all())
        if self._watchdog is not None:
            self._watchdog.stand_down()
        trials.sort(key=lambda one: one.cost(self._options.smallest))
        outputs = [lambda: self._show(trials)]
        if self._options.csv:
            outputs.append(lambda: self._write(trials))
        if self._options.plot:
            outputs.append(lambda: self._draw(trials))
        return 0 if all_done(PROGRAM, outputs) and self._runner.all_kept else WRONG

    def _show(self, trials: Sequence[Trial]) -> None:
        with on_standard_output():
            print("\n".join(_table(self._ranges, trials)))

    def _write(self, trials: Sequence[Trial]) -> None:
        with writing.replacing(self._options.csv) as file:
            csv.writer(file, lineterminator="\n").writerows(_rows(self._ranges, trials))

    def _draw(self, trials: Sequence[Trial]) -> None:
        from drone_sim.grading import heat_map

        options, plan = self._options, self._plan
        figures = [one.figures[options.smallest] if options.smallest else one.points for one in trials]
        heat_map.save(
            options.plot,
            plan.title or plan.name,
            [one.key for one in self._ranges],
            [(one.values, figure) for one, figure in zip(trials, figures)],
            options.smallest or "points",
        )
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
                self._plan.parameters(changes=_changes([one], [value]))
        for path in filter(None, (options.csv, options.plot)):
            writing.check_writable(path)
        if options.plot:
            self._check_plot(options.plot)

    def _check_plot(self, file: str) -> None:
        from drone_sim.grading import heat_map  # noqa: F401 - where there is no matplotlib, nothing is flown

        if not file.endswith((".png", ".svg", ".pdf")):
            raise ValueError(f"--plot {shown(file)}: must end in .png, .svg or .pdf")
        if len(self._ranges) > 2:
            raise ValueError(f"--plot: shows one parameter or two, not {len(self._ranges)}")

    def _all(self) -> Iterator[Trial]:
        return self._flown(list(itertools.product(*(one.values for one in self._ranges))))

    def _optimized(self) -> list[Trial]:
        trials: list[Trial] = []

        def costs(points: Sequence[tuple[float, ...]]) -> list[float]:
            flown = list(self._flown(points, quiet=True))
            trials.extend(flown)
            best = min(trials, key=lambda one: one.cost(self._options.smallest))
            print(f"{PROGRAM}: {len(trials)} tried; {_words(self._ranges, best)}", file=sys.stderr, flush=True)
            return [one.cost(self._options.smallest) for one in flown]

        _search(costs, [one.ends for one in self._ranges], self._options.evaluations, self._options.random_seed)
        return list({one.values: one for one in trials}.values())

    def _flown(self, points: Sequence[tuple[Any, ...]], quiet: bool = False) -> Iterator[Trial]:
        """Fly all seeds of all points; give a trial for each, in their order."""
        jobs = [[self._job(point, seed) for seed in range(self._seeds)] for point in points]
        results = {job.key: result for job, result in self._runner.fly([job for some in jobs for job in some], quiet)}
        for point, some in zip(points, jobs):
            yield _trial(tuple(point), [results[job.key] for job in some])

    def _job(self, point: Sequence[Any], seed: int) -> Job:
        changes = _changes(self._ranges, point)
        return Job(str(self._plan.path), self._script, seed, changes, key_of(self._contents, seed, changes))


def _search(costs: _Costs, bounds: Sequence[tuple[float, float]], evaluations: int, seed: int) -> None:
    """Ask for the costs of one generation of points after the other: about so many in all.

    A criterion is passed or failed, so the cost changes in steps and has no slope: a method with a population can cross
    such steps, a simplex stops on them. SciPy's differential evolution flies a whole generation at a time, on all
    workers, and the same seed gives the same search on one worker and on many; optuna, which learns from each trial as
    it ends, does not.
    """
    from scipy.optimize import differential_evolution  # takes as long to import as ten flights

    population = max(_FEWEST, _OF_A_PARAMETER * len(bounds))
    generator = np.random.default_rng(seed)
    first = np.array(bounds).T[0] + generator.random((population, len(bounds))) * np.ptp(bounds, axis=1)
    differential_evolution(
        lambda points: np.array(costs([tuple(float(f"{value:.{_DIGITS}g}") for value in one) for one in points.T])),
        bounds,
        init=first,
        maxiter=max(0, evaluations // population - 1),
        seed=generator,
        polish=False,
        updating="deferred",
        vectorized=True,
        tol=0,
    )


def _trial(values: tuple[Any, ...], results: Sequence[Result]) -> Trial:
    figures: dict[str, float | None] = {}
    for name in dict.fromkeys(outcome.name for outcome in results[0].outcomes):
        found = [outcome.value for result in results for outcome in result.outcomes if outcome.name == name]
        numbers = [one for one in found if one is not None]
        figures[name] = fmean(numbers) if len(numbers) == len(found) else None
    passed = sum(one.passed for one in results)
    return Trial(values, passed, len(results), fmean(one.points for one in results), results[0].of, figures)


# ---- the ranges


class RangeError(ValueError):
    """A range is wrong; one line that names it and what is allowed."""


@dataclass(frozen=True)
class ParameterRange:
    """A key, dots between its parts, and values."""

    key: str
    values: tuple[Any, ...]

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition(".")[2]

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value. Raises RangeError where they are no numbers, or the same."""
        if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.values):
            raise RangeError(f"--param {self.name}: --optimize looks among numbers only")
        low, high = float(min(self.values)), float(max(self.values))
        if low == high:
            raise RangeError(f"--param {self.name}: --optimize needs two values to search between, such as 1:10:2")
        return low, high


def ranges_of(texts: Sequence[str]) -> list[ParameterRange]:
    """Return the ranges of several `KEY=VALUES`. Raises RangeError."""
    known = [key for key, _ in flattened(read_yaml(package_path() / "config" / "drone.yaml"))]
    found = []
    for text in texts:
        key, equals, values = text.partition("=")
        if not equals or not key or not values:
            raise RangeError(f"--param {shown(text)}: {_FORM}")
        found.append(ParameterRange(_full_key(key, known), tuple(_values(text, values))))
    for key in {one.key for one in found}:
        if sum(one.key == key for one in found) > 1:
            raise RangeError(f"--param {key}: is given twice")
    return found


def _changes(ranges: Sequence[ParameterRange], values: Sequence[Any]) -> dict[str, Any]:
    """Return the nested mapping that gives each key its value."""
    return nested(zip((one.key for one in ranges), values))


def _full_key(key: str, known: Sequence[str]) -> str:
    if key in known or (key.startswith(_FREE) and key.removeprefix(_FREE).isidentifier()):
        return key
    ending = [one for one in known if one.endswith(f".{key}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        raise RangeError(f"--param {shown(key)}: may be {' or '.join(ending[:5])}: name one of them")
    plain = {one.rpartition(".")[2] for one in known}
    said = near_names(key, known if "." in key else plain)
    raise RangeError(f"--param {shown(key)}: no such key in config/drone.yaml; {said}")


def _values(text: str, values: str) -> Sequence[Any]:
    if ":" in values:
        return _evenly(text, values.split(":"))
    try:
        found = [yaml_files.parse(one) for one in values.split(",")]
    except yaml_files.YamlError as error:
        raise RangeError(f"--param {shown(text)}: {error}") from None
    if any(isinstance(one, (dict, list)) or one is None for one in found) or len(found) > _MOST_VALUES:
        raise RangeError(f"--param {shown(text)}: {_FORM}")
    return found


def _evenly(text: str, parts: Sequence[str]) -> list[float]:
    """Return COUNT values from START to STOP, both among them."""
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
        is_right = len(parts) == 3 and math.isfinite(start) and math.isfinite(stop) and 1 <= count <= _MOST_VALUES
    except (ValueError, IndexError):
        is_right = False
    if not is_right:
        raise RangeError(f"--param {shown(text)}: {_FORM}; COUNT is from 1 to {_MOST_VALUES}")
    return [float(f"{value:.12g}") for value in np.linspace(start, stop, count)]  # 0.3, not 0.30000000000000004


# ---- what is told


def _words(ranges: Sequence[ParameterRange], trial: Trial) -> str:
    values = ", ".join(f"{one.name} = {_short(value)}" for one, value in zip(ranges, trial.values))
    return f"best so far {trial.points:.4g} of {trial.of:.4g} points with {values}"


def _rows(ranges: Sequence[ParameterRange], trials: Sequence[Trial]) -> Iterator[list[Any]]:
    yield [*(one.key for one in ranges), "passed", "flights", "points", "of", *trials[0].figures]
    for one in trials:
        yield [*one.values, one.passed, one.flights, one.points, one.of, *one.figures.values()]


def _table(ranges: Sequence[ParameterRange], trials: Sequence[Trial]) -> list[str]:
    """Return lines in columns, the best trials first."""
    lines = in_columns([[_short(cell) for cell in row] for row in _rows(ranges, trials[:_LINES])])
    more = len(trials) - _LINES
    return [*lines, f"and {more} more: --csv OUT.csv writes all"] if more > 0 else lines


def _short(cell: Any) -> str:
    if cell is None:
        return "-"
    return f"{cell:.4g}" if isinstance(cell, float) else str(cell)


def _parser() -> argparse.ArgumentParser:
    parser = GradingParser(prog=PROGRAM, description="Fly a plan with every combination of values, and show a table.")
    add_to(parser)
    parser.add_argument(
        "script", metavar="SCRIPT", nargs="?", help="child script (default: the plan's, or the built-in script pilot)"
    )
    parser.add_argument(
        "--param",
        metavar="KEY=VALUES",
        action="append",
        required=True,
        help="a key of config/drone.yaml, such as Kzref, with START:STOP:COUNT or A,B,...; may be given several times",
    )
    parser.add_argument(
        "--smallest",
        metavar="NAME",
        default="",
        help="with equal points, sort by the smallest figure of this criterion",
    )
    parser.add_argument("--csv", metavar="OUT.csv", help="write all rows of the table")
    parser.add_argument(
        "--plot", metavar="OUT.png", help="draw points (or --smallest): a curve for one parameter, a heat map for two"
    )
    parser.add_argument("--optimize", action="store_true", help="search for the best values within the ranges")
    parser.add_argument(
        "--evaluations", metavar="N", type=int, default=200, help="for --optimize: about how many trials (200)"
    )
    parser.add_argument("--random-seed", metavar="N", type=int, default=0, help="for --optimize (0)")
    return parser


if __name__ == "__main__":
    sys.exit(main(watchdog=Watchdog(PROGRAM)))
