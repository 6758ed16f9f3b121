"""Jobs (single flights of a plan by a script), the keys of their results, and the store of results on the disk.

The store appends a line of JSON after each flight, so that an interrupted run can be continued.
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
from drone_sim.grading.flight import result_of
from drone_sim.grading.jobs import files
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

_DAY = 86400.0  # s
_MAX_LINE = 2**23  # characters
_MAX_HASHED = 64 * 2**20  # bytes; of a larger file, size and modification time are compared instead of the content


@dataclass(frozen=True)
class Job:
    """A flight of the plan in the file `plan`, by a script as Plan.script_of returns it, with a seed and changes."""

    plan: str
    script: str
    seed: int
    changes: Mapping[str, Any] = field(default_factory=dict, hash=False)
    key: str = ""  # of the contents of all files, see `key_of`
    error: str = ""  # why the script cannot be flown, in one line


@dataclass(frozen=True)
class JobResult:
    """The result of a job, and its table in the format of `fly --csv`, b'' if there is none."""

    job: Job
    result: Result
    table: bytes = b""
    is_lost: bool = False  # a limit or a crash ended it, so the next time it may end differently


def lost_flight(job: Job, plan: Plan, reason: str) -> JobResult:
    """Return the result of a job whose flight was lost; `reason` is one line."""
    return JobResult(job, result_of(plan, job.script, job.seed, job.changes, reason), is_lost=True)


def key_of(contents: str, seed: int, changes: Mapping[str, Any]) -> str:
    """Return 32 hexadecimal digits for the digest of `contents_of`, a seed and changes."""
    text = json.dumps([contents, seed, changes], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def contents_of(plan: Plan, script: str) -> str:
    """Return a digest of all that a flight depends on besides seed and changes: its files, this package, its engine.

    Paths count relative to the plan's or the script's folder, so that a script can be moved with its folder. Raises
    OSError, ScriptError for a script that does not exist, and Unreadable for a script that cannot be read.
    """
    own_files = files.of_script(plan, script)
    name = own_files[0].name if own_files else script
    digest = hashlib.sha256(f"{version()}\0{name}".encode(errors="surrogateescape"))
    own = {path: hashlib.sha256(files.read(path)).hexdigest() for path in own_files}
    for folder, digests in (
        (plan.folder, {path: _digest(path) for path in files.of_plan(plan, {})}),
        (own_files[0].parent if own_files else plan.folder, own),
    ):
        for name, file_digest in sorted((os.path.relpath(path, folder), one) for path, one in digests.items()):
            digest.update(f"\0{name}\0{file_digest}".encode(errors="surrogateescape"))
    return digest.hexdigest()


def _digest(path: Path) -> str:
    status = path.stat()
    if status.st_size > _MAX_HASHED:
        return f"{status.st_size} {status.st_mtime_ns}"
    return hashlib.sha256(path.read_bytes()).hexdigest()


@functools.cache
def version() -> str:
    """Return a digest of the simulator: this package's files, Python, NumPy, PyBullet and the type of processor."""
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


def default_folder() -> Path:
    return cache_path() / "grading"


def archives_folder(folder: Path) -> Path:
    """Return the folder, inside the folder of results, into which archives of submissions are unpacked."""
    return folder / "submissions"


class ResultStore:
    """The stored results and tables of a plan's flights. Lost flights are not stored."""

    def __init__(self, folder: Path, plan: Plan):
        """Create the `folder`, which may hold results of other plans too. Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        path_digest = hashlib.sha256(os.fsencode(plan.path)).hexdigest()[:12]
        self._file = folder / f"{plan.name}-{path_digest}.jsonl"
        self._tables = folder / f"{plan.name}-{path_digest}-tables"
        self._is_at_line_start = False

    def find(self, jobs: Sequence[Job], tables: bool) -> dict[str, Result]:
        """Return the stored results by the jobs' keys; with `tables`, only those with a table.

        A result may name another script with the same contents, because it has the same key.
        """
        wanted = {job.key for job in jobs}
        found: dict[str, Result] = {}
        if not self._file.exists():
            return found
        with open(self._file, encoding="utf-8", errors="replace") as file:
            while line := file.readline(_MAX_LINE):
                try:
                    values = json.loads(line)
                    key, result = str(values["key"]), Result.from_json(values["result"])
                except (ValueError, KeyError, TypeError, RecursionError):  # incomplete, or in another format
                    continue
                if key in wanted and (not (tables and result.flown) or self.table(key) is not None):
                    found[key] = result
        return found

    def add(self, flight: JobResult) -> None:
        """Store a flight. Raises OSError, in one line that names the file."""
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
        start = "" if self._is_at_line_start else "\n"  # an interrupted run may have left half a line
        self._is_at_line_start = False
        # A line is appended by one write, so that two programs do not mix their lines, unless the disk is full.
        with writing.name_in_errors(self._file), open(self._file, "ab", buffering=0) as file:
            content = (start + line).encode()
            while content:
                content = content[file.write(content) :]
        self._is_at_line_start = True

    def table(self, key: str) -> Path | None:
        path = self._tables / f"{key}.csv"
        return path if path.is_file() else None

    def clear(self) -> None:
        """Remove the plan's results. Raises OSError."""
        self._file.unlink(missing_ok=True)
        for path in self._tables.glob("*.csv"):
            remove(path, within=self._tables)


def count_results(folder: Path) -> int:
    return sum(bool(line.strip()) for file in folder.glob("*.jsonl") for line in file.read_bytes().splitlines())


def remove_old_results(folder: Path, days: float) -> None:
    """Remove results, tables and unpacked submissions that are older than some days, as far as permissions allow."""
    oldest = time.time() - days * _DAY
    for path in (*folder.glob("*.jsonl"), *folder.glob("*-tables/*"), *archives_folder(folder).glob("*")):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest:
                remove(path, within=folder)
