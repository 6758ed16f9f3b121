"""`rosrun drone_sim grade --verify RESULTS.json`: fly what a file of results says once more, and compare."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.grading import evidence
from drone_sim.grading import plan as plans
from drone_sim.grading.arguments import GradingParser, is_sandboxed, status_of
from drone_sim.grading.flight import ungraded
from drone_sim.grading.jobs import pool, settings
from drone_sim.grading.jobs.files import Unreadable, given_script, read
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
_LARGEST = 2**28  # bytes


def main(arguments: Sequence[str], watchdog: Watchdog | None = None) -> int:
    """Verify; return 0 where every flight comes out as the file says, 1 where one does not, 2 for what cannot be."""
    parser = GradingParser(prog=PROGRAM, description=__doc__)
    parser.add_argument("--verify", metavar="RESULTS.json", required=True, help="a file of --json")
    parser.add_argument("--key", metavar="FILE", help="the key with which the file was signed")
    parser.add_argument("--jobs", metavar="N", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--sandbox", choices=("auto", "on", "off"), default="auto")
    options = parser.parse_args(arguments)
    return status_of(PROGRAM, lambda: _verify(options), watchdog)


def _verify(options: argparse.Namespace) -> int:
    content = _content(options.verify)
    if options.key and not evidence.is_signed(content, evidence.key_in(options.key)):
        print(f"{options.verify}: is not signed by {options.key}, or was changed since", file=sys.stderr)
        return DIFFERENT
    plan = plans.read(content["plan"]["path"])
    for line in _changes(plan, content):
        print(f"{PROGRAM}: {printable(line)}", file=sys.stderr)
    said = [Result.from_json(one) for one in content["results"]]
    again = _flown(plan, said, options)
    different = 0
    for one, raw in zip(said, content["results"]):
        now = as_json.finite(again[one.script, one.seed].to_json())
        names = [name for name in now if now[name] != raw[name]]
        different += bool(names)
        for name in names:
            where = f"{one.script}, seed {one.seed}: {name}"
            print(printable(f"{where}: the file says {shown(raw[name])}, the flight {shown(now[name])}"))
    print(f"{len(said) - different} of {len(said)} flights are what the file says, to the last bit")
    return DIFFERENT if different else 0


def _content(path: str) -> dict[str, Any]:
    """Return what a file of results holds. Raises Unreadable and ValueError."""
    try:
        content = json.loads(read(Path(path), _LARGEST))
        if (content["format"], content["version"]) != (as_json.FORMAT, as_json.VERSION) or not content["plan"]["path"]:
            raise ValueError
        if any(one["changes"] for one in content["results"]):
            raise ValueError
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError):
        raise ValueError(f"{path}: is not a file that grade --json has written") from None
    except ValueError as error:
        raise ValueError(str(error) or f"{path}: is not a file that grade --json has written") from None
    return dict(content)


def _changes(plan: Plan, content: Mapping[str, Any]) -> Iterator[str]:
    """Give a line for each thing that is not what it was when the file was written."""
    for one in content["scripts"]:
        now, before = evidence.hashes_of(plan, one["script"]), one.get("hashes", {})
        for name in before:
            if now.get(name) != before[name]:
                yield f"{one['script'] or 'the built-in script'}: not what it was: {name}"


def _flown(plan: Plan, said: Sequence[Result], options: argparse.Namespace) -> dict[tuple[str, int], Result]:
    numbers = settings.load()
    how = FlightOptions(numbers.limits, numbers.batches, is_sandboxed(PROGRAM, options.sandbox))
    contents = {script: _contents(plan, script) for script in {one.script for one in said}}
    found = {(one.script, one.seed): ungraded(plan, one.script, one.seed, {}, one.error or "") for one in said}
    jobs = [
        Job(str(plan.path), one.script, one.seed, {}, key_of(contents[one.script], one.seed, {}))
        for one in said
        if contents[one.script]
    ]
    with pool.opened(how, max(1, min(options.jobs, len(jobs)))) as fly:
        found.update({(one.job.script, one.job.seed): one.result for one in fly(jobs)})
    return found


def _contents(plan: Plan, script: str) -> str:
    """Return what contents_of does; '' for what cannot be flown, such as a zip that was refused."""
    try:
        return contents_of(plan, given_script(script))
    except (Unreadable, ScriptError):
        return ""


def asks_for_it(arguments: Sequence[str]) -> bool:
    """Tell whether a command line asks for a verification."""
    return any(one == "--verify" or one.startswith("--verify=") for one in arguments)
