"""How a child script's files are read, and what goes wrong in it, in one line each."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drone_sim.files.resources import MEBIBYTE, read_bytes
from drone_sim.message_text import encodable

LONGEST_MESSAGE = 600  # characters


def read_source(path: str | Path) -> bytes:
    """Return what a script's file, or that of a helper, holds. Raises ValueError, without its name."""
    try:
        return read_bytes(path, MEBIBYTE)
    except OSError as error:
        raise ValueError(error.strerror or str(error)) from None


class ScriptError(Exception):
    """A child script failed: in which phase, file and line, and for what reason; one line where it is said."""

    def __init__(self, phase: str, path: str, line: int, reason: str):
        """It failed in a `phase`, at a `path` and `line` (0: not known), for a `reason`."""
        words = " ".join(reason[: 2 * LONGEST_MESSAGE].split())
        self.phase, self.path, self.line = phase, path, line
        self.reason = words if len(words) <= LONGEST_MESSAGE else words[:LONGEST_MESSAGE] + "…"
        super().__init__(phase, path, line, self.reason)

    def __str__(self) -> str:
        """Return the line."""
        place = f"{self.path}:{self.line}" if self.line else self.path
        return encodable(f"[{self.phase}] {place}: {self.reason}")


def no_function(callback: Any, known: Iterable[str]) -> str:
    """Return the message on a callback that a script does not have, with the near ones of the functions that it has."""
    near = difflib.get_close_matches(str(callback), list(known))
    return f"no function '{callback}' for this callback{'; near names are ' if near else ''}{', '.join(near)}"
