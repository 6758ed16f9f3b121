"""How sensors fail: they fall silent, or say the same thing over and over."""

from __future__ import annotations

from typing import Literal

from drone_sim.sensors.sensor import Instrument, Reading

Failure = Literal["ok", "silent", "frozen"]


class Failing:
    """Looks in place of an instrument, which goes on measuring: once sound again, its noise is what it would be."""

    def __init__(self, instrument: Instrument, failure: Failure):
        """Begin to fail; what is frozen before its first reading freezes with that."""
        self._instrument = instrument
        self._frozen = failure == "frozen"
        self._last = instrument.latest

    def look(self, count: int) -> None:
        """Take part in a sub-step; of new readings none is left, or each is the last one once more."""
        own = self._instrument
        known = len(own.readings)
        own.look(count)
        new = own.readings[known:]
        if not new:
            return
        del own.readings[known:]
        if self._frozen:
            value = (self._last or new[0]).value
            own.readings += [Reading(one.at, value) for one in new]
            self._last = own.readings[-1]
        own.latest = self._last
