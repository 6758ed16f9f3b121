"""Load a Python child script and call its phases."""

from __future__ import annotations

import traceback
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Dict

PHASES = ("init", "actuation", "sensing", "cleanup")


class ScriptError(Exception):
    """A child script failed: phase, file, line and message, in one line."""

    def __init__(self, phase: str, path: str, line: int, message: str):
        """Take where it failed and why."""
        super().__init__(f"[{phase}] {path}:{line}: {' '.join(message.split())}")
        self.phase = phase


class PythonScript:
    """A file that defines sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup as it needs them.

    It finds `sim`, `simROS`, `require` and `self` (an empty object to keep variables in), as
    CoppeliaSim's Python scripts do.
    """

    def __init__(self, path: str, modules: Dict[str, Any]):
        """Run the file's top level; raises ScriptError."""
        self._path = path
        self._globals: Dict[str, Any] = {
            "__name__": Path(path).stem,
            "__file__": path,
            "self": SimpleNamespace(),
            "require": modules.__getitem__,
            **modules,
        }
        try:
            source = Path(path).read_text(encoding="utf-8")
            exec(compile(source, path, "exec"), self._globals)
        except Exception as error:
            raise self._error("load", error) from error

    def call(self, phase: str) -> None:
        """Call `sysCall_<phase>` if the script has it; raises ScriptError."""
        function = self._globals.get(f"sysCall_{phase}")
        if function is None:
            return
        try:
            function()
        except Exception as error:
            raise self._error(phase, error) from error

    def callback(self, name: str, message: Any) -> None:
        """Call the script's function of that name with a message; raises ScriptError."""
        try:
            self._globals[name](message)
        except Exception as error:
            raise self._error(name, error) from error

    def _error(self, phase: str, error: Exception) -> ScriptError:
        if isinstance(error, SyntaxError):
            return ScriptError(phase, self._path, error.lineno or 0, f"SyntaxError: {error.msg}")
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == self._path]
        return ScriptError(phase, self._path, (lines or [0])[-1] or 0, f"{type(error).__name__}: {error}")
