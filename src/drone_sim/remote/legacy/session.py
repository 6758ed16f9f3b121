"""What one client asks for: commands that are carried out once, commands that stream, and steps that it triggers."""

from __future__ import annotations

import logging
import math
import time
import zlib
from collections import deque
from collections.abc import Callable

from drone_sim.message_text import encodable, printable
from drone_sim.remote.client import Client
from drone_sim.remote.conversation import Task, Until
from drone_sim.remote.legacy import wire
from drone_sim.remote.legacy.asked import Asked, Handler, Reach, Refused
from drone_sim.remote.legacy.functions import served
from drone_sim.remote.legacy.signals import TAKE_STRING
from drone_sim.remote.legacy.values import ints, text
from drone_sim.remote.legacy.wire import Answer, Command
from drone_sim.run.player import Player
from drone_sim.scripting import script_log

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_SYNCHRONOUS, _FREE, _NEXT, _ERRORS, _GOODBYE = 0x0001, 0x0002, 0x0003, 0x0004, 0x000A  # commands
_MOST_STREAMS = 1000
_LARGEST = 64 * 1024 * 1024  # bytes of an answer
_MOST_SPLIT = 16  # commands that come in pieces, at a time
_MOST_ERRORS = 50  # that are kept for simxGetLastErrors, and that are written to the log
_STANDING = 0.05  # s between two looks at what streams, while the simulation stands
_WORD, _SIGN = 0xFFFFFFFF, 0x80000000


class _Stream:
    """A command that is carried out again and again."""

    def __init__(self, command: Command, ask: Asked, do: Handler):
        self.command, self.ask, self.do = command, ask, do
        self.step = (-1, -1)  # run and step in which it was carried out last
        self.last = -math.inf  # s, when that was

    def is_due(self, step: tuple[int, int], now: float) -> bool:
        """Tell whether it may say something new, by the step and the real time."""
        since = now - self.last
        return since >= 1e-3 * self.command.delay and (self.step != step or since >= _STANDING)


class Session:
    """The session of one client. Only the simulation's thread calls it."""

    def __init__(
        self,
        name: str,
        client: Client,
        player: Player,
        selected: list[int],
        clock: Callable[[], float] = time.monotonic,
    ):
        """`name` says in the log who it is, `client` has the functions; `selected` is what clients have selected."""
        self.name = name
        self.is_over = False  # whether it has said goodbye
        self._client, self._player, self._clock = client, player, clock
        self._selected = selected
        self._reach = Reach({}, selected)
        self._streams: dict[tuple[int, bytes], _Stream] = {}
        self._split: dict[tuple[int, bytes], bytearray] = {}
        self._errors: deque[str] = deque(maxlen=_MOST_ERRORS)
        self._said: set[str] = set()
        self._size = 0  # bytes of the answer so far

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait for this client to trigger it."""
        return self._client.stepping.holds

    def synchronous(self, on: bool) -> None:
        """Let the simulation step only when this client triggers it, or freely."""
        if on != bool(self._client.stepping.level):
            self._client.stepping.set(on)

    def leave(self) -> None:
        """Hold nothing up, and remove what it has left."""
        self._streams.clear()
        self._split.clear()
        self._client.leave()

    def answer(self, message: bytes) -> Task:
        """Carry out what a message asks for; return the message that answers it. Raises ValueError for what is none."""
        asked = wire.read(message)
        answers, self._size = [], 0
        for command in asked.commands:
            whole = self._put_together(command)
            if whole is None:
                continue
            if whole.code == _NEXT:
                yield from self._step()
            self._keep_up()
            answer = self._carried_out(whole)
            if answer is not None:
                answers.append(answer)
        self._keep_up()
        answers += self._streamed()
        script_log.end_call()
        return wire.write(asked, answers, self._stamp())

    # ---- steps

    def _step(self) -> Task:
        """Let the simulation take one step, if it is playing and waits for this client; return when it has."""
        simulation, stepping = self._player.simulation, self._client.stepping
        if self._player.playing and stepping.level:
            before = simulation.run, simulation.steps
            yield stepping.wait(Until(lambda: (simulation.run, simulation.steps) != before))

    # ---- commands

    def _keep_up(self) -> None:
        functions = self._client.functions()
        if functions is not self._reach.functions:
            self._reach = Reach(functions, self._selected)
            for stream in self._streams.values():
                stream.ask.reach = self._reach

    def _put_together(self, command: Command) -> Command | None:
        """Return a command with all of its data, None where more are to come."""
        if command.is_whole:
            return command
        key = command.code, command.raw_key
        data = self._split.setdefault(key, bytearray())
        if len(data) != command.shift or (len(self._split) > _MOST_SPLIT and not data):
            del self._split[key]
            return command._replace(data=b"", shift=0, whole=0) if command.shift else None
        data += command.data
        if len(data) < command.whole:
            return None
        return command._replace(data=bytes(self._split.pop(key)), shift=0)

    def _carried_out(self, command: Command) -> Answer | None:
        """Return what became of a command, None where there is nothing to say."""
        key = command.code, command.raw_key
        if command.mode == wire.DISCONTINUE:
            self._streams.pop(key, None)
            return Answer(command, b"")
        if command.code in (_SYNCHRONOUS, _FREE, _NEXT, _ERRORS, _GOODBYE):
            return Answer(command, self._own(command.code))
        function = served(command.code)
        ask = Asked(function.name, command, self._reach)
        if command.mode not in (wire.STREAMING, wire.STREAMING_SPLIT):
            return self._done(command, ask, function.do)
        if key not in self._streams and len(self._streams) >= _MOST_STREAMS:
            self._tell(f"{function.name}: at most {_MOST_STREAMS} commands can stream at once")
            return Answer(command, None)
        self._streams[key] = _Stream(command, ask, function.do)
        return None

    def _own(self, code: int) -> bytes:
        """Carry out a command that is about the session itself."""
        if code == _ERRORS:
            errors = list(self._errors)
            self._errors.clear()
            return ints(len(errors)) + b"".join(map(text, errors))
        if code in (_SYNCHRONOUS, _FREE):
            self.synchronous(code == _SYNCHRONOUS)
        self.is_over = self.is_over or code == _GOODBYE
        return b""

    def _streamed(self) -> list[Answer]:
        """Return what streams and may be new."""
        simulation = self._player.simulation
        step, now = (simulation.run, simulation.steps), self._clock()
        answers = []
        for key, one in list(self._streams.items()):
            if one.is_due(step, now):
                one.step, one.last = step, now
                answer = self._done(one.command, one.ask, one.do)
                if answer is not None:
                    answers.append(answer)
                    if one.command.code == TAKE_STRING and answer.data is not None:
                        del self._streams[key]  # the client waits for one value
        return answers

    def _done(self, command: Command, ask: Asked, do: Handler) -> Answer | None:
        try:
            if self._size > _LARGEST:
                raise ask.refused(f"the reply has more than {_LARGEST} bytes")
            data = do(ask)
            self._size += len(data or b"")
        except Refused as refused:
            _LOG.debug("a command failed:", exc_info=True)
            if str(refused):
                self._tell(str(refused))
            return Answer(command, None)
        return None if data is None else Answer(command, data)

    def _tell(self, line: str) -> None:
        """Keep what was refused for simxGetLastErrors; write it to the log, the first time."""
        self._errors.append(line)
        if line not in self._said and len(self._said) < _MOST_ERRORS:
            self._said.add(line)
            _LOG.warning("%s (requested by %s)", encodable(printable(line)), self.name)

    def _stamp(self) -> wire.Stamp:
        simulation, player = self._player.simulation, self._player
        known = simulation.parameters
        running, paused = simulation.running, simulation.running and player.paused
        state = running | paused << 1 | (known.real_time_factor == 1) << 2
        simulated = round(1e3 * simulation.time) if running else 0
        now = round(1e3 * self._clock()) & _WORD
        scene = zlib.crc32(known.scene_file.encode()) & 0xFFFF
        return wire.Stamp((now ^ _SIGN) - _SIGN, simulated, scene, state)
