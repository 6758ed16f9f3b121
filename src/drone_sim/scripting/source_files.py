"""The files that a child script is made of: its own, and the helpers beside it."""

from __future__ import annotations

from pathlib import Path

from drone_sim.files.resources import read_bytes

_LARGEST = 1024 * 1024  # bytes


def read(path: str | Path) -> bytes:
    """Return what a file holds; raises OSError and, for one that is none or too large, ValueError."""
    return read_bytes(path, _LARGEST)
