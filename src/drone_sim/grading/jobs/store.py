"""Results on the disk: a line of JSON for each flight as it comes, so that a run that was interrupted can go on."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from drone_sim.grading.jobs.job import Job
from drone_sim.grading.jobs.process import Flight
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result

_DAY = 86400.0  # s
_LONGEST = 2**23  # characters of a line


def default_folder() -> Path:
    """Return where results lie if nobody says where: the user's cache."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "drone_sim" / "grading"


class Store:
    """The results of a plan's flights in a folder, and their tables. Lost flights are not kept."""

    def __init__(self, folder: Path, plan: Plan):
        """Make the folder. Raises OSError."""
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

    def add(self, flight: Flight) -> None:
        """Keep a flight, its table first. Raises OSError, in one line that names the file."""
        if flight.is_lost:
            return
        if flight.table:
            self._tables.mkdir(exist_ok=True)
            path = self._tables / f"{flight.job.key}.csv"
            unfinished = path.with_suffix(f".{os.getpid()}")
            with _named(path):
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
        with _named(self._file), open(self._file, "ab", buffering=0) as file:
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
            path.unlink(missing_ok=True)


def forget_old(folder: Path, days: float) -> None:
    """Remove files that nothing has been added to for so long; as far as that is allowed."""
    oldest = time.time() - days * _DAY
    for path in (*folder.glob("*.jsonl"), *folder.glob("*-tables/*")):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest:
                path.unlink()


@contextlib.contextmanager
def _named(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OSError(f"{path}: {error.strerror or error}") from None


def _read(line: str) -> tuple[str, Result | None]:
    """Return key and result of a line; None for one that was cut off, or is none of ours."""
    try:
        values: dict[str, Any] = json.loads(line)
        return str(values["key"]), Result.from_json(values["result"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return "", None
