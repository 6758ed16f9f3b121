"""The sensors of one vehicle, except its cameras."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore, in_turn
from drone_sim.sensors.sensor import Failing, Failure, Instrument, Mounting, SensorParameters
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE

_DIVERGED = 1e9  # sum of m, m/s and rad/s beyond which nothing is measured; the end of the step reports it


class Instruments:
    """The instruments of a vehicle: created once, reset at the start of every run."""

    def __init__(self, vehicle: VehicleParameters, suffix: str, body: Body, context: SimulationContext):
        """Create the instruments of a body; `suffix` is appended to the names of their objects."""
        self.by_name: dict[str, Instrument] = {}
        self.by_object: dict[str, Instrument] = {}  # by the object name that scripts use
        self.fixed_frames: dict[str, Matrix] = {}  # root from frame, for sensors on the root that are no URDF link
        self.moving_frames: dict[str, Callable[[], Matrix]] = {}  # world from sensor frame, for other sensors
        for name, sensor in vehicle.sensors.items():
            object_name = f"{sensor.object or name}{suffix}"
            pose = _pose(context.objects, sensor, object_name)
            instrument = sensor.make(Mounting(f"{vehicle.name}/{name}", body, pose, context.sub_step))
            self.by_name[name] = self.by_object[object_name] = instrument
            parent, matrix = sensor.placed(body.rigid.links)
            if parent not in ("", DRONE):
                self.moving_frames[sensor.frame] = pose
            elif sensor.frame not in body.rigid.links:
                self.fixed_frames[sensor.frame] = matrix
        self._body = body
        self._all = tuple(self.by_name.values())
        self._working: tuple[Instrument | Failing, ...] = self._all

    def __bool__(self) -> bool:
        return bool(self._all)

    def reset(self) -> None:
        """Reset all instruments; the vehicle must be at its start pose and its objects in the tree."""
        for instrument in self._all:
            instrument.reset()

    def clear(self) -> None:
        """Forget the readings of the last step."""
        for instrument in self._all:
            instrument.readings.clear()

    def look(self, count: int) -> None:
        """Update the working instruments after sub-step number `count` of the run."""
        (x, y, z), _, (vx, vy, vz), (wx, wy, wz) = self._body.state
        if not -_DIVERGED < x + y + z + vx + vy + vz + wx + wy + wz < _DIVERGED:  # a NaN also makes this true
            return
        for instrument in self._working:
            instrument.look(count)

    def fail(self, failures: Mapping[str, Failure]) -> None:
        """Apply the failures by instrument name; all other instruments work."""
        working: Failure = "ok"
        modes = [(instrument, failures.get(name, working)) for name, instrument in self.by_name.items()]
        self._working = tuple(item if mode == working else Failing(item, mode) for item, mode in modes)

    def save_state(self) -> Restore:
        """Return a function that restores the instruments; restore the body before."""
        return in_turn(*(instrument.save_state() for instrument in self._all))


def _pose(objects: ObjectTree, parameters: SensorParameters, name: str) -> Callable[[], Matrix]:
    """Return a function that returns world from a sensor's frame, by its object, which a script may have moved."""
    if parameters.from_object is IDENTITY:  # the usual case; called in every sub-step
        return lambda: objects.named(name).matrix()
    return lambda: parameters.sensor_at(objects.named(name).matrix())
