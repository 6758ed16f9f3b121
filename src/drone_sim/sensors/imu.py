"""An inertial measurement unit after REP 145: angular velocity, specific force, orientation.

Specific force is what an accelerometer measures, f = Rᵀ (a - g): 9.81 m/s² upwards at rest, 0 in free fall. A sample
is the mean since the last sample, like the integrals of a strapdown IMU (Savage, Strapdown Inertial Navigation
Integration Algorithm Design, J. Guidance 21(1) and 21(2), 1998):

    f = 1/T sum R_k^T (dv_k - g dt)        w = 1/T sum R_k^T w_k dt

where dv_k is the change of the mount point's velocity in sub-step k, and R_k the sensor's axes at its end: Bullet keeps
the direction of a force constant in the world until then. So the samples sum up to the change of velocity, contacts
included, at any rate; with a sample in every sub-step, (R f + g) dt is exactly that change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

from drone_sim.config.types import Checked, Name
from drone_sim.mechanics.frames import (
    IDENTITY,
    Matrix,
    Quaternion,
    Vector,
    multiply_quaternions,
    rotate_back,
    rotation_between,
    to_quaternion,
)
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Instrument, Mounting, Output, SensorParameters, Topic, diagonal, xyz

_ZERO: Vector = (0.0, 0.0, 0.0)
_NOT_REPORTED = [-1.0, *([0.0] * 8)]  # covariance of a missing measurement (REP 145)


class ImuNoise(Checked):
    """Noise of each measurement."""

    angular_velocity: NoiseParameters = NoiseParameters()  # rad/s
    linear_acceleration: NoiseParameters = NoiseParameters()  # m/s²
    orientation: NoiseParameters = NoiseParameters()  # rad, about each axis of the sensor


class ImuParameters(SensorParameters):
    """An IMU. Its topics are below the namespace `topic`."""

    kind: Literal["imu"]
    topic: Topic = "imu"
    frame: Name = "imu_link"
    noise: ImuNoise = ImuNoise()

    suffixes = ("/data", "/data_raw")

    def make(self, mounting: Mounting) -> Imu:
        return Imu(self, mounting)


class ImuSample(NamedTuple):
    """The measurements of an IMU, in its frame."""

    orientation: Quaternion  # of the sensor in the world
    angular_velocity: Vector  # rad/s
    specific_force: Vector  # m/s²


class Imu(Instrument):
    """Integrates in every sub-step; a sample is the mean since the last sample."""

    parameters: ImuParameters

    def __init__(self, parameters: ImuParameters, mounting: Mounting):
        super().__init__(parameters, mounting)
        noise = parameters.noise
        self._rate_noise = self.make_noise(noise.angular_velocity, 3)
        self._force_noise = self.make_noise(noise.linear_acceleration, 3)
        self._tilt_noise = self.make_noise(noise.orientation, 3)
        self.outputs = (
            Output("/data", "sensor_msgs/Imu", self._data),
            Output("/data_raw", "sensor_msgs/Imu", self._raw),
        )
        self._velocity, self._axes, self._teleports = _ZERO, IDENTITY, 0
        self._delta_velocity, self._delta_angle, self._duration = _ZERO, _ZERO, 0.0

    # ---- measuring

    def reset(self) -> None:
        super().reset()
        self._axes = self.mounting.pose()
        self._velocity = self._point_velocity(self._axes)
        self._teleports = self.carrier.teleports
        self._delta_velocity, self._delta_angle, self._duration = _ZERO, _ZERO, 0.0  # m/s, rad, s since the last sample

    def look(self, count: int) -> None:
        """Integrate over the last sub-step, then sample if due."""
        axes, step, carrier = self.mounting.pose(), self.mounting.sub_step, self.carrier
        velocity, last, last_axes = self._point_velocity(axes), self._velocity, self._axes
        if self._teleports != carrier.teleports:  # a teleport, at rest, is neither acceleration nor rotation
            self._teleports, last, last_axes = carrier.teleports, _ZERO, axes
        change = velocity[0] - last[0], velocity[1] - last[1], velocity[2] - last[2] - carrier.gravity * step
        (gx, gy, gz), (cx, cy, cz) = self._delta_velocity, rotate_back(axes, change)
        self._delta_velocity = gx + cx, gy + cy, gz + cz
        # A rotation vector has the same components in the old and the new frame.
        (tx, ty, tz), (rx, ry, rz) = self._delta_angle, rotation_between(last_axes, axes)
        self._delta_angle = tx + rx, ty + ry, tz + rz
        self._axes, self._velocity = axes, velocity
        self._duration += step
        super().look(count)

    def sample(self) -> ImuSample:
        """Return the mean rates and forces since the last sample, and the present orientation."""
        (vx, vy, vz), (tx, ty, tz), rate = self._delta_velocity, self._delta_angle, 1 / self._duration
        self._delta_velocity, self._delta_angle, self._duration = _ZERO, _ZERO, 0.0
        orientation, tilt = to_quaternion(self._axes), self._tilt_noise.add(_ZERO)
        if any(tilt):
            orientation = multiply_quaternions(orientation, _quaternion(tilt))
        wx, wy, wz = self._rate_noise.add((tx * rate, ty * rate, tz * rate))
        fx, fy, fz = self._force_noise.add((vx * rate, vy * rate, vz * rate))
        return ImuSample(orientation, (wx, wy, wz), (fx, fy, fz))

    def _point_velocity(self, axes: Matrix) -> Vector:
        """Return the velocity (m/s, world) of the vehicle at the sensor's position."""
        root, _, (vx, vy, vz), (wx, wy, wz) = self.carrier.state
        x, y, z = axes[3] - root[0], axes[7] - root[1], axes[11] - root[2]
        return vx + (wy * z - wz * y), vy + (wz * x - wx * z), vz + (wx * y - wy * x)

    def save_state(self) -> Restore:
        integrals = saved(self, "_velocity", "_axes", "_delta_velocity", "_delta_angle", "_duration")
        return in_turn(super().save_state(), integrals, self._update_teleports)

    def _update_teleports(self) -> None:
        self._teleports = self.carrier.teleports

    # ---- messages

    def _raw(self, value: ImuSample, header: Mapping[str, Any]) -> Fields:
        return {
            "header": header,
            "orientation_covariance": _NOT_REPORTED,
            "angular_velocity": xyz(value.angular_velocity),
            "angular_velocity_covariance": diagonal(*[self._rate_noise.variance] * 3),
            "linear_acceleration": xyz(value.specific_force),
            "linear_acceleration_covariance": diagonal(*[self._force_noise.variance] * 3),
        }

    def _data(self, value: ImuSample, header: Mapping[str, Any]) -> Fields:
        x, y, z, w = value.orientation
        return {
            **self._raw(value, header),
            "orientation": {"x": x, "y": y, "z": z, "w": w},
            "orientation_covariance": diagonal(*[self._tilt_noise.variance] * 3),
        }


def _quaternion(vector: Sequence[float]) -> Quaternion:
    """Return the unit quaternion of a rotation vector (rad)."""
    angle = math.hypot(*vector)
    scale = math.sin(angle / 2) / angle if angle else 0.5
    x, y, z = vector
    return x * scale, y * scale, z * scale, math.cos(angle / 2)
