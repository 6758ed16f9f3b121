"""The propeller model of V-REP's script: a fan of particles whose momentum lifts the drone.

With v the particle velocity (m/s) and n the particles emitted in a step of dt seconds:

    n      = floor(430 dt + carry)          carry: the fraction left over from the step before
    thrust = n * 8500 * v * pi * 0.005^3 / (6 dt)     along the propeller's +z   (N)
    torque = rotation * 0.002 * v                     about the same axis        (N m)

V-REP 3.x keeps the carry (21, 22, 21, ... particles at dt = 0.05 s), CoppeliaSim 4.x drops it (always
21). Source: the Lua script in V-REP's stock quadricopter model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import Annotated, Literal

from drone_sim.config.types import Checked, Finite, Limits, Within
from drone_sim.forces.force import Force, PushedBody
from drone_sim.mechanics.frames import Vector, rotate
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.wrench import Wrench

PARTICLE_VELOCITY = "particleVelocity"  # the commanded one (m/s), among the parameters of a propeller's script
_velocity_in = itemgetter(PARTICLE_VELOCITY)


class PropellerParameters(Checked):
    """Parameters of V-REP's particle model."""

    law: Literal["3.x", "4.x"]
    particles_per_second: Annotated[Finite, Within(1e-3, 1e6)]
    particle_density: Annotated[Finite, Within(1e-3, 1e6)]
    particle_size: Annotated[Finite, Within(1e-6, 1)]
    torque_per_velocity: Annotated[Finite, Within(0, 1e3)]
    velocity_limits: Limits


class ParticleLaw:
    """Counts the particles of a step; each propeller emits this number."""

    def __init__(self, parameters: PropellerParameters, time_step: float):
        """Create the model for a time step in seconds."""
        self._rate = parameters.particles_per_second * time_step
        self._keeps_carry = parameters.law == "3.x"
        volume = math.pi * parameters.particle_size**3 / 6
        self._newtons = parameters.particle_density * volume / time_step
        self.carry = 0.0  # the fraction of a particle left over from the last step

    def emit(self) -> float:
        """Emit one step's particles; return the thrust in newtons per m/s of their velocity."""
        particles = math.floor(self._rate + self.carry)
        if self._keeps_carry:
            self.carry += self._rate - particles
        return particles * self._newtons


class Propellers(Force):
    """A drone's propellers: their thrust, and the amount of air that they have moved."""

    def __init__(
        self,
        parameters: PropellerParameters,
        axes: Sequence[Vector],
        points: Sequence[Vector],
        rotations: Sequence[int],
        time_step: float,
        commands: Sequence[Mapping[str, float]],
    ):
        """Create the propellers: axis (unit, root link's frame), point (m, inertial frame) and sense (+-1) of each.

        `commands` has PARTICLE_VELOCITY of each, and is read in every step.
        """
        self._commands = commands
        self._is_weak = False
        self.effectiveness: tuple[float, ...] = (1.0,) * len(axes)
        self.air = [0.0] * len(axes)  # m of air that has gone through each
        self.clipped = 0  # steps in which a limit was applied
        self._newtons = 0.0  # per m/s, in the last step
        self._emitted: Sequence[float] = [0.0] * len(axes)  # m/s, in the last step
        self._law = ParticleLaw(parameters, time_step)
        self._time_step = time_step
        self._slowest, self._fastest = parameters.velocity_limits or (-math.inf, math.inf)
        by_axis: dict[Vector, list[tuple[int, float, float, float, float]]] = {}
        for number, (axis, point, rotation) in enumerate(zip(axes, points, rotations)):
            by_axis.setdefault(axis, []).append((number, *point, rotation * parameters.torque_per_velocity))
        self._by_axis = list(by_axis.items())

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        """Emit a step's particles at the commanded velocities, within limits."""
        velocities, matrix = list(map(_velocity_in, self._commands)), body.matrix
        if min(velocities) < self._slowest or max(velocities) > self._fastest:
            if not self._is_weak:
                self.clipped += 1
            velocities = [min(max(velocity, self._slowest), self._fastest) for velocity in velocities]
        if self._is_weak:
            velocities = [share * velocity for share, velocity in zip(self.effectiveness, velocities)]
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
        """Scale each propeller's velocity, and so its thrust and torque, by a share: 1 is intact, 0 is stopped.

        Propellers without a number are intact.
        """
        count = len(self.air)
        self.effectiveness = (*effectiveness, *[1.0] * count)[:count]
        self._is_weak = any(share != 1 for share in effectiveness)

    @property
    def velocities(self) -> Sequence[float]:
        """Particle velocity of each propeller in m/s, in the last step."""
        return self._emitted

    @property
    def thrusts(self) -> list[float]:
        """Thrust of each propeller in N, in the last step."""
        return [self._newtons * velocity for velocity in self._emitted]

    def save_state(self) -> Restore:
        emission = saved(self, "air", "_emitted", "_newtons")
        return in_turn(saved(self._law, "carry"), emission, partial(self.weaken, self.effectiveness))
