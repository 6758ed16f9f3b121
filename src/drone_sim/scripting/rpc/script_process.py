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
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.rpc import effects, values
from drone_sim.scripting.rpc.api_stubs import ApiStubs
from drone_sim.scripting.rpc.connection import Channel, Disconnected
from drone_sim.scripting.time_limit import TimeLimit

_MAX_QUEUED = 1000  # items in a message
_WARM_UP_SCRIPT = "pilot"  # loaded once, before the process forks


def serve(worker: ScriptWorker, end: socket.socket, path: str) -> None:
    """Execute the commands of the simulation for the script file at `path`, until it disconnects."""
    worker.open(Channel(end), path)
    try:
        while True:
            worker.execute(worker.receive())
    except Disconnected:
        return


class ScriptWorker:
    """The script's end of the RPC: executes the simulation's commands; it may load several scripts from its file."""

    _channel: Channel
    path: str  # of the script's file

    def __init__(self) -> None:
        """Prepare for the first script; `open` must be called next."""
        self._scripts: dict[int, _LoadedScript] = {}  # by the number that the simulation assigned
        self._next = _LoadedScript(self)
        self._queued: list[list[Any]] = []  # items for the next message
        self._functions: list[Any] = []
        self._numbers: dict[int, int] = {}  # numbers of functions, by id()
        self._caller: _LoadedScript | None = None  # the running script

    def open(self, channel: Channel, path: str) -> None:
        self._channel, self.path = channel, path

    # ---- messages

    def receive(self) -> tuple[Any, ...]:
        """Return the next message. Raises Disconnected."""
        message = self._channel.receive()
        if message is None:
            raise Disconnected("no message arrived")
        content: tuple[Any, ...] = marshal.loads(message)
        return content

    def queue(self, item: list[Any]) -> None:
        self._queued.append(item)
        if len(self._queued) > _MAX_QUEUED:
            self._send()

    def _send(self) -> None:
        items, self._queued = self._queued, []
        self._channel.send(values.written(items))

    def request(self, item: list[Any]) -> tuple[Any, Exception | None, list[Any]]:
        """Send a call; return its result, or the error that it raised, and the snapshot that came with it."""
        self._queued.append(item)
        self._send()
        while True:
            message = self.receive()
            if message[0] == "go":
                self.execute(message)
            elif message[0] == "is":
                _, value, snapshot = message
                return self._decoded(value), None, self._decoded(snapshot)
            else:
                _, kind, text, explanation, snapshot = message
                error = values.ERRORS.get(kind, RuntimeError)(text)
                error.explained = explanation
                return None, error, self._decoded(snapshot)

    def _decoded(self, value: Any) -> Any:
        return values.incoming(value, self._functions.__getitem__, self._functions_of)

    def _functions_of(self, script: int) -> FunctionsOfScript:
        assert self._caller is not None  # it has requested them
        return FunctionsOfScript(self._caller.call_script_function, script)

    def marked(self, value: Any) -> Any:
        return values.marked(value, self._number)

    def _number(self, function: Any) -> int:
        if id(function) not in self._numbers:
            if len(self._functions) >= effects.MAX_FUNCTIONS:
                raise ValueError(f"a script can pass at most {effects.MAX_FUNCTIONS} functions")
            self._numbers[id(function)] = len(self._functions)
            self._functions.append(function)  # this reference keeps its id() from being reused
        return self._numbers[id(function)]

    # ---- commands for the scripts

    def execute(self, message: tuple[Any, ...]) -> None:
        """Execute a command, and send its result or error."""
        _, number, command, arguments, snapshot = message
        script = self._scripts.get(number)
        if script is None:
            script = self._scripts[number] = self._next if not self._scripts else _LoadedScript(self)
        outer, self._caller = self._caller, script
        try:
            result = script.do(command, [self._decoded(argument) for argument in arguments], self._decoded(snapshot))
            self._queued.append(["end", script.is_threaded, self.marked(result)])
        except ScriptError as error:
            place = str(error.phase), str(error.path), int(error.line), str(error.reason)
            self._queued.append(["failed", script.is_threaded, *place])
        finally:
            self._caller = outer
        self._send()


class _LoadedScript:
    def __init__(self, worker: ScriptWorker):
        self._worker = worker
        self._limit, self._turns = TimeLimit(0.0), Turns()
        self._stubs = ApiStubs(worker, self._limit.outside, self._turns)
        self._script: load.Script = load.no_script()
        self._saved_states: list[Callable[[], None]] = []  # functions that restore them
        self.call_script_function = vars(self._stubs.modules["sim"])["callScriptFunction"]

    @property
    def is_threaded(self) -> bool:
        return self._script.threaded

    def do(self, command: str, arguments: list[Any], snapshot: list[Any]) -> Any:
        """Execute a command of the simulation. Raises ScriptError."""
        self._stubs.begin(effects.phase_of(command, arguments), snapshot)
        try:
            if command in ("load", "save", "restore"):
                return getattr(self, f"_{command}")(*arguments)
            return getattr(self._script, command)(*arguments)
        finally:
            self._stubs.end()

    def _load(self, seconds: float, processor: int | None) -> list[Any]:
        if processor is not None:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(0, {processor})
        self._limit.seconds = seconds
        self._script = load.load(self._worker.path, self._stubs.modules, self._limit, self._turns)
        return [self._script.idle, self._script.is_empty]

    def _save(self) -> int:
        self._saved_states.append(self._script.save_state())
        return len(self._saved_states) - 1

    def _restore(self, number: int) -> None:
        self._saved_states[number]()


def prepared() -> ScriptWorker:
    """Return a worker for the forks of this process, with the imports of both script languages loaded."""
    for name in ("drone_sim.scripting.lua.script", "drone_sim.scripting.python.thread"):
        importlib.import_module(name)
    simulation_socket, script_socket = socket.socketpair()
    with simulation_socket, script_socket:  # warm up: forks share what the first script has read and compiled
        first = ScriptWorker()
        first.open(Channel(script_socket), _WARM_UP_SCRIPT)
        first.execute(("go", 1, "load", [0.0, None], []))
    return ScriptWorker()
