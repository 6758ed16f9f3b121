"""Evidence for results, for those who doubt them: hashes of everything that they depend on, and a signature."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from drone_sim.grading.jobs import files
from drone_sim.grading.jobs.job import version
from drone_sim.grading.plan import Plan
from drone_sim.message_text import shown
from drone_sim.scripting.errors import ScriptError

_SHORTEST_KEY, _LARGEST_KEY = 16, 2**16  # bytes
_SIGNATURE = "signature"


def hashes_of(plan: Plan, script: str) -> dict[str, str]:
    """Return SHA-256 of the plan's file, of the files that it names (`config`), of the script's own, of the package.

    What cannot be read any more is left out. The package's hash covers its files, Python, NumPy, PyBullet and the
    processor.
    """
    found = {"package": version()}
    for name, paths in (
        ("plan", lambda: [plan.path]),
        ("config", lambda: [one for one in files.of_plan(plan, {}) if one != plan.path]),
        ("script", lambda: files.of_script(plan, script)),
    ):
        try:
            found[name] = _digest(paths())
        except (OSError, ValueError, ScriptError):
            continue
    return found


def _digest(paths: Iterable[Path]) -> str:
    """Return one digest of files, by their names and contents, wherever they lie."""
    digest = hashlib.sha256()
    for name, path in sorted((os.fsencode(path.name), path) for path in paths):
        digest.update(name + b"\0" + hashlib.sha256(files.read(path)).digest())
    return digest.hexdigest()


def key_in(path: str) -> bytes:
    """Return what the file of a key holds. Raises Unreadable, and ValueError for a key that could be guessed."""
    key = files.read(Path(path), _LARGEST_KEY)
    if len(key) < _SHORTEST_KEY:
        raise ValueError(f"--key {shown(path)}: holds {len(key)} bytes; it must hold {_SHORTEST_KEY} at least")
    return key


def signed(content: Mapping[str, Any], key: bytes) -> dict[str, Any]:
    """Return what a file of results holds with a signature over all of it: HMAC-SHA256."""
    return {**content, _SIGNATURE: _signature(content, key)}


def is_signed(content: Mapping[str, Any], key: bytes) -> bool:
    """Tell whether the signature in a file of results matches its content, with the same key."""
    return hmac.compare_digest(str(content.get(_SIGNATURE, "")).encode(), _signature(content, key).encode())


def _signature(content: Mapping[str, Any], key: bytes) -> str:
    said = {name: one for name, one in content.items() if name != _SIGNATURE}
    text = json.dumps(said, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hmac.new(key, text.encode(), "sha256").hexdigest()
