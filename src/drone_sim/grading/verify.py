"""`rosrun drone_sim grade --verify RESULTS.json`: fly the flights of a results file again, and compare."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drone_sim.grading import plan as plans
from drone_sim.grading.arguments import GradingParser, is_sandboxed, status_of
from drone_sim.grading.flight import result_of
from drone_sim.grading.jobs import pool, settings
from drone_sim.grading.jobs.files import Unreadable, read, submission_path
from drone_sim.grading.jobs.job import Job, contents_of, key_of
from drone_sim.grading.jobs.pool import FlightOptions
from drone_sim.grading.outputs import as_json
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import printable, shown
from drone_sim.run.watchdog import Watchdog
from drone_sim.scripting.errors import ScriptError

PROGRAM = "grade"
DIFFERENT = 1
_MAX_SIZE = 2**28  # bytes


def main(arguments: Sequence[str], watchdog: Watchdog | None = None) -> int:
    """Verify; return 0 if every result is that of the file, 1 if one is not, 2 after one line for a user's mistake."""
    parser = GradingParser(prog=PROGRAM, description=__doc__)
    parser.add_argument("--verify", metavar="RESULTS.json", required=True, help="a file of --json")
    parser.add_argument("--key", metavar="FILE", help="the key with which the file was signed")
    parser.add_argument("--jobs", metavar="N", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--sandbox", choices=("auto", "on", "off"), default="auto")
    options = parser.parse_args(arguments)
    return status_of(PROGRAM, lambda: _verify(options), watchdog)


def _verify(options: argparse.Namespace) -> int:
    content = _read(options.verify)
    if options.key and not as_json.is_signed(content, as_json.read_key(options.key, "--key")):
        print(f"{options.verify}: is not signed by {options.key}, or was changed since", file=sys.stderr)
        return DIFFERENT
    plan = plans.read(content["plan"]["path"])
    for script in content["scripts"]:
        hashes = as_json.hashes_of(plan, script["script"])
        for name, old_hash in script.get("hashes", {}).items():
            if hashes.get(name) != old_hash:
                label = printable(script["script"]) or "the built-in script"
                print(f"{PROGRAM}: {label}: not what it was: {printable(name)}", file=sys.stderr)
    results = [Result.from_json(result) for result in content["results"]]
    new_results = _fly_again(plan, results, options)
    different = 0
    for result, values in zip(results, content["results"]):
        new_values = as_json.finite(new_results[result.script, result.seed].to_json())
        names = [name for name in new_values if new_values[name] != values[name]]
        different += bool(names)
        for name in names:
            where = f"{result.script}, seed {result.seed}: {name}"
            print(printable(f"{where}: the file says {shown(values[name])}, the flight {shown(new_values[name])}"))
    print(f"{len(results) - different} of {len(results)} flights are what the file says, to the last bit")
    return DIFFERENT if different else 0


def _read(path: str) -> dict[str, Any]:
    """Return the content of a results file. Raises Unreadable and ValueError."""
    try:
        content = json.loads(read(Path(path), _MAX_SIZE))
        if (content["format"], content["version"]) != (as_json.FORMAT, as_json.VERSION) or not content["plan"]["path"]:
            raise ValueError
        if any(result["changes"] for result in content["results"]):
            raise ValueError
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError):
        raise ValueError(f"{path}: is not a file that grade --json has written") from None
    except ValueError as error:
        raise ValueError(str(error) or f"{path}: is not a file that grade --json has written") from None
    return dict(content)


def _fly_again(plan: Plan, results: Sequence[Result], options: argparse.Namespace) -> dict[tuple[str, int], Result]:
    """Return the results of new flights by script and seed; a script that cannot be flown keeps its error."""
    numbers = settings.load()
    flight_options = FlightOptions(numbers.limits, numbers.batches, is_sandboxed(PROGRAM, options.sandbox))
    contents: dict[str, str] = {}
    for script in {result.script for result in results}:
        with contextlib.suppress(Unreadable, ScriptError):
            contents[script] = contents_of(plan, submission_path(script))
    new_results = {
        (result.script, result.seed): result_of(plan, result.script, result.seed, {}, result.error or "")
        for result in results
    }
    jobs = [
        Job(str(plan.path), result.script, result.seed, {}, key_of(contents[result.script], result.seed, {}))
        for result in results
        if result.script in contents
    ]
    with pool.open_pool(flight_options, max(1, min(options.jobs, len(jobs)))) as fly:
        new_results.update({(flight.job.script, flight.job.seed): flight.result for flight in fly(jobs)})
    return new_results
