"""A magnetometer: the scene's magnetic field in the sensor's axes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from drone_sim.config.types import Name
from drone_sim.mechanics.frames import rotate_back
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic, diagonal, xyz


class MagneticFieldParameters(SensorParameters):
    """A magnetometer of three axes. The bias of its noise models hard iron."""

    kind: Literal["magnetic_field"]
    topic: Topic = "magnetic_field"
    frame: Name = "imu_link"
    noise: NoiseParameters = NoiseParameters()  # T

    def make(self, mounting: Mounting) -> MagneticField:
        return MagneticField(self, mounting)


class MagneticField(Instrument):
    """Measures B = Rᵀ B_world, in T."""

    parameters: MagneticFieldParameters

    def __init__(self, parameters: MagneticFieldParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        self._noise = self.make_noise(parameters.noise, 3)
        self.outputs = (Output("", "sensor_msgs/MagneticField", self._message),)

    def sample(self) -> list[float]:
        """Return the field in T along the sensor's axes."""
        return self._noise.add(rotate_back(self.mounting.pose(), self.carrier.magnetic_field))

    def _message(self, value: list[float], header: Mapping[str, Any]) -> Fields:
        covariance = diagonal(*[self._noise.variance] * 3)
        return {"header": header, "magnetic_field": xyz(value), "magnetic_field_covariance": covariance}
