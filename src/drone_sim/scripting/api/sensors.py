"""`sim`: what sensors read, cameras aside (those are in vision.py).

CoppeliaSim has a function of its own for proximity sensors; its accelerometers, gyroscopes and GPS are models whose
scripts send what they make up. So there is one name more here, readSensor, for all of them.
"""

from __future__ import annotations

from typing import Any

from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.host import Host, Readable
from drone_sim.scripting.api.types import Handle

_NOT_YET, _NOTHING, _DETECTED = -1, 0, 1  # detection states of CoppeliaSim
_Detection = tuple[int, float, list[float], int, list[float]]


class Sensors:
    """The functions on sensors."""

    def __init__(self, host: Host):
        """Take the drone whose sensors they are."""
        self._objects = host.objects
        self._sensors = host.sensors

    def readProximitySensor(self, handle: Handle) -> _Detection:
        """Return detection state, distance (m), point, object and normal, as of the last reading of a range sensor.

        The state is 1, 0 where nothing is within range, -1 before the first reading. Point (m) and unit normal are in
        the sensor's frame, which looks along z; the object is -1 where it has no name.
        """
        sensor = self._sensor(handle)
        detected = getattr(sensor, "detected", None)
        if detected is None:
            name = self._objects[handle].name
            raise WrongValue(f"'{name}' is no sensor of the kind range")
        found = detected()
        if found is None:
            return _NOTHING if sensor.read() else _NOT_YET, 0.0, [0.0, 0.0, 0.0], WORLD, [0.0, 0.0, 0.0]
        distance, what, normal = found
        met = self._objects.handle(what) if what in self._objects else WORLD
        return _DETECTED, distance, [0.0, 0.0, distance], met, list(normal)

    def readSensor(self, handle: Handle) -> dict[str, Any] | None:
        """Return the last reading of a sensor of any kind, by the names of its message's fields; nothing before it.

        The stamp in its `header` is the simulated time in s at which it was measured.
        """
        return self._sensor(handle).read()

    def _sensor(self, handle: int) -> Readable:
        name = self._objects[handle].name
        if name not in self._sensors:
            known = ", ".join(self._sensors) or "none"
            raise WrongValue(f"'{name}' is no sensor that measures numbers; there are: {known}")
        return self._sensors[name]
