"""Evidence for results: hashes of everything that they depend on, and a signature."""

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

_MIN_KEY, _MAX_KEY = 16, 2**16  # bytes
_SIGNATURE = "signature"


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


def sign(content: Mapping[str, Any], key: bytes) -> dict[str, Any]:
    """Return the content of a results file with an HMAC-SHA256 signature over all of it."""
    return {**content, _SIGNATURE: _signature(content, key)}


def is_signed(content: Mapping[str, Any], key: bytes) -> bool:
    """Return whether the content of a results file has the right signature for a key."""
    return hmac.compare_digest(str(content.get(_SIGNATURE, "")).encode(), _signature(content, key).encode())


def _signature(content: Mapping[str, Any], key: bytes) -> str:
    unsigned = {name: value for name, value in content.items() if name != _SIGNATURE}
    text = json.dumps(unsigned, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hmac.new(key, text.encode(), "sha256").hexdigest()
