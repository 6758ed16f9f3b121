"""`sim`: tubes, two-way pipes between two scripts, which V-REP 3.x's sensors send their readings through."""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from drone_sim.scripting.api.calls import Function, WrongValue, numbers
from drone_sim.scripting.api.script_values import refuse_if_too_large
from drone_sim.scripting.api.types import Handle, Name, Number, Text

_MOST = 1000  # ends of tubes
_LONGEST = 1000  # packets that wait at one end


class _End(NamedTuple):
    tube: tuple[int, str]
    waiting: deque[Any]


class Tubes:
    """The tubes between the scripts of a simulation: each has one header and name, and two ends."""

    def __init__(self) -> None:
        """Start with none."""
        self._ends: dict[int, _End] = {}
        self._last_handle = 0

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back the tubes, and what waits in them."""
        kept, last = copy.deepcopy(self._ends), self._last_handle

        def recall() -> None:
            self._ends, self._last_handle = copy.deepcopy(kept), last

        return recall

    def functions(self) -> dict[str, Function]:
        """Return what a script may call, by name."""
        found = (self.tubeOpen, self.tubeClose, self.tubeStatus, self.tubeWrite, self.tubeRead)
        return {one.__name__: one for one in found}

    def tubeOpen(self, header: Number, name: Name, size: Number = 1, *_unused: Any) -> int:
        """Open one end of a tube, at which up to `size` packets wait; return its handle.

        It is connected once somebody opens the other end, with the same header and name.
        """
        kind, length = (int(one) for one in numbers((header, size), 2))
        if not isinstance(name, str):
            raise WrongValue("the name of a tube is a string")
        if sum(one.tube == (kind, name) for one in self._ends.values()) >= 2:
            raise ValueError(f"the tube '{name:.80}' has two ends already")
        if len(self._ends) >= _MOST:
            raise ValueError(f"{_MOST} ends of tubes are open already: close some")
        self._last_handle += 1
        self._ends[self._last_handle] = _End((kind, name), deque(maxlen=min(max(1, length), _LONGEST)))
        return self._last_handle

    def tubeClose(self, handle: Handle) -> None:
        """Close one end of a tube."""
        self._end(handle)
        del self._ends[handle]

    def tubeStatus(self, handle: Handle) -> tuple[int, int, int]:
        """Return 1 where both ends are open, else 0, and how many packets wait at this end and at the other."""
        end, other = self._end(handle), self._other(handle)
        return int(other is not None), len(end.waiting), len(other.waiting) if other else 0

    def tubeWrite(self, handle: Handle, data: Text) -> int:
        """Send a string to the other end, where the oldest goes if there are too many; return 1, 0 for no other end."""
        if not isinstance(data, (str, bytes)):
            raise WrongValue("a string is expected")
        refuse_if_too_large(data)
        other = self._other(handle)
        if other is not None:
            other.waiting.append(data)
        return int(other is not None)

    def tubeRead(self, handle: Handle, _wait: Any = False) -> Any:
        """Return the oldest string that waits at this end; nothing where none does."""
        waiting = self._end(handle).waiting
        return waiting.popleft() if waiting else None

    def _end(self, handle: int) -> _End:
        if handle not in self._ends:
            raise ValueError(f"no tube has the handle {handle}")
        return self._ends[handle]

    def _other(self, handle: int) -> _End | None:
        tube = self._end(handle).tube
        return next((one for number, one in self._ends.items() if one.tube == tube and number != handle), None)
