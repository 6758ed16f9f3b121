"""`sim`: what a vehicle's instruments read; cameras are in vision.py, proximity sensors in proximity.py.

CoppeliaSim has a function of its own for proximity sensors; its accelerometers, gyroscopes and GPS are models whose
scripts send what they make up. So there is one name more here, readSensor, for all of them.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from drone_sim.mechanics.frames import Vector
from drone_sim.scripting.api.calls import WrongValue
from drone_sim.scripting.api.host import Host, Readable
from drone_sim.scripting.api.types import Handle


@runtime_checkable
class _ForceSensor(Protocol):
    def hold(self, world: Any, body: int, link: int) -> None: ...

    def read(self) -> tuple[Vector, Vector]: ...


class Sensors:
    """The functions on sensors."""

    def __init__(self, host: Host):
        """Take the drone whose sensors they are."""
        self._objects = host.objects
        self._sensors = host.sensors

    def readForceSensor(self, handle: Handle) -> tuple[int, list[float], list[float]]:
        """Return 1, and force (N) and torque (N m) by which what hangs on a force sensor acts on it, in its frame."""
        found = self._objects[handle]
        if not isinstance(found, _ForceSensor):
            raise WrongValue(f"'{found.name}' is not a force sensor of the scene")
        force, torque = found.read()
        return 1, list(force), list(torque)

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
