"""A client's session: commands executed once, streaming commands, and the steps that the client triggers."""

from __future__ import annotations

import logging
import math
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from drone_sim.message_text import encodable, printable
from drone_sim.remote.client import Client
from drone_sim.remote.conversation import Task, Until
from drone_sim.remote.legacy import wire
from drone_sim.remote.legacy.commands import TAKE_STRING, HandlerFunction, handler_of
from drone_sim.remote.legacy.request import Refused, Request, ints, text
from drone_sim.remote.legacy.wire import Answer, Command
from drone_sim.run.player import Player
from drone_sim.scripting import script_log

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_SYNCHRONOUS, _FREE, _NEXT, _ERRORS, _GOODBYE = 0x0001, 0x0002, 0x0003, 0x0004, 0x000A  # commands
_MAX_STREAMS = 1000
_MAX_REPLY_SIZE = 64 * 1024 * 1024  # bytes
_MAX_SPLIT = 16  # incomplete commands, which are sent in pieces, at a time
_MAX_ERRORS = 50  # kept for simxGetLastErrors, and written to the log
_IDLE_INTERVAL = 0.05  # s between executions of streaming commands while the simulation is not stepping
_WORD, _SIGN = 0xFFFFFFFF, 0x80000000


@dataclass
class _Stream:
    """A command that is executed repeatedly."""

    command: Command
    request: Request
    do: HandlerFunction
    step: tuple[int, int] = (-1, -1)  # run and step of the last execution
    last: float = -math.inf  # s, time of the last execution

    def is_due(self, step: tuple[int, int], now: float) -> bool:
        """Return whether the result may have changed, by the step and the real time (s)."""
        elapsed = now - self.last
        return elapsed >= 1e-3 * self.command.delay and (self.step != step or elapsed >= _IDLE_INTERVAL)


class Session:
    """The session of one client. Only the simulation's thread calls it."""

    def __init__(self, name: str, client: Client, player: Player, selected: list[int], clock: Callable[[], float]):
        """`name` is for the log, `client` has the functions; `selected` contains the objects selected by clients."""
        self.name = name
        self.is_over = False  # whether the client has ended it
        self._client, self._player, self._clock = client, player, clock
        self.stepping = client.stepping
        self._selected = selected
        self._streams: dict[tuple[int, bytes], _Stream] = {}
        self._split: dict[tuple[int, bytes], bytearray] = {}
        self._errors: deque[str] = deque(maxlen=_MAX_ERRORS)
        self._logged: set[str] = set()
        self._size = 0  # bytes of the reply so far

    def synchronous(self, on: bool) -> None:
        """Switch synchronous mode, in which the simulation steps only when this client triggers it."""
        if on != bool(self.stepping.level):
            self.stepping.set(on)

    def leave(self) -> None:
        """Release the simulation, and remove the client's streams, drawings and the like."""
        self._streams.clear()
        self._split.clear()
        self._client.leave()

    def answer(self, message: bytes) -> Task:
        """Execute the commands in a message; return the reply. Raises ValueError for an invalid message."""
        request = wire.read(message)
        answers, self._size = [], 0
        for command in request.commands:
            complete = self._put_together(command)
            if complete is None:
                continue
            if complete.code == _NEXT:
                yield from self._step()
            answer = self._execute(complete)
            if answer is not None:
                answers.append(answer)
        answers += self._stream_replies()
        script_log.end_call()
        return wire.write(request, answers, self._stamp())

    # ---- steps

    def _step(self) -> Task:
        """Let the simulation take a step, if it is playing in synchronous mode; return after it."""
        simulation = self._player.simulation
        if self._player.playing and self.stepping.level:
            before = simulation.run, simulation.steps
            yield self.stepping.wait(Until(lambda: (simulation.run, simulation.steps) != before))

    # ---- commands

    def _put_together(self, command: Command) -> Command | None:
        """Return a command with all of its data, None if parts are missing."""
        if not command.shift and len(command.data) == command.whole:
            return command
        key = command.code, command.raw_key
        data = self._split.setdefault(key, bytearray())
        if len(data) != command.shift or (len(self._split) > _MAX_SPLIT and not data):
            del self._split[key]
            return command._replace(data=b"", shift=0, whole=0) if command.shift else None
        data += command.data
        if len(data) < command.whole:
            return None
        return command._replace(data=bytes(self._split.pop(key)), shift=0)

    def _execute(self, command: Command) -> Answer | None:
        """Execute a command; return its reply, None if there is none."""
        key = command.code, command.raw_key
        if command.mode == wire.DISCONTINUE:
            self._streams.pop(key, None)
            return Answer(command, b"")
        if command.code in (_SYNCHRONOUS, _FREE, _NEXT, _ERRORS, _GOODBYE):
            return Answer(command, self._execute_session_command(command.code))
        function = handler_of(command.code)
        request = Request(function.name, command, self._client, self._selected)
        if command.mode not in (wire.STREAMING, wire.STREAMING_SPLIT):
            return self._call(command, request, function.do)
        if key not in self._streams and len(self._streams) >= _MAX_STREAMS:
            self._report(f"{function.name}: at most {_MAX_STREAMS} commands can stream at once")
            return Answer(command, None)
        self._streams[key] = _Stream(command, request, function.do)
        return None

    def _execute_session_command(self, code: int) -> bytes:
        if code == _ERRORS:
            errors = list(self._errors)
            self._errors.clear()
            return ints(len(errors)) + b"".join(map(text, errors))
        if code in (_SYNCHRONOUS, _FREE):
            self.synchronous(code == _SYNCHRONOUS)
        self.is_over = self.is_over or code == _GOODBYE
        return b""

    def _stream_replies(self) -> list[Answer]:
        """Execute the streaming commands that are due; return their replies."""
        simulation = self._player.simulation
        step, now = (simulation.run, simulation.steps), self._clock()
        answers = []
        for key, stream in list(self._streams.items()):
            if stream.is_due(step, now):
                stream.step, stream.last = step, now
                answer = self._call(stream.command, stream.request, stream.do)
                if answer is not None:
                    answers.append(answer)
                    if stream.command.code == TAKE_STRING and answer.data is not None:
                        del self._streams[key]  # the client waits for one value
        return answers

    def _call(self, command: Command, request: Request, do: HandlerFunction) -> Answer | None:
        try:
            if self._size > _MAX_REPLY_SIZE:
                raise request.refused(f"the reply has more than {_MAX_REPLY_SIZE} bytes")
            data = do(request)
            self._size += len(data or b"")
        except Refused as refused:
            _LOG.debug("a command failed:", exc_info=True)
            if str(refused):
                self._report(str(refused))
            return Answer(command, None)
        return None if data is None else Answer(command, data)

    def _report(self, line: str) -> None:
        """Keep an error for simxGetLastErrors; write it to the log at its first occurrence."""
        self._errors.append(line)
        if line not in self._logged and len(self._logged) < _MAX_ERRORS:
            self._logged.add(line)
            _LOG.warning("%s (requested by %s)", encodable(printable(line)), self.name)

    def _stamp(self) -> wire.Stamp:
        simulation, player = self._player.simulation, self._player
        parameters = simulation.parameters
        running, paused = simulation.running, simulation.running and player.paused
        state = running | paused << 1 | (parameters.real_time_factor == 1) << 2
        simulated = round(1e3 * simulation.time) if running else 0
        now = round(1e3 * self._clock()) & _WORD
        scene = zlib.crc32(parameters.scene_file.encode()) & 0xFFFF
        return wire.Stamp((now ^ _SIGN) - _SIGN, simulated, scene, state)
