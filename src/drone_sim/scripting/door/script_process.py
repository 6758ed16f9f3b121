"""The script's process: it obeys the simulation's process, one command at a time, and sends it the API calls."""

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

_MOST_WAITING = 1000  # items, for the next message
_FIRST = "pilot"  # that is loaded, once, before any other
_MOST_FUNCTIONS = 100_000  # that a script has handed over


def serve(script_end: ScriptEnd, end: socket.socket, path: str) -> None:
    """Load and call the script in a file as the other end of a connection says, until that is closed."""
    script_end.open(Channel(end), path)
    try:
        while True:
            script_end.obey(script_end.receive())
    except Disconnected:
        return


class ScriptEnd:
    """The door, seen from the script: of one file, from which several scripts may be loaded."""

    _channel: Channel
    path: str  # of the script's file

    def __init__(self) -> None:
        """Be ready for the first script; `open` comes before anything else."""
        self._hosted: dict[int, _Hosted] = {}  # by the number that the simulation has given it
        self._next = _Hosted(self)
        self._waiting: list[list[Any]] = []
        self._functions: list[Any] = []
        self._numbers: dict[int, int] = {}  # by id()
        self._caller: _Hosted | None = None  # the script that runs
        self._asked = 0  # questions in the call that runs

    def open(self, channel: Channel, path: str) -> None:
        """Take the channel for messages, and the script's file."""
        self._channel, self.path = channel, path

    # ---- messages

    def receive(self) -> tuple[Any, ...]:
        """Return the next message. Raises Disconnected."""
        message = self._channel.receive()
        if message is None:
            raise Disconnected("no message arrived")
        read: tuple[Any, ...] = marshal.loads(message)
        return read

    def leave(self, item: list[Any]) -> None:
        """Leave an item for the next message."""
        self._waiting.append(item)
        if len(self._waiting) > _MOST_WAITING:
            self._send()

    def _send(self) -> None:
        items, self._waiting = self._waiting, []
        self._channel.send(values.written(items))

    def ask(self, item: list[Any]) -> tuple[Any, Answers]:
        """Return the answer to an item, and to what is expected next; raises the error that there was."""
        self._waiting.append(item)
        self._send()
        self._asked += 1
        while True:
            message = self.receive()
            if message[0] == "go":
                self.obey(message)
            elif message[0] == "is":
                _, found, (answers, places) = message
                return self._given(found), (self._given(answers), places)
            else:
                _, kind, text, line = message
                error = ERRORS.get(kind, RuntimeError)(text)
                error.explained = line
                raise error

    def _given(self, value: Any) -> Any:
        return values.incoming(value, self._functions.__getitem__, self._functions_of)

    def _functions_of(self, script: int) -> FunctionsOfScript:
        assert self._caller is not None  # it has asked for them
        return FunctionsOfScript(self._caller.call_script_function, script)

    def marked(self, value: Any) -> Any:
        """Return a value as a message can have it."""
        return values.marked(value, self._number)

    def _number(self, function: Any) -> int:
        if id(function) not in self._numbers:
            if len(self._functions) >= _MOST_FUNCTIONS:
                raise ValueError(f"a script can pass at most {_MOST_FUNCTIONS} functions")
            self._numbers[id(function)] = len(self._functions)
            self._functions.append(function)  # kept: nothing else ever has its id
        return self._numbers[id(function)]

    # ---- what is asked of the scripts

    def obey(self, message: tuple[Any, ...]) -> None:
        """Do what a message says, and tell how it ended."""
        _, number, what, arguments, (answers, places), may_go_on = message
        hosted = self._hosted.get(number)
        if hosted is None:
            hosted = self._hosted[number] = self._next if not self._hosted else _Hosted(self)
        before, self._caller = self._caller, hosted
        try:
            self._asked = 0
            goes_on = self._do(hosted, what, [self._given(one) for one in arguments], (self._given(answers), places))
            if what == "call" and arguments == ["actuation"]:
                hosted.is_silent = not self._asked
            if may_go_on and goes_on and hosted.is_silent and not self._asked:
                self._waiting[-1].append("goes on")
                self._do(hosted, "call", ["actuation"], NO_ANSWERS)
                hosted.is_silent = not self._asked
        finally:
            self._caller = before
        self._send()

    def _do(self, hosted: _Hosted, what: str, arguments: list[Any], answers: Answers) -> bool:
        """Do one thing, and leave word how it ended; return whether it has not failed."""
        try:
            found = hosted.do(what, arguments, answers)
        except ScriptError as error:
            place = [error.phase, error.path, error.line, error.reason]
            self._waiting.append(["failed", hosted.is_threaded, *map(_sent, place)])
            return False
        self._waiting.append(["end", hosted.is_threaded, self.marked(found)])
        return True


class _Hosted:
    """One script, and what stands in for the API there."""

    def __init__(self, end: ScriptEnd):
        self._end = end
        self._limit, self._turns = TimeLimit(0.0), Turns()
        self._stand_ins = StandIns(end, self._limit.outside, self._turns)
        self._script: load.Script = load.no_script()
        self._snapshots: list[Callable[[], None]] = []
        self.is_silent = False  # whether its last actuation asked for nothing
        self.call_script_function = vars(self._stand_ins.modules["sim"])["callScriptFunction"]

    @property
    def is_threaded(self) -> bool:
        """Whether it has a thread that has not ended."""
        return self._script.threaded

    def do(self, what: str, arguments: list[Any], answers: Any) -> Any:
        """Do what the simulation says. Raises ScriptError."""
        named = arguments[0] if arguments and isinstance(arguments[0], str) else ""
        self._stand_ins.begin(f"{what} {named}", answers)
        try:
            if what in ("load", "save", "restore"):
                return getattr(self, f"_{what}")(*arguments)
            return getattr(self._script, what)(*arguments)
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
    """Return an end for each fork of this process, which has imported what scripts of either language need."""
    for name in ("drone_sim.scripting.lua.script", "drone_sim.scripting.python.thread"):
        importlib.import_module(name)
    here, there = socket.socketpair()
    with here, there:  # what the first script of a process reads and compiles, forks have
        first = ScriptEnd()
        first.open(Channel(there), _FIRST)
        first.obey(("go", 1, "load", [0.0, None], NO_ANSWERS, False))
    return ScriptEnd()
