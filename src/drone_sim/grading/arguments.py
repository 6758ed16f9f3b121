"""What `grade` and `sweep` have in common on the command line, and how they end."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn

from tqdm import tqdm

from drone_sim.command_line import SIGNALLED, Parser, format_error
from drone_sim.command_line import status_of as status_of_action
from drone_sim.grading import plan as plans
from drone_sim.grading.flight import ungraded
from drone_sim.grading.jobs import pool, sandbox, settings
from drone_sim.grading.jobs.job import Job, JobResult, ResultStore, default_folder, forget_old
from drone_sim.grading.jobs.pool import FlightOptions
from drone_sim.grading.jobs.sandbox import NoSandbox
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import printable, shown
from drone_sim.run.watchdog import Watchdog

WRONG = 2  # exit status
_MOST_JOBS = 1024


class GradingParser(Parser):
    """A parser whose exit status for wrong arguments is not that of flights that fail."""

    wrong = WRONG


def add_to(parser: argparse.ArgumentParser) -> None:
    """Add the plan, and how flights are flown."""
    parser.add_argument("plan", metavar="PLAN", help="the plan's file.yaml, or a task's name such as hover")
    cores = len(os.sched_getaffinity(0))
    parser.add_argument(
        "--seeds", metavar="N", type=_number(1, plans.MAX_SEEDS), help="seeds 0 to N-1 (default: the plan's)"
    )
    parser.add_argument(
        "--jobs", metavar="N", type=_number(1, _MOST_JOBS), default=cores, help=f"flights at a time ({cores})"
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


def results_folder(options: argparse.Namespace) -> Path:
    """Return where results are kept."""
    return Path(options.results) if options.results else default_folder()


class Runner:
    """Flies jobs as the options say, keeps their results, and takes those that are there already."""

    def __init__(self, program: str, options: argparse.Namespace, plan: Plan, tables: bool = False):
        """Look for bubblewrap, and make the folder of results of a `plan`, as the `options` of a `program` say.

        `tables`: each flight's table is wanted, too. Raises OSError.
        """
        numbers = settings.load()
        self._options = options
        folder = results_folder(options)
        self.store = ResultStore(folder, plan)
        if not options.results:
            forget_old(folder, numbers.results.kept)
        if options.fresh:
            self.store.forget()
        self._flight_options = FlightOptions(
            numbers.limits, numbers.batches, is_sandboxed(program, options.sandbox), tables, numbers.workers.patience
        )
        self._program = program
        self.all_kept = True
        self._plan = plan
        self._open = contextlib.ExitStack()
        self._fly: pool.Fly | None = None  # once there is something to fly

    def __enter__(self) -> Runner:
        """Return this."""
        return self

    def __exit__(self, *_exception: object) -> None:
        """End what is still flown."""
        self._open.close()

    def fly(self, jobs: Sequence[Job], quiet: bool = False) -> Iterator[tuple[Job, Result]]:
        """Yield each job and its result as they finish, those already stored first; `quiet`: print nothing."""
        known = self.store.known(jobs, self._flight_options.tables)
        if known and not quiet:
            said = "--fresh flies them anew"
            print(f"{self._program}: {len(known)} of {len(jobs)} flights are known ({said})", file=sys.stderr)
        with tqdm(total=len(jobs), unit=" flights", disable=quiet or None, leave=False, smoothing=0.1) as bar:
            waiting = []
            for job in jobs:
                if job.error:
                    bar.update()
                    yield job, ungraded(self._plan, job.script, job.seed, job.changes, job.error)
                elif job.key in known:
                    bar.update()
                    yield job, known[job.key].of_script(job.script)
                else:
                    waiting.append(job)
            for flight in self._flights(waiting):
                self._keep(flight)
                bar.update()
                yield flight.job, flight.result

    def _keep(self, flight: JobResult) -> None:
        """Store a flight's result. If the disk is full, say so once; the other flights go on."""
        try:
            self.store.add(flight)
        except OSError as error:
            if self.all_kept:
                why = printable(format_error(error))
                tqdm.write(f"{self._program}: {why}: not all results are kept", file=sys.stderr)
            self.all_kept = False

    def _flights(self, jobs: Sequence[Job]) -> Iterator[JobResult]:
        if not jobs:
            return
        if self._fly is None:
            workers = min(self._options.jobs, len(jobs))
            self._fly = self._open.enter_context(pool.opened(self._flight_options, workers, self._options.scheduler))
        yield from self._fly(jobs)


@contextlib.contextmanager
def on_standard_output() -> Iterator[None]:
    """Let an OSError say what could not be written to: a full disk, a pipe that nobody reads."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        raise OSError(f"standard output: {error.strerror}") from None


def all_done(program: str, actions: Iterable[Callable[[], None]]) -> bool:
    """Do every action, also after one that fails, which gets one line; return whether all succeeded."""
    return not any([status_of_action(program, action, WRONG) for action in actions])


def status_of(program: str, action: Callable[[], int], watchdog: Watchdog | None) -> int:
    """Return an action's exit status: 2 after one line for what cannot be done, 130 after Ctrl-C."""
    if watchdog is not None:
        watchdog.ready(_interrupt)
    status = status_of_action(program, action, WRONG)
    return SIGNALLED + watchdog.asked if status > SIGNALLED and watchdog is not None and watchdog.asked else status


def _interrupt() -> NoReturn:
    raise KeyboardInterrupt


def is_sandboxed(program: str, wanted: str) -> bool:
    """Tell whether scripts run in the sandbox, as `wanted` says (auto, on, off); print a warning where there is none.

    Raises NoSandbox.
    """
    if wanted == "off":
        return False
    try:
        sandbox.command(1)
    except NoSandbox as error:
        if wanted == "on":
            raise
        print(f"{program}: Python scripts can change your files: {error}", file=sys.stderr)
        return False
    return True


def _number(low: int, high: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 20 and low <= int(text) <= high):
            raise argparse.ArgumentTypeError(f"{shown(text)}: must be a whole number from {low} to {high}")
        return int(text)

    return number
