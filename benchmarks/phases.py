"""Where the microseconds of a step go: its phases in three flights, and the PyBullet calls that every step needs."""

import statistics
import time
from collections.abc import Callable
from typing import Any

from tqdm import tqdm

from benchmarks import loop
from benchmarks.cores import one_core
from benchmarks.loop_worker import FLIGHTS, Flight

Row = dict[str, Any]
# The phases of run/stepping.py, as the table calls them.
PHASES = {
    "_actuate": "scripts: actuation",
    "_sum_forces": "forces",
    "_advance": "advance",
    "_read_back": "read back",
    "_sense": "scripts: sensing",
}
STEP, BARE = "step", "bare PyBullet: forces and steps"
LEAST = "  of it PyBullet: pose, force, torque, step"
NAMES = ["scripts: actuation", "forces", "advance", LEAST, "read back", "scripts: sensing", STEP, BARE]
ROUNDS = 60
STEPS = 40  # of a flight in each round
_Times = dict[str, list[float]]


def measure(rounds: int = ROUNDS) -> list[Row]:
    """Return the times (us) of a step and its phases, a column for each flight, and `of_bare`.

    Each time is the median of the quietest round; `of_bare` is the median over the rounds.
    """
    with one_core():
        alone = {BARE: loop.bare(), LEAST: loop.least()}
        flights = {name: begin() for name, begin in FLIGHTS.items()}
        times: dict[str, _Times] = {name: {row: [] for row in NAMES} for name in flights}
        medians: dict[str, _Times] = {name: {row: [] for row in NAMES} for name in flights}
        for name, flight in flights.items():
            _time_phases(flight, times[name])
        for _ in tqdm(range(rounds), desc="  rounds", leave=False):
            for name, flight in flights.items():
                _time(flight.step, times[name][STEP])
                for row, step in alone.items():
                    _time(step, times[name][row])
                for row, some in times[name].items():
                    medians[name][row].append(1e6 * statistics.median(some))
                    some.clear()
    rows = [{"name": f"{row}, us", **{name: min(medians[name][row]) for name in flights}} for row in NAMES]
    return [*rows, {"name": "of_bare", **{name: _share(medians[name]) for name in flights}}]


def _share(medians: _Times) -> float:
    return statistics.median(bare / step for bare, step in zip(medians[BARE], medians[STEP]))


def _time(step: Callable[[], None], times: list[float]) -> None:
    for _ in range(STEPS):
        start = time.perf_counter()
        step()
        times.append(time.perf_counter() - start)


def _time_phases(flight: Flight, times: _Times) -> None:
    """Let the steps of a flight add the times of their phases to `times`."""
    stepper = flight.simulation._stepper
    for method, row in PHASES.items():
        setattr(stepper, method, _timed(getattr(stepper, method), times[row]))


def _timed(phase: Callable[..., Any], times: list[float]) -> Callable[..., Any]:
    def timed(*arguments: Any) -> Any:
        start = time.perf_counter()
        result = phase(*arguments)
        times.append(time.perf_counter() - start)
        return result

    return timed
