"""How the blades of a vehicle's propellers turn: looks only."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drone_sim.vehicles.body import Body
from drone_sim.vehicles.quadricopter_objects import joint
from drone_sim.vehicles.rotors import PROPELLERS, Rotors
from drone_sim.wording import near_names


class Blades:
    """The angles of the blades: as the air that went through turns them, or as the script says."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str, air: Callable[[], Sequence[float]]):
        """Take what they look like, and how much air (m) has gone through each propeller."""
        self._rotors = rotors
        self._body = body
        self._names = [joint(number) + suffix for number, _ in enumerate(PROPELLERS, start=1)]
        self._air = air
        self.reset()

    def reset(self) -> None:
        """Forget what a script has said."""
        self._said: dict[str, float] = {}
        self.turned = True  # by a script, since they were shown

    def has(self, name: str) -> bool:
        """Tell whether that is the name of one of the joints."""
        return name in self._names

    def turn(self, name: str, angle: float | None = None) -> float:
        """Turn a propeller's blades, by the name of their joint, to an angle (rad), unless None; return it.

        Raises ValueError for a name that is no joint.
        """
        if name not in self._names:
            raise ValueError(f"'{name}' is not a joint; {near_names(name, self._names)}")
        if angle is not None:
            self._said[name] = angle
            self.turned = True
        number = self._names.index(name)
        return self._said.get(name, self._rotors.angle(number, self._air()[number]))

    @property
    def angles(self) -> dict[str, float]:
        """Angle (rad, 0 to 2 pi) of each propeller's blades, by joint of the URDF."""
        return self._rotors.by_joint([self.turn(name) for name in self._names])

    def show(self) -> None:
        """Turn them in the world's pictures to where they are."""
        self.turned = False
        self._body.place_visuals(self._rotors.visuals(self.angles))

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what a script has said."""
        kept = dict(self._said)

        def recall() -> None:
            self._said, self.turned = dict(kept), True

        return recall
