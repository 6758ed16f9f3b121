"""A vehicle's propellers: where they sit, what scripts command, the law that makes thrust of it, their blades."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from drone_sim.forces.propellers import PropellerParameters, Propellers
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.inertia import Inertia, Inertial, combined
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.message_text import near_names
from drone_sim.vehicles.body import Body, Pushed
from drone_sim.vehicles.quadricopter_objects import DRONE, joint, respondable
from drone_sim.vehicles.types.vehicle_type import VehicleType
from drone_sim.world.pictures import Place

PARTICLE_VELOCITY = "particleVelocity"
_BLADE_TURN = 3.0  # rad per metre of air: slow enough for 20 pictures a second to show which way


class Rotors:
    """The links and blades of the propellers of one body."""

    def __init__(self, rigid: RigidBody, urdf_name: str, type_of_vehicle: type[VehicleType]):
        """Find them; raises UrdfError for a link that is missing."""
        self._type = type_of_vehicle
        own = [f"propeller_{place}" for place, _ in type_of_vehicle.rotors]
        for name in own:
            if name not in rigid.links:
                raise urdf.UrdfError(f"{urdf_name}: no link {name}")
        self.links: list[Matrix] = [rigid.links[name] for name in own]  # root from link
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
        return self._type.propellers(law, axes, points, time_step, commanded)

    def angle(self, number: int, air: float) -> float:
        """Return the angle (rad) of a propeller's blades, from 0: they turn opposite to their reaction torque."""
        return -self._type.rotors[number][1] * _BLADE_TURN * air

    def by_joint(self, values: Sequence[float]) -> dict[str, float]:
        """Return values of the propellers by their blades' joint of the URDF."""
        return {f"blades_{place}_joint": value for (place, _), value in zip(self._type.rotors, values)}

    def visuals(self, angles: dict[str, float], speeds: dict[str, float]) -> dict[int, Place]:
        """Return where the blades' visuals are, at these angles and speeds (rad/s) by joint: by index."""
        places = {}
        for blades in self._blades:
            turned = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angles.get(blades.joint_name, 0.0)))
            place = frames.multiply(frames.multiply(blades.joint, turned), blades.local)
            places[blades.visual] = Place(place, blades.joint, speeds.get(blades.joint_name, 0.0))
        return places


class Blades:
    """The angles of the blades: as the air that went through turns them, or as the script says."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str, law: Callable[[], Propellers]):
        """Take what they look like, and the law that says how much air goes through each propeller."""
        self._rotors = rotors
        self._body = body
        self._names = [joint(number) + suffix for number, _ in enumerate(rotors.links, start=1)]
        self._law = law
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
        return self._said.get(name, self._rotors.angle(number, self._law().air[number]))

    @property
    def angles(self) -> dict[str, float]:
        """Angle (rad, 0 to 2 pi) of each propeller's blades, by joint of the URDF."""
        return self._rotors.by_joint([self.turn(name) % (2 * math.pi) for name in self._names])

    @property
    def _speeds(self) -> dict[str, float]:
        """How fast each propeller's blades turn (rad/s), by joint of the URDF; 0 where a script turns them."""
        speeds = [self._rotors.angle(number, flow) for number, flow in enumerate(self._law().velocities)]
        return self._rotors.by_joint([speed * (name not in self._said) for name, speed in zip(self._names, speeds)])

    def show(self) -> None:
        """Turn them in the world's pictures to where they are."""
        self.turned = False
        self._body.place_visuals(self._rotors.visuals(self.angles, self._speeds))

    def save_state(self) -> Restore:
        """Return a function that brings back what a script has said."""
        return saved(self, "_said")


class Propulsion:
    """What drives one body; its shapes are the drone and its propellers, which are one body in the world."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str):
        """Take where they sit, and the suffix of the objects' names; `begin` and `attach` come before anything else."""
        self.rotors = rotors
        self._body = body
        self._names = [respondable(number) + suffix for number, _ in enumerate(rotors.links, start=1)]
        self._commanded: list[dict[str, Any]] = [{} for _ in self._names]  # parameters of the propellers' scripts
        self._whole = DRONE + suffix
        links = dict(zip((self._whole, *self._names), (IDENTITY, *rotors.links)))
        self.shapes: dict[str, Matrix] = {  # inertial frame of the body from each of its dynamic shapes
            name: frames.multiply(body.inertial_from_root, link) for name, link in links.items()
        }
        self.blades = Blades(rotors, body, suffix, lambda: self.law)

    def begin(self, law: PropellerParameters, time_step: float) -> None:
        """Stand still, as at the start of a run."""
        self.law: Propellers = self.rotors.propellers(law, self._body.inertial_from_root, time_step, self._velocities)
        self._body.propellers = self.law
        self.blades.reset()

    def attach(self, law: PropellerParameters) -> None:
        """Obey the parameters of the propellers' scripts, which are as at a start."""
        for one in self._commanded:
            one.clear()
            one.update({PARTICLE_VELOCITY: 0.0, **particles(law)})
        self._driven = list(self._commanded)

    @property
    def script_parameters(self) -> dict[str, dict[str, Any]]:
        """The parameters of the propellers' scripts, by the scripts' objects."""
        return dict(zip(self._names, self._commanded))

    @property
    def particle_velocities(self) -> tuple[float, ...]:
        """What the script commands: m/s, propellers 1, 2, and so on."""
        return tuple([one[PARTICLE_VELOCITY] for one in self._commanded])

    def _velocities(self) -> Sequence[float]:
        return [one[PARTICLE_VELOCITY] for one in self._driven]

    def give_way(self, name: str) -> dict[str, Any] | None:
        """Let a script of its own drive a propeller, in the place of the built-in law.

        Return its parameters; None for the name of what is no propeller.
        """
        if name not in self._names:
            return None
        number = self._names.index(name)
        self._driven[number] = {PARTICLE_VELOCITY: 0.0}
        return self._commanded[number]

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Both keep their direction through the sub-steps. Raises ValueError for an object that is no dynamic shape.
        """
        self._body.add_force(Pushed(shape, force, torque, frames.transform(self._place(shape), offset)))

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Forget the forces on a shape, or the torques, or both, that were added since the last step.

        Raises ValueError for an object that is no dynamic shape.
        """
        self._place(shape)
        self._body.drop_forces(shape, forces, torques)

    def _place(self, shape: str) -> Matrix:
        if shape not in self.shapes:
            raise ValueError(f"'{shape}' is not a dynamic shape; there are: {', '.join(self.shapes)}")
        return self.shapes[shape]

    def masses(self) -> dict[str, float]:
        """Return the mass (kg) of each shape, by object name."""
        own = {name: one.mass for name, one in self._inertials()}
        return {self._whole: self._body.mass - sum(own.values()), **own}

    def inertias(self) -> dict[str, Inertia]:
        """Return how the mass of each shape lies, in that shape's frame, by object name."""
        links = dict(zip(self._names, self.rotors.links))
        found = {name: one.seen_from(links[name]) for name, one in self._inertials() if one.mass}
        if sum(one.mass for one in self.rotors.others):
            found[self._whole] = combined(self.rotors.others).seen_from(IDENTITY)
        return found

    def _inertials(self) -> list[tuple[str, Inertial]]:
        return list(zip(self._names, self.rotors.inertials))


def particles(law: PropellerParameters) -> dict[str, float]:
    """Return what V-REP's scripts read of the particles, under its names."""
    return {
        "particleCountPerSecond": law.particles_per_second,
        "particleDensity": law.particle_density,
        "particleSize": 1.0,  # a factor, in the stock scripts
    }
