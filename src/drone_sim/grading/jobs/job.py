"""A job: one flight of a plan by a script, and the key under which its result is kept."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files.resources import package_path
from drone_sim.grading.jobs import files
from drone_sim.grading.plan import Plan

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


def job_of(plan: Plan, script: str, seed: int, changes: Mapping[str, Any] | None = None) -> Job:
    """Return the job of a flight. Raises what `contents_of` does."""
    changes = changes or {}
    return Job(str(plan.path), script, seed, dict(changes), key_of(contents_of(plan, script), seed, changes))


def key_of(contents: str, seed: int, changes: Mapping[str, Any]) -> str:
    """Return 32 hexadecimal digits for what `contents_of` gave, a seed and changes."""
    told = json.dumps([contents, seed, changes], sort_keys=True, default=str)
    return hashlib.sha256(told.encode()).hexdigest()[:32]


def contents_of(plan: Plan, script: str) -> str:
    """Return a digest of all that a flight depends on beside seed and changes: its files, this package, its engine.

    Of the files it is the contents that counts, and where each lies beside the one that names it. Raises OSError,
    ScriptError for a script that is not there, and Unreadable for one that cannot be read.
    """
    flown = files.of_script(plan, script)
    digests = {path: _digest(path) for path in files.of_plan(plan, {})}
    digests |= {path: hashlib.sha256(files.read(path)).hexdigest() for path in flown}
    digest = hashlib.sha256(f"{version()}\0{flown[0].name if flown else script}".encode(errors="surrogateescape"))
    folder = os.path.commonpath([path.parent for path in digests])
    for path in sorted(digests):
        digest.update(f"\0{os.path.relpath(path, folder)}\0{digests[path]}".encode(errors="surrogateescape"))
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
