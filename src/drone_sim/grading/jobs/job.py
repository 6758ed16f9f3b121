"""A job: one flight of a plan by a script, and the key under which its result is kept."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from drone_sim.files.resources import package_path
from drone_sim.grading.plan import Plan
from drone_sim.scripting.load import script_path

_LARGEST = 64 * 2**20  # bytes: of a larger file size and time count, not what is in it
_READ_FOR_NAMES = 2**20  # bytes: a longer file names no others
_MOST_FILES = 1000
_WORD = re.compile(r"[\w./-]{1,200}")
_NAMES_OTHERS = (".py", ".lua", ".yaml", ".yml", ".urdf", ".dae", ".obj", ".mtl")
_ENDINGS = ("", ".py", ".lua", "/__init__.py", "/init.lua")  # of what `import` and `require` name


@dataclass(frozen=True)
class Job:
    """One flight: of the plan in a file, by a script as Plan.script_of gives it, with a seed and changes."""

    plan: str
    script: str
    seed: int
    changes: Mapping[str, Any] = field(default_factory=dict, hash=False)
    key: str = ""  # the same for the same contents of all files; see `key_of`


def job_of(plan: Plan, script: str, seed: int, changes: Mapping[str, Any] | None = None) -> Job:
    """Return the job of a flight. Raises OSError for a file that cannot be read, ScriptError for no such script."""
    changes = changes or {}
    return Job(str(plan.path), script, seed, dict(changes), key_of(contents_of(plan, script), seed, changes))


def key_of(contents: str, seed: int, changes: Mapping[str, Any]) -> str:
    """Return 32 hexadecimal digits for what `contents_of` gave, a seed and changes."""
    told = json.dumps([contents, seed, changes], sort_keys=True, default=str)
    return hashlib.sha256(told.encode()).hexdigest()[:32]


def contents_of(plan: Plan, script: str) -> str:
    """Return a digest of all that a flight depends on beside seed and changes: its files, this package, its engine.

    Of the files it is the contents that counts, and where each lies beside the one that names it. Raises OSError,
    and ScriptError for a script that is not there.
    """
    files = files_named([*plan.files, Path(script_path(script))])
    folder = os.path.commonpath([path.parent for path in files])
    digest = hashlib.sha256(version().encode())
    for path in files:
        digest.update(f"\0{os.path.relpath(path, folder)}\0{_digest(path)}".encode(errors="surrogateescape"))
    return digest.hexdigest()


def files_named(paths: list[Path]) -> list[Path]:
    """Return the files, and those that their texts name (imports, meshes, URDFs, scripts), and so on, sorted.

    A word of a text counts as a name where there is such a file beside it: rather one file too many, for which a
    flight is flown again, than one too few.
    """
    found = dict.fromkeys(path.resolve() for path in paths)
    waiting = list(found)
    while waiting and len(found) < _MOST_FILES:
        for path in _named_in(waiting.pop()):
            if path not in found:
                found[path] = None
                waiting.append(path)
    return sorted(found)


def _named_in(path: Path) -> Iterator[Path]:
    if path.suffix.lower() not in _NAMES_OTHERS or path.stat().st_size > _READ_FOR_NAMES:
        return
    text = path.read_text(encoding="utf-8", errors="replace")
    names = {name for word in _WORD.findall(text) for name in (word, word.replace(".", "/")) if set(name) - {".", "/"}}
    beside = {entry.name for entry in os.scandir(path.parent)}
    for name in names:
        first = name.split("/", 1)[0]
        if first in beside or first in ("", "..", ".") or any(first + ending in beside for ending in _ENDINGS):
            yield from (one.resolve() for one in _candidates(path.parent, name) if one.is_file())


def _candidates(folder: Path, name: str) -> Iterator[Path]:
    for ending in _ENDINGS:
        try:
            yield folder / f"{name}{ending}"
        except ValueError:
            return


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
    files = sorted(
        [*here.rglob("*.py"), *here.rglob("*.lua"), *(root / "config").rglob("*.yaml"), *root.glob("urdf/*")]
    )
    digest = hashlib.sha256(
        f"{platform.python_version()} {np.__version__} {metadata.version('pybullet')} {platform.machine()}".encode()
    )
    for path in files:
        digest.update(_digest(path).encode())
    return digest.hexdigest()
