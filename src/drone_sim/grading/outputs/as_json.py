"""All results as one JSON object, for programs, with hashes of all that they depend on, and a signature."""

from __future__ import annotations

import hashlib
import hmac
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.grading.jobs import files
from drone_sim.grading.jobs.job import version
from drone_sim.grading.outputs.script_results import group_by_script
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import shown
from drone_sim.scripting.errors import ScriptError

FORMAT = "drone_sim grades"
VERSION = 1  # of the format; it changes if a key is renamed or changes its meaning, not if a key is added
_MIN_KEY, _MAX_KEY = 16, 2**16  # bytes
_SIGNATURE = "signature"


def write(
    plan: Plan,
    results: Sequence[Result],
    path: str | Path,
    key: bytes | None = None,
    names: Mapping[str, str] | None = None,
) -> None:
    """Write the file, with a signature if there is a key. Raises OSError, in one line that names the file."""
    values = content(plan, results, names)
    if key is not None:
        values = {**values, _SIGNATURE: _signature(values, key)}
    writing.write(path, json.dumps(values, indent=1, allow_nan=False) + "\n")


def content(plan: Plan, results: Sequence[Result], names: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the content of the file; figures that are not finite become None."""
    scripts = [
        {
            "script": script.script,
            "name": script.label,
            "flights": len(script.flights),
            "passed": script.passed,
            "points": script.points,
            "of": script.of,
            "worst": {"seed": script.worst.seed, "points": script.worst.points},
            "failed": dict(script.failures),
            "hashes": hashes_of(plan, script.script),
        }
        for script in group_by_script(results, names)
    ]
    return finite(
        {
            "format": FORMAT,
            "version": VERSION,
            "plan": {"name": plan.name, "title": plan.title, "path": str(plan.path)},
            "scripts": scripts,
            "results": [result.to_json() for result in results],
        }
    )


def finite(value: Any) -> Any:
    """Return a value with None for each number that is not finite, which JSON does not allow."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# ---- evidence


def hashes_of(plan: Plan, script: str) -> dict[str, str]:
    """Return the SHA-256 of the plan's file, the files that it names (`config`), the script's files, and the package.

    Files that can no longer be read are left out. The package's hash covers its files, Python, NumPy, PyBullet and the
    processor.
    """
    hashes = {"package": version()}
    for name, paths in (
        ("plan", lambda: [plan.path]),
        ("config", lambda: [path for path in files.of_plan(plan, {}) if path != plan.path]),
        ("script", lambda: files.of_script(plan, script)),
    ):
        try:
            hashes[name] = _digest(paths())
        except (OSError, ValueError, ScriptError):
            continue
    return hashes


def _digest(paths: Iterable[Path]) -> str:
    """Return a digest of the names and contents of files, whatever their folders are."""
    digest = hashlib.sha256()
    for name, path in sorted((os.fsencode(path.name), path) for path in paths):
        digest.update(name + b"\0" + hashlib.sha256(files.read(path)).digest())
    return digest.hexdigest()


def read_key(path: str, option: str) -> bytes:
    """Return the content of an option's key file. Raises Unreadable, and ValueError for a key that is too short."""
    key = files.read(Path(path), _MAX_KEY)
    if len(key) < _MIN_KEY:
        raise ValueError(f"{option} {shown(path)}: holds {len(key)} bytes; it must hold at least {_MIN_KEY}")
    return key


def is_signed(values: Mapping[str, Any], key: bytes) -> bool:
    """Return whether the content of a results file has the right signature for a key."""
    return hmac.compare_digest(str(values.get(_SIGNATURE, "")).encode(), _signature(values, key).encode())


def _signature(values: Mapping[str, Any], key: bytes) -> str:
    """Return the HMAC-SHA256 over all of the content but the signature."""
    unsigned = {name: value for name, value in values.items() if name != _SIGNATURE}
    text = json.dumps(unsigned, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hmac.new(key, text.encode(), "sha256").hexdigest()
