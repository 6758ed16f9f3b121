"""The options, the flights and the exit status that `grade` and `sweep` have in common."""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from drone_sim.command_line import SIGNALLED, Parser, format_error
from drone_sim.command_line import status_of as status_of_action
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import result_of
from drone_sim.grading.jobs import pool, sandbox, settings
from drone_sim.grading.jobs.job import Job, ResultStore, default_folder, remove_old_results
from drone_sim.grading.jobs.pool import FlightOptions
from drone_sim.grading.jobs.sandbox import NoSandbox
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import printable, shown
from drone_sim.run.watchdog import Watchdog

WRONG = 2  # exit status for wrong arguments; 1 is for flights that fail
_MAX_JOBS = 1024


class GradingParser(Parser):
    wrong = WRONG


def add_to(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for the plan and its flights to a parser."""
    parser.add_argument("plan", metavar="PLAN", help="the plan's file.yaml, or a task's name such as hover")
    cores = len(os.sched_getaffinity(0))
    parser.add_argument(
        "--seeds",
        metavar="N",
        type=functools.partial(_whole_number, plans.MAX_SEEDS),
        help="seeds 0 to N-1 (default: the plan's)",
    )
    parser.add_argument(
        "--jobs",
        metavar="N",
        type=functools.partial(_whole_number, _MAX_JOBS),
        default=cores,
        help=f"flights at a time ({cores})",
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", default="", help="a Dask scheduler, such as tcp://host:8786")
    parser.add_argument("--results", metavar="DIR", help=f"the folder where results are saved ({default_folder()})")
    parser.add_argument("--fresh", action="store_true", help="fly everything again, also saved results")
    parser.add_argument(
        "--sandbox",
        choices=("auto", "on", "off"),
        default="auto",
        help="use bubblewrap for every flight: if it works, always (or refuse to fly), or never (auto)",
    )


def _whole_number(largest: int, text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 20 and 1 <= int(text) <= largest):
        raise argparse.ArgumentTypeError(f"{shown(text)}: must be a whole number from 1 to {largest}")
    return int(text)


def results_folder(options: argparse.Namespace) -> Path:
    return Path(options.results) if options.results else default_folder()


class Runner:
    """Flies jobs and stores their results; a job with a stored result is not flown again."""

    def __init__(self, program: str, options: argparse.Namespace, plan: Plan, tables: bool = False):
        """Check the sandbox, and create the folder of results; `tables`: store the flights' tables. Raises OSError."""
        numbers = settings.load()
        self._program, self._options, self._plan = program, options, plan
        folder = results_folder(options)
        self.store = ResultStore(folder, plan)
        if not options.results:
            remove_old_results(folder, numbers.results.kept)
        if options.fresh:
            self.store.clear()
        self._flight_options = FlightOptions(
            numbers.limits, numbers.batches, is_sandboxed(program, options.sandbox), tables, numbers.workers.patience
        )
        self.all_stored = True
        self._open = contextlib.ExitStack()
        self._fly: pool.Fly | None = None  # set before the first flight

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._open.close()

    def fly(self, jobs: Sequence[Job], quiet: bool = False) -> Iterator[tuple[Job, Result]]:
        """Yield each job and its result as they finish, those already stored first; `quiet`: print nothing."""
        stored = self.store.find(jobs, self._flight_options.tables)
        if stored and not quiet:
            count = f"{len(stored)} of {len(jobs)} flights are known"
            print(f"{self._program}: {count} (--fresh flies them again)", file=sys.stderr)
        with tqdm(total=len(jobs), unit=" flights", disable=quiet or None, leave=False, smoothing=0.1) as bar:
            new_jobs = []
            for job in jobs:
                if job.error:
                    bar.update()
                    yield job, result_of(self._plan, job.script, job.seed, job.changes, job.error)
                elif job.key in stored:
                    bar.update()
                    yield job, stored[job.key].of_script(job.script)
                else:
                    new_jobs.append(job)
            if not new_jobs:
                return
            if self._fly is None:
                workers = min(self._options.jobs, len(new_jobs))
                opened = pool.open_pool(self._flight_options, workers, self._options.scheduler)
                self._fly = self._open.enter_context(opened)
            for flight in self._fly(new_jobs):
                try:
                    self.store.add(flight)
                except OSError as error:  # such as a full disk: the other flights go on
                    if self.all_stored:
                        reason = printable(format_error(error))
                        tqdm.write(f"{self._program}: {reason}: not all results are kept", file=sys.stderr)
                    self.all_stored = False
                bar.update()
                yield flight.job, flight.result


@contextlib.contextmanager
def on_standard_output() -> Iterator[None]:
    """Name standard output in an OSError of writing to it, such as a full disk or a closed pipe."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        raise OSError(f"standard output: {error.strerror}") from None


def run_all(program: str, actions: Iterable[Callable[[], None]]) -> bool:
    """Run every action, even after one that fails, which prints one line; return whether all succeeded."""
    return not any([status_of_action(program, action, WRONG) for action in actions])


def status_of(program: str, action: Callable[[], int], watchdog: Watchdog | None) -> int:
    """Return the exit status of an action: WRONG after one line for a user's mistake, 130 after Ctrl-C."""

    def interrupt() -> NoReturn:
        raise KeyboardInterrupt

    if watchdog is not None:
        watchdog.ready(interrupt)
    status = status_of_action(program, action, WRONG)
    return SIGNALLED + watchdog.asked if status > SIGNALLED and watchdog is not None and watchdog.asked else status


def is_sandboxed(program: str, option: str) -> bool:
    """Return whether scripts run in the sandbox; `option` is auto (print a warning if there is none), on or off.

    Raises NoSandbox.
    """
    if option == "off":
        return False
    try:
        sandbox.command(1)
    except NoSandbox as error:
        if option == "on":
            raise
        print(f"{program}: Python scripts can change your files: {error}", file=sys.stderr)
        return False
    return True
