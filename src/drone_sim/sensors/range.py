"""A distance sensor: one ray along its x axis, as sensor_msgs/Range has it, downwards where nothing else is said.

What is beyond its range is +Inf, what is too near -Inf (REP-117).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Length, Name, ParameterError, Unit, Within
from drone_sim.mechanics.frames import Vector, from_rpy, position, rotate_back, transform
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Fitting, Hit, Instrument, Output, SensorParameters, Topic

_RADIATION = {"ultrasound": 0, "infrared": 1}  # sensor_msgs/Range
# V-REP's proximity sensors look along their z; as the vision sensors, with y up and x to the left.
_OBJECT = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


class RangeParameters(SensorParameters):
    """A distance sensor of one ray."""

    kind: Literal["range"]
    topic: Topic = "range"
    frame: Name = "range_link"
    radiation: Literal["ultrasound", "infrared"] = "infrared"
    field_of_view: Annotated[Finite, Within(0, math.pi), Unit("rad")] = 0.0  # for the message; it is one ray
    min_range: Annotated[Finite, Within(0, 1e4), Unit("m")]
    max_range: Annotated[Length, Unit("m")]
    noise: NoiseParameters = NoiseParameters()  # m

    default_mount = from_rpy((0.0, 0.0, 0.0), (0.0, math.pi / 2, 0.0))
    from_object = _OBJECT

    def make(self, fitting: Fitting) -> Range:
        """Return the instrument; `reset` comes before its first look."""
        return Range(self, fitting)

    def check(self, sub_step: float) -> None:
        """Raise ParameterError for periods that sub_step does not divide, or a range without extent."""
        super().check(sub_step)
        if not self.min_range < self.max_range:
            raise ParameterError(
                f"must be less than max_range = {self.max_range:g}", ("min_range",), f"{self.min_range:g}"
            )


class RangeSample(NamedTuple):
    """A distance (m) as it was measured, and what the ray truly met."""

    distance: float
    hit: Hit | None
    normal: Vector  # of what it met, in the frame of the object that scripts find


class Range(Instrument):
    """Sends a ray with every sample."""

    parameters: RangeParameters

    def __init__(self, parameters: RangeParameters, fitting: Fitting):
        """Take what it is like and where it sits."""
        super().__init__(parameters, fitting)
        self._noise = self.make_noise(parameters.noise, 1)
        self.outputs = (Output("", "sensor_msgs/Range", self._message),)

    def sample(self) -> RangeSample:
        """Return the distance of what is ahead."""
        own, pose = self.parameters, self.fitting.pose()
        hit = self.carrier.ray(position(pose), transform(pose, (own.max_range, 0.0, 0.0)))
        if hit is None:
            return RangeSample(math.inf, None, (0.0, 0.0, 0.0))
        normal = rotate_back(_OBJECT, rotate_back(pose, hit.normal))
        (measured,) = self._noise.add((hit.distance,))
        if measured > own.max_range:
            measured = math.inf
        elif measured < own.min_range:
            measured = -math.inf
        return RangeSample(measured, hit, normal)

    def detected(self) -> tuple[float, str, Vector] | None:
        """Return the distance (m) last measured, the name of what was met, and its unit normal in the object's frame.

        None where nothing is within its range.
        """
        sample: RangeSample | None = self.latest and self.latest.value
        if sample is None or sample.hit is None or not math.isfinite(sample.distance):
            return None
        return sample.distance, sample.hit.what, sample.normal

    def _message(self, value: RangeSample, header: Mapping[str, Any]) -> Fields:
        own = self.parameters
        return {
            "header": header,
            "radiation_type": _RADIATION[own.radiation],
            "field_of_view": own.field_of_view,
            "min_range": own.min_range,
            "max_range": own.max_range,
            "range": value.distance,
        }
