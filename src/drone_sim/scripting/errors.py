"""What goes wrong in a child script, in one line each."""

from __future__ import annotations


class ScriptError(Exception):
    """A child script failed: phase, file, line and message, in one line."""

    def __init__(self, phase: str, path: str, line: int, message: str):
        """Take where it failed (line 0: not known) and why."""
        place = f"{path}:{line}" if line else path
        super().__init__(f"[{phase}] {place}: {' '.join(message.split())}")
        self.phase = phase
        self.path = path
        self.line = line


class UnknownName(AttributeError):
    """A script asked for a function or constant that the API does not have."""
