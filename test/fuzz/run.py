#!/usr/bin/env python3
"""`./dev.sh fuzz [CASES] [--seed N]`: try odd input against the real code, in processes that may die.

A case passes if it is taken, or refused with one line, within 3 s of the processor and the limit of memory. Each
other way to end is a fault: it is counted, its smallest example is kept in a folder of its own, and named by one
line at the end.
Exit status 1 where there was any.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import pickle
import re
import shutil
import sys
import time
import warnings
import zlib
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import hypothesis
from case import Case
from hypothesis import HealthCheck, Phase, given, settings
from pool import Trier

KINDS = (
    "messages",
    "requests",
    "connections",
    "legacy_commands",
    "bags",
    "archives",
    "browsers",
    "parameters",
    "scenes",
    "meshes",
    "urdfs",
    "timelines",
    "lua_scripts",
    "python_scripts",
)
_CHUNK = 50  # cases of one run of hypothesis; a new kind of fault ends it
_SHRINKING = 30.0  # s
OUT = Path(__file__).parents[2] / "build" / "fuzz"


class Found(NamedTuple):
    """A kind of fault: its first words, the smallest case, how often it came."""

    fault: str
    case: Case
    count: int


class Result(NamedTuple):
    """What came of a kind's cases."""

    kind: str
    taken: int
    refused: int
    found: dict[str, Found]
    slowest: float


class _Wrong(AssertionError):
    """Tells hypothesis that a case failed."""


class _Enough(BaseException):
    """Ends hypothesis's search for a smaller case: it passes what is no Exception."""


class _Kind:
    """Tries a kind's cases; remembers what each fault looked like."""

    def __init__(self, name: str, trier: Trier):
        self.name = name
        self.cases = importlib.import_module(f"kinds.{name}").CASES
        self.trier = trier
        self.taken = self.refused = 0
        self.slowest = 0.0
        self.found: dict[str, Found] = {}
        self._new = ""  # the fault that is being made smaller
        self._until = 0.0
        self._known: dict[bytes, str] = {}  # hypothesis asks again for what it tried

    def run(self, count: int, seed: int) -> Result:
        """Try `count` cases; the seed and the kind's name say which."""
        seed = seed * 1_000_003 + zlib.crc32(self.name.encode())
        chunk = 0
        while self._tried() < count and chunk < count:  # where hypothesis has no more to try, it ends early
            self._chunk(min(_CHUNK, count - self._tried()), seed + chunk)
            chunk += 1
        return Result(self.name, self.taken, self.refused, self.found, self.slowest)

    def _tried(self) -> int:
        return self.taken + self.refused + sum(found.count for found in self.found.values())

    def _chunk(self, count: int, seed: int) -> None:
        self._new = ""
        self._known.clear()
        profile = settings(
            max_examples=count,
            database=None,
            deadline=None,
            phases=(Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
            report_multiple_bugs=False,
        )
        with contextlib.suppress(_Wrong, _Enough, hypothesis.errors.FlakyFailure):
            hypothesis.seed(seed)(profile(given(self.cases)(self._one)))()

    def _one(self, case: Case) -> None:
        if self._new and time.monotonic() > self._until:
            raise _Enough
        if self._fault(case) == self._new != "":
            raise _Wrong(self._new)

    def _fault(self, case: Case) -> str:
        """Return the kind of fault that this case shows, '' for none."""
        key = pickle.dumps(case)
        if key in self._known:
            return self._known[key]
        answer = self.trier.run(case)
        self.slowest = max(self.slowest, answer.seconds)
        name = self._known[key] = fingerprint(answer.fault)
        if not name:
            self.taken += not answer.refusal
            self.refused += bool(answer.refusal)
            return ""
        if name not in self.found:
            if not self._new:
                self._new, self._until = name, time.monotonic() + _SHRINKING
            self.found[name] = Found(answer.fault, case, 1)
        else:
            old = self.found[name]
            smaller = old if len(pickle.dumps(old.case)) <= len(key) else Found(answer.fault, case, 0)
            self.found[name] = smaller._replace(count=old.count + 1)
        return name


def fingerprint(fault: str) -> str:
    """Return what two faults of one cause have in common: the first line without its numbers and quotes."""
    first = fault.partition("\n")[0]
    if first.startswith("crash"):
        place = re.search(r"(\w+\.py)\", line \d+ in (\w+)", fault)
        first += f" in {place.group(1)}:{place.group(2)}" if place else fault[len(first) : 200].replace("\n", " ")
        return first
    return re.sub(r"(0x)?\d[\d.e+-]*|'[^']*'|\"[^\"]*\"|/tmp/\S*", "_", first)[:90]


def run_kind(name: str, count: int, seed: int, trier: Trier) -> Result:
    """Try `count` cases of a kind."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hypothesis.errors.HypothesisWarning)  # some cases are large
        return _Kind(name, trier).run(count, seed)


def _run_alone(name: str, count: int, seed: int) -> Result:
    trier = Trier()
    try:
        return run_kind(name, count, seed, trier)
    finally:
        trier.close()


def keep(result: Result, out: Path, seed: int) -> list[str]:
    """Write each fault's case into a folder; return a line on each."""
    lines = []
    for name, found in sorted(result.found.items(), key=lambda item: -item[1].count):
        folder = out / f"{result.kind}-{zlib.crc32(name.encode()):08x}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for file, content in found.case.files.items():
            (folder / file).write_bytes(content)
        (folder / "case.pickle").write_bytes(pickle.dumps(found.case))
        (folder / "fault.txt").write_text(
            f"seed {seed}\n{found.case!r:.5000}\n\n{found.fault}\n", encoding="utf-8", errors="replace"
        )
        lines.append(f"{folder}: {found.count} times: {found.fault.splitlines()[0][:160]}")
    return lines


def _again(folders: list[str]) -> int:
    """Try what earlier runs have found."""
    trier, status = Trier(), 0
    for folder in folders:
        answer = trier.run(pickle.loads((Path(folder) / "case.pickle").read_bytes()))
        status |= bool(answer.fault)
        print(f"{folder}: {answer.fault or answer.refusal or 'taken'} ({answer.seconds:.2f} s)", flush=True)
    trier.close()
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="./dev.sh fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="?", type=int, default=1000, help="how many, over all kinds (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="the same seed tries the same cases (default: 0)")
    parser.add_argument(
        "--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND", help=f"of {', '.join(KINDS)}"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="where the faults are kept (default: build/fuzz)")
    parser.add_argument("--again", nargs="+", metavar="FOLDER", help="try again what was kept there, and nothing else")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (default: 2)")
    return parser


def main() -> int:
    """Run."""
    options = _parser().parse_args()
    if options.again:
        return _again(options.again)
    began, lines = time.monotonic(), []
    count = -(-options.cases // len(options.kinds))
    with ProcessPoolExecutor(options.jobs) as executor:
        futures: list[Any] = [executor.submit(_run_alone, kind, count, options.seed) for kind in options.kinds]
        for future in futures:
            one: Result = future.result()
            faults = sum(found.count for found in one.found.values())
            print(
                f"{one.kind}: {one.taken} taken, {one.refused} refused, {faults} faults of {len(one.found)} kinds; "
                f"the slowest took {one.slowest:.1f} s",
                flush=True,
            )
            lines += keep(one, options.out, options.seed)
    print(f"seed {options.seed}, {time.monotonic() - began:.0f} s; {len(lines)} kinds of fault", *lines, sep="\n")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
