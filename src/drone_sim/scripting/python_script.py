"""Load a Python child script and call its phases."""

from __future__ import annotations

import ast
import copy
import traceback
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, Dict, Mapping

from drone_sim.objects import near_names
from drone_sim.scripting.api_scripts import LOG
from drone_sim.scripting.calls import Api, mistake
from drone_sim.scripting.constants import PHASES
from drone_sim.scripting.errors import ScriptError, UnknownName
from drone_sim.scripting.messages import Callback
from drone_sim.scripting.time_limit import Stopped, TimeLimit

__all__ = ["PythonScript", "ScriptError"]

_STOPPED = "__stopped__"  # Stopped, among a script's globals
_FUNCTIONS = {phase: f"sysCall_{phase}" for phase in PHASES}


class PythonScript:
    """A file that defines sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup as it needs them.

    It finds `sim`, `simROS`, `require` and `self` (an empty object to keep variables in), as
    CoppeliaSim's Python scripts do. What it prints goes to the log.
    """

    def __init__(self, path: str, modules: Mapping[str, Api], limit: TimeLimit):
        """Run the file's top level; raises ScriptError."""
        self._path = path
        self._limit = limit
        self._modules = modules
        self._globals: Dict[str, Any] = {
            "__name__": Path(path).stem,
            "__file__": path,
            "self": SimpleNamespace(),
            "require": self._require,
            "print": _print,
            _STOPPED: Stopped,
            **modules,
        }
        try:
            tree = ast.parse(Path(path).read_bytes(), path)
            code = compile(_let_stopped_pass(tree), path, "exec")
        except (SyntaxError, ValueError, RecursionError) as error:
            raise self._error("load", error) from None
        self._run("load", exec, code, self._globals)

    def call(self, phase: str) -> None:
        """Call `sysCall_<phase>` if the script has it; raises ScriptError."""
        function = self._globals.get(_FUNCTIONS[phase])
        if function is not None:
            self._run(phase, function)

    def callback(self, callback: Callback, message: Any) -> None:
        """Call the script's function (or that of this name) with a message; raises ScriptError."""
        if callable(callback):
            self._run(getattr(callback, "__name__", "callback"), callback, message)
            return
        function = self._globals.get(callback)
        if not callable(function):
            raise ScriptError(str(callback), self._path, 0, f"the script has no function '{callback}' to call back")
        self._run(callback, function, message)

    def remember(self) -> Callable[[], None]:
        """Return a function that gives `self` and the global variables the values that they have now.

        Values that cannot be copied (open files, modules, API objects) stay as they are.
        """
        kept = _copied(self._globals)

        def recall() -> None:
            fresh = _copied(kept)
            for name in set(self._globals) - set(fresh) - {"__builtins__"}:
                del self._globals[name]
            self._globals.update(fresh)

        return recall

    def close(self) -> None:
        """Forget the script; it cannot be called after that."""
        self._globals.clear()

    def _run(self, phase: str, function: Any, *arguments: Any) -> None:
        try:
            self._limit.run(function, *arguments)
        except (Exception, Stopped, SystemExit) as error:
            # Not chained: nobody wants the simulator's own frames, nor keeps the script's alive.
            raise self._error(phase, error) from None

    def _require(self, name: str) -> Api:
        if name not in self._modules:
            raise UnknownName(f"no module '{name}'; {near_names(str(name), self._modules)}")
        return self._modules[name]

    def _error(self, phase: str, error: BaseException) -> ScriptError:
        if isinstance(error, SyntaxError) and error.filename == self._path:
            return ScriptError(phase, self._path, error.lineno or 0, f"SyntaxError: {error.msg}")
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == self._path]
        return ScriptError(phase, self._path, (lines or [0])[-1] or 0, self._message(error))

    def _message(self, error: BaseException) -> str:
        if isinstance(error, Stopped):
            return str(self._limit)
        if isinstance(error, UnknownName):
            return str(error)
        return mistake(error, self._modules.values()) or f"{type(error).__name__}: {error}"


def _copied(variables: Mapping[str, Any]) -> Dict[str, Any]:
    memo: Dict[int, Any] = {}  # one for all: what is shared stays shared
    return {name: _copy(value, memo) for name, value in variables.items() if name != "__builtins__"}


def _copy(value: Any, memo: Dict[int, Any]) -> Any:
    if isinstance(value, SimpleNamespace):  # attribute by attribute: one that cannot be copied spoils no other
        made = memo.setdefault(id(value), SimpleNamespace())
        made.__dict__.update({name: _copy(one, memo) for name, one in vars(value).items()})
        return made
    if isinstance(value, Api):
        return value
    try:
        return copy.deepcopy(value, memo)
    except Exception:  # whatever a class of the script's raises when it is copied
        return value


def _print(*values: Any, sep: str = " ", file: Any = None, **options: Any) -> None:
    if file is not None:
        print(*values, sep=sep, file=file, **options)
    else:
        LOG.info("%s", (sep if sep is not None else " ").join(map(str, values)))


def _let_stopped_pass(tree: ast.Module) -> ast.Module:
    """Let no handler of the script catch Stopped: `while True: try: ... except: pass` has to end, too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Try) and node.handlers:
            name = ast.Name(id=_STOPPED, ctx=ast.Load())
            handler = ast.ExceptHandler(type=name, name=None, body=[ast.Raise(exc=None, cause=None)])
            first = node.handlers[0]
            for part in ast.walk(handler):
                if isinstance(part, (ast.expr, ast.stmt, ast.excepthandler)):
                    ast.copy_location(part, first)
            node.handlers.insert(0, handler)
    return tree
