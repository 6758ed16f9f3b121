"""Where V-REP's four propellers sit on a URDF, and how their blades look as they turn."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from drone_sim.forces.propellers import PropellerParameters, Propellers
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.urdf import RigidBody

# V-REP's propellers 1 to 4: where they sit, and the sense of their reaction torque.
PROPELLERS = (("front_left", -1), ("back_left", +1), ("back_right", -1), ("front_right", +1))
_BLADE_TURN = 3.0  # rad per metre of air: slow enough for 20 pictures a second to show which way


class Rotors:
    """The links and blades of the propellers of one body."""

    def __init__(self, rigid: RigidBody, urdf_name: str):
        """Find them; raises UrdfError for a link that is missing."""
        for place, _ in PROPELLERS:
            if f"propeller_{place}" not in rigid.links:
                raise urdf.UrdfError(f"{urdf_name}: no link propeller_{place}")
        self.links: list[Matrix] = [rigid.links[f"propeller_{place}"] for place, _ in PROPELLERS]  # root from link
        own = [f"propeller_{place}" for place, _ in PROPELLERS]
        self.inertials = [rigid.inertials[name] for name in own]  # without their blades, in the root link's frame
        self.others = [one for name, one in rigid.inertials.items() if name not in own]
        self._blades = rigid.blades

    def propellers(
        self,
        law: PropellerParameters,
        inertial_from_root: Matrix,
        time_step: float,
        commanded: Callable[[], Sequence[float]],
    ) -> Propellers:
        """Return what pushes there, at the velocities (m/s) that `commanded` returns."""
        points = [frames.position(frames.multiply(inertial_from_root, link)) for link in self.links]
        axes = [(link[2], link[6], link[10]) for link in self.links]
        return Propellers(law, axes, points, [sense for _, sense in PROPELLERS], time_step, commanded)

    @staticmethod
    def angle(number: int, air: float) -> float:
        """Return the angle (rad) of a propeller's blades, from 0: they turn against the torque that they leave."""
        return -PROPELLERS[number][1] * _BLADE_TURN * air

    @staticmethod
    def by_joint(angles: Sequence[float]) -> dict[str, float]:
        """Return the blades' angles (rad, 0 to 2 pi) by joint of the URDF."""
        return {f"blades_{place}_joint": angle % (2 * math.pi) for (place, _), angle in zip(PROPELLERS, angles)}

    def visuals(self, angles: dict[str, float]) -> dict[int, Matrix]:
        """Return where the blades' visuals are at these angles by joint: by index, in the root link's frame."""
        places = {}
        for blades in self._blades:
            turned = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angles.get(blades.joint_name, 0.0)))
            places[blades.visual] = frames.multiply(frames.multiply(blades.joint, turned), blades.local)
        return places
