"""`sim`: data that scripts send to each other without wires (3.x): who is in reach of an antenna may receive them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.scripting.api.broadcasts import Broadcast
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.registry import Attachment
from drone_sim.scripting.api.types import Handle, Name, Number, Text, WrongValue, numbers

_SELF, _WORLD, _ALL, _TREE, _CHAIN = (CONSTANTS[f"handle_{one}"] for one in ("self", "default", "all", "tree", "chain"))
_STEPS = 1.5  # that data can be received, where nothing else is said
_REACH = (100.0, math.pi, math.tau, 0.0)  # m, rad, rad, s
_ROUND = 0.99  # of a half or a whole turn, from which on it is one


class Wireless(Functions):
    """Data that scripts send to each other without wires (3.x)."""

    @sim("345")
    def sendData(
        self, target: Handle, header: int, name: Name, data: Text, antenna: Handle | None = None, *reach: Number | None
    ) -> int:
        """Send a string to sim.handle_all, _tree (below this script), _chain (above it) or a script; return 1.

        A receiver must be in reach: at most `actionRadius` (100 m) from the object `antenna` (sim.handle_default: the
        world's origin), within `emissionAngle1` (pi) up and down and `emissionAngle2` (2 pi) about its z axis. It must
        ask within `persistence` seconds (one and a half steps).
        """
        if not isinstance(name, str) or not isinstance(data, (str, bytes)) or not name or not data:
            raise WrongValue("name and data must be strings that are not empty")
        if target not in (_ALL, _TREE, _CHAIN):
            self._context.scripts[target]
        clock = self._context.clock
        said = itertools.zip_longest(reach[: len(_REACH)], _REACH)
        radius, vertical, level, seconds = numbers([usual if one is None else one for one, usual in said], len(_REACH))
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
        """Return the oldest data that this script has not received, its sender, header and name; nothing if none.

        With a header or a name only those; with an `index` from 0 the one of that number, which then still waits.
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
        for one in self._context.broadcasts.waiting(self._context.clock.time):
            is_wanted = header in (None, -1, one.header) and name in (None, one.name)
            if own.handle == one.sender or own.handle in one.received_by or not is_wanted:
                continue
            place = self._place(one.antenna)
            if place is not None and self._is_for(one) and _reaches(one, frames.transform(frames.invert(place), here)):
                yield one

    @property
    def _own(self) -> Attachment:
        return self._context.scripts.attached_to(self._host.own_script)

    def _antenna(self, handle: int | None) -> int:
        if handle in (None, _SELF):
            return self._objects.handle(self._host.own_script)
        return _WORLD if handle == _WORLD else self._objects.handle_of(self._objects[handle or 0])

    def _place(self, antenna: int) -> Matrix | None:
        """Return where an antenna is, None where it is gone."""
        if antenna == _WORLD:
            return IDENTITY
        return self._objects.matrix(antenna) if antenna in set(self._objects) else None

    def _is_for(self, broadcast: Broadcast) -> bool:
        """Tell whether data are sent to this script."""
        sender = self._context.scripts.get(broadcast.sender)
        if broadcast.target == _ALL or sender is None or broadcast.target not in (_TREE, _CHAIN):
            return broadcast.target in (_ALL, self._own.handle)
        objects = self._objects
        there, here = (objects[objects.handle(one.name)] for one in (sender, self._own))
        return here.is_part_of(there) if broadcast.target == _TREE else there.is_part_of(here)


def _reaches(broadcast: Broadcast, place: frames.Vector) -> bool:
    """Tell whether data reach a place in the antenna's frame."""
    x, y, z = place
    vertical, level = broadcast.angles
    return (
        math.hypot(x, y, z) <= broadcast.radius
        and (vertical >= _ROUND * math.pi or 2 * math.atan2(abs(z), math.hypot(x, y)) < vertical)
        and (level >= _ROUND * math.tau or 2 * abs(math.atan2(y, x)) < level)
    )
