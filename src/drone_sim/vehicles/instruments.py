"""The sensors of one vehicle that measure numbers, and the vehicle as they see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from drone_sim.config.place import DatumParameters
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import State
from drone_sim.sensors.failing import Failing, Failure
from drone_sim.sensors.parameters import SensorParameters
from drone_sim.sensors.sensor import Carrier, Contact, Fitting, Hit, Instrument
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.quadricopter_objects import DRONE
from drone_sim.vehicles.shared import Shared

_NOBODY = ("", "")
_NOWHERE = 1e9  # m, m/s and rad/s, summed: there is nothing to measure, and the step ends the flight


class Carrying:
    """A vehicle's body in its world, as sensors see it (sensors.sensor.Carrier)."""

    def __init__(self, body: Body, thrusts: Callable[[], Sequence[float]], shared: Shared):
        """Take the body, what its propellers' thrusts are (N), and the world around it."""
        self._body = body
        self._thrusts = thrusts
        self._world, self._names = shared.world, shared.names
        self.mass, self.gravity = body.mass, shared.gravity
        self.datum: DatumParameters = shared.datum
        self.magnetic_field: Vector = shared.magnetic_field

    @property
    def state(self) -> State:
        """Pose and velocity of the root link."""
        return self._body.state

    @property
    def jumps(self) -> int:
        """How often it has been put somewhere else, at rest."""
        return self._body.jumps

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""
        return self._body.wind

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N."""
        return self._thrusts()

    def ray(self, start: Vector, end: Vector) -> Hit | None:
        """Return what a ray (m, world) meets first that is not the vehicle itself; None for nothing."""
        hit = self._world.ray(start, end, ignoring=self._body.number)
        return None if hit is None else Hit(hit.distance, self._names.get(hit.body, _NOBODY)[1], hit.normal)

    def contacts(self) -> list[Contact]:
        """Return what the vehicle touched in the last sub-step."""
        touched = self._world.contacts(self._body.number)
        return [Contact(self._names.get(one.body, _NOBODY)[0], one.point, one.normal, one.force) for one in touched]


class Instruments:
    """The instruments of a vehicle: made once, reset with every run."""

    def __init__(self, vehicle: VehicleParameters, suffix: str, body: Body, carrying: Carrier, shared: Shared):
        """Make them; they hang on objects whose names have the suffix."""
        self.by_name: dict[str, Instrument] = {}
        self.by_object: dict[str, Instrument] = {}  # by the name that scripts find
        self.fixed_frames: dict[str, Matrix] = {}  # root from those that the URDF has not, on the root
        self.moving_frames: dict[str, Callable[[], Matrix]] = {}  # world from those that hang on something else
        for name, one in vehicle.sensors.items():
            seen_as = f"{one.object or name}{suffix}"
            pose = partial(_pose, shared, one, seen_as)
            made = one.make(Fitting(f"{vehicle.name}/{name}", carrying, pose, shared.sub_step))
            self.by_name[name] = self.by_object[seen_as] = made
            parent, matrix = one.placed(body.rigid.links)
            if parent not in ("", DRONE):
                self.moving_frames[one.frame] = pose
            elif one.frame not in body.rigid.links:
                self.fixed_frames[one.frame] = matrix
        self.carrier = carrying
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

    def remember(self) -> Callable[[], None]:
        """Return a function that brings them back, once the body is where it was."""
        recalls = [one.remember() for one in self._all]

        def recall() -> None:
            for one in recalls:
                one()

        return recall


def _pose(shared: Shared, parameters: SensorParameters, name: str) -> Matrix:
    """Return the world from a sensor's frame: a script may have moved the object."""
    objects = shared.objects
    return parameters.sensor_at(objects.matrix(objects.handle(name)))
