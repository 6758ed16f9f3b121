"""Findings of a script check."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping
from typing import NamedTuple

LARGEST = 1 << 18  # bytes of a script
MOST = 100  # findings
_NEAR = 0.75  # least ratio of difflib

Known = Mapping[str, Collection[str]]  # names in each module of the API


class Finding(NamedTuple):
    """A mistake in a script: line and first column (from 1), column after the last one (0: end of line), a sentence."""

    line: int
    column: int
    end: int
    said: str  # the name in the cockpit's page
    severity: str = "error"  # or "warning"


def not_defined(name: str, known: Collection[str]) -> str:
    """Return the message for an undefined name."""
    near = difflib.get_close_matches(name, sorted(known), cutoff=_NEAR)
    return f"'{name}' is not defined{'; near names are ' if near else ''}{', '.join(near)}"
