"""A script that may fail alone: after its first error it is not called any more, and what else flies goes on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drone_sim.scripting.api.service_servers import Unanswered
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.breakpoints import Scope
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import Script
from drone_sim.scripting.script_log import LOG


class GuardedScript:
    """Calls a script until that fails; the error is told once."""

    def __init__(self, script: Script):
        """Take the script, loaded."""
        self._script = script
        self.failure: ScriptError | None = None
        self.language, self.idle, self.is_empty = script.language, script.idle, script.is_empty
        self.flat_names = script.flat_names
        self._calls = 0  # that have not returned

    @property
    def threaded(self) -> bool:
        """Whether it has a thread that has not ended."""
        return self.failure is None and self._script.threaded

    @property
    def is_busy(self) -> bool:
        """Whether it is being called, or has a thread that has not ended."""
        return self._calls > 0 or self.threaded

    def call(self, phase: str) -> None:
        """Run a phase: init, actuation, sensing or cleanup."""
        self._attempt(self._script.call, phase)

    def take_turn(self) -> None:
        """Let its thread run until it is left."""
        self._attempt(self._script.take_turn)

    def defines(self, name: str) -> bool:
        """Return whether the script's own file defines a global function of this name. Raises ScriptError."""
        self._refuse_if_failed(name)
        return self._script.defines(name)

    def call_function(self, name: str, arguments: list[Any]) -> Any:
        """Call a global function for another script; an error counts as that script's. Raises ScriptError."""
        self._refuse_if_failed(name)
        return self._called(self._script.call_function, name, arguments)

    def call_own(self, name: str, arguments: list[Any]) -> Any:
        """Call a global function for the script itself. Raises ScriptError."""
        return self._script.call_own(name, arguments)

    def execute(self, text: str) -> Any:
        """Run a text in the script for another one; an error counts as that script's. Raises ScriptError."""
        self._refuse_if_failed("executeScriptString")
        return self._called(self._script.execute, text)

    def execute_own(self, text: str) -> Any:
        """Run a text for the script itself. Raises ScriptError."""
        return self._script.execute_own(text)

    def _refuse_if_failed(self, name: str) -> None:
        if self.failure is not None:
            raise ScriptError(name, self.failure.path, 0, "the script has failed and is no longer called")

    def callback(self, callback: Callback, message: Any) -> None:
        """Call a function of the script with a message."""
        self._attempt(self._script.callback, callback, message)

    def answer(self, callback: Callback, request: Any) -> Any:
        """Call a function of the script with a request; return what it returns. Raises Unanswered where it fails."""
        if self.failure is None:
            try:
                return self._called(self._script.answer, callback, request)
            except ScriptError as error:
                self._fail(error)
        raise Unanswered(f"the script has failed and is no longer called: {self.failure}")

    def check(self, callback: Callback) -> None:
        """Fail where the script has no such function to call back."""
        self._attempt(self._script.check, callback)

    def follow_breakpoints(self) -> None:
        """Look at the lines that have breakpoints by now, or at none."""
        self._script.follow_breakpoints()

    def variables(self) -> list[Scope]:
        """Return its variables; none of one that has failed in a way that leaves nothing to be read."""
        return self._script.variables()

    def save_state(self) -> Callable[[], None]:
        """Return a function that gives the script's variables the values that they have now."""
        failure, restore_script = self.failure, self._script.save_state() if self.failure is None else None

        def restore() -> None:
            self.failure = failure
            if restore_script is not None:
                restore_script()

        return restore

    def close(self) -> None:
        """Free what the script holds; may be called twice."""
        self._script.close()

    def _attempt(self, action: Callable[..., None], *arguments: Any) -> None:
        if self.failure is None:
            try:
                self._called(action, *arguments)
            except ScriptError as error:
                self._fail(error)

    def _called(self, action: Callable[..., Any], *arguments: Any) -> Any:
        self._calls += 1
        try:
            return action(*arguments)
        finally:
            self._calls -= 1

    def _fail(self, error: ScriptError) -> None:
        self.failure = error
        tell_failure(error)


def tell_failure(error: ScriptError) -> None:
    """Say what went wrong, and that the flight goes on."""
    LOG.error("%s; this script is no longer called", error)
