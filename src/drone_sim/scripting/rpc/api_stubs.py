"""Stubs of the API in the script's process, which forward calls to the simulation's process.

Most calls of a controller need no message of their own: the results of its usual reads arrive with the start of the
phase, and are valid until the script changes something of that kind. Writes are sent with the end of the phase, once a
call of the same form has succeeded. A segment is the part of a phase between two requests to the simulation; the
expected reads of each segment are remembered.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from math import isfinite
from typing import Any, NamedTuple, Protocol

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import Api, Function, contents
from drone_sim.scripting.api.constants import bare
from drone_sim.scripting.api.control import Action, Call, Steps, Turns, Wait, waits
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.api.scripts import ScriptFunctions
from drone_sim.scripting.api.threads import Threads
from drone_sim.scripting.rpc import effects
from drone_sim.scripting.rpc.places import Place, Places
from drone_sim.scripting.rpc.values import ALL_PLAIN, PLAIN

_MAX_SEGMENTS = 50  # of a phase; more are not remembered
_MAX_FORMS = 10_000  # remembered forms of successful calls
_UNKNOWN = object()
_ALL_NUMBERS = frozenset((float, int)).issuperset
Read = tuple[str, tuple[Any, ...]]  # a function's name and its arguments
Answers = tuple[list[Any], list[Place]]  # results of expected reads (Ellipsis: none), and poses of objects
NO_ANSWERS: Answers = ([], [])


class SimulationLink(Protocol):
    """Connection to the simulation. A Protocol because the implementation, script_process, imports this module."""

    def request(self, item: list[Any]) -> tuple[Any, Answers]: ...
    def queue(self, item: list[Any]) -> None: ...
    def marked(self, value: Any) -> Any: ...


class Expected(NamedTuple):
    """The expected reads of a segment."""

    reads: tuple[Read, ...] = ()
    handles: tuple[int, ...] = ()  # of objects whose poses it reads


_NOTHING = Expected()


class Segment:
    """A segment of a phase: before its first request, or between two requests."""

    __slots__ = ("changed", "handles", "known", "number", "phase", "reads")

    def __init__(self, phase: str, number: int, known: dict[Read, Any]):
        """Start segment `number` (from 0) of a phase; `known` contains the results of its expected reads."""
        self.phase, self.number, self.known = phase, number, known
        self.reads: dict[Read, None] = {}
        self.handles: dict[int, None] = {}
        self.changed: set[str] = set()  # kinds of data that may differ from those at its beginning

    def forget(self, kind: str) -> None:
        if kind not in self.changed:
            self.changed.add(kind)
            self.known = {read: value for read, value in self.known.items() if effects.READS[read[0]] != kind}


class ApiStubs:
    def __init__(self, link: SimulationLink, call_outside: Callable[[Callable[[], Any]], Any], turns: Turns):
        """`link` leads to the simulation; `call_outside` calls a blocking function outside the script's time limit.

        `turns` switch the script's thread.
        """
        self._link, self._call_outside = link, call_outside
        self._segments: list[Segment] = []  # of the running phases, each nested in the previous one
        self._expected: dict[tuple[str, int], Expected] = {}
        self._succeeded: set[Any] = set()
        self._places = Places()
        self._threads = Threads.__new__(Threads)
        self._threads._services = SceneServices(turns=turns)
        self.modules = {
            name: Api(
                name, {key: self._local(func) or self._stub(name, func) for key, func in functions.items()}, constants
            )
            for name, functions, constants in declared()
        }

    # ---- phases

    def begin(self, phase: str, answers: Answers, number: int = 0) -> None:
        """Start segment `number` of a phase with the results of its expected reads."""
        values, places = answers
        reads = self._expected.get((phase, number), _NOTHING).reads
        known = {read: value for read, value in zip(reads, values) if value is not Ellipsis}
        self._segments.append(Segment(phase, number, known))
        self._places.take(places)

    def end(self) -> None:
        """End the phase, and announce its reads if they are not the expected ones."""
        segment = self._segments.pop()
        key = segment.phase, segment.number
        expected = self._expected.get(key, _NOTHING)
        if expected.reads == (*segment.reads,) and expected.handles == (*segment.handles,):
            return
        if segment.number < _MAX_SEGMENTS and (key in self._expected or len(self._expected) < effects.MAX_READS):
            self._expected[key] = Expected(tuple(segment.reads), tuple(segment.handles))
            reads = [[name, *self._link.marked(list(arguments))] for name, arguments in segment.reads]
            self._link.queue(["reads", segment.phase, segment.number, reads, list(segment.handles)])

    # ---- calls

    def _local(self, function: Function) -> Function | None:
        """Return the function that is called in this process; None for one that is called in the simulation's."""
        kind, name = type(getattr(function, "__self__", None)), function.__name__
        if kind is Threads and name in effects.OWN_THREADS:
            own: Function = getattr(self._threads, name)
            return own
        is_local = kind in effects.OWN_CLASSES or (kind is ScriptFunctions and name in effects.OWN_LOG)
        return function if is_local else None

    def _stub(self, module: str, function: Function) -> Function:
        name = f"{module}.{function.__name__}"
        if waits(function):
            stub = self._waiting_stub(name)
        elif module == "sim" and function.__name__ in effects.PLACED:
            stub = self._pose_reading_stub(name, self._places.function(function.__name__))
        elif module == "sim" and function.__name__ in effects.PUT:
            stub = self._pose_changing_stub(name, self._places.function(function.__name__))
        elif name in effects.READS:
            stub = self._reading_stub(name, effects.READS[name])
        elif name in effects.CHANGES:
            stub = self._changing_stub(name, effects.CHANGES[name])
        else:
            stub = self._forwarding_stub(name)
        stub.__name__, stub.__qualname__, stub.__doc__ = function.__name__, function.__qualname__, function.__doc__
        stub.__annotations__ = function.__annotations__
        stub.__signature__ = _signature(function)  # type: ignore[attr-defined]
        return stub

    def _forwarding_stub(self, name: str) -> Function:
        def call(*arguments: Any, **named: Any) -> Any:
            return self._request(name, arguments, named)

        return call

    def _reading_stub(self, name: str, kind: str) -> Function:
        segments = self._segments

        def read(*arguments: Any, **named: Any) -> Any:
            segment, key = segments[-1], (name, arguments)
            if named or kind in segment.changed:
                return self._request(name, arguments, named)
            try:
                result = segment.known.get(key, _UNKNOWN)
            except TypeError:  # unhashable arguments, such as a list
                return self._request(name, arguments, named)
            if len(segment.reads) < effects.MAX_READS:
                segment.reads[key] = None
            if result is _UNKNOWN:
                result = segment.known[key] = self._send(name, arguments, named, -1)[0]
            return _copied(result)

        return read

    def _pose_reading_stub(self, name: str, function: Function) -> Function:
        segments, places = self._segments, self._places

        def read(*arguments: Any, **named: Any) -> Any:
            segment = segments[-1]
            if named or effects.PLACES in segment.changed or not 1 <= len(arguments) <= 2:
                return self._request(name, arguments, named)
            handle, frame = arguments if len(arguments) == 2 else (*arguments, WORLD)
            if type(handle) is not int or type(frame) is not int:
                return self._request(name, arguments, named)
            _announce(segment, handle)
            if frame != WORLD:
                _announce(segment, frame)
            if places.knows(handle, frame):
                return function(handle, frame)
            return self._send(name, arguments, named, -1)[0]

        return read

    def _pose_changing_stub(self, name: str, function: Function) -> Function:
        change = self._changing_stub(name, (effects.PLACES, effects.MOTION))
        segments, places, succeeded, link = self._segments, self._places, self._succeeded, self._link

        def put(*arguments: Any, **named: Any) -> Any:
            segment = segments[-1]
            if named or effects.PLACES in segment.changed or not arguments or type(arguments[0]) is not int:
                return change(*arguments, **named)
            handle = arguments[0]
            _announce(segment, handle)
            if not places.is_mark(handle) or _form(name, arguments) not in succeeded:
                return change(*arguments, **named)
            try:
                function(*arguments)
            except Exception:  # the simulation's error text is better
                return change(*arguments, **named)
            link.queue(["set", name, *arguments])
            places.forget_below(handle)
            for key in [read for read in segment.known if effects.READS[read[0]] == effects.MOTION]:
                if not places.is_apart(bare(key[1][0]), handle):
                    del segment.known[key]
            return None

        return put

    def _changing_stub(self, name: str, kinds: tuple[str, ...]) -> Function:
        segments, succeeded, link = self._segments, self._succeeded, self._link

        def change(*arguments: Any, **named: Any) -> Any:
            segment = segments[-1]
            for kind in kinds:
                segment.forget(kind)
            form = None if named else _form(name, arguments)
            if form in succeeded and form is not None:
                link.queue(["set", name, *arguments])
                return None
            result, _ = self._send(name, arguments, named, -1)
            if form is not None and result is None and len(succeeded) < _MAX_FORMS:
                succeeded.add(form)
            return result

        return change

    def _request(self, name: str, arguments: Any, named: Any) -> Any:
        """Call a function in the simulation's process; afterwards known results may be invalid."""
        segment = self._segments[-1]
        try:
            result, answers = self._send(name, arguments, named, segment.number + 1)
        except Exception:  # the function may have changed something before it failed
            for kind in effects.KINDS:
                segment.forget(kind)
            self._places.take(())
            raise
        phase, number = segment.phase, segment.number + 1
        self.end()
        self.begin(phase, answers, number)
        return result

    def _send(self, name: str, arguments: Any, named: Any, segment: int) -> tuple[Any, Answers]:
        marked = self._link.marked
        by_name = [[key, marked(value)] for key, value in named.items()]
        item = ["call", name, segment, by_name, *map(marked, arguments)]
        return self._call_outside(lambda: self._link.request(item))  # type: ignore[no-any-return]

    def _waiting_stub(self, name: str) -> Function:
        def call(*arguments: Any, **named: Any) -> Wait:
            number, result = self._request(name, arguments, named), []  # of a wait in the simulation's process

            def steps() -> Steps:
                answer = None
                while True:
                    kind, *rest = self._request("wait", (number, answer), {})
                    if kind == "over":
                        result.append(rest[0])
                        return
                    answer = yield Call(rest[0], list(rest[1])) if kind == "call" else None

            return Action(steps(), lambda: result[0])

        return call


def _form(name: str, arguments: tuple[Any, ...]) -> Any:
    """Return a key shared by calls that differ only in finite numbers of their last argument; None if there is none."""
    others = arguments[:-1]
    if not arguments or not ALL_PLAIN(map(type, others)):
        return None
    last = arguments[-1]
    kind = type(last)
    if kind is float:
        return (name, others, float) if isfinite(last) else None
    if kind is list:
        is_suitable = last and _ALL_NUMBERS(map(type, last)) and isfinite(sum(last))
        return (name, others, list, len(last)) if is_suitable else None
    return (name, arguments) if kind in PLAIN else None


def _copied(value: Any) -> Any:
    """Return a copy of a value, which the script may change."""
    kind = type(value)
    if kind is list:
        return list(map(_copied, value)) if value and type(value[0]) is not float else value[:]
    if kind is tuple:
        return tuple(map(_copied, value))
    if kind is dict:
        return {key: _copied(item) for key, item in value.items()}
    return value


@functools.cache
def declared() -> list[tuple[str, dict[str, Function], dict[str, Any]]]:
    """Return each module's name, functions and constants; only functions that need no simulation may be called."""
    return [contents(api) for api in listing.apis().values()]


def _announce(segment: Any, handle: int) -> None:
    if len(segment.handles) < effects.MAX_READS:
        segment.handles[handle] = None


@functools.cache
def _signature(function: Function) -> inspect.Signature:
    return inspect.signature(function)
