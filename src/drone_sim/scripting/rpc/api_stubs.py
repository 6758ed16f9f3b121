"""Stubs of the API in the script's process, which forward calls to the simulation's process.

Most calls of a controller need no message of their own. Each message from the simulation contains a snapshot: the
results of the reads that the current phase made in its last run. The mirror answers reads from it, until the script
changes something of their kind. Writes are sent in order with the next message, once a call of the same form has
succeeded. Every other call is a message, and its reply contains a new snapshot.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from math import isfinite
from typing import Any, Protocol

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api import listing
from drone_sim.scripting.api.calls import Api, Function, contents
from drone_sim.scripting.api.control import Action, Call, Steps, Turns, Wait, waits
from drone_sim.scripting.api.host import SceneServices
from drone_sim.scripting.rpc import effects
from drone_sim.scripting.rpc.mirror import POSE, Mirror, Read
from drone_sim.scripting.rpc.values import ALL_PLAIN, PLAIN

_MAX_FORMS = 10_000  # remembered forms of successful calls
_ALL_NUMBERS = frozenset((float, int)).issuperset


class SimulationLink(Protocol):
    """Connection to the simulation. A Protocol because the implementation, script_process, imports this module."""

    def request(self, item: list[Any]) -> tuple[Any, Exception | None, list[Any]]: ...
    def queue(self, item: list[Any]) -> None: ...
    def marked(self, value: Any) -> Any: ...


class ApiStubs:
    def __init__(self, link: SimulationLink, call_outside: Callable[[Callable[[], Any]], Any], turns: Turns):
        """`link` leads to the simulation; `call_outside` calls a blocking function outside the script's time limit.

        `turns` switch the script's thread.
        """
        self._link, self._call_outside = link, call_outside
        self._outer: list[tuple[str, dict[Read, None]]] = []  # phases and reads, each waiting for the next one
        self._phase = ""
        self._reads: dict[Read, None] = {}  # of the running phase
        self._watched: dict[str, dict[Read, None]] = {}  # by phase: the reads whose results are in its snapshots
        self._mirror = Mirror()
        self._succeeded: set[Any] = set()  # forms of calls
        self.modules = {}
        apis = listing.apis(self._mirror.objects, SceneServices(turns=turns))
        for name, functions, constants in map(contents, apis.values()):
            stubs = {key: self._stub(name, function) for key, function in functions.items()}
            self.modules[name] = Api(name, stubs, constants)

    # ---- phases

    def begin(self, phase: str, results: list[Any]) -> None:
        """Begin a phase with a snapshot; it may be nested in a request of another phase."""
        self._outer.append((self._phase, self._reads))
        self._phase, self._reads = phase, {}
        self._mirror.take(self._watched.get(phase, ()), results)

    def end(self) -> None:
        """End the phase; announce its reads, unless they are those of its last run."""
        if self._reads != self._watched.get(self._phase, {}):
            self._watched[self._phase] = self._reads
            reads = [[name, *map(self._link.marked, arguments)] for name, arguments in self._reads]
            self._link.queue(["reads", reads])
        self._phase, self._reads = self._outer.pop()

    def _watch(self, read: Read) -> None:
        if len(self._reads) < effects.MAX_READS:
            self._reads[read] = None

    # ---- calls

    def _stub(self, module: str, function: Function) -> Function:
        name = f"{module}.{function.__name__}"
        if effects.is_own(function):
            return function
        if waits(function):
            stub = self._waiting_stub(name)
        elif name in effects.POSE_READS:
            stub = self._pose_reading_stub(name, function)
        elif name in effects.READS:
            stub = self._reading_stub(name)
        elif name in effects.CHANGES:
            stub = self._changing_stub(name, function)
        else:
            stub = self._forwarding_stub(name)
        return functools.update_wrapper(stub, function)

    def _forwarding_stub(self, name: str) -> Function:
        def call(*arguments: Any, **named: Any) -> Any:
            return self._request(name, arguments, named)

        return call

    def _reading_stub(self, name: str) -> Function:
        mirror = self._mirror

        def read(*arguments: Any, **named: Any) -> Any:
            try:
                hash(arguments)
            except TypeError:  # such as a list
                return self._request(name, arguments, named)
            key = name, arguments
            is_known = not named and key in mirror.results
            result = _copied(mirror.results[key]) if is_known else self._request(name, arguments, named)
            if not named:
                self._watch(key)
            return result

        return read

    def _pose_reading_stub(self, name: str, function: Function) -> Function:
        """Return the stub of a `function` that depends on nothing but the poses of its arguments."""
        mirror = self._mirror

        def read(*arguments: Any, **named: Any) -> Any:
            if named or not 1 <= len(arguments) <= 2:
                return self._request(name, arguments, named)
            handle, frame = arguments if len(arguments) == 2 else (*arguments, WORLD)
            if type(handle) is not int or type(frame) is not int:
                return self._request(name, arguments, named)
            is_known = mirror.knows(handle, frame)
            result = function(handle, frame) if is_known else self._request(name, arguments, named)
            self._watch((POSE, (handle,)))
            if frame != WORLD:
                self._watch((POSE, (frame,)))
            return result

        return read

    def _changing_stub(self, name: str, function: Function) -> Function:
        kind, mirror, succeeded, link = effects.CHANGES[name], self._mirror, self._succeeded, self._link

        def change(*arguments: Any, **named: Any) -> Any:
            form = None if named else _form(name, arguments)
            if form is None or form not in succeeded:
                result = self._request(name, arguments, named)
                if form is not None and result is None and len(succeeded) < _MAX_FORMS:
                    succeeded.add(form)
                return result
            link.queue(["set", name, *arguments])
            if kind == effects.POSES:
                self._watch((POSE, arguments[:1]))
            if kind != effects.POSES or not mirror.move_mark(function, arguments):
                mirror.forget(kind)
            return None

        return change

    def _request(self, name: str, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        """Call a function in the simulation's process, and take the snapshot that comes with its result or error."""
        if not self._outer:  # called by a thread that the script has started itself
            raise RuntimeError(f"{name} cannot be called between the script's phases")
        marked = self._link.marked
        by_name = [[key, marked(value)] for key, value in named.items()]
        item = ["call", name, by_name, *map(marked, arguments)]
        result, error, results = self._call_outside(lambda: self._link.request(item))
        self._mirror.take(self._watched.get(self._phase, ()), results)
        if error is not None:
            raise error
        return result

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
    """Return a key shared by calls that differ only in finite numbers of their last argument; None if there is none.

    It is why an error is raised in the line that causes it, although writes are not waited for: a wrong handle, name or
    count of values has another form. If all writes were waited for, a step of the built-in script would take eight
    messages to the script instead of two.
    """
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
