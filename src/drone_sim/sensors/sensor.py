"""Base classes of sensors, and the interface of the vehicle that carries them.

A `Sensor` has a period, a latest sample and a snapshot. An `Instrument` measures numbers: `look` is called after every
sub-step; at the end of each period it takes a sample, which becomes a `Reading` after the latency. A camera is the
other kind: it renders on request, after whole steps.
An instrument describes the messages of its readings in `outputs`, as plain data, so that their publisher needs no code
for each kind.
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

# Body frame (x forward, y left, z up) from optical frame (z forward, x right, y down): REP 103.
_OPTICAL = from_rpy((0.0, 0.0, 0.0), (-math.pi / 2, 0.0, -math.pi / 2))


class MountParameters(Checked):
    """A pose in the frame of an object ('' is the vehicle's root): position in m; roll, pitch, yaw in rad.

    Cameras look, and rays point, along its +x.
    """

    parent: Label = ""
    position: Point
    rpy: Angles

    @property
    def frame(self) -> Matrix:
        """Transform parent-from-mount; the mount has x forward, y left, z up."""
        return from_rpy(self.position, self.rpy)

    @property
    def optical(self) -> Matrix:
        """Transform parent-from-optical for a camera with this mount: z forward, x right, y down."""
        return multiply(self.frame, _OPTICAL)


Topic = Annotated[str, Field(pattern=TOPIC, max_length=128)]


class SensorParameters(Checked):
    """Rate, mount and names of a sensor. Cameras have `CameraParameters` instead."""

    kind: str  # a Literal in each subclass
    rate: Annotated[Finite, Within(1e-3, 1e5), Unit("Hz")]  # of simulated time; the period is a multiple of sub_step
    topic: Topic  # in the vehicle's namespace
    frame: Name  # frame_id of its messages
    object: Name | None = None  # name of the object that scripts find; default: the sensor's name
    mount: MountParameters | None = None
    latency: Annotated[Finite, Within(0, 60), Unit("s")] = 0.0  # whole sub-steps, from the measurement to the reading
    seed: Annotated[int, Within(0, 2**63 - 1)] = 0

    suffixes: ClassVar[tuple[str, ...]] = ("",)  # of its topics, appended to `topic`
    default_mount: ClassVar[Matrix] = IDENTITY  # root-from-sensor, without `mount` and without a URDF link `frame`
    from_object: ClassVar[Matrix] = IDENTITY  # sensor frame from the frame of the object that scripts find

    def make(self, mounting: Mounting) -> Instrument:
        """Return the instrument; call its `reset` before `look`."""
        raise NotImplementedError

    def period(self, sub_step: float) -> int:
        """Return the number of sub-steps (of `sub_step` seconds) between two samples."""
        return max(1, round(1 / (self.rate * sub_step)))

    def check(self, sub_step: float) -> None:
        """Raise ParameterError if the period or the latency is not a whole multiple of `sub_step` (s)."""
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
        """Yield each topic, and a word for its content."""
        for suffix in self.suffixes:
            yield f"{self.topic}{suffix}", suffix[1:] or self.kind

    def placed(self, links: Mapping[str, Matrix]) -> tuple[str, Matrix]:
        """Return the parent object ('' is the vehicle's root), and the transform parent-from-sensor.

        Without `mount`, the sensor is at the URDF link named `frame`; `links` holds the transforms root-from-link.
        """
        if self.mount is not None:
            return self.mount.parent, self.mount.frame
        return "", links.get(self.frame, self.default_mount)

    def sensor_at(self, world_from_object: Matrix) -> Matrix:
        """Return the transform world-from-sensor for the pose of the object that scripts find."""
        return multiply(world_from_object, invert(self.from_object))


Fields = dict[str, Any]  # of a ROS message, by name; nested messages are mappings and lists


class Hit(NamedTuple):
    """The first hit of a ray: distance (m), object, and the surface's unit normal in the world."""

    distance: float
    what: str  # name of the object; '' if it has none
    normal: Vector


class Contact(NamedTuple):
    """A contact point of the vehicle in the last sub-step; all vectors in the world frame."""

    what: str  # name of the other object, the floor or another vehicle
    point: Vector  # m
    normal: Vector  # unit normal of the other's surface, towards the vehicle
    force: Vector  # N, on the vehicle, friction included


class Carrier(Protocol):
    """The vehicle as its sensors see it, after the last sub-step."""

    state: State  # of the root link
    teleports: int  # number of teleports, each of which leaves it at rest; never decreases
    mass: float  # kg
    gravity: float  # acceleration of free fall along z in m/s², negative downwards
    datum: DatumParameters  # position of the world's origin on the Earth
    magnetic_field: Vector  # of the Earth, T, world

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N."""

    @property
    def wind(self) -> Vector:
        """Velocity of the air at the vehicle (m/s, world)."""

    def ray(self, start: Vector, end: Vector) -> Hit | None:
        """Return the first hit of a ray (m, world), ignoring the vehicle; None if it hits nothing."""

    def contacts(self) -> list[Contact]:
        """Return the vehicle's contacts in the last sub-step."""


@dataclass(frozen=True)
class Mounting:
    """The connection of a sensor to its vehicle."""

    name: str  # unique, such as drone/imu; seeds the noise
    carrier: Carrier
    pose: Callable[[], Matrix]  # transform world-from-sensor
    sub_step: float  # s


class Reading(NamedTuple):
    """A sample, noise included."""

    at: int  # time of the measurement, in (sub-)steps since the start of the run
    value: Any  # its type depends on the sensor's kind


class Output(NamedTuple):
    """A topic on which every reading is published."""

    suffix: str  # appended to the sensor's topic: '' or '/data'
    kind: str  # message type, such as sensor_msgs/Imu
    fields: Callable[[Any, Mapping[str, Any]], Fields]  # (value of a reading, std_msgs/Header) -> message


class Sensor(ABC):
    """A periodic sampler. Instruments count sub-steps, cameras count steps."""

    def __init__(self, period: int):
        """`period`: number of (sub-)steps between two samples."""
        self.period = period
        self.latest: Reading | None = None  # None before the first sample

    def is_due(self, count: int) -> bool:
        """Return whether a sample is due after `count` (sub-)steps since the start of the run."""
        return count % self.period == 0

    @abstractmethod
    def reset(self) -> None:
        """Return to the state at the start of a run."""

    @abstractmethod
    def save_state(self) -> Restore:
        """Return a function that restores the sensor's present state; it may be called repeatedly."""


class Instrument(Sensor):
    """A sensor that measures numbers. Its noise is seeded by `seed` and the names of its vehicle and itself.

    `readings` holds the new readings; the publisher clears the list.
    """

    outputs: tuple[Output, ...]

    def __init__(self, parameters: SensorParameters, mounting: Mounting):
        """Create it; call `reset` before `look`."""
        super().__init__(parameters.period(mounting.sub_step))
        self.parameters = parameters
        self.mounting = mounting
        self.carrier = mounting.carrier
        self.interval = self.period * mounting.sub_step  # s
        self.readings: list[Reading] = []
        self._delay = round(parameters.latency / mounting.sub_step)
        self._queue: deque[tuple[int, Reading]] = deque()  # (count at which the sample becomes a reading, sample)
        self._noises: list[Noise] = []
        self._random = np.random.default_rng()

    def make_noise(self, parameters: NoiseParameters, axes: int) -> Noise:
        """Return the noise of a measurement of `axes` numbers. The sensor resets, saves and restores it."""
        noise = Noise(parameters, axes, self.interval)
        self._noises.append(noise)
        return noise

    def change_noise(self, parameters: SensorParameters) -> None:
        """Replace the noise parameters; `parameters` differs from the present ones in nothing else."""
        changed = dict(_noises(parameters))
        paths = {id(noise): path for path, noise in _noises(self.parameters)}
        for noise in self._noises:
            noise.change(changed[paths[id(noise.parameters)]])
        self.parameters = parameters

    @abstractmethod
    def sample(self) -> Any:
        """Take a sample and return its value, noise included."""

    def look(self, count: int) -> None:
        """Process a sub-step, the `count`-th since the start of the run."""
        if count % self.period == 0:  # is_due, without a call in every sub-step
            sample = Reading(count, self.sample())
            if not self._delay:
                self.latest = sample
                self.readings.append(sample)
                return
            self._queue.append((count + self._delay, sample))
        while self._queue and self._queue[0][0] <= count:
            self.latest = self._queue.popleft()[1]
            self.readings.append(self.latest)

    def reset(self) -> None:
        """Return to the state at the start of a run; every run has the same noise."""
        self.latest = None
        self.readings.clear()
        self._queue.clear()
        entropy = [self.parameters.seed, *self.mounting.name.encode()]
        self._random = np.random.default_rng(np.random.SeedSequence(entropy))
        for noise in self._noises:
            noise.restart(self._random)

    def save_state(self) -> Restore:
        """Return a function that restores noise, delayed samples and readings."""
        samples = saved(self, "parameters", "latest", "readings", "_queue")
        return in_turn(samples, saved(self._random.bit_generator, "state"), *(n.save_state() for n in self._noises))

    def header(self, reading: Reading) -> dict[str, Any]:
        """Return the std_msgs/Header of a reading: time of the measurement (s, simulated) and frame."""
        return {"stamp": reading.at * self.mounting.sub_step, "frame_id": self.parameters.frame}

    def read(self) -> Fields | None:
        """Return the latest reading as the fields of its first message; None before the first reading."""
        if self.latest is None:
            return None
        return self.outputs[0].fields(self.latest.value, self.header(self.latest))


# Failures of a sensor; silent: no readings, frozen: repeats the same value.
Failure = Literal["ok", "silent", "frozen"]


class Failing:
    """Stands in for a failed instrument, which keeps measuring so that the fault does not change its later noise."""

    def __init__(self, instrument: Instrument, failure: Failure):
        """Start the failure. An instrument frozen before its first reading freezes at that reading."""
        self._instrument = instrument
        self._frozen = failure == "frozen"
        self._last = instrument.latest

    def look(self, count: int) -> None:
        """Process a sub-step; drop its readings, or replace their values by the frozen one."""
        instrument = self._instrument
        old_count = len(instrument.readings)
        instrument.look(count)
        new = instrument.readings[old_count:]
        if not new:
            return
        del instrument.readings[old_count:]
        if self._frozen:
            value = (self._last or new[0]).value
            instrument.readings += [Reading(reading.at, value) for reading in new]
            self._last = instrument.readings[-1]
        instrument.latest = self._last


def _noises(model: Checked, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], NoiseParameters]]:
    """Yield all noise parameters with the path of keys to them."""
    for key, value in model:
        if isinstance(value, NoiseParameters):
            yield (*path, key), value
        elif isinstance(value, Checked):
            yield from _noises(value, (*path, key))


def xyz(vector: Sequence[float]) -> dict[str, float]:
    """Return a vector as the fields of geometry_msgs/Vector3 or Point."""
    x, y, z = vector
    return {"x": x, "y": y, "z": z}


def diagonal(first: float, second: float, third: float) -> list[float]:
    """Return a 3 x 3 diagonal covariance, row-major."""
    return [first, 0.0, 0.0, 0.0, second, 0.0, 0.0, 0.0, third]
