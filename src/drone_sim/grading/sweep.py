"""`rosrun drone_sim sweep`: fly a plan with many values of parameters, or search for the best values."""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from drone_sim.config.types import flattened, nested, read_yaml
from drone_sim.files import writing, yaml_files
from drone_sim.files.resources import package_path
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.grading.arguments import WRONG, GradingParser, Runner, add_to, on_standard_output, run_all, status_of
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.outputs.script_results import align_columns
from drone_sim.grading.result import Result
from drone_sim.message_text import near_names, shown
from drone_sim.run.watchdog import Watchdog
from drone_sim.scripting.load import script_path

PROGRAM = "sweep"
MAX_FLIGHTS = 1_000_000
_MAX_LINES = 60  # of the table, the best first; --csv has all
_FIGURE_WEIGHT = 1e-3  # points, the most that the figure of --smallest counts: it only decides between equal points
_POPULATION_PER_PARAMETER = 5
_MIN_POPULATION = 5  # of differential evolution
_DIGITS = 6  # of an optimized value
_MAX_VALUES = 10_000  # of one parameter
_MAX_LABELLED_CELLS = 150  # of a heat map; more cells have no room for numbers
_SCRIPT_PREFIX = "script_parameters."  # every key with this prefix is allowed
_FORM = "must be KEY=START:STOP:COUNT or KEY=A,B,..., such as Kzref=1:10:10"
_GetCosts = Callable[[Sequence[tuple[float, ...]]], Sequence[float]]


@dataclass(frozen=True)
class Trial:
    """The result of one combination of values over all seeds."""

    values: tuple[Any, ...]
    passed: int
    flights: int
    points: float  # mean
    of: float
    figures: dict[str, float | None]  # means by the criteria's names; None if a flight has no figure

    def cost(self, smallest: str) -> float:
        """Return the cost, lowest for the best trial: by points, then by the figure of the criterion `smallest`."""
        figure = self.figures[smallest] if smallest else 0.0
        return -self.points + _FIGURE_WEIGHT * (2 / math.pi * math.atan(abs(figure)) if figure is not None else 1.0)


def main(arguments: Sequence[str] | None = None, watchdog: Watchdog | None = None) -> int:
    """Sweep; return 0, 2 after one line for a user's mistake, or 130 after Ctrl-C: finished flights are stored."""
    options = _parser().parse_intermixed_args(arguments)
    return status_of(PROGRAM, lambda: _Sweep(options, watchdog).run(), watchdog)


class _Sweep:
    def __init__(self, options: argparse.Namespace, watchdog: Watchdog | None):
        """Read and check the plan, the script and the options. Raises the errors that status_of reports."""
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
        with self._runner:
            if self._options.optimize:
                trials = self._optimize()
            else:
                trials = self._fly(list(itertools.product(*(parameter.values for parameter in self._ranges))))
        if self._watchdog is not None:
            self._watchdog.stand_down()
        trials.sort(key=lambda trial: trial.cost(self._options.smallest))
        outputs = [lambda: self._show(trials)]
        if self._options.csv:
            outputs.append(lambda: self._write(trials))
        if self._options.plot:
            outputs.append(lambda: self._plot(trials))
        return 0 if run_all(PROGRAM, outputs) and self._runner.all_stored else WRONG

    def _show(self, trials: Sequence[Trial]) -> None:
        with on_standard_output():
            rows = [[_format_cell(cell) for cell in row] for row in self._rows(trials[:_MAX_LINES])]
            print("\n".join(align_columns(rows)))
            if len(trials) > _MAX_LINES:
                print(f"and {len(trials) - _MAX_LINES} more: --csv OUT.csv writes all")

    def _write(self, trials: Sequence[Trial]) -> None:
        with writing.replacing(self._options.csv) as file:
            csv.writer(file, lineterminator="\n").writerows(self._rows(trials))

    def _rows(self, trials: Sequence[Trial]) -> Iterator[list[Any]]:
        yield [*(parameter.key for parameter in self._ranges), "passed", "flights", "points", "of", *trials[0].figures]
        for trial in trials:
            yield [*trial.values, trial.passed, trial.flights, trial.points, trial.of, *trial.figures.values()]

    def _plot(self, trials: Sequence[Trial]) -> None:
        """Plot a curve over one parameter, or a heat map over two."""
        from matplotlib.figure import Figure  # not pyplot, which keeps every figure

        path, smallest, keys = self._options.plot, self._options.smallest, [parameter.key for parameter in self._ranges]
        drawn = [(trial.values, trial.figures[smallest] if smallest else trial.points) for trial in trials]
        figure = Figure(figsize=(7, 5), layout="constrained")
        axes = figure.subplots()
        if len(keys) == 1:
            points = sorted((values[0], np.nan if height is None else height) for values, height in drawn)
            axes.plot(*zip(*points), "o-")
            axes.set_xlabel(keys[0])
            axes.set_ylabel(smallest or "points")
            axes.grid(alpha=0.3)
        else:
            figure.colorbar(_draw_map(axes, drawn), label=smallest or "points")
            axes.set_ylabel(keys[0])
            axes.set_xlabel(keys[1])
        axes.set_title(self._plan.title or self._plan.name)
        with writing.replacing(path, binary=True) as file:
            figure.savefig(file, format=Path(path).suffix[1:], dpi=120)
        with on_standard_output():
            print(f"wrote {path}")

    def _check(self) -> None:
        options, names = self._options, [criterion.label for criterion in self._plan.criteria]
        if options.smallest and options.smallest not in names:
            near = near_names(options.smallest, names)
            raise ValueError(f"--smallest {shown(options.smallest)}: no such criterion; {near}")
        flights = (
            options.evaluations if options.optimize else math.prod(len(parameter.values) for parameter in self._ranges)
        )
        if flights * self._seeds > MAX_FLIGHTS:
            raise ValueError(f"--param: makes {flights * self._seeds} flights; at most {MAX_FLIGHTS} are allowed")
        for parameter in self._ranges:
            for value in dict.fromkeys(parameter.ends if options.optimize else parameter.values):
                self._plan.parameters(changes=_changes([parameter], [value]))
        for path in filter(None, (options.csv, options.plot)):
            writing.check_writable(path)
        if options.plot:
            import matplotlib  # noqa: F401 - fails before anything is flown

            if not options.plot.endswith((".png", ".svg", ".pdf")):
                raise ValueError(f"--plot {shown(options.plot)}: must end in .png, .svg or .pdf")
            if len(self._ranges) > 2:
                raise ValueError(f"--plot: shows one parameter or two, not {len(self._ranges)}")

    def _optimize(self) -> list[Trial]:
        trials: list[Trial] = []

        def get_costs(points: Sequence[tuple[float, ...]]) -> list[float]:
            new_trials = self._fly(points, quiet=True)
            trials.extend(new_trials)
            best = min(trials, key=lambda trial: trial.cost(self._options.smallest))
            named = zip((parameter.name for parameter in self._ranges), best.values)
            values = ", ".join(f"{name} = {_format_cell(value)}" for name, value in named)
            points_of = f"{best.points:.4g} of {best.of:.4g} points"
            print(f"{PROGRAM}: {len(trials)} tried; best so far {points_of} with {values}", file=sys.stderr, flush=True)
            return [trial.cost(self._options.smallest) for trial in new_trials]

        _minimize(
            get_costs,
            [parameter.ends for parameter in self._ranges],
            self._options.evaluations,
            self._options.random_seed,
        )
        return list({trial.values: trial for trial in trials}.values())

    def _fly(self, points: Sequence[tuple[Any, ...]], quiet: bool = False) -> list[Trial]:
        """Fly all seeds of all points, and return a trial for each point."""
        jobs: list[list[Job]] = []
        for point in points:
            changes, path = _changes(self._ranges, point), str(self._plan.path)
            keys = [key_of(self._contents, seed, changes) for seed in range(self._seeds)]
            jobs.append([Job(path, self._script, seed, changes, key) for seed, key in enumerate(keys)])
        results = {job.key: result for job, result in self._runner.fly([*itertools.chain(*jobs)], quiet)}
        return [_trial(tuple(point), [results[job.key] for job in flights]) for point, flights in zip(points, jobs)]


def _draw_map(axes: Any, trials: Sequence[tuple[tuple[Any, ...], float | None]]) -> Any:
    """Draw a cell for every combination of a grid, or a dot for every trial of an optimisation; return the drawing."""
    from matplotlib.ticker import MaxNLocator

    rows, columns = (sorted({values[index] for values, _ in trials}) for index in (0, 1))
    if len(rows) * len(columns) != len(trials):
        x, y, colours = zip(*((column, row, value) for (row, column), value in trials if value is not None))
        return axes.scatter(x, y, c=colours)
    cells = np.full((len(rows), len(columns)), np.nan)
    for (row, column), value in trials:
        cells[rows.index(row), columns.index(column)] = np.nan if value is None else value
    drawing = axes.imshow(cells, origin="lower", aspect="auto")
    for axis, values in ((axes.yaxis, rows), (axes.xaxis, columns)):
        axis.set_major_locator(MaxNLocator(nbins=min(12, len(values)), integer=True))
        axis.set_major_formatter(lambda at, _, values=values: _tick_label(at, values))
    if cells.size <= _MAX_LABELLED_CELLS:
        middle = (np.nanmin(cells) + np.nanmax(cells)) / 2 if np.isfinite(cells).any() else 0.0
        for (row, column), value in np.ndenumerate(cells):
            if np.isfinite(value):
                colour = "black" if value > middle else "white"
                axes.text(column, row, f"{value:.3g}", ha="center", va="center", color=colour, fontsize=8)
    return drawing


def _tick_label(at: float, values: Sequence[Any]) -> str:
    is_cell = at == int(at) and 0 <= at < len(values)
    return _format_cell(values[int(at)]) if is_cell else ""


def _minimize(get_costs: _GetCosts, bounds: Sequence[tuple[float, float]], evaluations: int, seed: int) -> None:
    """Search for the point with the lowest cost; `get_costs` gets one generation of points at a time.

    A criterion either passes or fails, so the cost changes in steps and has no slope: a method with a population can
    cross such steps, a simplex stops on them. SciPy's differential evolution flies a whole generation at a time, on all
    workers, and the same seed gives the same search with any number of workers; optuna, which learns from each trial as
    it ends, does not.
    """
    from scipy.optimize import differential_evolution  # takes as long to import as ten flights

    population = max(_MIN_POPULATION, _POPULATION_PER_PARAMETER * len(bounds))
    generator = np.random.default_rng(seed)
    first = np.array(bounds).T[0] + generator.random((population, len(bounds))) * np.ptp(bounds, axis=1)
    differential_evolution(
        lambda points: np.array(
            get_costs([tuple(float(f"{value:.{_DIGITS}g}") for value in point) for point in points.T])
        ),
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
        values_of_name = [outcome.value for result in results for outcome in result.outcomes if outcome.name == name]
        numbers = [value for value in values_of_name if value is not None]
        figures[name] = fmean(numbers) if len(numbers) == len(values_of_name) else None
    passed = sum(result.passed for result in results)
    return Trial(values, passed, len(results), fmean(result.points for result in results), results[0].of, figures)


class RangeError(ValueError):
    """A range is wrong; one line names it and what is allowed."""


@dataclass(frozen=True)
class ParameterRange:
    """The values of a key, whose parts are separated by dots."""

    key: str
    values: tuple[Any, ...]

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition(".")[2]

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value. Raises RangeError if the values are not numbers, or are equal."""
        if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.values):
            raise RangeError(f"--param {self.name}: --optimize needs numbers")
        low, high = float(min(self.values)), float(max(self.values))
        if low == high:
            raise RangeError(f"--param {self.name}: --optimize needs two values to search between, such as 1:10:2")
        return low, high


def ranges_of(texts: Sequence[str]) -> list[ParameterRange]:
    """Return the ranges of several `KEY=VALUES`. Raises RangeError."""
    known = [key for key, _ in flattened(read_yaml(package_path() / "config" / "drone.yaml"))]
    ranges = []
    for text in texts:
        key, equals, values = text.partition("=")
        if not equals or not key or not values:
            raise RangeError(f"--param {shown(text)}: {_FORM}")
        ranges.append(ParameterRange(_full_key(key, known), tuple(_parse_values(text, values))))
    for key, count in Counter(parameter.key for parameter in ranges).items():
        if count > 1:
            raise RangeError(f"--param {key}: is given twice")
    return ranges


def _changes(ranges: Sequence[ParameterRange], values: Sequence[Any]) -> dict[str, Any]:
    return nested(zip((parameter.key for parameter in ranges), values))


def _full_key(key: str, known: Sequence[str]) -> str:
    if key in known or (key.startswith(_SCRIPT_PREFIX) and key.removeprefix(_SCRIPT_PREFIX).isidentifier()):
        return key
    matches = [name for name in known if name.endswith(f".{key}")]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise RangeError(f"--param {shown(key)}: may be {' or '.join(matches[:5])}: name one of them")
    near = near_names(key, known if "." in key else {name.rpartition(".")[2] for name in known})
    raise RangeError(f"--param {shown(key)}: no such key in config/drone.yaml; {near}")


def _parse_values(text: str, values: str) -> Sequence[Any]:
    """Return the values A,B,..., or COUNT values from START to STOP, including both."""
    if ":" not in values:
        try:
            parsed = [yaml_files.parse(word) for word in values.split(",")]
        except yaml_files.YamlError as error:
            raise RangeError(f"--param {shown(text)}: {error}") from None
        if any(isinstance(value, (dict, list)) or value is None for value in parsed) or len(parsed) > _MAX_VALUES:
            raise RangeError(f"--param {shown(text)}: {_FORM}")
        return parsed
    try:
        start, stop, number = values.split(":")
        low, high, count = float(start), float(stop), int(number)
        is_valid = math.isfinite(low) and math.isfinite(high) and 1 <= count <= _MAX_VALUES
    except ValueError:
        is_valid = False
    if not is_valid:
        raise RangeError(f"--param {shown(text)}: {_FORM}; COUNT is from 1 to {_MAX_VALUES}")
    return [float(f"{value:.12g}") for value in np.linspace(low, high, count)]  # 0.3, not 0.30000000000000004


def _format_cell(cell: Any) -> str:
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
