"""Child scripts in Python."""

from __future__ import annotations

import ast
import contextlib
import copy
import functools
import inspect
import reprlib
import traceback
from collections.abc import Callable, Mapping
from types import CodeType
from typing import TYPE_CHECKING, Any

from drone_sim.message_text import near_names
from drone_sim.scripting import phase_names, script_log
from drone_sim.scripting.api.calls import Api, Function, UnknownName, contents, mistake
from drone_sim.scripting.api.control import Call, NoThread, Turns, waits
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError, no_function
from drone_sim.scripting.phase_names import FUNCTIONS, THREADS
from drone_sim.scripting.python.helpers import Helpers
from drone_sim.scripting.python.inspection import LineTracer
from drone_sim.scripting.python.inspection import variables as variables_of
from drone_sim.scripting.python.process import Forks, end_copy, process_kept
from drone_sim.scripting.script_log import THREAD_GOES_ON, say, shown
from drone_sim.scripting.time_limit import Labels, ScriptStopped, TimeLimit

if TYPE_CHECKING:
    from drone_sim.scripting.python.thread import PythonThread

_STOPPED = "__stopped__"  # name of ScriptStopped in a script's globals
_LAZY = (inspect.isgeneratorfunction, inspect.iscoroutinefunction, inspect.isasyncgenfunction)
_NAMES_THREAD = b"sysCall_thread"
_RARE = frozenset(FUNCTIONS).difference(("actuation", "sensing"))
_NOT_COPIED = ("__builtins__", "__loader__", "__spec__")


class Variables:
    """A script's `self`: an empty object to store variables in. Python reads it faster than a SimpleNamespace."""

    @reprlib.recursive_repr()
    def __repr__(self) -> str:
        return f"self({', '.join(f'{name}={value!r}' for name, value in vars(self).items())})"


class PythonScript(Script):
    """A Python file that may define sysCall_init, sysCall_actuation, sysCall_sensing and sysCall_cleanup.

    The script and its helper modules find `sim`, `simROS`, `require` and `self`, as in CoppeliaSim. Their prints go to
    the log.
    """

    language = "python"

    def __init__(
        self,
        path: str,
        source: bytes,
        modules: Mapping[str, Api],
        limit: TimeLimit,
        turns: Turns,
        breakpoints: Breakpoints | None = None,
        customizes: bool = False,
    ):
        """Run the top level of `source`, the contents of the file `path`. Raises ScriptError.

        `modules` are the API, `limit` is its time limit, `turns` switch its thread. `breakpoints` belong to all
        scripts. `customizes`: whether it is a customization script.
        """
        self._path = path
        self._limit, self._labels = limit, Labels(path, limit)
        self.is_empty = not source.strip()
        self._modules = modules
        self._thread = self._new_thread(turns) if _NAMES_THREAD in source else None
        self._api = {name: _waiting(api, turns, self._call_function) for name, api in modules.items()}
        if self._thread:
            self._api = {name: self._thread.counted(api) for name, api in self._api.items()}
        names = {"self": Variables(), "require": self._require, "print": _print, _STOPPED: ScriptStopped, **self._api}
        self._helpers = Helpers(path, names, _compiled)
        self._globals: dict[str, Any] = {
            "__name__": self._helpers.package,
            "__file__": path,
            "__builtins__": self._helpers.builtins,
            **names,
        }
        self._breakpoints = breakpoints if breakpoints is not None else Breakpoints()
        self.follow_breakpoints()
        try:
            with process_kept():
                self._run("load", lambda: exec(_compiled(source, path), self._globals))
            self._check_names(customizes)
        except ScriptError:
            self.close()
            raise

    def _new_thread(self, turns: Turns) -> PythonThread:
        try:
            # Imported here because only threads need greenlet.
            from drone_sim.scripting.python.thread import PythonThread
        except ImportError as error:
            message = f"threads of Python scripts need greenlet (pip install greenlet): {error}"
            raise ScriptError("load", self._path, 0, message) from None
        return PythonThread(turns)

    def _check_names(self, customizes: bool) -> None:
        """Raise ScriptError for a misspelt phase function, or one that is a generator or coroutine."""
        functions = {name: value for name, value in self._named() if callable(value) and not name.startswith("__")}
        for name, intended in phase_names.misspelt(functions):
            raise self._error_at(functions[name], phase_names.never_called(name, intended))
        for name in (*FUNCTIONS.values(), *THREADS):
            function = functions.get(name)
            if any(is_lazy(function) for is_lazy in _LAZY):
                raise self._error_at(function, f"{name} would not run, because it has a `yield` or is `async`")
        phase_names.warn(self._path, functions, customizes)
        self.idle = phase_names.idle(functions, customizes)

    def _named(self) -> list[tuple[str, Any]]:
        """Return its global variables, without keys that are no strings, which `globals()` accepts."""
        return [(name, value) for name, value in self._globals.items() if isinstance(name, str)]

    def _error_at(self, function: Any, message: str) -> ScriptError:
        code = getattr(function, "__code__", None)
        path, line = (code.co_filename, code.co_firstlineno) if inspect.iscode(code) else (self._path, 0)
        return ScriptError("load", path, line, message)

    def _run_phase(self, phase: str) -> None:
        function = self._globals.get(FUNCTIONS[phase])
        if function is None:
            return
        if phase in _RARE:
            with process_kept():
                self._run(phase, function)
        else:
            self._run(phase, function)

    def _has_thread(self) -> bool:
        return self._thread is not None and not self._thread.has_ended and self._thread_function() is not None

    def _thread_function(self) -> Any:
        return next((self._globals[name] for name in THREADS if name in self._globals), None)

    def _resume_thread(self) -> None:
        if self._thread is not None:
            self._run("thread", self._thread.take_turn, self._thread_function())

    def _has_function(self, name: str) -> bool:
        function = self._globals.get(name)
        return inspect.isfunction(function) and function.__code__.co_filename == self._path

    def _run_function(self, name: str, arguments: list[Any]) -> Any:
        self._check_callback(name)
        return self._run(name, self._globals[name], *arguments)

    def call_own(self, name: Callback, arguments: list[Any]) -> Any:
        return self._call_function(Call(name, arguments))

    def _run_text(self, text: str) -> Any:
        return self._run("executeScriptString", self.execute_own, text)

    def execute_own(self, text: str) -> Any:
        """Return the value of `text` if it is an expression; otherwise run it and return None."""
        try:
            code = _compiled_text(text, "eval")
        except SyntaxError:
            code = _compiled_text(text, "exec")
        return eval(code, self._globals)

    def _run_callback(self, callback: Callback, message: Any, /) -> Any:
        if callable(callback):
            return self._run(getattr(callback, "__name__", "callback"), callback, message)
        self._check_callback(callback)
        return self._run(callback, self._globals[callback], message)

    _answer_request = _run_callback

    def _call_function(self, call: Call) -> Any:
        """Call one of its functions while its thread runs; return the result."""
        self._check_callback(call.callback)
        function = call.callback if callable(call.callback) else self._globals[call.callback]
        return function(*call.arguments)

    def _check_callback(self, callback: Callback) -> None:
        if not callable(callback) and not callable(self._globals.get(callback)):
            known = [name for name, value in self._named() if inspect.isfunction(value)]
            raise ScriptError(str(callback), self._path, 0, no_function(callback, known))

    def follow_breakpoints(self) -> None:
        """Trace every line while there are breakpoints, by an instance attribute `_run` that replaces the method."""
        tracer = LineTracer(self._breakpoints) if self._breakpoints else None
        if self._thread is not None:
            self._thread.tracer = tracer
        if tracer is not None:
            self.__dict__["_run"] = functools.partial(tracer.call, self._run_plainly)
        else:
            self.__dict__.pop("_run", None)

    def variables(self) -> list[Scope]:
        return variables_of(self._globals)

    def _save(self) -> Callable[[], None]:
        """Return a function that restores `self`, and the global variables of the script and of the modules beside it.

        Values that cannot be copied (open files, modules, API objects) stay as they are.
        """
        restore_variables = self._run("snapshot", self._save_variables)

        def restore() -> None:
            if self._has_thread():
                script_log.say(THREAD_GOES_ON.format(self._path))
            self._run("restore", restore_variables)

        return restore

    def _save_variables(self) -> Callable[[], None]:
        modules = self._helpers.modules()
        # They contain the `self` of the helper modules, and of a script that has deleted its own.
        builtins = self._helpers.builtins
        namespaces = (self._globals, *map(vars, modules.values()))
        own, *kept = _copied({"self": builtins["self"]}, *namespaces)
        uncopied = [{name: variables[name] for name in _NOT_COPIED if name in variables} for variables in namespaces]

        def restore() -> None:
            for name in set(self._helpers.modules()) - set(modules):
                self._helpers.forget(name)
            restored, *copies = _copied(own, *kept)
            builtins.update(restored)
            for variables, values, others in zip(namespaces, copies, uncopied):
                for name in set(variables) - set(values) - set(_NOT_COPIED):
                    del variables[name]
                variables.update(values)
                variables.update(others)

        return restore

    def close(self) -> None:
        """End its thread and remove its modules; the script cannot be called afterwards."""
        if self._has_thread() and self._thread is not None:
            with contextlib.suppress(ScriptError):
                self._run("cleanup", self._thread.end)
        self.__dict__.pop("_run", None)
        self._globals.clear()
        self._helpers.close()

    def _run(self, phase: str, function: Any, *arguments: Any) -> Any:
        failed = result = None
        forks = Forks.count
        self._limit.label = self._labels[phase]
        try:
            result = self._limit.run(function, *arguments)
        except BaseException as error:  # also KeyboardInterrupt, because it may be the script's own
            failed = self._error(phase, error)
        if Forks.count != forks:
            end_copy(self._path)
        if script_log.Lines.count:  # rarely true; checked here to save a function call in every phase
            script_log.end_call()
        if failed is not None:  # raised here and not chained, so that it does not keep the script's frames alive
            raise failed
        return result

    _run_plainly = _run

    def _require(self, name: str) -> Api:
        if name in PLUGINS:
            raise UnknownName(not_there("", name, ()))
        if name not in self._api:
            raise UnknownName(f"there is no module '{name}'; {near_names(str(name), self._api)}")
        return self._api[name]

    def _error(self, phase: str, error: BaseException) -> ScriptError:
        if self._limit.struck:
            while isinstance(error.__context__, ScriptStopped):  # raised again, in a handler
                error = error.__context__
            return ScriptError(phase, *self._place(error), str(self._limit))
        kind = "an exception"
        try:
            kind = type(error).__name__
            (path, line), message = self._limit.run(self._format_error, error)
        except BaseException:
            path, line, message = self._path, 0, f"{kind}, which cannot be shown"
        return ScriptError(phase, path, line, message)

    def _format_error(self, error: BaseException) -> tuple[tuple[str, int], str]:
        """Return place and message of an exception. A method of the script's own exception class may raise or hang."""
        if isinstance(error, SyntaxError) and error.filename in self._helpers.files:
            return (str(error.filename), error.lineno or 0), f"SyntaxError: {error.msg}"
        place = self._place(error)
        if isinstance(error, (UnknownName, NoThread)):
            return place, str(error)
        name = type(error).__name__
        text = self._helpers.shown(error) if isinstance(error, ImportError) else shown(error)
        return place, mistake(error, self._modules.values()) or (f"{name}: {text}" if text else name)

    def _place(self, error: BaseException) -> tuple[str, int]:
        """Return file and line, in the script or a helper module, where an exception was raised."""
        frames = ((frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__))
        return ([(self._path, 0)] + [place for place in frames if place[0] in self._helpers.files])[-1]


@functools.lru_cache(maxsize=32)  # the same few scripts fly many times, also in forks of this process
def _compiled(source: bytes, path: str) -> CodeType:
    return compile(_reraise_stopped(ast.parse(source, path)), path, "exec", dont_inherit=True)


def _compiled_text(text: str, mode: str) -> CodeType:
    tree = ast.parse(text, "(text)", mode)
    return compile(_reraise_stopped(tree), "(text)", mode, dont_inherit=True)


def _copied(*namespaces: Mapping[str, Any]) -> list[dict[str, Any]]:
    memo: dict[int, Any] = {}  # shared, so that objects in several namespaces stay shared
    return [
        {name: _copy(value, memo) for name, value in variables.items() if name not in _NOT_COPIED}
        for variables in namespaces
    ]


def _copy(value: Any, memo: dict[int, Any]) -> Any:
    # Attribute by attribute, so that one that cannot be copied does not matter for the rest.
    if isinstance(value, Variables):
        if id(value) in memo:  # it is one of its own attributes
            return memo[id(value)]
        variables = memo[id(value)] = Variables()
        variables.__dict__.update({name: _copy(attribute, memo) for name, attribute in vars(value).items()})
        return variables
    if isinstance(value, Api):
        return value
    try:
        return copy.deepcopy(value, memo)
    except Exception:  # any exception that a class of the script raises when it is copied
        return value


def _waiting(api: Api, turns: Turns, called: Callable[[Call], Any]) -> Api:
    """Return a module whose functions switch from the script's thread to the simulation as long as they have to wait.

    `called` calls functions of the script for them.
    """
    name, functions, constants = contents(api)

    def waiting(function: Function, shown: str) -> Function:
        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            return turns.wait_for(function(*arguments, **named), shown, called)

        return call

    wrapped = {key: waiting(function, f"{name}.{key}") for key, function in functions.items() if waits(function)}
    return Api(name, {**functions, **wrapped}, constants) if wrapped else api


def _print(*values: Any, sep: str = " ", file: Any = None, **options: Any) -> None:
    if file is not None:
        print(*values, sep=sep, file=file, **options)
    else:
        say((sep if sep is not None else " ").join(map(shown, values)))


def _reraise_stopped(tree: ast.AST) -> Any:
    """Let every `try` re-raise ScriptStopped, so that also `while True: try: ... except: pass` ends."""
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
