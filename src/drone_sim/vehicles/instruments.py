"""The sensors of one vehicle that measure numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.saved_state import Restore, in_turn
from drone_sim.sensors.sensor import Failing, Failure, Fitting, Instrument, SensorParameters
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE

_NOWHERE = 1e9  # m, m/s and rad/s, summed: there is nothing to measure, and the step ends the flight


class Instruments:
    """The instruments of a vehicle: made once, reset with every run."""

    def __init__(self, vehicle: VehicleParameters, suffix: str, body: Body, context: SimulationContext):
        """Make them for a body; they hang on objects whose names have the suffix."""
        self.by_name: dict[str, Instrument] = {}
        self.by_object: dict[str, Instrument] = {}  # by the name that scripts find
        self.fixed_frames: dict[str, Matrix] = {}  # root from those that the URDF has not, on the root
        self.moving_frames: dict[str, Callable[[], Matrix]] = {}  # world from those that hang on something else
        for name, one in vehicle.sensors.items():
            seen_as = f"{one.object or name}{suffix}"
            pose = partial(_pose, context, one, seen_as)
            made = one.make(Fitting(f"{vehicle.name}/{name}", body, pose, context.sub_step))
            self.by_name[name] = self.by_object[seen_as] = made
            parent, matrix = one.placed(body.rigid.links)
            if parent not in ("", DRONE):
                self.moving_frames[one.frame] = pose
            elif one.frame not in body.rigid.links:
                self.fixed_frames[one.frame] = matrix
        self._body = body
        self._all = tuple(self.by_name.values())
        self._looking: tuple[Instrument | Failing, ...] = self._all

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self._all)

    def reset(self) -> None:
        """Begin anew, with the vehicle at its starting place and its objects in the tree."""
        for one in self._all:
            one.reset()

    def clear(self) -> None:
        """Forget the readings of the last step."""
        for one in self._all:
            one.readings.clear()

    def look(self, count: int) -> None:
        """Let them take part in a sub-step, `count` of which there have been since the start of the run."""
        place, _, linear, angular = self._body.state
        if not -_NOWHERE < sum(place) + sum(linear) + sum(angular) < _NOWHERE:  # nor a NaN, with which nothing is known
            return
        for one in self._looking:
            one.look(count)

    def fail(self, failures: Mapping[str, Failure]) -> None:
        """Let those fail that are named, and no others."""
        sound: Failure = "ok"
        named = [(one, failures.get(name, sound)) for name, one in self.by_name.items()]
        self._looking = tuple(one if how == sound else Failing(one, how) for one, how in named)

    def save_state(self) -> Restore:
        """Return a function that brings them back, once the body is where it was."""
        return in_turn(*(one.save_state() for one in self._all))


def _pose(context: SimulationContext, parameters: SensorParameters, name: str) -> Matrix:
    """Return the world from a sensor's frame: a script may have moved the object."""
    objects = context.objects
    return parameters.sensor_at(objects.matrix(objects.handle(name)))
