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
from typing import List, Sequence, Tuple

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
    sum p_i F_i[c].
    """

    def __init__(self) -> None:
        """Start with no force at all."""
        self.force = [0.0, 0.0, 0.0]
        self.torque = [0.0, 0.0, 0.0]
        self.moments: List[List[float]] = [[0.0, 0.0, 0.0] for _ in range(3)]

    def add(self, force: Sequence[float], torque: Sequence[float], point: Sequence[float]) -> None:
        """Add a force (N, world) at a point (m, inertial frame of the body), and a torque (N m, world)."""
        for axis in range(3):
            self.force[axis] += force[axis]
            self.torque[axis] += torque[axis]
            column = self.moments[axis]
            column[0] += point[0] * force[axis]
            column[1] += point[1] * force[axis]
            column[2] += point[2] * force[axis]

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
