"""`sim`: proximity sensors and force sensors of the scene, and a vehicle's instruments.

A proximity sensor of the scene measures when it is read; a range sensor of a vehicle measures at its own rate.
CoppeliaSim's accelerometers, gyroscopes and GPS are models whose scripts compute and send the readings; instead, there
is a function readSensor for all instruments. Cameras are in vision.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.host import Functions
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
        """Return 1, and the force (N) and torque (N m) of the child on a force sensor, in the sensor's frame."""
        found = self._objects[handle]
        if not isinstance(found, _ForceSensor):
            raise WrongValue(f"'{found.name}' is not a force sensor of the scene")
        force, torque = found.read()
        return 1, list(force), list(torque)

    @sim("")
    def readSensor(self, handle: Handle) -> dict[str, Any] | None:
        """Return the last reading of an instrument as the fields of its message; nothing before the first reading.

        The stamp in its `header` is the simulated time in s of the measurement.
        """
        name = self._objects[handle].name
        if name not in self._host.sensors:
            known = ", ".join(self._host.sensors) or "none"
            raise WrongValue(f"'{name}' is not a sensor that measures numbers; known are {known}")
        return self._host.sensors[name].read()


class FoundObject(Protocol):
    """An object detected by a sensor, in the sensor's frame."""

    distance: float  # m
    point: Vector
    name: str
    normal: Vector


@runtime_checkable
class Detector(Protocol):
    """A proximity sensor of the scene."""

    entity: int  # handle of the object or collection that it detects, or EVERYTHING

    def detect(self, wanted: Callable[[str], bool] = ...) -> Any:
        """Return the nearest (FoundObject) of the objects whose names are wanted, or None."""


class ProximitySensors(Functions):
    """Proximity sensors of the scene, and range sensors of vehicles."""

    @sim("345")
    def readProximitySensor(self, handle: Handle) -> _Detection:
        """Return detection state, distance (m), point, object and normal.

        The state is 1, 0 if nothing is within range, or -1 before the first reading of a range sensor. Point (m) and
        unit normal are in the sensor's frame, which looks along z; the object is -1 if it does not exist any more.
        """
        found = self._objects[handle]
        return self._detection(self._detected(found)) if isinstance(found, Detector) else self._last(found.name)

    @sim("345")
    def handleProximitySensor(self, handle: Handle) -> _Detection:
        """Like readProximitySensor; for sim.handle_all and _all_except_explicit, return the nearest detection."""
        if handle not in EVERY_SENSOR:
            return self.readProximitySensor(handle)
        detections = [found for found in map(self._detected, self._all(Detector)) if found is not None]
        return self._detection(min(detections, key=lambda found: found.distance, default=None))

    @sim("345")
    def checkProximitySensor(self, handle: Handle, entity: Handle) -> _Detection:
        """Like readProximitySensor, but only for an object or collection, or for sim.handle_all."""
        sensor = self._objects[handle]
        if not isinstance(sensor, Detector):
            raise WrongValue(f"'{sensor.name}' is not a proximity sensor of the scene: {self._known()}")
        return self._detection(self._detected(sensor, entity))

    @sim("345")
    def checkProximitySensorEx(
        self, handle: Handle, entity: Handle, _mode: int = 0, threshold: Number = 0.0, _maxAngle: Number = 0.0
    ) -> _Detection:
        """Like checkProximitySensor, but only up to a distance (m; 0: no limit)."""
        found = self.checkProximitySensor(handle, entity)
        return found if not threshold or found[1] <= threshold else self._detection(None)

    @sim("345")
    def resetProximitySensor(self, handle: Handle) -> None:
        """Do nothing: a sensor measures when it is read, and stores no reading."""
        if handle not in EVERY_SENSOR:
            self._objects[handle]

    def _detected(self, sensor: Detector, entity: int | None = None) -> FoundObject | None:
        """Return the detected object of an entity; None means the entity that the sensor is set to detect."""
        names = self._names_of(sensor.entity if entity is None else entity)
        found: FoundObject | None = sensor.detect() if names is None else sensor.detect(names.__contains__)
        return found

    def _detection(self, found: FoundObject | None) -> _Detection:
        if found is None:
            return _none(_NOTHING)
        return _DETECTED, found.distance, list(found.point), self._handle(found.name), list(found.normal)

    def _last(self, name: str) -> _Detection:
        """Return the last detection of a vehicle's range sensor."""
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
        ranges = [name for name, sensor in self._host.sensors.items() if hasattr(sensor, "detected")]
        return f"there are: {', '.join([*ranges, *(item.name for item in self._all(Detector))]) or 'none'}"


def _none(state: int) -> _Detection:
    """Return a detection without an object; its lists are new, because the script may change them."""
    return state, 0.0, [0.0, 0.0, 0.0], WORLD, [0.0, 0.0, 0.0]
