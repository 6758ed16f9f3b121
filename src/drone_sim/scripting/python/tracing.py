"""Breakpoints of Python scripts, by a trace function that Python calls for each line."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

from drone_sim.scripting.breakpoints import Breakpoints
from drone_sim.scripting.python.inspection import variables_at

_set_trace, _get_trace = sys.settrace, sys.gettrace  # before process.py replaces them


class LineTracer:
    """Detects reached breakpoints."""

    def __init__(self, breakpoints: Breakpoints):
        """`breakpoints` may change later."""
        self._breakpoints = breakpoints

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function, and trace it with all functions that it calls. Raises its exceptions."""
        before = _get_trace()
        _set_trace(self._on_call)
        try:
            return function(*arguments)
        finally:
            _set_trace(before)

    def resume(self) -> None:
        """Trace a thread that starts or resumes; to be called in its greenlet."""
        _set_trace(None)  # since 3.13, only frames that run when tracing is switched on are traced
        _set_trace(self._on_call)
        frame: FrameType | None = sys._getframe()
        while frame is not None:
            if self._breakpoints.lines(frame.f_code.co_filename):
                frame.f_trace = self._on_line
            frame = frame.f_back

    def _on_call(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        return self._on_line if self._breakpoints.lines(frame.f_code.co_filename) else None

    def _on_line(self, frame: FrameType, event: str, _argument: Any) -> Any:
        file = frame.f_code.co_filename
        if event == "line" and frame.f_lineno in self._breakpoints.lines(file):
            self._breakpoints.reach(file, frame.f_lineno, lambda: variables_at(frame))
        return self._on_line
