"""What a type of vehicle is: where its propellers sit, and the law by which they push."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from drone_sim.forces.propellers import PropellerParameters, Propellers
from drone_sim.mechanics.frames import Vector


class VehicleType:
    """A type of vehicle, by the name that the key `type` has.

    `rotors` are propellers 1, 2, and so on: where each sits, by the links propeller_<place> and, below, blades_<place>
    of the URDF, and the sense (+-1) of its reaction torque.
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
        """Return what pushes along `axes` (unit, root link's frame) at `points` (m, inertial frame): V-REP's particles.

        `commanded` returns the velocities (m/s) that scripts ask for.
        """
        return Propellers(law, axes, points, [sense for _, sense in cls.rotors], time_step, commanded)
