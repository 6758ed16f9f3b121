"""Load a Python child script and call its phases."""

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
from drone_sim.scripting.api.calls import Api, Function, UnknownName, contents, mistake, save_state
from drone_sim.scripting.api.control import Call, NoThread, Turns, waits
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError, no_function
from drone_sim.scripting.phase_names import FUNCTIONS, THREADS
from drone_sim.scripting.python.helpers import Helpers
from drone_sim.scripting.python.inspection import variables as variables_of
from drone_sim.scripting.python.process import Forks, end_copy, process_kept
from drone_sim.scripting.python.tracing import LineTracer
from drone_sim.scripting.script_log import THREAD_GOES_ON, say, shown
from drone_sim.scripting.time_limit import Labels, ScriptStopped, TimeLimit

if TYPE_CHECKING:
    from drone_sim.scripting.python.thread import PythonThread

_STOPPED = "__stopped__"  # ScriptStopped, among a script's globals
_NAMES_THREAD = b"sysCall_thread"
_RARE = frozenset(("init", "cleanup"))
_NOT_COPIED = ("__builtins__", "__loader__", "__spec__")


class Variables:
    """An empty object to keep variables in: a script's `self`. Python reads it faster than a SimpleNamespace."""

    @reprlib.recursive_repr()
    def __repr__(self) -> str:
        """Show what is in it."""
        return f"self({', '.join(f'{name}={value!r}' for name, value in vars(self).items())})"


class PythonScript(Script):
    """A file that defines sysCall_init, sysCall_actuation, sysCall_sensing, sysCall_cleanup as it needs them.

    It finds `sim`, `simROS`, `require` and `self` (an empty object to keep variables in), as
    CoppeliaSim's Python scripts do; so do the modules beside it that it imports. What it prints goes to the log.
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
    ):
        """Run the top level of a `source`. Raises ScriptError.

        `path` is its file, `modules` are the API, `limit` is how long it may run, `turns` are its thread's;
        `breakpoints` are those of all scripts.
        """
        self._path = path
        self._limit, self._labels = limit, Labels(path, limit)
        self.is_empty = not source.strip()
        self._modules = modules
        self._thread = self._new_thread(turns) if _NAMES_THREAD in source else None
        self._found = {name: _waiting(one, turns, self._called) for name, one in modules.items()}
        if self._thread:
            self._found = {name: self._thread.counted(one) for name, one in self._found.items()}
        found = {"self": Variables(), "require": self._require, "print": _print, _STOPPED: ScriptStopped, **self._found}
        self._helpers = Helpers(path, found, _compiled)
        self._globals: dict[str, Any] = {
            "__name__": self._helpers.package,
            "__file__": path,
            "__builtins__": self._helpers.builtins,
            **found,
        }
        self._breakpoints = breakpoints if breakpoints is not None else Breakpoints()
        self.follow_breakpoints()
        try:
            with process_kept():
                self._run("load", lambda: exec(_compiled(source, path), self._globals))
            self._check_names()
        except ScriptError:
            self.close()
            raise

    def _new_thread(self, turns: Turns) -> PythonThread:
        try:
            from drone_sim.scripting.python.thread import PythonThread  # whoever has no thread needs no greenlet
        except ImportError as error:
            said = f"threads of Python scripts need greenlet (pip install greenlet): {error}"
            raise ScriptError("load", self._path, 0, said) from None
        return PythonThread(turns)

    def _check_names(self) -> None:
        """Raise ScriptError for a function that was meant to be a phase, but would not be called as one."""
        functions = {name: one for name, one in self._named() if callable(one) and not name.startswith("__")}
        for name, meant in phase_names.misspelt(functions):
            raise self._error_at(functions[name], phase_names.never_called(name, meant))
        for name in (*FUNCTIONS.values(), *THREADS):
            one = functions.get(name)
            if inspect.isgeneratorfunction(one) or inspect.iscoroutinefunction(one) or inspect.isasyncgenfunction(one):
                raise self._error_at(one, f"{name} would not run, because it has a `yield` or is `async`")
        phase_names.warn(self._path, functions)
        self.idle = phase_names.idle(functions)

    def _named(self) -> list[tuple[str, Any]]:
        """Return its global variables; `globals()` takes any key."""
        return [(name, one) for name, one in self._globals.items() if isinstance(name, str)]

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

    def call_own(self, name: str, arguments: list[Any]) -> Any:
        self._check_callback(name)
        return self._globals[name](*arguments)

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

    def _called(self, call: Call) -> Any:
        """Return what one of its functions returns, in the midst of its thread."""
        self._check_callback(call.callback)
        function = call.callback if callable(call.callback) else self._globals[call.callback]
        return function(*call.arguments)

    def _check_callback(self, callback: Callback) -> None:
        if not callable(callback) and not callable(self._globals.get(callback)):
            known = [name for name, one in self._named() if inspect.isfunction(one)]
            raise ScriptError(str(callback), self._path, 0, no_function(callback, known))

    def follow_breakpoints(self) -> None:
        """Check every line while there are breakpoints: then another `_run` replaces the one that does not."""
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
        restoring = save_state(self._modules.values())
        restore_variables = self._run("snapshot", self._save_variables)

        def restore() -> None:
            if self._has_thread():
                script_log.say(THREAD_GOES_ON.format(self._path))
            self._run("restore", restore_variables)
            for one in restoring:
                one()

        return restore

    def _save_variables(self) -> Callable[[], None]:
        modules = self._helpers.modules()
        builtins = self._helpers.builtins  # where its modules find `self`, and it, too, if it has lost its own
        namespaces = (self._globals, *map(vars, modules.values()))
        own, *kept = _copied({"self": builtins["self"]}, *namespaces)
        as_they_are = [{name: one[name] for name in _NOT_COPIED if name in one} for one in namespaces]

        def restore() -> None:
            for name in set(self._helpers.modules()) - set(modules):
                self._helpers.forget(name)
            found, *copies = _copied(own, *kept)
            builtins.update(found)
            for variables, fresh, others in zip(namespaces, copies, as_they_are):
                for name in set(variables) - set(fresh) - set(_NOT_COPIED):
                    del variables[name]
                variables.update(fresh)
                variables.update(others)

        return restore

    def close(self) -> None:
        """Forget the script; it cannot be called after that."""
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
        except BaseException as error:  # KeyboardInterrupt, too: whose it is cannot be told
            failed = self._error(phase, error)
        if Forks.count != forks:
            end_copy(self._path)
        if script_log.Lines.count:  # seldom: asked here, a call less in every phase
            script_log.end_call()
        if failed is not None:  # not chained: nobody wants the simulator's own frames, nor keeps the script's alive
            raise failed
        return result

    _run_plainly = _run

    def _require(self, name: str) -> Api:
        if name in PLUGINS:
            raise UnknownName(not_there("", name, ()))
        if name not in self._found:
            raise UnknownName(f"there is no module '{name}'; {near_names(str(name), self._found)}")
        return self._found[name]

    def _error(self, phase: str, error: BaseException) -> ScriptError:
        if self._limit.struck:
            while isinstance(error.__context__, ScriptStopped):  # struck once more, in a handler
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
        """Return place and message of an exception; a class of the script's own may raise here, or never return."""
        if isinstance(error, SyntaxError) and error.filename in self._helpers.files:
            return (str(error.filename), error.lineno or 0), f"SyntaxError: {error.msg}"
        place = self._place(error)
        if isinstance(error, (UnknownName, NoThread)):
            return place, str(error)
        name = type(error).__name__
        text = self._helpers.shown(error) if isinstance(error, ImportError) else shown(error)
        return place, mistake(error, self._modules.values()) or (f"{name}: {text}" if text else name)

    def _place(self, error: BaseException) -> tuple[str, int]:
        """Return file and line, in the script or a module beside it, where an exception was raised."""
        frames = ((frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__))
        return ([(self._path, 0)] + [place for place in frames if place[0] in self._helpers.files])[-1]


@functools.lru_cache(maxsize=32)  # the same few scripts fly again and again, in forks of this process, too
def _compiled(source: bytes, path: str) -> CodeType:
    return compile(_let_stopped_pass(ast.parse(source, path)), path, "exec", dont_inherit=True)


def _compiled_text(text: str, mode: str) -> CodeType:
    tree = ast.parse(text, "(text)", mode)
    return compile(_let_stopped_pass(tree), "(text)", mode, dont_inherit=True)


def _copied(*namespaces: Mapping[str, Any]) -> list[dict[str, Any]]:
    memo: dict[int, Any] = {}  # one for all: what is shared stays shared
    return [
        {name: _copy(value, memo) for name, value in variables.items() if name not in _NOT_COPIED}
        for variables in namespaces
    ]


def _copy(value: Any, memo: dict[int, Any]) -> Any:
    if isinstance(value, Variables):  # attribute by attribute: one that cannot be copied spoils no other
        if id(value) in memo:  # it is among its own attributes
            return memo[id(value)]
        made = memo[id(value)] = Variables()
        made.__dict__.update({name: _copy(one, memo) for name, one in vars(value).items()})
        return made
    if isinstance(value, Api):
        return value
    try:
        return copy.deepcopy(value, memo)
    except Exception:  # whatever a class of the script's raises when it is copied
        return value


def _waiting(api: Api, turns: Turns, called: Callable[[Call], Any]) -> Api:
    """Return a module whose functions leave the script's thread as long as they have to wait.

    `called` calls what they ask of the script meanwhile.
    """
    name, functions, constants = contents(api)

    def waiting(function: Function, shown: str) -> Function:
        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            return turns.wait_for(function(*arguments, **named), shown, called)

        return call

    that_wait = {key: waiting(one, f"{name}.{key}") for key, one in functions.items() if waits(one)}
    return Api(name, {**functions, **that_wait}, constants) if that_wait else api


def _print(*values: Any, sep: str = " ", file: Any = None, **options: Any) -> None:
    if file is not None:
        print(*values, sep=sep, file=file, **options)
    else:
        say((sep if sep is not None else " ").join(map(shown, values)))


def _let_stopped_pass(tree: ast.AST) -> Any:
    """Let no handler of the script catch ScriptStopped: `while True: try: ... except: pass` has to end, too."""
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
