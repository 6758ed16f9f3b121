"""`sim`: what sensors read: proximity sensors and force sensors of the scene, and a vehicle's instruments.

A proximity sensor of the scene measures at the moment when it is read; a range sensor has measured at its own rate.
CoppeliaSim's accelerometers, gyroscopes and GPS are models whose scripts compute and send the readings; so there is one
more function here, readSensor, for all instruments. Cameras are in vision.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_collections import members
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions, Readable
from drone_sim.scripting.api.types import Handle, Number, WrongValue

_NOT_YET, _NOTHING, _DETECTED = -1, 0, 1  # detection states of CoppeliaSim
EVERY_SENSOR = (CONSTANTS["handle_all"], CONSTANTS["handle_all_except_explicit"])
EVERYTHING = CONSTANTS["handle_all"]
_Detection = tuple[int, float, list[float], int, list[float]]


@runtime_checkable
class _ForceSensor(Protocol):
    def hold(self, world: Any, body: int, link: int) -> None: ...

    def read(self) -> tuple[Vector, Vector]: ...


class Sensors(Functions):
    """Force sensors of the scene, and sensors of a vehicle."""

    @sim("345")
    def readForceSensor(self, handle: Handle) -> tuple[int, list[float], list[float]]:
        """Return 1, and the force (N) and torque (N m) of the object below a force sensor on it, in its frame."""
        found = self._objects[handle]
        if not isinstance(found, _ForceSensor):
            raise WrongValue(f"'{found.name}' is not a force sensor of the scene")
        force, torque = found.read()
        return 1, list(force), list(torque)

    @sim("")
    def readSensor(self, handle: Handle) -> dict[str, Any] | None:
        """Return the last reading of any sensor as the fields of its message; nothing before the first reading.

        The stamp in its `header` is the simulated time in s at which it was measured.
        """
        return self._sensor(handle).read()

    def _sensor(self, handle: int) -> Readable:
        name = self._objects[handle].name
        if name not in self._host.sensors:
            known = ", ".join(self._host.sensors) or "none"
            raise WrongValue(f"'{name}' is not a sensor that measures numbers; known are {known}")
        return self._host.sensors[name]


class FoundObject(Protocol):
    """What a sensor has found, in its own frame."""

    distance: float  # m
    point: Vector
    name: str
    normal: Vector


@runtime_checkable
class Detector(Protocol):
    """A proximity sensor of the scene."""

    entity: int  # handle of the object or collection that it looks for, or EVERYTHING

    def detect(self, wanted: Callable[[str], bool] = ...) -> Any:
        """Return what is nearest (FoundObject) of the objects whose names are wanted, or None."""


class ProximitySensors(Functions):
    """Proximity sensors: those of the scene, and a vehicle's range sensors."""

    @sim("345")
    def readProximitySensor(self, handle: Handle) -> _Detection:
        """Return detection state, distance (m), point, object and normal.

        The state is 1, 0 where nothing is within range, -1 before a range sensor's first reading. Point (m) and unit
        normal are in the sensor's frame, which looks along z; the object is -1 where it has gone.
        """
        found = self._objects[handle]
        return self._seen(self._detected(found)) if isinstance(found, Detector) else self._last(found.name)

    @sim("345")
    def handleProximitySensor(self, handle: Handle) -> _Detection:
        """Do what readProximitySensor does; for sim.handle_all, and _all_except_explicit, return the nearest of all."""
        if handle not in EVERY_SENSOR:
            return self.readProximitySensor(handle)
        every = [self._objects[one] for one in self._objects]
        seen = [self._detected(one) for one in every if isinstance(one, Detector)]
        return self._seen(min((one for one in seen if one is not None), key=lambda one: one.distance, default=None))

    @sim("345")
    def checkProximitySensor(self, handle: Handle, entity: Handle) -> _Detection:
        """Do what readProximitySensor does, but only for one object or collection, or for sim.handle_all."""
        sensor = self._objects[handle]
        if not isinstance(sensor, Detector):
            raise WrongValue(f"'{sensor.name}' is not a proximity sensor of the scene: {self._known()}")
        return self._seen(self._detected(sensor, entity))

    @sim("345")
    def checkProximitySensorEx(
        self, handle: Handle, entity: Handle, _mode: int = 0, threshold: Number = 0.0, _maxAngle: Number = 0.0
    ) -> _Detection:
        """Do what checkProximitySensor does, but only up to a distance (m); 0 is no limit."""
        found = self.checkProximitySensor(handle, entity)
        return found if not threshold or found[1] <= threshold else self._seen(None)

    @sim("345")
    def resetProximitySensor(self, handle: Handle) -> None:
        """Do nothing: a sensor measures when it is read, and keeps no reading."""
        if handle not in EVERY_SENSOR:
            self._objects[handle]

    def _detected(self, sensor: Detector, entity: int | None = None) -> FoundObject | None:
        """Return what a sensor detects of an entity; if none is given, of the one that the sensor is set to detect."""
        of = sensor.entity if entity is None else entity
        if of == EVERYTHING:
            found: FoundObject | None = sensor.detect()
            return found
        detectable = members(of, self._objects, self._context.collections)
        names = {name for one in detectable for name in self._objects[one].names}
        found = sensor.detect(names.__contains__)
        return found

    def _seen(self, found: FoundObject | None) -> _Detection:
        if found is None:
            return _none(_NOTHING)
        return _DETECTED, found.distance, list(found.point), self._handle(found.name), list(found.normal)

    def _last(self, name: str) -> _Detection:
        """Return what a vehicle's range sensor has read."""
        sensor = self._host.sensors.get(name)
        detected = getattr(sensor, "detected", None)
        if sensor is None or detected is None:
            raise WrongValue(f"'{name}' is neither a range sensor nor a proximity sensor: {self._known()}")
        found = detected()
        if found is None:
            return _none(_NOTHING if sensor.read() else _NOT_YET)
        distance, name, normal = found
        return _DETECTED, distance, [0.0, 0.0, distance], self._handle(name), list(normal)

    def _handle(self, name: str) -> int:
        return self._objects.handle(name) if name in self._objects else WORLD

    def _known(self) -> str:
        ranges = [name for name, one in self._host.sensors.items() if hasattr(one, "detected")]
        every = [self._objects[one] for one in self._objects]
        return f"there are: {', '.join([*ranges, *(one.name for one in every if isinstance(one, Detector))]) or 'none'}"


def _none(state: int) -> _Detection:
    """Return what is read where nothing is detected; the lists are the script's own."""
    return state, 0.0, [0.0, 0.0, 0.0], WORLD, [0.0, 0.0, 0.0]
