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
from collections.abc import Callable, Sequence
from typing import Annotated, Literal

from drone_sim.config.types import Checked, Finite, Limits, Within
from drone_sim.forces.force import Force, PushedBody
from drone_sim.mechanics.frames import Vector, rotate
from drone_sim.mechanics.wrench import Wrench


class PropellerParameters(Checked):
    """V-REP's particle law."""

    law: Literal["3.x", "4.x"]
    particles_per_second: Annotated[Finite, Within(1e-3, 1e6)]
    particle_density: Annotated[Finite, Within(1e-3, 1e6)]
    particle_size: Annotated[Finite, Within(1e-6, 1)]
    torque_per_velocity: Annotated[Finite, Within(0, 1e3)]
    velocity_limits: Limits


class ParticleLaw:
    """Counts the particles of a step, which are as many for every propeller."""

    def __init__(self, parameters: PropellerParameters, time_step: float):
        """Take the law's constants, and the step in seconds."""
        self._rate = parameters.particles_per_second * time_step
        self._keeps_carry = parameters.law == "3.x"
        volume = math.pi * parameters.particle_size**3 / 6
        self._newtons = parameters.particle_density * volume / time_step
        self.carry = 0.0  # the fraction of a particle left over by the last step

    def emit(self) -> float:
        """Emit one step's particles; return the thrust in newtons per m/s of their velocity."""
        particles = math.floor(self._rate + self.carry)
        if self._keeps_carry:
            self.carry += self._rate - particles
        return particles * self._newtons


class Propellers(Force):
    """A drone's propellers: their thrust, and how much air has gone through them."""

    def __init__(
        self,
        parameters: PropellerParameters,
        axes: Sequence[Vector],
        points: Sequence[Vector],
        rotations: Sequence[int],
        time_step: float,
        commanded: Callable[[], Sequence[float]],
    ):
        """Take where each pushes along (unit, root link's frame) and acts (m, inertial frame), and its sense (+-1).

        `commanded` returns the particle velocities (m/s) that are asked for.
        """
        self._commanded = self._given = commanded
        self.effectiveness: tuple[float, ...] = (1.0,) * len(axes)
        self.air = [0.0] * len(axes)  # m of it that went through each
        self.clipped = 0  # steps in which a limit was in force
        self._newtons = 0.0  # per m/s, of the step
        self._emitted: Sequence[float] = [0.0] * len(axes)  # m/s, of the step
        self._law = ParticleLaw(parameters, time_step)
        self._time_step = time_step
        self._limits = self._slowest, self._fastest = parameters.velocity_limits or (-math.inf, math.inf)
        by_axis: dict[Vector, list[tuple[int, float, float, float, float]]] = {}
        for number, (axis, point, rotation) in enumerate(zip(axes, points, rotations)):
            by_axis.setdefault(axis, []).append((number, *point, rotation * parameters.torque_per_velocity))
        self._by_axis = list(by_axis.items())

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        """Emit a step's particles at the velocities that are commanded, within limits."""
        velocities, matrix = self._commanded(), body.matrix
        if min(velocities) < self._slowest or max(velocities) > self._fastest:
            self.clipped += 1
            velocities = [min(max(velocity, self._slowest), self._fastest) for velocity in velocities]
        self._emitted = velocities
        newtons = self._newtons = self._law.emit()
        air, time_step = self.air, self._time_step
        for axis, members in self._by_axis:
            force = torque = x = y = z = 0.0
            for number, px, py, pz, newton_metres in members:
                velocity = velocities[number]
                thrust = newtons * velocity
                force += thrust
                torque += newton_metres * velocity
                x += px * thrust
                y += py * thrust
                z += pz * thrust
                air[number] += velocity * time_step
            along_x, along_y, along_z = along = rotate(matrix, axis)
            wrench.add_parallel(
                (along_x * force, along_y * force, along_z * force),
                (along_x * torque, along_y * torque, along_z * torque),
                (x, y, z),
                along,
            )

    def weaken(self, effectiveness: Sequence[float]) -> None:
        """Let each blow at this share of the velocity, and so of thrust and torque: 1 is sound, 0 is stopped.

        Those for which there is no number are sound.
        """
        count = len(self.air)
        self.effectiveness = (*effectiveness, *[1.0] * count)[:count]
        if all(share == 1 for share in effectiveness):
            self._commanded, (self._slowest, self._fastest) = self._given, self._limits
        else:
            self._commanded, self._slowest, self._fastest = self._weakened, -math.inf, math.inf

    def _weakened(self) -> list[float]:
        slowest, fastest = self._limits
        return [share * min(max(one, slowest), fastest) for share, one in zip(self.effectiveness, self._given())]

    @property
    def velocities(self) -> Sequence[float]:
        """Velocity of the particles of each propeller in m/s, as in the last step."""
        return self._emitted

    @property
    def thrusts(self) -> list[float]:
        """Thrust of each propeller in N, as in the last step."""
        return [self._newtons * velocity for velocity in self._emitted]

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back the fraction of a particle, what was emitted, and what is broken."""
        carry, air, effectiveness = self._law.carry, list(self.air), self.effectiveness
        emitted, newtons = list(self._emitted), self._newtons

        def restore() -> None:
            self._law.carry, self.air = carry, list(air)
            self._emitted, self._newtons = emitted, newtons
            self.weaken(effectiveness)

        return restore
