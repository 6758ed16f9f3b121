"""`rosrun drone_sim grade`: fly scripts by a plan, each flight in a process of its own, and say how well."""

from __future__ import annotations

import argparse
import functools
import hmac
import itertools
import os
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from drone_sim.files import writing
from drone_sim.grading import evidence, tasks, verify
from drone_sim.grading import plan as plans
from drone_sim.grading.arguments import (
    WRONG,
    GradingParser,
    Runner,
    add_to,
    all_done,
    on_standard_output,
    results_folder,
    status_of,
)
from drone_sim.grading.autograder import archive as autograder
from drone_sim.grading.jobs import files
from drone_sim.grading.jobs.files import Unreadable, given_script, read
from drone_sim.grading.jobs.job import Job, contents_of, key_of, unpacked
from drone_sim.grading.outputs import as_json, gradescope, junit, marks, table
from drone_sim.grading.outputs.by_script import by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.grading.submissions.folders import submissions_of
from drone_sim.grading.submissions.similarity import source_of
from drone_sim.grading.submissions.submission import Submission, names_of
from drone_sim.message_text import printable, shown
from drone_sim.run.watchdog import Watchdog

PROGRAM = "grade"
FAILED = 1
_SHORTEST_SECRET, _LARGEST_SECRET = 16, 2**16  # bytes
_LARGEST_SEED = 10**12
_WRITERS: dict[str, Callable[..., None]] = {"junit": junit.write, "json": as_json.write, "gradescope": gradescope.write}


def main(arguments: Sequence[str] | None = None, watchdog: Watchdog | None = None) -> int:
    """Grade; return 0 where every flight passes, 1 where one does not, 2 after a line for what cannot be done.

    With a watchdog, a signal ends the program: the flights so far are kept, shown and written, and the exit status is
    128 + the signal's number.
    """
    given = sys.argv[1:] if arguments is None else arguments
    if verify.asks_for_it(given):
        return verify.main(given, watchdog)
    options = _parser().parse_intermixed_args(given)
    if options.autograder:
        return status_of(PROGRAM, lambda: _write_autograder(options), None)
    return status_of(PROGRAM, lambda: _Grading(options, watchdog).run(), watchdog)


def _write_autograder(options: argparse.Namespace) -> int:
    if options.script or options.secret:
        raise ValueError("--autograder: takes only a plan and --seeds; students can read everything in the zip")
    plan = plans.read(tasks.find(options.plan))
    autograder.write(plan, options.seeds or plan.seeds, options.autograder)
    return 0


class _Grading:
    """One run of the program."""

    def __init__(self, options: argparse.Namespace, watchdog: Watchdog | None):
        """Read and check what `options` say; a `watchdog` stands by. Raises what status_of expects."""
        self._options = options
        self._watchdog = watchdog
        self._plan = plans.read(tasks.find(options.plan))
        store = unpacked(results_folder(options))
        given = [one for name in options.script for one in submissions_of(name, store)]
        seeds = seeds_of(options.seeds or self._plan.seeds, options.secret)
        jobs = jobs_of(self._plan, given or [Submission(self._plan.default_script)], seeds)
        self._submissions, self._names = list(jobs), names_of(jobs)
        self._jobs = [job for some in jobs.values() for job in some]
        _check_outputs(options, len(jobs))
        self._key = evidence.key_in(options.key) if options.key else None
        self._runner = Runner(PROGRAM, options, self._plan, tables=bool(options.html))
        self._results: dict[Job, Result] = {}

    def run(self) -> int:
        """Fly, and tell."""
        try:
            with self._runner:
                self._fly()
        except KeyboardInterrupt:
            if self._watchdog is not None:
                self._watchdog.stand_down()  # what follows takes its time
            self._report()
            print(
                f"{PROGRAM}: {len(self._results)} of {len(self._jobs)} flights were flown, and are kept",
                file=sys.stderr,
            )
            raise
        if self._watchdog is not None:
            self._watchdog.stand_down()
        if not (self._report() and self._runner.all_kept):
            return WRONG
        return 0 if all(result.passed for result in self._results.values()) else FAILED

    def _fly(self) -> None:
        left = Counter(job.script for job in self._jobs)
        for job, result in self._runner.fly(self._jobs):
            self._results[job] = result
            left[job.script] -= 1
            if not left[job.script] and len(self._submissions) > 1:
                self._say(job.script)

    def _say(self, script: str) -> None:
        """Tell how a script has done, as soon as it is known."""
        (one,) = by_script((result for job, result in self._results.items() if job.script == script), self._names)
        said = f"{one.passed} of {len(one.flights)} flights passed, {one.points:.4g} of {one.of:.4g} points"
        tqdm.write(f"{printable(one.label)}: {said}", file=sys.stderr)

    def _report(self) -> bool:
        """Show and write everything that can be; return whether all of it was."""
        results = [self._results[job] for job in self._jobs if job in self._results]
        if not results:
            return True
        outputs: list[Callable[[], None]] = [lambda: self._show(results)]
        for option, write in _WRITERS.items():
            if path := getattr(self._options, option):
                signed = {"key": self._key, "names": self._names} if option == "json" else {}
                outputs.append(functools.partial(write, self._plan, results, path, **signed))
        if path := self._options.marks:
            outputs.append(lambda: marks.write(self._submissions, by_script(results, self._names), path))
        if self._options.html:
            outputs.append(lambda: self._write_html(results))
        return all_done(PROGRAM, outputs)

    def _show(self, results: Sequence[Result]) -> None:
        with on_standard_output():
            table.show(self._plan, results, names=self._names)

    def _write_html(self, results: Sequence[Result]) -> None:
        from drone_sim.grading.outputs.html import report

        keys = {(job.script, job.seed): job.key for job in self._jobs}
        tables = lambda one: self._runner.store.table(keys[one.script, one.seed])  # noqa: E731
        flown = {one.script for one in results}
        sources = {
            one.script: source_of(files.of_script(self._plan, one.script))
            for one in self._submissions
            if one.script in flown and not one.error
        }
        report.write(self._plan, results, tables, self._options.html, self._names, sources)
        with on_standard_output():
            print(f"wrote {Path(self._options.html) / 'index.html'}")


def seeds_of(count: int, secret: str | None) -> list[int]:
    """Return the seeds to fly: from 0 on, or those that follow from the contents of the file `secret` alone.

    Raises Unreadable, and ValueError for a file of so few bytes that one could try them all.
    """
    if secret is None:
        return list(range(count))
    key = read(Path(secret), _LARGEST_SECRET)
    if len(key) < _SHORTEST_SECRET:
        raise ValueError(f"--secret {shown(secret)}: holds {len(key)} bytes; it must hold {_SHORTEST_SECRET} at least")
    drawn = (int.from_bytes(hmac.digest(key, b"seed %d" % number, "sha256"), "big") for number in itertools.count())
    seeds = (1 + one % _LARGEST_SEED for one in drawn)  # not 0, which is the plan as everybody knows it
    found: dict[int, None] = {}
    while len(found) < count:
        found[next(seeds)] = None
    return list(found)


def jobs_of(plan: Plan, submissions: Sequence[Submission], seeds: Sequence[int]) -> dict[Submission, list[Job]]:
    """Return the flights of each submission, whose script is a whole path then. Raises ScriptError and OSError.

    A script that is there, and cannot be read, is an error of its own flights.
    """
    found: dict[str, tuple[Submission, str]] = {}
    for one in submissions:
        contents = script = one.script
        if not one.error:
            try:
                script = given_script(script)
                contents = contents_of(plan, script)
            except Unreadable as why:
                script = os.path.abspath(script)
                one = replace(one, error=str(why))
        found.setdefault(script, (replace(one, script=script), contents))
    return {
        one: [Job(str(plan.path), one.script, seed, {}, key_of(contents, seed, {}), one.error) for seed in seeds]
        for one, contents in found.values()
    }


def _check_outputs(options: argparse.Namespace, scripts: int) -> None:
    """Raise ValueError or OSError for what cannot be written, before anything is flown."""
    for option in (*_WRITERS, "marks"):
        if path := getattr(options, option):
            writing.check_writable(path)
    if options.gradescope and scripts > 1:
        raise ValueError(f"--gradescope: is for one script, not {scripts}")
    if options.html:
        from drone_sim.grading.outputs.html import report

        report.check(options.html)


def _parser() -> argparse.ArgumentParser:
    parser = GradingParser(
        prog=PROGRAM, description="Fly scripts with a plan and grade them; exit status 0 if all pass, 1 if not."
    )
    add_to(parser)
    parser.add_argument(
        "script",
        metavar="SCRIPT",
        nargs="*",
        default=[],
        help="child scripts; folders, zips or CSVs of a class (default: the plan's own, or the built-in script pilot)",
    )
    parser.add_argument("--marks", metavar="OUT.csv", help="write the class's marks, as Moodle imports them")
    parser.add_argument("--secret", metavar="FILE", help="compute secret seeds from a file that only the teacher has")
    parser.add_argument("--junit", metavar="OUT.xml", help="write results as JUnit's XML")
    parser.add_argument("--json", metavar="OUT.json", help="write all results and figures")
    parser.add_argument("--key", metavar="FILE", help="sign the file of --json")
    parser.add_argument("--verify", metavar="RESULTS.json", help="fly the flights of a --json file again, and compare")
    parser.add_argument("--gradescope", metavar="results.json", help="write one script's results for Gradescope")
    parser.add_argument("--autograder", metavar="OUT.zip", help="do not fly: write an autograder for Gradescope")
    parser.add_argument("--html", metavar="DIR", help="write a report with plots and a replay of every flight")
    return parser


if __name__ == "__main__":
    sys.exit(main(watchdog=Watchdog(PROGRAM)))
