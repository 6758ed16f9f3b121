"""What a sensor is: how often it looks, what it last measured, a snapshot of its own; what carries it.

A `Sensor` has a period, a latest sample, and can be brought back. An `Instrument` is one that measures numbers: after
every sub-step it is told how many there have been (`look`); when its period is over it takes a sample, which becomes a
`Reading` after the latency. A camera is the other sort: it looks when somebody asks, after whole steps.
An instrument says itself which messages its readings make (`outputs`), as neutral data: who publishes them knows none
of the kinds.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from pydantic import Field

from drone_sim.config.types import (
    TOPIC,
    Angles,
    Checked,
    DatumParameters,
    Finite,
    Label,
    Name,
    ParameterError,
    Point,
    Unit,
    Within,
)
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector, from_rpy, invert, multiply
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.state import State
from drone_sim.sensors.noise import Noise, NoiseParameters

# An optical frame (z forward, x right, y down) in a frame with x forward, y left, z up: REP-103.
_OPTICAL = from_rpy((0.0, 0.0, 0.0), (-math.pi / 2, 0.0, -math.pi / 2))


class MountParameters(Checked):
    """A place in the frame of an object ('' is the vehicle's root): metres; rad, roll, pitch, yaw.

    Cameras look, and rays go, along its +x.
    """

    parent: Label = ""
    position: Point
    rpy: Angles

    @property
    def frame(self) -> Matrix:
        """Parent from the mounted frame: x forward, y left, z up."""
        return from_rpy(self.position, self.rpy)

    @property
    def optical(self) -> Matrix:
        """Parent from the optical frame of a camera that is mounted so: z forward, x right, y down."""
        return multiply(self.frame, _OPTICAL)


Topic = Annotated[str, Field(pattern=TOPIC, max_length=128)]


class SensorParameters(Checked):
    """When a sensor samples, where it sits, and what it is called; cameras have parameters of their own."""

    kind: str  # each kind names its own
    rate: Annotated[Finite, Within(1e-3, 1e5), Unit("Hz")]  # of simulated time; sub_step divides its period
    topic: Topic  # in the vehicle's namespace
    frame: Name  # of its messages
    object: Name | None = None  # its name among the objects that a script finds; the sensor's own if left out
    mount: MountParameters | None = None
    latency: Annotated[Finite, Within(0, 60), Unit("s")] = 0.0  # whole sub-steps, from measuring to reading
    seed: Annotated[int, Within(0, 2**63 - 1)] = 0

    suffixes: ClassVar[tuple[str, ...]] = ("",)  # of the topics that it publishes, after `topic`
    default_mount: ClassVar[Matrix] = IDENTITY  # the root from the sensor's frame, where nothing says anything else
    from_object: ClassVar[Matrix] = IDENTITY  # the sensor's frame from that of the object that scripts find

    def make(self, fitting: Fitting) -> Instrument:
        """Return the instrument; `reset` comes before its first look."""
        raise NotImplementedError

    def period(self, sub_step: float) -> int:
        """Return the sub-steps (of `sub_step` seconds) between two samples."""
        return max(1, round(1 / (self.rate * sub_step)))

    def check(self, sub_step: float) -> None:
        """Raise ParameterError for a period or a latency that is no whole multiple of `sub_step` (s)."""
        steps = self.period(sub_step)
        if abs(steps * sub_step * self.rate - 1) > 1e-4:
            raise ParameterError(
                f"its period must be a whole multiple of sub_step = {sub_step:g} s; "
                f"{1 / (steps * sub_step):.6g} Hz is near",
                ("rate",),
                f"{self.rate:g}",
            )
        if abs(round(self.latency / sub_step) * sub_step - self.latency) > 1e-6 * sub_step:
            raise ParameterError(
                f"must be a whole multiple of sub_step = {sub_step:g} s", ("latency",), f"{self.latency:g}"
            )

    def topics(self) -> Iterator[tuple[str, str]]:
        """Yield what it publishes, and what each topic is."""
        for suffix in self.suffixes:
            yield f"{self.topic}{suffix}", suffix[1:] or self.kind

    def placed(self, links: Mapping[str, Matrix]) -> tuple[str, Matrix]:
        """Return the object that it hangs on ('' is the vehicle's root), and that from the sensor's frame.

        It sits where `mount` says, or at the link of the URDF (given as root from link) that is named like its frame.
        """
        if self.mount is not None:
            return self.mount.parent, self.mount.frame
        return "", links.get(self.frame, self.default_mount)

    def sensor_at(self, world_from_object: Matrix) -> Matrix:
        """Return the world from the sensor's frame, given the object's pose."""
        if self.from_object is IDENTITY:  # most often, and a fast sensor asks in every sub-step
            return world_from_object
        return multiply(world_from_object, invert(self.from_object))


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

    state: State  # of the root link
    jumps: int  # how often it has been put somewhere else, at rest; never counts down
    mass: float  # kg
    gravity: float  # acceleration of free fall along z in m/s², negative downwards
    datum: DatumParameters  # where on the Earth the world's origin is
    magnetic_field: Vector  # the Earth's in the world, in T

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N."""

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""

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
    def save_state(self) -> Restore:
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

    def save_state(self) -> Restore:
        """Return a function that brings back noise, latency and readings."""
        own = saved(self, "parameters", "latest", "readings", "_queue")
        return in_turn(own, saved(self._random.bit_generator, "state"), *(one.save_state() for one in self._noises))

    def header(self, reading: Reading) -> dict[str, Any]:
        """Return the header of a reading's message: when it was measured (s of simulated time), and in which frame."""
        return {"stamp": reading.at * self.fitting.sub_step, "frame_id": self.parameters.frame}

    def read(self) -> Fields | None:
        """Return the last reading as the fields of its first message; None before there is one."""
        if self.latest is None:
            return None
        return self.outputs[0].fields(self.latest.value, self.header(self.latest))


# How sensors fail: they fall silent, or say the same thing over and over.
Failure = Literal["ok", "silent", "frozen"]


class Failing:
    """Takes the place of a failing instrument, which goes on measuring: the fault does not change its later noise."""

    def __init__(self, instrument: Instrument, failure: Failure):
        """Begin to fail; what is frozen before its first reading freezes with that."""
        self._instrument = instrument
        self._frozen = failure == "frozen"
        self._last = instrument.latest

    def look(self, count: int) -> None:
        """Take part in a sub-step; new readings are dropped, or each has the frozen value instead."""
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
