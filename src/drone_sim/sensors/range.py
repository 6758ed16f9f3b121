"""A distance sensor: sensor_msgs/Range from one ray along its x axis, which points down by default.

A distance beyond the range is +Inf, one below it -Inf (REP 117).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from drone_sim.config.types import Finite, Length, Name, ParameterError, Unit, Within
from drone_sim.mechanics.frames import Vector, from_rpy, position, rotate_back, transform
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Hit, Instrument, Mounting, Output, SensorParameters, Topic

_RADIATION = {"ultrasound": 0, "infrared": 1}  # sensor_msgs/Range
# Sensor frame from object frame. V-REP's proximity and vision sensors have z forward, y up and x left.
_OBJECT = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)


class RangeParameters(SensorParameters):
    """A distance sensor with one ray."""

    kind: Literal["range"]
    topic: Topic = "range"
    frame: Name = "range_link"
    radiation: Literal["ultrasound", "infrared"] = "infrared"
    field_of_view: Annotated[Finite, Within(0, math.pi), Unit("rad")] = 0.0  # for the message only
    min_range: Annotated[Finite, Within(0, 1e4), Unit("m")]
    max_range: Annotated[Length, Unit("m")]
    noise: NoiseParameters = NoiseParameters()  # m

    default_mount = from_rpy((0.0, 0.0, 0.0), (0.0, math.pi / 2, 0.0))
    from_object = _OBJECT

    def make(self, mounting: Mounting) -> Range:
        return Range(self, mounting)

    def check(self, sub_step: float) -> None:
        """Raise ParameterError as the base class does, and for an empty range."""
        super().check(sub_step)
        if not self.min_range < self.max_range:
            raise ParameterError(
                f"must be less than max_range = {self.max_range:g}", ("min_range",), f"{self.min_range:g}"
            )


class RangeSample(NamedTuple):
    """The measured distance (m), and the true hit of the ray."""

    distance: float
    hit: Hit | None
    normal: Vector  # of the hit surface, in the frame of the object that scripts find


class Range(Instrument):
    """Casts one ray per sample."""

    parameters: RangeParameters

    def __init__(self, parameters: RangeParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._noise = self.make_noise(parameters.noise, 1)
        self.outputs = (Output("", "sensor_msgs/Range", self._message),)

    def sample(self) -> RangeSample:
        parameters, pose = self.parameters, self.mounting.pose()
        hit = self.carrier.ray(position(pose), transform(pose, (parameters.max_range, 0.0, 0.0)))
        if hit is None:
            return RangeSample(math.inf, None, (0.0, 0.0, 0.0))
        normal = rotate_back(_OBJECT, rotate_back(pose, hit.normal))
        (measured,) = self._noise.add((hit.distance,))
        if measured > parameters.max_range:
            measured = math.inf
        elif measured < parameters.min_range:
            measured = -math.inf
        return RangeSample(measured, hit, normal)

    def detected(self) -> tuple[float, str, Vector] | None:
        """Return the last measured distance (m), the name of the hit object, and its unit normal in the object's frame.

        None if nothing is within the range.
        """
        sample: RangeSample | None = self.latest and self.latest.value
        if sample is None or sample.hit is None or not math.isfinite(sample.distance):
            return None
        return sample.distance, sample.hit.what, sample.normal

    def _message(self, value: RangeSample, header: Mapping[str, Any]) -> Fields:
        parameters = self.parameters
        return {
            "header": header,
            "radiation_type": _RADIATION[parameters.radiation],
            "field_of_view": parameters.field_of_view,
            "min_range": parameters.min_range,
            "max_range": parameters.max_range,
            "range": value.distance,
        }
