"""What a sensor is: how often it looks, what it last measured, a snapshot of its own; what carries it.

A `Sensor` has a period, a latest sample, and can be brought back. An `Instrument` is one that measures numbers: after
every sub-step it is told how many there have been (`look`); when its period is over it takes a sample, which becomes a
`Reading` after the latency. A camera is the other sort: it looks when somebody asks, after whole steps.
An instrument says itself which messages its readings make (`outputs`), as neutral data: who publishes them knows none
of the kinds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from drone_sim.config.place import DatumParameters
from drone_sim.config.types import Checked
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import State
from drone_sim.sensors.noise import Noise, NoiseParameters
from drone_sim.sensors.parameters import SensorParameters

Fields = dict[str, Any]  # of a ROS message, by name; nested mappings and lists for its own messages


class Hit(NamedTuple):
    """What a ray meets first: how far away (m), which object, and its surface's unit normal in the world."""

    distance: float
    what: str  # name of the object; '' for one that has none
    normal: Vector


class Contact(NamedTuple):
    """One point at which the vehicle touched something in the last sub-step; all vectors in the world."""

    what: str  # name of what it touched: an object of the scene, the floor, another vehicle
    point: Vector  # m
    normal: Vector  # unit, of the other's surface, towards the vehicle
    force: Vector  # N, on the vehicle, friction included


class Carrier(Protocol):
    """The vehicle, as its sensors see it: all of it as of the last sub-step."""

    @property
    def state(self) -> State:
        """Pose and velocity of the root link."""

    @property
    def jumps(self) -> int:
        """How often it has been put somewhere else, at rest; never counts down."""

    @property
    def mass(self) -> float:
        """Mass in kg."""

    @property
    def gravity(self) -> float:
        """Acceleration of free fall along z in m/s², negative downwards."""

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N."""

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""

    @property
    def datum(self) -> DatumParameters:
        """Where on the Earth the world's origin is."""

    @property
    def magnetic_field(self) -> Vector:
        """The Earth's field in the world, in T."""

    def ray(self, start: Vector, end: Vector) -> Hit | None:
        """Return what a ray (m, world) meets first that is not the vehicle itself; None for nothing."""

    def contacts(self) -> list[Contact]:
        """Return what the vehicle touched in the last sub-step."""


@dataclass(frozen=True)
class Fitting:
    """How one sensor is fitted to a vehicle."""

    name: str  # of vehicle and sensor, such as drone/imu: no other has it, and its noise depends on it
    carrier: Carrier
    pose: Callable[[], Matrix]  # world from the sensor's frame
    sub_step: float  # s


class Reading(NamedTuple):
    """A sample as it was measured, noise included."""

    at: int  # (sub-)steps since the start of the run when it was measured
    value: Any  # what the sensor's kind makes of it


class Output(NamedTuple):
    """A topic on which every reading becomes a message."""

    suffix: str  # after the sensor's own topic: '' or '/data'
    kind: str  # of message, such as sensor_msgs/Imu
    fields: Callable[[Any, Mapping[str, Any]], Fields]  # of a reading's value, with this std_msgs/Header


class Sensor(ABC):
    """Something that samples when its period is over: instruments count sub-steps, cameras steps."""

    def __init__(self, period: int):
        """Take the number of (sub-)steps between two samples."""
        self.period = period
        self.latest: Reading | None = None  # None before the first

    def is_due(self, count: int) -> bool:
        """Tell whether a sample is due after `count` (sub-)steps since the start of the run."""
        return count % self.period == 0

    @abstractmethod
    def reset(self) -> None:
        """Begin anew, as at the start of a run."""

    @abstractmethod
    def remember(self) -> Callable[[], None]:
        """Return a function that brings back all that the sensor is now; it may be called again and again."""


class Instrument(Sensor):
    """A sensor that measures numbers. Its noise is its own: of its seed, its vehicle's name and its own name.

    `readings` are those that came since whoever uses them last cleared the list.
    """

    outputs: tuple[Output, ...]

    def __init__(self, parameters: SensorParameters, fitting: Fitting):
        """Take what it is and where; `reset` comes before the first look."""
        super().__init__(parameters.period(fitting.sub_step))
        self.parameters = parameters
        self.fitting = fitting
        self.carrier = fitting.carrier
        self.interval = self.period * fitting.sub_step  # s
        self.readings: list[Reading] = []
        self._delay = round(parameters.latency / fitting.sub_step)
        self._queue: deque[tuple[int, Reading]] = deque()  # samples, and the count at which each is there
        self._noises: list[Noise] = []
        self._random = np.random.default_rng()

    def make_noise(self, parameters: NoiseParameters, axes: int) -> Noise:
        """Return the noise of one of its measurements; what has been made so starts and goes back with the sensor."""
        noise = Noise(parameters, axes, self.interval)
        self._noises.append(noise)
        return noise

    def change_noise(self, parameters: SensorParameters) -> None:
        """Measure with the noise of these parameters, which are its own in all else."""
        changed = dict(_noises(parameters))
        paths = {id(one): path for path, one in _noises(self.parameters)}
        for noise in self._noises:
            noise.change(changed[paths[id(noise.parameters)]])
        self.parameters = parameters

    @property
    def frame(self) -> str:
        """Name of the frame that its messages are in."""
        return self.parameters.frame

    @abstractmethod
    def sample(self) -> Any:
        """Return the value of a sample taken now, noise included."""

    def look(self, count: int) -> None:
        """Take part in a sub-step, `count` of which there have been since the start of the run."""
        if self.is_due(count):
            self._queue.append((count + self._delay, Reading(count, self.sample())))
        while self._queue and self._queue[0][0] <= count:
            self.latest = self._queue.popleft()[1]
            self.readings.append(self.latest)

    def reset(self) -> None:
        """Begin anew: the same noise in every run."""
        self.latest = None
        self.readings.clear()
        self._queue.clear()
        words = [self.parameters.seed, *self.fitting.name.encode()]
        self._random = np.random.default_rng(np.random.SeedSequence(words))
        for noise in self._noises:
            noise.restart(self._random)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back noise, latency and readings."""
        latest, readings, queue = self.latest, list(self.readings), list(self._queue)
        random = self._random.bit_generator.state
        noises = [noise.remember() for noise in self._noises]
        parameters = self.parameters

        def recall() -> None:
            self.parameters = parameters
            self.latest = latest
            self.readings[:] = readings
            self._queue = deque(queue)
            self._random.bit_generator.state = random
            for noise in noises:
                noise()

        return recall

    def header(self, reading: Reading) -> dict[str, Any]:
        """Return the header of a reading's message: when it was measured (s of simulated time), and in which frame."""
        return {"stamp": reading.at * self.fitting.sub_step, "frame_id": self.frame}

    def read(self) -> Fields | None:
        """Return the last reading as the fields of its first message; None before there is one."""
        if self.latest is None:
            return None
        return self.outputs[0].fields(self.latest.value, self.header(self.latest))


def _noises(model: Checked, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], NoiseParameters]]:
    """Yield the noises in a sensor's parameters, by the keys that lead to them."""
    for key, value in model:
        if isinstance(value, NoiseParameters):
            yield (*above, key), value
        elif isinstance(value, Checked):
            yield from _noises(value, (*above, key))


def xyz(vector: Sequence[float]) -> dict[str, float]:
    """Return three numbers as the fields of geometry_msgs/Vector3 and Point."""
    x, y, z = vector
    return {"x": x, "y": y, "z": z}


def diagonal(first: float, second: float, third: float) -> list[float]:
    """Return a covariance of three independent axes, 9 numbers row by row."""
    return [first, 0.0, 0.0, 0.0, second, 0.0, 0.0, 0.0, third]
