"""An anemometer: the velocity of the air at the vehicle, relative to the ground, not to the vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import Vector
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic, xyz


class WindParameters(SensorParameters):
    """An anemometer."""

    kind: Literal["wind"]
    topic: Topic = "wind"
    frame: Name = "base_link"
    noise: NoiseParameters = NoiseParameters()  # m/s

    def make(self, mounting: Mounting) -> Wind:
        return Wind(self, mounting)


class Wind(Instrument):
    """Measures the wind, including gusts."""

    parameters: WindParameters

    def __init__(self, parameters: WindParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._noise = self.make_noise(parameters.noise, 3)
        self.outputs = (Output("", "geometry_msgs/Vector3Stamped", self._message),)

    def sample(self) -> Vector:
        """Return the velocity of the air (m/s, world)."""
        x, y, z = self._noise.add(self.carrier.wind)
        return x, y, z

    def _message(self, value: Vector, header: Mapping[str, Any]) -> Fields:
        return {"header": {**header, "frame_id": "world"}, "vector": xyz(value)}
