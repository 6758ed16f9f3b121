"""Load a Python child script and call its phases."""

from __future__ import annotations

import ast
import copy
import traceback
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, Dict, Mapping, Tuple

from drone_sim.objects import near_names
from drone_sim.scripting import script_log
from drone_sim.scripting.calls import Api, mistake
from drone_sim.scripting.constants import PHASES
from drone_sim.scripting.errors import ScriptError, UnknownName
from drone_sim.scripting.messages import Callback
from drone_sim.scripting.process import process_kept
from drone_sim.scripting.script_log import say, shown
from drone_sim.scripting.time_limit import Stopped, TimeLimit

__all__ = ["PythonScript", "ScriptError"]

_STOPPED = "__stopped__"  # Stopped, among a script's globals
_RARE = ("init", "cleanup")
_FUNCTIONS = {phase: f"sysCall_{phase}" for phase in PHASES}


class PythonScript:
    """A file that defines sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup as it needs them.

    It finds `sim`, `simROS`, `require` and `self` (an empty object to keep variables in), as
    CoppeliaSim's Python scripts do. What it prints goes to the log.
    """

    def __init__(self, path: str, source: bytes, modules: Mapping[str, Api], limit: TimeLimit):
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
        with process_kept():
            self._run("load", self._load, source)

    def _load(self, source: bytes) -> None:
        code = compile(_let_stopped_pass(ast.parse(source, self._path)), self._path, "exec")
        exec(code, self._globals)

    def call(self, phase: str) -> None:
        """Call `sysCall_<phase>` if the script has it; raises ScriptError."""
        function = self._globals.get(_FUNCTIONS[phase])
        if function is None:
            return
        if phase in _RARE:
            with process_kept():
                self._run(phase, function)
        else:
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
        failed = None
        try:
            self._limit.run(function, *arguments)
        except BaseException as error:  # KeyboardInterrupt, too: whose it is cannot be told
            failed = self._error(phase, error)
        script_log.end_call()
        if failed is not None:  # not chained: nobody wants the simulator's own frames, nor keeps the script's alive
            raise failed

    def _require(self, name: str) -> Api:
        if name not in self._modules:
            raise UnknownName(f"no module '{name}'; {near_names(str(name), self._modules)}")
        return self._modules[name]

    def _error(self, phase: str, error: BaseException) -> ScriptError:
        if self._limit.struck:
            return ScriptError(phase, self._path, self._line(error), str(self._limit))
        kind = "an exception"
        try:
            kind = type(error).__name__
            line, message = self._limit.run(self._told, error)
        except BaseException:
            line, message = 0, f"{kind}, which cannot be shown"
        return ScriptError(phase, self._path, line, message)

    def _told(self, error: BaseException) -> Tuple[int, str]:
        """Return line and message of an exception; whatever the script made of it may raise, or not return."""
        if isinstance(error, SyntaxError) and error.filename == self._path:
            return error.lineno or 0, f"SyntaxError: {error.msg}"
        line = self._line(error)
        if isinstance(error, UnknownName):
            return line, str(error)
        name, text = type(error).__name__, shown(error)
        return line, mistake(error, self._modules.values()) or (f"{name}: {text}" if text else name)

    def _line(self, error: BaseException) -> int:
        found = 0
        for frame, line in traceback.walk_tb(error.__traceback__):
            if frame.f_code.co_filename == self._path:
                found = line
        return found


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
        say((sep if sep is not None else " ").join(map(shown, values)))


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
