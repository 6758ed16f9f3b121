"""Proxy of a script in another process: calls the script, and executes the API calls that it requests.

Nothing that the script's process sends is trusted: functions are looked up by name in the script's own modules, their
arguments are numbers, strings, bytes, lists and mappings of these, and size and time of everything are limited.
"""

from __future__ import annotations

import functools
import inspect
import itertools
import logging
from collections.abc import Callable, Mapping
from time import monotonic
from typing import Any, NoReturn

from drone_sim.scripting.api.calls import Api, Function, contents, mistake
from drone_sim.scripting.api.control import Wait
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.breakpoints import Scope
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.rpc import effects, values
from drone_sim.scripting.rpc.connection import Disconnected, ScriptConnection
from drone_sim.scripting.rpc.mirror import POSE, pose_of
from drone_sim.scripting.rpc.values import ALL_PLAIN, PLAIN, InvalidMessage, ScriptFunction, kind_of
from drone_sim.scripting.time_limit import TimeLimit

_LOG = logging.getLogger(__name__)
GRACE = 5.0  # s beyond the time limit, which the script's process should enforce itself
_MAX_WAITS = 1000
_MAX_TEXT = 1000  # characters of an error text, and of the name of a phase


class ConnectionClosed(ScriptError):
    """The script's process has ended or violated the protocol; its scripts are not called any more."""


class ScriptProxy(Script):
    def __init__(self, connection: ScriptConnection, path: str, modules: Mapping[str, Api], limit: TimeLimit):
        """Load the script file at `path` with the API `modules`, in the process of `connection`. Raises ScriptError."""
        self._connection, self._path = connection, path
        self._number = next(connection.numbers)  # identifies the script in its process
        self._modules, self._limit = modules, limit
        self._functions = {
            f"{name}.{key}": function for name, api in modules.items() for key, function in contents(api)[1].items()
        }
        self._changes = {name: function for name, function in self._functions.items() if name in effects.CHANGES}
        self._handed: dict[int, ScriptFunction] = {}
        self._watched = WatchedReads(connection, self._functions, self._value)
        self._waits = PendingWaits()
        self._failure: tuple[str, Exception] | None = None  # of a call whose reply the script did not wait for
        self._deadline = 0.0
        self._phase = ""  # the current one
        self.language = "python" if path.endswith(".py") else "lua"
        self._thread_is_alive = False
        result = self._do("load", [self._limit.seconds, self._connection.processor])
        if type(result) is not list or [type(field) for field in result] != [str, bool]:
            self._end("load", "its process sent an invalid message: malformed result of load")
        self.idle, self.is_empty = result[0][:_MAX_TEXT], result[1]

    # ---- interface of a script

    def _run_phase(self, phase: str) -> None:
        if not self._connection.why_closed or phase != "cleanup":
            self._do("call", [phase])

    def _has_thread(self) -> bool:
        return self._thread_is_alive

    def _resume_thread(self) -> None:
        self._do("take_turn", [])

    def _has_function(self, name: str) -> bool:
        """Return False: only scripts in this process are asked, because another process could lie."""
        return False

    def _run_function(self, name: str, arguments: list[Any]) -> Any:
        return self._do("call_function", [name, arguments])

    def call_own(self, name: Callback, arguments: list[Any]) -> Any:
        return self._do("call_own", [name, arguments])

    def _run_text(self, text: str) -> Any:
        return self._do("execute", [text])

    def execute_own(self, text: str) -> Any:
        return self._do("execute_own", [text])

    def _run_callback(self, callback: Callback, message: Any) -> None:
        self._do("callback", [callback, message])

    def _answer_request(self, callback: Callback, request: Any) -> Any:
        return self._do("answer", [callback, request])

    def _check_callback(self, callback: Callback) -> None:
        if not isinstance(callback, ScriptFunction):
            self._do("check", [callback])

    def follow_breakpoints(self) -> None:
        """Do nothing: nobody debugs a submission while it is graded."""

    def variables(self) -> list[Scope]:
        """Return none: nobody debugs a submission while it is graded."""
        return []

    def _save(self) -> Callable[[], None]:
        number = self._do("save", [])
        return lambda: self._do("restore", [number])

    def close(self) -> None:
        if not self._connection.why_closed:
            self._do("close", [])

    # ---- messages

    def _do(self, command: str, arguments: list[Any]) -> Any:
        """Send a command to the script, execute the calls that it requests, and return its result. Raises ScriptError.

        Commands are nested: a call may lead to a command to the same script.
        """
        is_named = arguments and command not in ("load", "take_turn", "execute", "execute_own")
        shown = str(arguments[0]) if is_named else command  # in error texts
        if self._connection.why_closed:
            raise ConnectionClosed(shown, self._path, 0, self._connection.why_closed)
        outer, limit = (self._phase, self._deadline, self._failure), self._limit.seconds
        self._phase, self._failure = effects.phase_of(command, arguments), None
        self._deadline = monotonic() + (limit + GRACE if limit else 1e9)
        try:
            encoded = [values.outgoing(argument) for argument in arguments]
            self._connection.send(("go", self._number, command, encoded, self._watched.snapshot(self._phase)))
            return self._until_end(shown)
        except TimeoutError:
            self._end(shown, f"did not return after {limit:g} s (script_time_limit)")
        except Disconnected:
            self._connection.is_gone = True
            self._end(shown, "its process has ended")
        except InvalidMessage as error:
            self._end(shown, f"its process sent an invalid message: {error}")
        finally:
            self._phase, self._deadline, self._failure = outer

    def _end(self, shown: str, why: str) -> NoReturn:
        self._connection.close(why)
        raise ConnectionClosed(shown, self._path, 0, why) from None

    def _until_end(self, shown: str) -> Any:
        """Handle the script's items until its result or error."""
        connection, items = self._connection, self._connection.items
        while True:
            item = items.popleft() if items else connection.next_item(self._deadline)
            kind = item[0]
            if kind == "set" and len(item) > 1:
                self._set(item)
            elif kind == "call":
                self._serve_call(item)
            elif kind == "reads":
                self._watched.watch(self._phase, item)
            elif kind == "end":
                return self._returned(shown, item)
            elif kind == "failed":
                if len(item) != 6 or [type(field) for field in item[2:]] != [str, str, int, str]:
                    raise InvalidMessage("malformed failure")
                _, threaded, name, path, line, reason = item
                self._thread_is_alive = threaded is True
                raise ScriptError(name[:_MAX_TEXT], path[:_MAX_TEXT], line, reason)
            else:
                raise InvalidMessage(f"unknown reply '{kind:.20}'")

    def _returned(self, shown: str, item: list[Any]) -> Any:
        if len(item) != 3:
            raise InvalidMessage("malformed end of a call")
        self._thread_is_alive = item[1] is True
        if self._failure is not None:
            raise ScriptError(shown, self._path, 0, self._explained(*self._failure))
        return None if item[2] is None else self._value(item[2])

    # ---- requests of the script

    def _set(self, item: list[Any]) -> None:
        """Execute a call without a return value, whose reply the script does not wait for."""
        name, arguments = item[1], item[2:]
        function = self._changes.get(name) if type(name) is str else None
        if function is None:
            raise InvalidMessage("function that needs a reply")
        if self._failure is not None:
            return
        if not ALL_PLAIN(map(type, arguments)):
            arguments = [value if type(value) in PLAIN else self._value(value) for value in arguments]
        try:
            on_result = self._connection.permit(name, arguments)
            function(*arguments)
            if on_result is not None:
                on_result(None)
        except Exception as error:
            self._failure = name, error

    def _serve_call(self, item: list[Any]) -> None:
        """Execute a call, and send its result or error with a new snapshot."""
        if len(item) < 3 or type(item[2]) is not list:
            raise InvalidMessage("malformed call")
        began = monotonic()
        try:
            if self._failure is not None:
                (item[1], failure), self._failure = self._failure, None
                raise failure
            result = self._called(item[1], item[3:], item[2])
            answer: tuple[Any, ...] = "is", values.outgoing(self._waits.kept(result))
        except (InvalidMessage, ConnectionClosed):
            raise
        except Exception as error:
            answer = "no", kind_of(error), _text(error), self._explained(item[1], error)
        snapshot = self._watched.snapshot(self._phase)
        self._deadline += monotonic() - began
        self._connection.send((*answer, snapshot))

    def _called(self, name: Any, arguments: list[Any], named: list[Any]) -> Any:
        """Return the result of a call; `named` are pairs of names and arguments."""
        if not all(type(pair) is list and len(pair) == 2 and type(pair[0]) is str for pair in named):
            raise InvalidMessage("malformed named arguments")
        function = self._functions.get(name) if type(name) is str else None
        positional = arguments if ALL_PLAIN(map(type, arguments)) else [self._value(value) for value in arguments]
        by_name = {key: self._value(value) for key, value in named}
        if name == "wait":
            return self._waits.step(*positional)
        if function is None:
            raise InvalidMessage("unknown function of the API")
        in_order = positional
        if by_name:  # arguments that do not fit are reported by the function itself
            others = [*inspect.signature(function).parameters][len(positional) :]
            in_order = [*positional, *(by_name.get(name) for name in others)]
        on_result = self._connection.permit(name, in_order)
        result = function(*positional, **by_name)
        if on_result is not None:
            on_result(result)
        return result

    def _value(self, value: Any) -> Any:
        return values.unmarked(value, self._script_function)

    def _script_function(self, number: int) -> ScriptFunction:
        if number not in self._handed:
            if len(self._handed) >= effects.MAX_FUNCTIONS:
                raise InvalidMessage("too many functions")
            self._handed[number] = ScriptFunction(number)
        return self._handed[number]

    def _explained(self, name: Any, error: Exception) -> str:
        text = mistake(error, self._modules.values())
        if text is None:
            text = f"{name if isinstance(error, ValueError) else type(error).__name__}: {_text(error)}"
        return text[: 2 * _MAX_TEXT]


def _text(error: Exception) -> str:
    text = error.args[0] if isinstance(error, KeyError) and error.args else error
    return str(text)[:_MAX_TEXT]


class WatchedReads:
    """The reads that a script's phases made in their last run; snapshots contain their results."""

    def __init__(self, connection: ScriptConnection, functions: Mapping[str, Function], value: Callable[[Any], Any]):
        """Begin without reads; `functions` are the script's API, `value` decodes an argument."""
        self._connection, self._functions, self._value = connection, functions, value
        self._reads: dict[str, list[tuple[Function, list[Any]]]] = {}  # by phase

    def watch(self, phase: str, item: list[Any]) -> None:
        """Store the reads that the script announces for a phase. Raises InvalidMessage."""
        if len(item) != 2 or type(item[1]) is not list:
            raise InvalidMessage("malformed list of reads")
        if len(item[1]) > effects.MAX_READS:
            raise InvalidMessage("too many reads")
        self._reads[phase] = [self._read(read) for read in item[1]]

    def _read(self, read: Any) -> tuple[Function, list[Any]]:
        if type(read) is not list or not read or type(read[0]) is not str:
            raise InvalidMessage("not a read")
        name, arguments = read[0], [self._value(value) for value in read[1:]]
        function = self._functions.get(name) if name in effects.READS else None
        if name == POSE and len(arguments) == 1 and type(arguments[0]) is int:
            name, function = effects.POSE_READS[-1], functools.partial(pose_of, self._connection.objects)
        if function is None:
            raise InvalidMessage("not a read")
        try:
            self._connection.permit(name, arguments)
        except ValueError:
            return _refused, arguments
        return function, arguments

    def snapshot(self, phase: str) -> list[Any]:
        """Return the present results of a phase's reads; Ellipsis for those that fail or are not permitted."""
        results = []
        for function, arguments in self._reads.get(phase, ()):
            try:
                results.append(values.outgoing(function(*arguments)))
            except Exception:  # raised again if the script makes the call
                _LOG.debug("a watched read failed:", exc_info=True)
                results.append(...)
        return results


def _refused(*_: Any) -> NoReturn:
    raise ValueError("the script may not read this")


class PendingWaits:
    """The waits of a script's coroutines; the script's process identifies each by a number."""

    def __init__(self) -> None:
        self._waits: dict[int, tuple[Any, Wait]] = {}
        self._numbers = itertools.count(1)

    def kept(self, value: Any) -> Any:
        """Return `value`, or for a Wait the number that it is stored under. Raises ValueError for too many waits."""
        if not isinstance(value, Wait):
            return value
        if len(self._waits) >= _MAX_WAITS:
            raise ValueError(f"at most {_MAX_WAITS} coroutines of a script may wait at once")
        number = next(self._numbers)
        self._waits[number] = iter(value), value
        return number

    def step(self, number: Any = None, answer: Any = None, *_: Any) -> Any:
        """Advance a wait: return ("wait",), ("call", function, arguments) or ("over", value).

        Raises ValueError for an unknown number, and any error of the wait.
        """
        if number not in self._waits:
            raise ValueError("there is no wait with this number")
        steps, wait = self._waits[number]
        try:
            call = steps.send(answer)
        except StopIteration:
            del self._waits[number]
            return "over", wait.value()
        except BaseException:
            self._waits.pop(number, None)
            raise
        return ("call", call.callback, call.arguments) if call else ("wait",)
