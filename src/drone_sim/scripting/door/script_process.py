"""The script's process: executes the simulation's commands, one at a time, and sends it the script's API calls."""

from __future__ import annotations

import contextlib
import importlib
import marshal
import os
import socket
from collections.abc import Callable
from typing import Any

from drone_sim.scripting import load
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.scripts import FunctionsOfScript
from drone_sim.scripting.door import values
from drone_sim.scripting.door.channel import Channel, Disconnected
from drone_sim.scripting.door.functions import ERRORS
from drone_sim.scripting.door.stand_ins import NO_ANSWERS, Answers, StandIns
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.time_limit import TimeLimit

_MAX_QUEUED = 1000  # items in a message
_WARM_UP_SCRIPT = "pilot"  # loaded once, before the process forks
_MAX_FUNCTIONS = 100_000  # passed to the simulation


def serve(script_end: ScriptEnd, end: socket.socket, path: str) -> None:
    """Execute the commands for the script file at `path` that the other end sends, until it disconnects."""
    script_end.open(Channel(end), path)
    try:
        while True:
            script_end.obey(script_end.receive())
    except Disconnected:
        return


class ScriptEnd:
    """The script's end of the RPC; it may load several scripts from its file."""

    _channel: Channel
    path: str  # of the script's file

    def __init__(self) -> None:
        """Prepare for the first script; `open` must be called next."""
        self._hosted: dict[int, _Hosted] = {}  # by the number that the simulation assigned
        self._next = _Hosted(self)
        self._queued: list[list[Any]] = []  # items for the next message
        self._functions: list[Any] = []
        self._numbers: dict[int, int] = {}  # numbers of functions, by id()
        self._caller: _Hosted | None = None  # the running script
        self._requests = 0  # in the current call

    def open(self, channel: Channel, path: str) -> None:
        """Set the message channel and the script's file."""
        self._channel, self.path = channel, path

    # ---- messages

    def receive(self) -> tuple[Any, ...]:
        """Return the next message. Raises Disconnected."""
        message = self._channel.receive()
        if message is None:
            raise Disconnected("no message arrived")
        content: tuple[Any, ...] = marshal.loads(message)
        return content

    def leave(self, item: list[Any]) -> None:
        """Queue an item for the next message."""
        self._queued.append(item)
        if len(self._queued) > _MAX_QUEUED:
            self._send()

    def _send(self) -> None:
        items, self._queued = self._queued, []
        self._channel.send(values.written(items))

    def ask(self, item: list[Any]) -> tuple[Any, Answers]:
        """Send an item; return its result, and the results of the expected reads. Raises the error received."""
        self._queued.append(item)
        self._send()
        self._requests += 1
        while True:
            message = self.receive()
            if message[0] == "go":
                self.obey(message)
            elif message[0] == "is":
                _, value, (answers, places) = message
                return self._decoded(value), (self._decoded(answers), places)
            else:
                _, kind, text, line = message
                error = ERRORS.get(kind, RuntimeError)(text)
                error.explained = line
                raise error

    def _decoded(self, value: Any) -> Any:
        return values.incoming(value, self._functions.__getitem__, self._functions_of)

    def _functions_of(self, script: int) -> FunctionsOfScript:
        assert self._caller is not None  # it has requested them
        return FunctionsOfScript(self._caller.call_script_function, script)

    def marked(self, value: Any) -> Any:
        """Return a value encoded for a message."""
        return values.marked(value, self._number)

    def _number(self, function: Any) -> int:
        if id(function) not in self._numbers:
            if len(self._functions) >= _MAX_FUNCTIONS:
                raise ValueError(f"a script can pass at most {_MAX_FUNCTIONS} functions")
            self._numbers[id(function)] = len(self._functions)
            self._functions.append(function)  # this reference keeps its id() from being reused
        return self._numbers[id(function)]

    # ---- commands for the scripts

    def obey(self, message: tuple[Any, ...]) -> None:
        """Execute a command, and send how it ended."""
        _, number, command, arguments, (answers, places), may_go_on = message
        hosted = self._hosted.get(number)
        if hosted is None:
            hosted = self._hosted[number] = self._next if not self._hosted else _Hosted(self)
        outer, self._caller = self._caller, hosted
        try:
            self._requests = 0
            decoded = [self._decoded(argument) for argument in arguments]
            has_succeeded = self._do(hosted, command, decoded, (self._decoded(answers), places))
            if command == "call" and arguments == ["actuation"]:
                hosted.is_silent = not self._requests
            if may_go_on and has_succeeded and hosted.is_silent and not self._requests:
                self._queued[-1].append("goes on")
                self._do(hosted, "call", ["actuation"], NO_ANSWERS)
                hosted.is_silent = not self._requests
        finally:
            self._caller = outer
        self._send()

    def _do(self, hosted: _Hosted, command: str, arguments: list[Any], answers: Answers) -> bool:
        """Execute one command, and queue how it ended; return whether it succeeded."""
        try:
            result = hosted.do(command, arguments, answers)
        except ScriptError as error:
            place = [error.phase, error.path, error.line, error.reason]
            self._queued.append(["failed", hosted.is_threaded, *map(_sent, place)])
            return False
        self._queued.append(["end", hosted.is_threaded, self.marked(result)])
        return True


class _Hosted:
    """A script with its stubs of the API."""

    def __init__(self, end: ScriptEnd):
        self._end = end
        self._limit, self._turns = TimeLimit(0.0), Turns()
        self._stand_ins = StandIns(end, self._limit.outside, self._turns)
        self._script: load.Script = load.no_script()
        self._snapshots: list[Callable[[], None]] = []
        self.is_silent = False  # whether its last actuation made no request
        self.call_script_function = vars(self._stand_ins.modules["sim"])["callScriptFunction"]

    @property
    def is_threaded(self) -> bool:
        """Whether it has an unfinished thread."""
        return self._script.threaded

    def do(self, command: str, arguments: list[Any], answers: Any) -> Any:
        """Execute a command of the simulation. Raises ScriptError."""
        name = arguments[0] if arguments and isinstance(arguments[0], str) else ""
        self._stand_ins.begin(f"{command} {name}", answers)
        try:
            if command in ("load", "save", "restore"):
                return getattr(self, f"_{command}")(*arguments)
            return getattr(self._script, command)(*arguments)
        finally:
            self._stand_ins.end()

    def _load(self, seconds: float, processor: int | None) -> list[Any]:
        if processor is not None:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(0, {processor})
        self._limit.seconds = seconds
        self._script = load.load(self._end.path, self._stand_ins.modules, self._limit, self._turns)
        return [self._script.idle, self._script.is_empty]

    def _save(self) -> int:
        self._snapshots.append(self._script.save_state())
        return len(self._snapshots) - 1

    def _restore(self, number: int) -> None:
        self._snapshots[number]()


def _sent(value: Any) -> Any:
    return value if isinstance(value, int) else str(value)


def prepared() -> ScriptEnd:
    """Return an end for the forks of this process, with the imports of both script languages loaded."""
    for name in ("drone_sim.scripting.lua.script", "drone_sim.scripting.python.thread"):
        importlib.import_module(name)
    simulation_socket, script_socket = socket.socketpair()
    with simulation_socket, script_socket:  # warm up: forks share what the first script has read and compiled
        first = ScriptEnd()
        first.open(Channel(script_socket), _WARM_UP_SCRIPT)
        first.obey(("go", 1, "load", [0.0, None], NO_ANSWERS, False))
    return ScriptEnd()
