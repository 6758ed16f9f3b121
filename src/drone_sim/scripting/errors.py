"""What goes wrong in a child script, in one line each."""

from __future__ import annotations

LONGEST_MESSAGE = 600  # characters


class ScriptError(Exception):
    """A child script failed: phase, file, line and message, in one line."""

    def __init__(self, phase: str, path: str, line: int, message: str):
        """Take where it failed (line 0: not known) and why."""
        place = f"{path}:{line}" if line else path
        words = " ".join(message[: 2 * LONGEST_MESSAGE].split())
        if len(words) > LONGEST_MESSAGE:
            words = words[:LONGEST_MESSAGE] + "…"
        super().__init__(f"[{phase}] {place}: {words}")
        self.phase = phase
        self.path = path
        self.line = line


class UnknownName(AttributeError):
    """A script asked for a function or constant that the API does not have."""
