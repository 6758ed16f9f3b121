"""An inertial measurement unit, as REP-145 wants it: angular velocity, specific force, orientation.

Specific force is what an accelerometer feels, f = Rᵀ (a - g): 9.81 m/s² upwards at rest, nothing in free fall. A sample
is the mean since the last one, as a strapdown IMU's integrators give it (Savage, Strapdown Inertial Navigation
Integration Algorithm Design, J. Guidance 21(1) and 21(2), 1998):

    f = 1/T sum R_k^T (dv_k - g dt)        w = 1/T sum R_k^T w_k dt

with dv_k the change of the mounted point's velocity in sub-step k, and R_k the sensor's axes at the end of it: Bullet's
forces keep their direction in the world until then. What the samples add up to is thus how the velocity has changed,
with every contact, however seldom they are taken; with a sample in every sub-step, (R f + g) dt is exactly that.
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
    cross,
    multiply_quaternions,
    position,
    relative_turn,
    rotate_back,
    rotation_vector,
    to_quaternion,
)
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.sensors.noise import NoiseParameters
from drone_sim.sensors.sensor import Fields, Fitting, Instrument, Output, SensorParameters, Topic, diagonal, xyz

_ZERO: Vector = (0.0, 0.0, 0.0)
_NOT_REPORTED = [-1.0, *([0.0] * 8)]  # a covariance whose first number is -1


class ImuNoise(Checked):
    """What is wrong with each of its measurements."""

    angular_velocity: NoiseParameters = NoiseParameters()  # rad/s
    linear_acceleration: NoiseParameters = NoiseParameters()  # m/s²
    orientation: NoiseParameters = NoiseParameters()  # rad, about each axis of the sensor


class ImuParameters(SensorParameters):
    """An IMU; its topics are below `topic`."""

    kind: Literal["imu"]
    topic: Topic = "imu"
    frame: Name = "imu_link"
    noise: ImuNoise = ImuNoise()

    suffixes = ("/data", "/data_raw")

    def make(self, fitting: Fitting) -> Imu:
        """Return the instrument; `reset` comes before its first look."""
        return Imu(self, fitting)


class ImuSample(NamedTuple):
    """What an IMU measures, in its own frame."""

    orientation: Quaternion  # of the sensor in the world
    angular_velocity: Vector  # rad/s
    specific_force: Vector  # m/s²


class Imu(Instrument):
    """Integrates in every sub-step; a sample is the mean since the last one."""

    parameters: ImuParameters

    def __init__(self, parameters: ImuParameters, fitting: Fitting):
        """Take what it is like and where it sits."""
        super().__init__(parameters, fitting)
        noise = parameters.noise
        self._turning = self.make_noise(noise.angular_velocity, 3)
        self._feeling = self.make_noise(noise.linear_acceleration, 3)
        self._leaning = self.make_noise(noise.orientation, 3)
        self.outputs = (
            Output("/data", "sensor_msgs/Imu", self._data),
            Output("/data_raw", "sensor_msgs/Imu", self._raw),
        )
        self._velocity, self._axes, self._jumps = _ZERO, IDENTITY, 0
        self._gained, self._turned, self._passed = _ZERO, _ZERO, 0.0

    # ---- measuring

    def reset(self) -> None:
        """Begin anew, at rest."""
        super().reset()
        self._axes = self.fitting.pose()
        self._velocity = self._point_velocity(self._axes)
        self._jumps = self.carrier.jumps
        self._gained, self._turned, self._passed = _ZERO, _ZERO, 0.0  # m/s, rad and s since the last sample

    def look(self, count: int) -> None:
        """Integrate over the sub-step that has just been, then sample if it is time."""
        axes, step = self.fitting.pose(), self.fitting.sub_step
        velocity, last, fallen = self._point_velocity(axes), self._velocity, self.carrier.gravity * step
        before = self._axes
        if self._jumps != self.carrier.jumps:  # put there at rest: that was neither acceleration nor turn
            self._jumps, last, before = self.carrier.jumps, _ZERO, axes
        change = velocity[0] - last[0], velocity[1] - last[1], velocity[2] - last[2] - fallen
        (gx, gy, gz), (cx, cy, cz) = self._gained, rotate_back(axes, change)
        self._gained = gx + cx, gy + cy, gz + cz
        # The axis of a turn has the same components before and after.
        (tx, ty, tz), (rx, ry, rz) = self._turned, rotation_vector(relative_turn(before, axes))
        self._turned = tx + rx, ty + ry, tz + rz
        self._axes, self._velocity = axes, velocity
        self._passed += step
        super().look(count)

    def sample(self) -> ImuSample:
        """Return the means since the last sample, and the present orientation."""
        force, rate = (_sum(_ZERO, one, 1 / self._passed) for one in (self._gained, self._turned))
        self._gained, self._turned, self._passed = _ZERO, _ZERO, 0.0
        turn = multiply_quaternions(to_quaternion(self._axes), _rotation(self._leaning.add(_ZERO)))
        return ImuSample(turn, _vector(self._turning.add(rate)), _vector(self._feeling.add(force)))

    def _point_velocity(self, axes: Matrix) -> Vector:
        """Return the velocity (m/s, world) of the vehicle's point where the sensor sits."""
        place, _, linear, angular = self.carrier.state
        (x, y, z), (vx, vy, vz) = position(axes), linear
        sx, sy, sz = cross(angular, (x - place[0], y - place[1], z - place[2]))
        return vx + sx, vy + sy, vz + sz

    def save_state(self) -> Restore:
        """Return a function that brings it back, in the middle of a sample."""
        own = saved(self, "_velocity", "_axes", "_gained", "_turned", "_passed")
        return in_turn(super().save_state(), own, self._know_jumps)

    def _know_jumps(self) -> None:
        self._jumps = self.carrier.jumps

    # ---- messages

    def _raw(self, value: ImuSample, header: Mapping[str, Any]) -> Fields:
        return {
            "header": header,
            "orientation_covariance": _NOT_REPORTED,
            "angular_velocity": xyz(value.angular_velocity),
            "angular_velocity_covariance": diagonal(*[self._turning.variance] * 3),
            "linear_acceleration": xyz(value.specific_force),
            "linear_acceleration_covariance": diagonal(*[self._feeling.variance] * 3),
        }

    def _data(self, value: ImuSample, header: Mapping[str, Any]) -> Fields:
        x, y, z, w = value.orientation
        return {
            **self._raw(value, header),
            "orientation": {"x": x, "y": y, "z": z, "w": w},
            "orientation_covariance": diagonal(*[self._leaning.variance] * 3),
        }


def _sum(a: Sequence[float], b: Sequence[float], factor: float) -> Vector:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = values
    return x, y, z


def _rotation(vector: Sequence[float]) -> Quaternion:
    """Return the unit quaternion of a rotation vector (rad)."""
    angle = math.hypot(*vector)
    scale = math.sin(angle / 2) / angle if angle else 0.5
    x, y, z = vector
    return x * scale, y * scale, z * scale, math.cos(angle / 2)
