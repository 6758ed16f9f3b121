"""What a check of a script's text finds."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping
from typing import NamedTuple

LARGEST = 1 << 18  # bytes of a text that is checked
MOST = 100  # findings
_NEAR = 0.75  # of difflib's ratio

Known = Mapping[str, Collection[str]]  # names of each module of the API


class Finding(NamedTuple):
    """What is wrong: line and columns (from 1; `end` is behind the last one, 0 the line's end), and one sentence."""

    line: int
    column: int
    end: int
    said: str
    severity: str = "error"  # or "warning"


def not_defined(name: str, there: Collection[str]) -> str:
    """Return what to say of a name that nobody gives a value."""
    near = difflib.get_close_matches(name, sorted(there), cutoff=_NEAR)
    return f"'{name}' is not defined{'; near names are ' if near else ''}{', '.join(near)}"
