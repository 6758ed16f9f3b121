"""A job: one flight of a plan by a script; the key under which its result is kept, and where: on the disk.

Results are a line of JSON for each flight as it comes, so that a run that was interrupted can go on.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import os
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files import writing
from drone_sim.files.containment import remove
from drone_sim.files.resources import cache_path, package_path
from drone_sim.grading.flight import ungraded
from drone_sim.grading.jobs import files
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

_DAY = 86400.0  # s
_LONGEST = 2**23  # characters of a line
_LARGEST = 64 * 2**20  # bytes: of a larger file size and time count, not what is in it


@dataclass(frozen=True)
class Job:
    """One flight: of the plan in a file, by a script as Plan.script_of gives it, with a seed and changes."""

    plan: str
    script: str
    seed: int
    changes: Mapping[str, Any] = field(default_factory=dict, hash=False)
    key: str = ""  # the same for the same contents of all files; see `key_of`
    error: str = ""  # why the script cannot be flown, in one line


@dataclass(frozen=True)
class JobResult:
    """A job that was flown: its result, and its table as `fly --csv` writes it, b'' where there is none."""

    job: Job
    result: Result
    table: bytes = b""
    is_lost: bool = False  # a limit or a crash ended it: another time it may end in another way


def lost(job: Job, plan: Plan, why: str) -> JobResult:
    """Return what there is of a job of which nothing came back; `why` is one line."""
    return JobResult(job, ungraded(plan, job.script, job.seed, job.changes, why), is_lost=True)


def key_of(contents: str, seed: int, changes: Mapping[str, Any]) -> str:
    """Return 32 hexadecimal digits for what `contents_of` gave, a seed and changes."""
    text = json.dumps([contents, seed, changes], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def contents_of(plan: Plan, script: str) -> str:
    """Return a digest of all that a flight depends on beside seed and changes: its files, this package, its engine.

    Of each file, its content counts, and its path relative to the plan's or the script's folder: a script that was
    moved to another folder is the same. Raises OSError, ScriptError for one that is not there, Unreadable for one that
    cannot be read.
    """
    flown = files.of_script(plan, script)
    digest = hashlib.sha256(f"{version()}\0{flown[0].name if flown else script}".encode(errors="surrogateescape"))
    own = {path: hashlib.sha256(files.read(path)).hexdigest() for path in flown}
    for folder, digests in (
        (plan.folder, {path: _digest(path) for path in files.of_plan(plan, {})}),
        (flown[0].parent if flown else plan.folder, own),
    ):
        for name, said in sorted((os.path.relpath(path, folder), said) for path, said in digests.items()):
            digest.update(f"\0{name}\0{said}".encode(errors="surrogateescape"))
    return digest.hexdigest()


def _digest(path: Path) -> str:
    status = path.stat()
    if status.st_size > _LARGEST:
        return f"{status.st_size} {status.st_mtime_ns}"
    return hashlib.sha256(path.read_bytes()).hexdigest()


@functools.cache
def version() -> str:
    """Return a digest of what simulates: this package's files, Python, NumPy, PyBullet and the processor's kind."""
    here = Path(__file__).resolve().parents[2]
    root = package_path()
    sources = sorted(
        [*here.rglob("*.py"), *here.rglob("*.lua"), *(root / "config").rglob("*.yaml"), *root.glob("urdf/*")]
    )
    digest = hashlib.sha256(
        f"{platform.python_version()} {np.__version__} {metadata.version('pybullet')} {platform.machine()}".encode()
    )
    for path in sources:
        digest.update(_digest(path).encode())
    return digest.hexdigest()


# ---- on the disk


def default_folder() -> Path:
    """Return the default folder of results, in the user's cache."""
    return cache_path() / "grading"


def unpacked(folder: Path) -> Path:
    """Return the folder, inside the folder of results, into which the zips of a class are unpacked."""
    return folder / "submissions"


class ResultStore:
    """The results of a plan's flights in a folder, and their tables. Lost flights are not kept."""

    def __init__(self, folder: Path, plan: Plan):
        """Make the `folder`, for results of a `plan` and of others. Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        named = hashlib.sha256(os.fsencode(plan.path)).hexdigest()[:12]
        self._file = folder / f"{plan.name}-{named}.jsonl"
        self._tables = folder / f"{plan.name}-{named}-tables"
        self._has_begun = False

    def known(self, jobs: Sequence[Job], tables: bool) -> dict[str, Result]:
        """Return the results that are there, by the jobs' keys; if `tables`, only those with a table.

        A result names the script that was flown then; another of the same contents has the same key.
        """
        wanted = {job.key for job in jobs}
        found: dict[str, Result] = {}
        if not self._file.exists():
            return found
        with open(self._file, encoding="utf-8", errors="replace") as file:
            while line := file.readline(_LONGEST):
                key, result = _read(line)
                if result is None or key not in wanted:
                    continue
                if not (tables and result.flown) or self.table(key) is not None:
                    found[key] = result
        return found

    def add(self, flight: JobResult) -> None:
        """Keep a flight, its table first. Raises OSError, in one line that names the file."""
        if flight.is_lost:
            return
        if flight.table:
            self._tables.mkdir(exist_ok=True)
            path = self._tables / f"{flight.job.key}.csv"
            unfinished = path.with_suffix(f".{os.getpid()}")
            with writing.name_in_errors(path):
                try:
                    unfinished.write_bytes(flight.table)
                    unfinished.replace(path)
                except OSError:
                    unfinished.unlink(missing_ok=True)
                    raise
        line = json.dumps({"key": flight.job.key, "result": flight.result.to_json()}) + "\n"
        before = "" if self._has_begun else "\n"  # half a line may be there
        self._has_begun = False
        # One write at the end of the file: two programs at a time mix no lines. On a full disk it may be a part only.
        with writing.name_in_errors(self._file), open(self._file, "ab", buffering=0) as file:
            content = (before + line).encode()
            while content:
                content = content[file.write(content) :]
        self._has_begun = True

    def table(self, key: str) -> Path | None:
        """Return a flight's table, if it is there."""
        path = self._tables / f"{key}.csv"
        return path if path.is_file() else None

    def forget(self) -> None:
        """Remove the plan's results. Raises OSError."""
        self._file.unlink(missing_ok=True)
        for path in self._tables.glob("*.csv"):
            remove(path, within=self._tables)


def forget_old(folder: Path, days: float) -> None:
    """Remove files that nothing has been added to for so long; as far as that is allowed."""
    oldest = time.time() - days * _DAY
    for path in (*folder.glob("*.jsonl"), *folder.glob("*-tables/*"), *unpacked(folder).glob("*")):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest:
                remove(path, within=folder)


def _read(line: str) -> tuple[str, Result | None]:
    """Return key and result of a line; None for one that was cut off, or is none of ours."""
    try:
        values: dict[str, Any] = json.loads(line)
        return str(values["key"]), Result.from_json(values["result"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return "", None
