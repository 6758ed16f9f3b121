"""`sim`: wireless data between scripts (3.x), which scripts near an antenna can receive."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.registry import Attachment
from drone_sim.scripting.api.signals import Broadcast
from drone_sim.scripting.api.types import Handle, Name, Number, Text, WrongValue, numbers

_SELF, _WORLD, _ALL, _TREE, _CHAIN = (CONSTANTS[f"handle_{key}"] for key in ("self", "default", "all", "tree", "chain"))
_STEPS = 1.5  # default persistence
_REACH = (100.0, math.pi, math.tau, 0.0)  # defaults: m, rad, rad, s
_ROUND = 0.99  # fraction of a half or full circle that counts as a whole one


class Wireless(Functions):
    """Wireless data between scripts (3.x)."""

    @sim("345")
    def sendData(
        self, target: Handle, header: int, name: Name, data: Text, antenna: Handle | None = None, *reach: Number | None
    ) -> int:
        """Send a string to sim.handle_all, _tree (descendants), _chain (ancestors) or a script; return 1.

        A receiver must be within `actionRadius` (100 m) of the object `antenna` (sim.handle_default: the world's
        origin), and within `emissionAngle1` (pi) vertically and `emissionAngle2` (2 pi) about its z axis. It must call
        receiveData within `persistence` seconds (one and a half steps).
        """
        if not isinstance(name, str) or not isinstance(data, (str, bytes)) or not name or not data:
            raise WrongValue("name and data must be strings that are not empty")
        if target not in (_ALL, _TREE, _CHAIN):
            self._context.scripts[target]
        clock = self._context.clock
        pairs = itertools.zip_longest(reach[: len(_REACH)], _REACH)
        values = [default if value is None else value for value, default in pairs]
        radius, vertical, level, seconds = numbers(values, len(_REACH))
        until = clock.time + (seconds if seconds > 0 else _STEPS * clock.time_step)
        place = self._antenna(antenna)
        self._context.broadcasts.send(
            Broadcast(self._own.handle, int(target), int(header), name, data, place, radius, (vertical, level), until)
        )
        return 1

    @sim("345")
    def receiveData(
        self, header: int | None = None, name: Name | None = None, antenna: Handle | None = None, index: int = -1
    ) -> tuple[Text, int, int, str] | None:
        """Return the oldest data that this script has not received, sender, header and name; nothing if there is none.

        A header or a name selects data. With an `index` from 0, return the data with this number, and do not remove
        them.
        """
        place = self._place(self._antenna(antenna)) or IDENTITY
        found = list(self._in_reach(frames.position(place), header, name))
        number = max(int(index), 0)
        if number >= len(found):
            return None
        if index < 0:
            found[number].received_by.add(self._own.handle)
        return found[number].data, found[number].sender, found[number].header, found[number].name

    def _in_reach(self, here: frames.Vector, header: int | None, name: str | None) -> Iterator[Broadcast]:
        own = self._own
        for sent in self._context.broadcasts.waiting(self._context.clock.time):
            is_selected = header in (None, -1, sent.header) and name in (None, sent.name)
            if own.handle == sent.sender or own.handle in sent.received_by or not is_selected:
                continue
            place = self._place(sent.antenna)
            if (
                place is not None
                and self._is_for(sent)
                and _reaches(sent, frames.transform(frames.invert(place), here))
            ):
                yield sent

    @property
    def _own(self) -> Attachment:
        return self._context.scripts.attached_to(self._host.own_script, self._host.script_type)

    def _antenna(self, handle: int | None) -> int:
        if handle in (None, _SELF):
            return self._objects.handle(self._host.own_script)
        return _WORLD if handle == _WORLD else self._objects.handle_of(self._objects[handle or 0])

    def _place(self, antenna: int) -> Matrix | None:
        """Return the transform of an antenna, None if it does not exist any more."""
        if antenna == _WORLD:
            return IDENTITY
        return self._objects.matrix(antenna) if antenna in set(self._objects) else None

    def _is_for(self, broadcast: Broadcast) -> bool:
        """Return whether data are sent to this script."""
        sender = self._context.scripts.by_handle.get(broadcast.sender)
        if broadcast.target == _ALL or sender is None or broadcast.target not in (_TREE, _CHAIN):
            return broadcast.target in (_ALL, self._own.handle)
        objects = self._objects
        sending, receiving = (objects[objects.handle(script.name)] for script in (sender, self._own))
        return receiving.is_part_of(sending) if broadcast.target == _TREE else sending.is_part_of(receiving)


def _reaches(broadcast: Broadcast, place: frames.Vector) -> bool:
    """Return whether data reach a position in the antenna's frame."""
    x, y, z = place
    vertical, level = broadcast.angles
    return (
        math.hypot(x, y, z) <= broadcast.radius
        and (vertical >= _ROUND * math.pi or 2 * math.atan2(abs(z), math.hypot(x, y)) < vertical)
        and (level >= _ROUND * math.tau or 2 * abs(math.atan2(y, x)) < level)
    )
