"""Errors of child scripts, as one-line messages, and reading of their files."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drone_sim.files.resources import MEBIBYTE, read_bytes
from drone_sim.message_text import encodable

LONGEST_MESSAGE = 600  # characters


def read_source(path: str | Path) -> bytes:
    """Return the contents of the file of a script or helper. Raises ValueError; its message does not name the file."""
    try:
        return read_bytes(path, MEBIBYTE)
    except OSError as error:
        raise ValueError(error.strerror or str(error)) from None


class ScriptError(Exception):
    """Error of a child script: phase, file, line and reason, shown in one line."""

    def __init__(self, phase: str, path: str, line: int, reason: str):
        """Create it; `line` is 0 if unknown, and `reason` is shortened to LONGEST_MESSAGE."""
        words = " ".join(reason[: 2 * LONGEST_MESSAGE].split())
        self.phase, self.path, self.line = phase, path, line
        self.reason = words if len(words) <= LONGEST_MESSAGE else words[:LONGEST_MESSAGE] + "…"
        super().__init__(phase, path, line, self.reason)

    def __str__(self) -> str:
        place = f"{self.path}:{self.line}" if self.line else self.path
        return encodable(f"[{self.phase}] {place}: {self.reason}")


def no_function(callback: Any, known: Iterable[str]) -> str:
    """Return the message for a callback that a script does not have; it lists similar names among the `known` ones."""
    near = difflib.get_close_matches(str(callback), list(known))
    return f"no function '{callback}' for this callback{'; near names are ' if near else ''}{', '.join(near)}"
