"""A vehicle's four propellers: where they sit, what scripts command, the law that makes thrust of it, their blades."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from drone_sim.forces.propellers import PropellerParameters, Propellers
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix
from drone_sim.mechanics.inertia import Inertia, Inertial, together
from drone_sim.vehicles.blades import Blades
from drone_sim.vehicles.body import Body
from drone_sim.vehicles.quadricopter_objects import DRONE, respondable
from drone_sim.vehicles.rotors import Rotors
from drone_sim.vehicles.script_parameters import NUMBERS, PARTICLE_VELOCITY

_Four = tuple[float, float, float, float]


class Propulsion:
    """What drives one body; its shapes are the drone and the four propellers, which are one body in the world."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str):
        """Take where they sit, and the suffix of the objects' names; `begin` and `attach` come before anything else."""
        self.rotors = rotors
        self._body = body
        self._names = [respondable(number) + suffix for number in NUMBERS]
        self._whole = DRONE + suffix
        links = dict(zip((self._whole, *self._names), (IDENTITY, *rotors.links)))
        self.shapes: dict[str, Matrix] = {  # inertial frame of the body from each of its dynamic shapes
            name: frames.multiply(body.inertial_from_root, link) for name, link in links.items()
        }
        self.blades = Blades(rotors, body, suffix, lambda: self.law.air)

    def begin(self, law: PropellerParameters, time_step: float) -> None:
        """Stand still, as at the start of a run."""
        self.law: Propellers = self.rotors.propellers(law, self._body.inertial_from_root, time_step, self._velocities)
        self.blades.reset()

    def attach(self, parameters: Mapping[str, dict[str, Any]]) -> None:
        """Obey these parameters of scripts, by the scripts' objects."""
        self._commanded = [parameters[name] for name in self._names]
        self._driven = list(self._commanded)

    @property
    def particle_velocities(self) -> _Four:
        """What the script commands: m/s, propellers 1 to 4."""
        (first, second, third, fourth), key = self._commanded, PARTICLE_VELOCITY
        return first[key], second[key], third[key], fourth[key]

    def _velocities(self) -> _Four:
        (first, second, third, fourth), key = self._driven, PARTICLE_VELOCITY
        return first[key], second[key], third[key], fourth[key]

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust (N) of propellers 1 to 4 in the last step."""
        return self.law.thrusts

    def give_way(self, name: str) -> dict[str, Any] | None:
        """Let a script of its own drive a propeller, in the place of the built-in law.

        Return its parameters; None for the name of what is no propeller.
        """
        if name not in self._names:
            return None
        number = self._names.index(name)
        self._driven[number] = {PARTICLE_VELOCITY: 0.0}
        return self._commanded[number]

    def masses(self) -> dict[str, float]:
        """Return the mass (kg) of each shape, by object name."""
        own = {name: one.mass for name, one in self._inertials()}
        return {self._whole: self._body.mass - sum(own.values()), **own}

    def inertias(self) -> dict[str, Inertia]:
        """Return how the mass of each shape lies, in that shape's frame, by object name."""
        links = dict(zip(self._names, self.rotors.links))
        found = {name: one.seen_from(links[name]) for name, one in self._inertials() if one.mass}
        if sum(one.mass for one in self.rotors.others):
            found[self._whole] = together(self.rotors.others).seen_from(IDENTITY)
        return found

    def _inertials(self) -> list[tuple[str, Inertial]]:
        return list(zip(self._names, self.rotors.inertials))
