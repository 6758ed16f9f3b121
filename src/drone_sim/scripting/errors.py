"""What goes wrong in a child script, in one line each."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

from drone_sim.wording import encodable

LONGEST_MESSAGE = 600  # characters


class ScriptError(Exception):
    """A child script failed: phase, file, line and message, in one line."""

    def __init__(self, phase: str, path: str, line: int, message: str):
        """Take where it failed (line 0: not known) and why."""
        place = f"{path}:{line}" if line else path
        words = " ".join(message[: 2 * LONGEST_MESSAGE].split())
        if len(words) > LONGEST_MESSAGE:
            words = words[:LONGEST_MESSAGE] + "…"
        super().__init__(encodable(f"[{phase}] {place}: {words}"))
        self.phase = phase
        self.path = path
        self.line = line


class UnknownName(AttributeError):
    """A script asked for a function or constant that the API does not have."""


def no_function(callback: Any, known: Iterable[str]) -> str:
    """Return the message on a callback that a script does not have, with the near ones of the functions that it has."""
    near = difflib.get_close_matches(str(callback), list(known))
    return f"the script has no function '{callback}' to call back{'; near names are ' if near else ''}{', '.join(near)}"
