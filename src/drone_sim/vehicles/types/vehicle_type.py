"""Base class of the vehicle types: places of the propellers, and their thrust model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from drone_sim.forces.propellers import PropellerParameters, Propellers
from drone_sim.mechanics.frames import Vector


class VehicleType:
    """A type of vehicle; `name` is the value of the key `type`.

    `rotors` are propellers 1, 2, and so on: the place, which names the URDF links propeller_<place> and its child
    blades_<place>, and the sense (+-1) of the reaction torque.
    """

    name: ClassVar[str]
    rotors: ClassVar[tuple[tuple[str, int], ...]]

    @classmethod
    def propellers(
        cls,
        law: PropellerParameters,
        axes: Sequence[Vector],
        points: Sequence[Vector],
        time_step: float,
        commanded: Callable[[], Sequence[float]],
    ) -> Propellers:
        """Return V-REP's particle model, with thrust along `axes` (unit, root link) at `points` (m, inertial frame).

        `commanded` returns the particle velocities (m/s) that scripts command.
        """
        return Propellers(law, axes, points, [sense for _, sense in cls.rotors], time_step, commanded)
