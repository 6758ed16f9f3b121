"""A script in another process: it is called, and what it asks for is carried out.

Nothing that comes from there is believed: a function is looked up by name among those of the script's own modules, its
arguments are numbers, texts, bytes, lists and mappings of them, and all of it has a size and a time that it may take.
"""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable, Collection, Mapping
from time import monotonic
from typing import TYPE_CHECKING, Any, NoReturn

from drone_sim.scripting.api.calls import Api, Function, contents, mistake, save_state
from drone_sim.scripting.api.types import Callback
from drone_sim.scripting.breakpoints import Scope
from drone_sim.scripting.door import effects, values
from drone_sim.scripting.door.channel import Disconnected
from drone_sim.scripting.door.expected_reads import ExpectedReads
from drone_sim.scripting.door.functions import ScriptFunction, kind_of
from drone_sim.scripting.door.kept_waits import KeptWaits
from drone_sim.scripting.door.places import Place
from drone_sim.scripting.door.values import NoMessage
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

if TYPE_CHECKING:
    from drone_sim.scripting.door.simulation_end import SimulationEnd

GRACE = 5.0  # s beyond the time limit, which the script's process keeps by itself
_MOST_FUNCTIONS = 100_000
_PLAIN = frozenset((float, int, bool, str, type(None)))
_ALL_PLAIN = _PLAIN.issuperset
_LONGEST = 1000  # characters of a text that says what went wrong


class DoorClosed(ScriptError):
    """The script's process is gone, or does not keep to what is agreed: nothing of it is called any more."""


class ScriptThere:
    """A script in another process, as the simulation calls any (scripting.load.Script)."""

    def __init__(self, door: SimulationEnd, number: int, path: str, modules: Mapping[str, Api], limit: TimeLimit):
        """Take the door, the script's number there, its file, and its modules here; `load` comes first."""
        self._door, self._number, self._path = door, number, path
        self._modules, self._limit = modules, limit
        self._functions = {
            f"{name}.{key}": one for name, api in modules.items() for key, one in contents(api)[1].items()
        }
        self._changes = {name: one for name, one in self._functions.items() if name in effects.CHANGES}
        self._handed: dict[int, ScriptFunction] = {}
        self._expected = ExpectedReads(door, self._functions, self._value)
        self._waits = KeptWaits()
        self._failure: tuple[str, Exception] | None = None  # of a call whose answer the script did not wait for
        self._deadline = 0.0
        self._phase = ""  # that runs
        self._has_gone_on = False  # after a sensing, with the next actuation
        self.language = "python" if path.endswith(".py") else "lua"
        self.idle, self.is_empty, self.threaded = "", False, False
        self.flat_names: Collection[str] = ()

    def load(self) -> None:
        """Load it. Raises ScriptError."""
        found = self._do("load", [self._limit.seconds, self._door.processor])
        self.idle, self.is_empty = str(found[0])[:_LONGEST], bool(found[1])

    # ---- as any script

    def call(self, phase: str) -> None:
        """Run a phase: init, actuation, sensing or cleanup. Raises ScriptError."""
        if self._has_gone_on and phase == "actuation":
            self._finish()
        elif not self._door.why_closed or phase != "cleanup":
            self._do("call", [phase], phase == "sensing" and self._door.is_quiet())

    def take_turn(self) -> None:
        """Let its thread run until it is left; raises ScriptError."""
        self._do("take_turn", [])

    def defines(self, name: str) -> bool:
        """Return False: only scripts in this process are asked, because the other process could lie."""
        return False

    def call_function(self, name: str, arguments: list[Any]) -> Any:
        """Call a global function with values; return None, a value or a tuple of several. Raises ScriptError."""
        return self._do("call_function", [name, arguments])

    def call_own(self, name: str, arguments: list[Any]) -> Any:
        """Do the same when the script calls itself: the time counts for its present call. Raises ScriptError."""
        return self._do("call_own", [name, arguments])

    def execute(self, text: str) -> Any:
        """Run a text in the script; return None, a value or a tuple of several. Raises ScriptError."""
        return self._do("execute", [text])

    def execute_own(self, text: str) -> Any:
        """Do the same when the script calls itself: the time counts for its present call. Raises ScriptError."""
        return self._do("execute_own", [text])

    def callback(self, callback: Callback, message: Any) -> None:
        """Call a function of the script with a message. Raises ScriptError."""
        self._do("callback", [callback, message])

    def answer(self, callback: Callback, request: Any) -> Any:
        """Call a function of the script with a request; return what it returns. Raises ScriptError."""
        return self._do("answer", [callback, request])

    def check(self, callback: Callback) -> None:
        """Raise ScriptError where the script has no such function to call back."""
        if not isinstance(callback, ScriptFunction):
            self._do("check", [callback])

    def follow_breakpoints(self) -> None:
        """Look at no line: nobody watches a submission while it is graded."""

    def variables(self) -> list[Scope]:
        """Return none, for the same reason."""
        return []

    def save_state(self) -> Callable[[], None]:
        """Return a function that gives the script's variables the values that they have now."""
        number, restoring = self._do("save", []), save_state(self._modules.values())

        def restore() -> None:
            self._do("restore", [number])
            for one in restoring:
                one()

        return restore

    def close(self) -> None:
        """Free what the script holds; may be called twice."""
        if not self._door.why_closed:
            self._do("close", [])

    # ---- through the door

    def _finish(self) -> None:
        """Carry out what it has asked for in an actuation that it has run already."""
        self._has_gone_on = False
        self._phase = "call actuation"
        self._guarded("actuation")

    def _do(self, what: str, arguments: list[Any], may_go_on: bool = False) -> Any:
        """Let the script do something; carry out what it asks for meanwhile; return what it returned.

        `may_go_on`: whether it may run the actuation of the next step right after this sensing.
        """
        if self._has_gone_on:  # the flight ends without that step
            with contextlib.suppress(ScriptError):
                self._finish()
        is_text = what.startswith("execute")
        named = arguments[0] if arguments and isinstance(arguments[0], str) and not is_text else ""
        phase = f"{what} {named}"
        said = str(arguments[0]) if what not in ("load", "take_turn") and arguments and not is_text else what
        if self._door.why_closed:
            raise DoorClosed(said, self._path, 0, self._door.why_closed)
        given = [values.outgoing(one) for one in arguments]
        message = "go", self._number, what, given, self._reads(phase, 0), may_go_on
        return self._guarded(said, message)

    def _guarded(self, said: str, message: tuple[Any, ...] | None = None) -> Any:
        """Send a message, and carry out what comes until the script has returned; `said` is the phase in an error."""
        limit = self._limit.seconds
        outer, self._deadline = self._deadline, monotonic() + (limit + GRACE if limit else 1e9)
        try:
            if message is not None:
                self._door.send(message)
            return self._until_end(said)
        except TimeoutError:
            self._end(said, f"did not return after {self._limit.seconds:g} s (script_time_limit)")
        except Disconnected:
            self._door.is_gone = True
            self._end(said, "its process has ended")
        except NoMessage as error:
            self._end(said, f"its process sent an invalid message: {error}")
        finally:
            self._deadline = outer

    def _end(self, phase: str, why: str) -> NoReturn:
        self._door.close(why)
        raise DoorClosed(phase, self._path, 0, why) from None

    def _until_end(self, phase: str) -> Any:
        """Carry out what comes until the script has returned."""
        self._failure, outer = None, self._failure
        door, came = self._door, self._door.items
        try:
            while True:
                item = came.popleft() if came else door.next_item(self._deadline)
                how = item[0]
                if how == "set" and len(item) > 1:
                    self._set(item)
                elif how == "call":
                    self._answer(item)
                elif how == "reads":
                    self._expected.note(item)
                elif how == "end":
                    return self._returned(phase, item)
                elif how == "failed":
                    self._failed(item)
                else:
                    raise NoMessage(f"unknown reply '{how:.20}'")
        finally:
            self._failure = outer

    def _returned(self, phase: str, item: list[Any]) -> Any:
        if not 3 <= len(item) <= 4:
            raise NoMessage("malformed end of a call")
        self._has_gone_on = len(item) == 4
        self.threaded = item[1] is True
        if self._failure is not None:
            raise ScriptError(phase, self._path, 0, self._explained(*self._failure))
        return None if item[2] is None else self._value(item[2])

    def _failed(self, item: list[Any]) -> NoReturn:
        if len(item) != 6 or [type(one) for one in item[2:]] != [str, str, int, str]:
            raise NoMessage("malformed failure")
        _, threaded, phase, path, line, reason = item
        self.threaded = threaded is True
        raise ScriptError(phase[:_LONGEST], path[:_LONGEST], line, reason)

    # ---- what it asks for

    def _set(self, item: list[Any]) -> None:
        """Carry out a call that returns nothing, and for which the script does not wait."""
        name, arguments = item[1], item[2:]
        function = self._changes.get(name) if type(name) is str else None
        if function is None:
            raise NoMessage("unexpected call that waits")
        if self._failure is not None:
            return
        if not _ALL_PLAIN(map(type, arguments)):
            arguments = [one if type(one) in _PLAIN else self._value(one) for one in arguments]
        try:
            done = self._door.permit(name, arguments)
            function(*arguments)
            if done is not None:
                done(None)
        except Exception as error:
            self._failure = name, error

    def _answer(self, item: list[Any]) -> None:
        """Carry out a call, and answer it, with what is expected to be read next."""
        if len(item) < 4 or type(item[2]) is not int or type(item[3]) is not list:
            raise NoMessage("malformed call")
        began = monotonic()
        phase = self._phase
        try:
            if self._failure is not None:
                (item[1], failure), self._failure = self._failure, None
                raise failure
            found = self._called(item[1], item[4:], _named(item[3]))
            answer: tuple[Any, ...] = "is", values.outgoing(self._waits.kept(found)), self._reads(phase, item[2])
        except (NoMessage, DoorClosed):
            raise
        except Exception as error:
            answer = "no", kind_of(error), _text(error), self._explained(item[1], error)
        self._phase = phase
        self._deadline += monotonic() - began
        self._door.send(answer)

    def _called(self, name: Any, arguments: list[Any], named: Mapping[str, Any]) -> Any:
        function = self._functions.get(name) if type(name) is str else None
        given = arguments if _ALL_PLAIN(map(type, arguments)) else [self._value(one) for one in arguments]
        by_name = {key: self._value(one) for key, one in named.items()} if named else named
        if name == "wait":
            return self._waits.step(*given)
        if function is None:
            raise NoMessage("unknown function of the API")
        done = self._door.permit(name, _in_order(function, given, by_name))
        found = function(*given, **by_name)
        if done is not None:
            done(found)
        return found

    def _value(self, value: Any) -> Any:
        return values.unmarked(value, self._function_there)

    def _function_there(self, number: int) -> ScriptFunction:
        if number not in self._handed:
            if len(self._handed) >= _MOST_FUNCTIONS:
                raise NoMessage("too many functions")
            self._handed[number] = ScriptFunction(number)
        return self._handed[number]

    def _explained(self, name: Any, error: Exception) -> str:
        said = mistake(error, self._modules.values())
        if said is None:
            said = f"{name if isinstance(error, ValueError) else type(error).__name__}: {_text(error)}"
        return said[: 2 * _LONGEST]

    def _reads(self, phase: str, stretch: int) -> tuple[list[Any], list[Place]]:
        """Return what is expected to be read in a stretch of the phase, which runs from now on."""
        self._phase = phase
        return self._expected.answers(phase, stretch)


def _named(pairs: list[Any]) -> dict[str, Any]:
    """Return arguments by name. Raises NoMessage."""
    if not all(type(one) is list and len(one) == 2 and type(one[0]) is str for one in pairs):
        raise NoMessage("malformed named arguments")
    return dict(pairs)


def _in_order(function: Function, given: list[Any], by_name: Mapping[str, Any]) -> list[Any]:
    """Return the arguments of a call in their order; those that do not fit are left to the function to complain of."""
    if not by_name:
        return given
    names = [*inspect.signature(function).parameters]
    return [*given, *(by_name.get(name) for name in names[len(given) :])]


def _text(error: Exception) -> str:
    said = error.args[0] if isinstance(error, KeyError) and error.args else error
    return str(said)[:_LONGEST]
