"""Interface of a loaded child script, which may be in Lua or Python, in this process or another one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from typing import Any

from drone_sim.scripting.api.calls import Api, save_state
from drone_sim.scripting.api.service_servers import Unanswered
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.breakpoints import Scope
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import log_failure


class Script(ABC):
    """A loaded child script. Its methods raise ScriptError.

    After `isolate`, the first error of a call by the simulation is logged instead, and the script is not called any
    more. Calls by other scripts always raise.
    """

    language: str  # lua or python
    idle = ""  # why none of its phases is ever called; '' if one is
    is_empty = False
    flat_names: Collection[str] = ()  # functions that it calls by their V-REP 3.x names
    failure: ScriptError | None = None  # the error after which an isolated script is not called any more
    _modules: Mapping[str, Api]
    _is_isolated = False
    _calls = 0  # that have not returned

    def isolate(self) -> None:
        """Let this script fail alone: from now on, its errors are logged, and the simulation continues."""
        self._is_isolated = True

    @property
    def threaded(self) -> bool:
        """Whether it has an unfinished thread."""
        return self.failure is None and self._has_thread()

    @property
    def is_busy(self) -> bool:
        """Whether it is being called, or has an unfinished thread."""
        return self._calls > 0 or self.threaded

    def call(self, phase: str) -> None:
        """Run a phase: init, actuation, sensing or cleanup."""
        if self._is_isolated:
            self._attempt(self._run_phase, phase)
        else:  # the usual case, twice in every step
            self._run_phase(phase)

    def take_turn(self) -> None:
        """Resume its thread until it yields."""
        self._attempt(self._resume_thread)

    def callback(self, callback: Callback, message: Any) -> None:
        """Call a function of the script with a message."""
        self._attempt(self._run_callback, callback, message)

    def answer(self, callback: Callback, request: Any) -> Any:
        """Call a function of the script with a request; return its value. Isolated, it raises Unanswered on failure."""
        if self.failure is None:
            try:
                return self._counted(self._answer_request, callback, request)
            except ScriptError as error:
                self._fail(error)
        raise Unanswered(f"the script has failed and is no longer called: {self.failure}")

    def check(self, callback: Callback) -> None:
        """Fail if the script does not have this callback function."""
        self._attempt(self._check_callback, callback)

    # ---- calls by other scripts, whose errors are those of the caller: they are raised in any case

    def defines(self, name: str) -> bool:
        """Return whether the script's own file defines a global function with this name; imported ones do not count."""
        self._refuse_if_failed(name)
        return self._has_function(name)

    def call_function(self, name: str, arguments: list[Any]) -> Any:
        """Call a global function; return None, a value or a tuple of several."""
        self._refuse_if_failed(name)
        return self._counted(self._run_function, name, arguments)

    def execute(self, text: str) -> Any:
        """Run `text` as code of the script; return None, a value or a tuple of several."""
        self._refuse_if_failed("executeScriptString")
        return self._counted(self._run_text, text)

    @abstractmethod
    def call_own(self, name: Callback, arguments: list[Any]) -> Any:
        """Like call_function, for a call by the script itself: counts towards its current time limit.

        The function may also be given as itself.
        """

    @abstractmethod
    def execute_own(self, text: str) -> Any:
        """Like execute, for a call by the script itself: counts towards its current time limit."""

    # ---- state

    @abstractmethod
    def follow_breakpoints(self) -> None:
        """Check the lines that have breakpoints now, or none."""

    @abstractmethod
    def variables(self) -> list[Scope]:
        """Return its variables in readable form; none if it cannot be called any more."""

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores the current values of the script's variables, and of its API modules."""
        failure, parts = self.failure, []
        if failure is None:
            parts = [self._save(), *save_state(self._modules.values())]

        def restore() -> None:
            self.failure = failure
            for restore_part in parts:
                restore_part()

        return restore

    @abstractmethod
    def close(self) -> None:
        """Free the script's resources; a second call does nothing."""

    # ---- errors

    def _attempt(self, action: Callable[..., None], *arguments: Any) -> None:
        if not self._is_isolated:
            action(*arguments)
        elif self.failure is None:
            try:
                self._counted(action, *arguments)
            except ScriptError as error:
                self._fail(error)

    def _counted(self, action: Callable[..., Any], *arguments: Any) -> Any:
        self._calls += 1
        try:
            return action(*arguments)
        finally:
            self._calls -= 1

    def _fail(self, error: ScriptError) -> None:
        if not self._is_isolated:
            raise error
        self.failure = error
        log_failure(error)

    def _refuse_if_failed(self, name: str) -> None:
        if self.failure is not None:
            raise ScriptError(name, self.failure.path, 0, "the script has failed and is no longer called")

    # ---- what each language does

    @abstractmethod
    def _has_thread(self) -> bool: ...

    @abstractmethod
    def _run_phase(self, phase: str) -> None: ...

    @abstractmethod
    def _resume_thread(self) -> None: ...

    @abstractmethod
    def _run_callback(self, callback: Callback, message: Any, /) -> None: ...

    @abstractmethod
    def _answer_request(self, callback: Callback, request: Any, /) -> Any: ...

    @abstractmethod
    def _check_callback(self, callback: Callback) -> None: ...

    @abstractmethod
    def _has_function(self, name: str) -> bool: ...

    @abstractmethod
    def _run_function(self, name: str, arguments: list[Any]) -> Any: ...

    @abstractmethod
    def _run_text(self, text: str) -> Any: ...

    @abstractmethod
    def _save(self) -> Callable[[], None]: ...
