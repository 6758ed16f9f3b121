"""Data between scripts: `sim`'s signals and tubes, and the broadcasts of wireless.py."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.types import (
    MOST_BYTES,
    Handle,
    Name,
    Number,
    Text,
    WrongValue,
    check_name,
    numbers,
    refuse_if_too_large,
    written,
)

_MOST = 10_000  # signals of a kind
_LARGEST = 2**31 - 1
_MOST_ENDS = 1000  # open ends of tubes
_LONGEST = 1000  # packets waiting at one end
_MOST_BROADCASTS = 10_000  # waiting ones


class Signals:
    """Float, integer and string signals; each kind has its own names."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self._values: dict[type[Any], dict[str, Any]] = {float: {}, int: {}, str: {}}

    def get(self, kind: type[Any], name: str) -> Any:
        """Return the value of a signal, None if it is not set."""
        return self._values[kind].get(name)

    def find(self, name: str) -> Any:
        """Return the value of a signal of any kind, None if it is not set."""
        return next((values[name] for kind in (int, float, str) if name in (values := self._values[kind])), None)

    def of_name(self, name: str) -> tuple[Any, ...] | None:
        """Return the values of the float, integer and string signal with a name; None if none of them is set."""
        found = tuple(values.get(name) for values in self._values.values())
        return None if all(value is None for value in found) else found

    def names(self) -> list[str]:
        return [name for values in self._values.values() for name in values]

    def numbers(self) -> dict[str, float]:
        """Return the values of all float and integer signals by name; a float takes precedence."""
        return {**self._values[int], **self._values[float]}

    def set(self, kind: type[Any], name: str, value: Any) -> None:
        """Set a signal. Raises WrongValue, and ValueError for too many signals or too long strings."""
        check_name(name, "a signal")
        values = self._values[kind]
        if kind is str:
            size = sum(map(len, values.values())) - len(values.get(name, "")) + len(value)
            if size > MOST_BYTES:
                raise ValueError(f"all string signals together may have at most {MOST_BYTES} bytes, not {size}")
        if name not in values and len(values) >= _MOST:
            raise ValueError(f"at most {_MOST} signals of a kind are allowed: clear some")
        values[name] = value

    def forget(self, kind: type[Any], name: str | None) -> None:
        """Clear a signal of a kind, or all of them."""
        if name is None:
            self._values[kind].clear()
        else:
            self._values[kind].pop(name, None)

    def add_those_of(self, others: Signals) -> None:
        """Add the signals of `others` that are not set here."""
        for kind, values in others._values.items():
            self._values[kind] = {**values, **self._values[kind]}

    def save_state(self) -> Restore:
        return saved(self, "_values", deep=True)


class SignalFunctions:
    """Signals: named values that scripts share."""

    def __init__(self, signals: Signals):
        self._signals = signals

    @sim("345", setDoubleSignal="345")
    def setFloatSignal(self, name: Name, value: Number) -> None:
        """Set a float signal."""
        self._signals.set(float, name, float(value))

    @sim("5", setIntegerSignal="345")
    def setInt32Signal(self, name: Name, value: int) -> None:
        """Set an integer signal."""
        if not abs(value) <= _LARGEST:  # this form also refuses NaN
            raise WrongValue(f"expected a whole number within +-{_LARGEST}")
        self._signals.set(int, name, int(value))

    @sim("345", setBufferSignal="5")
    def setStringSignal(self, name: Name, value: Text) -> None:
        """Set a string signal; a number becomes a text with up to 14 digits."""
        value = written(value)
        if not isinstance(value, (str, bytes)):
            raise WrongValue("a string is expected")
        self._signals.set(str, name, value)


def _add_kind(word: str, kind: type[Any], what: str, generations: str = "345", **others: str) -> None:
    """Add the functions that read and clear signals of a kind; `others`: other words for the kind, with generations."""

    def get(self: SignalFunctions, name: Name) -> Any:
        return self._signals.get(kind, name)

    def clear(self: SignalFunctions, name: Name | None = None) -> None:
        self._signals.forget(kind, name)

    docs = {get: f"Return {what}, or nothing if it is not set.", clear: f"Clear {what}, or all of them."}
    for function, doc in docs.items():
        verb = function.__name__
        names = {f"{verb}{other}Signal": since for other, since in others.items()}
        sim.add(SignalFunctions, function, f"{verb}{word}Signal", doc, generations, **names)


_add_kind("Float", float, "a float signal", Double="345")
_add_kind("Int32", int, "an integer signal", "5", Integer="345")
_add_kind("String", str, "a string signal", Buffer="5")


class _End(NamedTuple):
    tube: tuple[int, str]
    waiting: deque[Any]


class Tubes:
    """Tubes between scripts: each has a header, a name, and two ends."""

    def __init__(self) -> None:
        self._ends: dict[int, _End] = {}
        self._last_handle = 0

    def open(self, kind: int, name: str, length: int) -> int:
        """Open an end at which up to `length` packets wait; return its handle. Raises ValueError."""
        if sum(end.tube == (kind, name) for end in self._ends.values()) >= 2:
            raise ValueError(f"the tube '{name:.80}' already has two ends")
        if len(self._ends) >= _MOST_ENDS:
            raise ValueError(f"at most {_MOST_ENDS} ends of tubes can be open: close some")
        self._last_handle += 1
        self._ends[self._last_handle] = _End((kind, name), deque(maxlen=min(max(1, length), _LONGEST)))
        return self._last_handle

    def close(self, handle: int) -> None:
        """Close an end. Raises ValueError for an unknown handle."""
        self.waiting(handle)
        del self._ends[handle]

    def __iter__(self) -> Iterator[int]:
        return iter(self._ends)

    def waiting(self, handle: int) -> deque[Any]:
        """Return the packets that wait at an end. Raises ValueError for an unknown handle."""
        if handle not in self._ends:
            raise ValueError(f"there is no tube with the handle {handle}")
        return self._ends[handle].waiting

    def waiting_at_other(self, handle: int) -> deque[Any] | None:
        """Return the packets that wait at the other end, None if that is not open. Raises ValueError."""
        self.waiting(handle)
        tube = self._ends[handle].tube
        return next((end.waiting for number, end in self._ends.items() if end.tube == tube and number != handle), None)

    def clear(self) -> None:
        self._ends.clear()
        self._last_handle = 0

    def save_state(self) -> Restore:
        return saved(self, "_ends", "_last_handle", deep=True)


class TubeFunctions:
    """Tubes: two-way connections between two scripts, which sensors of V-REP 3.x use."""

    def __init__(self, tubes: Tubes):
        self._tubes = tubes

    @sim("345")
    def tubeOpen(self, header: Number, name: Name, size: Number = 1, *_unused: Any) -> int:
        """Open an end of a tube, at which up to `size` packets wait; return its handle.

        It is connected when another call opens the other end with the same header and name.
        """
        kind, length = map(int, numbers((header, size), 2))
        if not isinstance(name, str):
            raise WrongValue("the name of a tube must be a string")
        return self._tubes.open(kind, name, length)

    @sim("345")
    def tubeClose(self, handle: Handle) -> None:
        """Close an end of a tube."""
        self._tubes.close(handle)

    @sim("345")
    def tubeStatus(self, handle: Handle) -> tuple[int, int, int]:
        """Return 1 if both ends are open, otherwise 0, and how many packets wait at this end and at the other."""
        here, other = self._tubes.waiting(handle), self._tubes.waiting_at_other(handle)
        return int(other is not None), len(here), len(other or ())

    @sim("345")
    def tubeWrite(self, handle: Handle, data: Text) -> int:
        """Send a string to the other end, which drops its oldest if it is full; return 1, or 0 if it is not open."""
        if not isinstance(data, (str, bytes)):
            raise WrongValue("a string is expected")
        refuse_if_too_large(data)
        other = self._tubes.waiting_at_other(handle)
        if other is not None:
            other.append(data)
        return int(other is not None)

    @sim("345")
    def tubeRead(self, handle: Handle, _wait: Any = False) -> Any:
        """Return and remove the oldest string that waits at this end; nothing if there is none."""
        waiting = self._tubes.waiting(handle)
        return waiting.popleft() if waiting else None


@dataclass(frozen=True)
class Broadcast:
    """Data from a script to another, or to sim.handle_all, _tree or _chain, which can be received until a time in s."""

    sender: int
    target: int
    header: int
    name: str
    data: Text
    antenna: int
    radius: float  # m
    angles: tuple[float, float]  # rad, vertical and horizontal
    until: float
    received_by: set[int] = field(default_factory=set)


class Broadcasts:
    """The broadcasts that can still be received."""

    def __init__(self) -> None:
        self.sent: list[Broadcast] = []

    def clear(self) -> None:
        self.sent = []

    def send(self, broadcast: Broadcast) -> None:
        """Send data. Raises ValueError if too many are waiting."""
        size = sum(len(item.data) for item in (broadcast, *self.sent))
        if len(self.sent) >= _MOST_BROADCASTS or size > MOST_BYTES:
            limits = f"{_MOST_BROADCASTS} messages or {MOST_BYTES} bytes"
            raise ValueError(f"more than {limits} are waiting: let them persist for a shorter time")
        self.sent.append(broadcast)

    def waiting(self, time: float) -> list[Broadcast]:
        """Return the broadcasts that can be received at a simulated time, oldest first; remove the others."""
        self.sent = [broadcast for broadcast in self.sent if time <= broadcast.until]
        return self.sent

    def save_state(self) -> Restore:
        return saved(self, "sent", deep=True)
