"""V-REP's propeller script: a fan of particles whose momentum lifts the drone.

With v the particle velocity (m/s) and n the particles emitted in a step of dt seconds:

    n      = floor(430 dt + carry)          carry: the fraction left over by the step before
    thrust = n * 8500 * v * pi * 0.005^3 / (6 dt)     along the propeller's +z   (N)
    torque = rotation * 0.002 * v                     about the same axis        (N m)

V-REP 3.x keeps the carry (21, 22, 21, ... particles at dt = 0.05 s), CoppeliaSim 4.x drops it (always
21). Source: the Lua script in V-REP's stock quadricopter model.
"""

from __future__ import annotations

import math
from typing import Iterable, List, Sequence, Tuple

from drone_sim.frames import Quaternion, Vector
from drone_sim.parameters import PropellerParameters


class ParticleFan:
    """One propeller: counts its particles, turns its particle velocity into thrust and torque."""

    def __init__(self, parameters: PropellerParameters, rotation: int, time_step: float):
        """Take the law's constants, the sense of rotation (+1 or -1) and the step in seconds."""
        self._rate = parameters.particles_per_second * time_step
        self._keeps_carry = parameters.law == "3.x"
        volume = math.pi * parameters.particle_size**3 / 6
        self._newtons = parameters.particle_density * volume / time_step
        self._newton_metres = rotation * parameters.torque_per_velocity
        self._carry = 0.0

    def emit(self, velocity: float) -> Tuple[float, float]:
        """Emit one step's particles at `velocity` (m/s); return thrust (N) and reaction torque (N m)."""
        particles = math.floor(self._rate + self._carry)
        if self._keeps_carry:
            self._carry += self._rate - particles
        return particles * self._newtons * velocity, self._newton_metres * velocity

    @property
    def carry(self) -> float:
        """The fraction of a particle left over by the last step (for snapshots)."""
        return self._carry

    @carry.setter
    def carry(self, value: float) -> None:
        self._carry = value


class Wrench:
    """World-fixed forces at body-fixed points, summed: what the sub-steps of one step re-apply.

    V-REP turns each force into the world once per step and re-applies that world vector in every
    sub-step, at a point that moves with the body. For points p_i (inertial frame of the body) and
    forces F_i (world), the torque about the centre of mass under the rotation R is sum (R p_i) x F_i.
    It is linear in R, so nine sums hold it for any number of forces: column c of `moments` is
    sum p_i F_i[c]. Written out without loops: both methods run in every step.
    """

    def __init__(self) -> None:
        """Start with no force at all."""
        self.force = [0.0, 0.0, 0.0]
        self.torque = [0.0, 0.0, 0.0]
        self.moments: List[List[float]] = [[0.0, 0.0, 0.0] for _ in range(3)]

    def add(self, force: Sequence[float], torque: Sequence[float], point: Sequence[float]) -> None:
        """Add a force (N, world) at a point (m, inertial frame of the body), and a torque (N m, world)."""
        fx, fy, fz = force
        px, py, pz = point
        total, turning = self.force, self.torque
        total[0] += fx
        total[1] += fy
        total[2] += fz
        turning[0] += torque[0]
        turning[1] += torque[1]
        turning[2] += torque[2]
        about_x, about_y, about_z = self.moments
        about_x[0] += px * fx
        about_x[1] += py * fx
        about_x[2] += pz * fx
        about_y[0] += px * fy
        about_y[1] += py * fy
        about_y[2] += pz * fy
        about_z[0] += px * fz
        about_z[1] += py * fz
        about_z[2] += pz * fz

    def add_along(self, axis: Vector, thrusts: Iterable[Tuple[float, float, Vector]]) -> None:
        """Add thrusts (N) and torques (N m) along one axis (unit, world) at points (m, inertial frame).

        Since they are parallel, sum p_i F_i is the one product (sum p_i f_i) axis.
        """
        force = torque = px = py = pz = 0.0
        for thrust, turning, point in thrusts:
            force += thrust
            torque += turning
            px += point[0] * thrust
            py += point[1] * thrust
            pz += point[2] * thrust
        for total, along in ((self.force, force), (self.torque, torque)):
            total[0] += along * axis[0]
            total[1] += along * axis[1]
            total[2] += along * axis[2]
        for column, share in zip(self.moments, axis):
            column[0] += px * share
            column[1] += py * share
            column[2] += pz * share

    def torque_under(self, orientation: Quaternion) -> Vector:
        """Return the torque about the centre of mass (N m, world) while the body has this orientation."""
        x, y, z, w = orientation
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = self.moments
        r01, r02 = 2 * (x * y - z * w), 2 * (x * z + y * w)
        r10, r12 = 2 * (x * y + z * w), 2 * (y * z - x * w)
        r20, r21 = 2 * (x * z - y * w), 2 * (y * z + x * w)
        r00, r11, r22 = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z), 1 - 2 * (x * x + y * y)
        torque = self.torque
        return (
            torque[0] + (r10 * cx + r11 * cy + r12 * cz) - (r20 * bx + r21 * by + r22 * bz),
            torque[1] + (r20 * ax + r21 * ay + r22 * az) - (r00 * cx + r01 * cy + r02 * cz),
            torque[2] + (r00 * bx + r01 * by + r02 * bz) - (r10 * ax + r11 * ay + r12 * az),
        )
