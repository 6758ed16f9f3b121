"""`rosrun drone_sim grade`: fly scripts by a plan, each flight in its own processes, and grade them."""

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
from drone_sim.grading import autograder, tasks, verify
from drone_sim.grading import plan as plans
from drone_sim.grading.arguments import (
    WRONG,
    GradingParser,
    Runner,
    add_to,
    on_standard_output,
    results_folder,
    run_all,
    status_of,
)
from drone_sim.grading.jobs import files
from drone_sim.grading.jobs.files import Unreadable, submission_path
from drone_sim.grading.jobs.job import Job, archives_folder, contents_of, key_of
from drone_sim.grading.outputs import as_json, gradescope, junit, marks, table
from drone_sim.grading.outputs.script_results import group_by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.grading.submissions.folders import submissions_of
from drone_sim.grading.submissions.similarity import source_of
from drone_sim.grading.submissions.submission import Submission, names_of
from drone_sim.message_text import printable
from drone_sim.run.watchdog import Watchdog

PROGRAM = "grade"
FAILED = 1
_MAX_SEED = 10**12
_WRITERS: dict[str, Callable[..., None]] = {"junit": junit.write, "json": as_json.write, "gradescope": gradescope.write}


def main(arguments: Sequence[str] | None = None, watchdog: Watchdog | None = None) -> int:
    """Grade; return 0 if every flight passes, 1 if one does not, 2 after one line for a user's mistake.

    With a watchdog, a signal ends the program: the flights so far are stored, shown and written, and the exit status is
    128 + the signal's number.
    """
    words = sys.argv[1:] if arguments is None else arguments
    if any(word == "--verify" or word.startswith("--verify=") for word in words):
        return verify.main(words, watchdog)
    options = _parser().parse_intermixed_args(words)
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
    def __init__(self, options: argparse.Namespace, watchdog: Watchdog | None):
        """Read and check the plan, the submissions and the options. Raises the errors that status_of reports."""
        self._options = options
        self._watchdog = watchdog
        self._plan = plans.read(tasks.find(options.plan))
        store = archives_folder(results_folder(options))
        submissions = [submission for argument in options.script for submission in submissions_of(argument, store)]
        seeds = seeds_of(options.seeds or self._plan.seeds, options.secret)
        jobs = jobs_of(self._plan, submissions or [Submission(self._plan.default_script)], seeds)
        self._submissions, self._names = list(jobs), names_of(jobs)
        self._jobs = [job for flights in jobs.values() for job in flights]
        _check_outputs(options, len(jobs))
        self._key = as_json.read_key(options.key, "--key") if options.key else None
        self._runner = Runner(PROGRAM, options, self._plan, tables=bool(options.html))
        self._results: dict[Job, Result] = {}

    def run(self) -> int:
        try:
            with self._runner:
                self._fly()
        except KeyboardInterrupt:
            if self._watchdog is not None:
                self._watchdog.stand_down()  # writing the outputs may take long
            self._write_outputs()
            count = f"{len(self._results)} of {len(self._jobs)}"
            print(f"{PROGRAM}: {count} flights were flown, and are kept", file=sys.stderr)
            raise
        if self._watchdog is not None:
            self._watchdog.stand_down()
        if not (self._write_outputs() and self._runner.all_stored):
            return WRONG
        return 0 if all(result.passed for result in self._results.values()) else FAILED

    def _fly(self) -> None:
        """Fly all jobs, and print a line for each script of several when its flights are complete."""
        left = Counter(job.script for job in self._jobs)
        for job, result in self._runner.fly(self._jobs):
            self._results[job] = result
            left[job.script] -= 1
            if not left[job.script] and len(self._submissions) > 1:
                results = (result for other, result in self._results.items() if other.script == job.script)
                (script,) = group_by_script(results, self._names)
                flights = f"{script.passed} of {len(script.flights)} flights passed"
                points = f"{script.points:.4g} of {script.of:.4g} points"
                tqdm.write(f"{printable(script.label)}: {flights}, {points}", file=sys.stderr)

    def _write_outputs(self) -> bool:
        """Show and write all outputs; return whether none failed."""
        results = [self._results[job] for job in self._jobs if job in self._results]
        if not results:
            return True
        outputs: list[Callable[[], None]] = [lambda: self._show(results)]
        for option, write in _WRITERS.items():
            if path := getattr(self._options, option):
                more = {"key": self._key, "names": self._names} if option == "json" else {}
                outputs.append(functools.partial(write, self._plan, results, path, **more))
        if path := self._options.marks:
            outputs.append(lambda: marks.write(self._submissions, group_by_script(results, self._names), path))
        if self._options.html:
            outputs.append(lambda: self._write_html(results))
        return run_all(PROGRAM, outputs)

    def _show(self, results: Sequence[Result]) -> None:
        with on_standard_output():
            table.show(self._plan, results, names=self._names)

    def _write_html(self, results: Sequence[Result]) -> None:
        from drone_sim.grading.outputs.html import report

        keys = {(job.script, job.seed): job.key for job in self._jobs}
        flown = {result.script for result in results}
        sources = {
            submission.script: source_of(files.of_script(self._plan, submission.script))
            for submission in self._submissions
            if submission.script in flown and not submission.error
        }

        def table_of(result: Result) -> Path | None:
            return self._runner.store.table(keys[result.script, result.seed])

        report.write(self._plan, results, table_of, self._options.html, self._names, sources)
        with on_standard_output():
            print(f"wrote {Path(self._options.html) / 'index.html'}")


def seeds_of(count: int, secret: str | None) -> list[int]:
    """Return the seeds to fly: 0 to count - 1, or seeds that depend only on the content of the file `secret`.

    Raises Unreadable, and ValueError for a secret that is so short that it can be guessed.
    """
    if secret is None:
        return list(range(count))
    key = as_json.read_key(secret, "--secret")
    numbers = (int.from_bytes(hmac.digest(key, b"seed %d" % index, "sha256"), "big") for index in itertools.count())
    seeds: dict[int, None] = {}
    while len(seeds) < count:
        seeds[1 + next(numbers) % _MAX_SEED] = None  # not 0, which everybody can fly
    return list(seeds)


def jobs_of(plan: Plan, submissions: Sequence[Submission], seeds: Sequence[int]) -> dict[Submission, list[Job]]:
    """Return the flights of each submission, whose script becomes an absolute path. Raises ScriptError and OSError.

    If a script exists but cannot be read, its jobs have an error.
    """
    by_script: dict[str, tuple[Submission, str]] = {}
    for submission in submissions:
        contents = script = submission.script
        if not submission.error:
            try:
                script = submission_path(script)
                contents = contents_of(plan, script)
            except Unreadable as error:
                script = os.path.abspath(script)
                submission = replace(submission, error=str(error))
        by_script.setdefault(script, (replace(submission, script=script), contents))
    return {
        submission: [
            Job(str(plan.path), submission.script, seed, {}, key_of(contents, seed, {}), submission.error)
            for seed in seeds
        ]
        for submission, contents in by_script.values()
    }


def _check_outputs(options: argparse.Namespace, scripts: int) -> None:
    """Raise ValueError or OSError, before anything is flown, for an output that cannot be written."""
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
