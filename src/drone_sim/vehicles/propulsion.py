"""A vehicle's propellers: mounting, commanded particle velocities, thrust model and blade visuals."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from drone_sim.forces.propellers import PARTICLE_VELOCITY, PropellerParameters, Propellers
from drone_sim.mechanics import frames, urdf
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.inertia import Inertia, Inertial, combined
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.message_text import near_names
from drone_sim.vehicles.body import Body, Pushed
from drone_sim.vehicles.quadricopter_objects import DRONE, joint, respondable
from drone_sim.vehicles.types import VehicleType
from drone_sim.world.pictures import Place

_BLADE_TURN = 3.0  # rad per metre of air; slow enough that 20 images/s show the direction


class Rotors:
    """The links and blades of the propellers of one body."""

    def __init__(self, rigid: RigidBody, urdf_name: str, kind: VehicleType):
        """Read them from the URDF. Raises UrdfError if a link is missing."""
        self.kind = kind
        names = [f"propeller_{place}" for place in kind.places]
        for name in names:
            if name not in rigid.links:
                raise urdf.UrdfError(f"{urdf_name}: no link {name}")
        self.links: list[Matrix] = [rigid.links[name] for name in names]  # root from link
        self.inertials = [rigid.inertials[name] for name in names]  # without their blades, in the root link's frame
        self.others = [inertial for name, inertial in rigid.inertials.items() if name not in names]
        self.blades = rigid.blades
        self.joints = [f"blades_{place}_joint" for place in kind.places]  # names in the URDF


class Blades:
    """The angles of the blades: computed from the air flow, or set by a script."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str, law: Callable[[], Propellers]):
        """Create them; `law` returns the thrust model, which knows the air flow through each propeller."""
        self._rotors = rotors
        self._body = body
        self._names = [joint(number) + suffix for number, _ in enumerate(rotors.links, start=1)]
        self._law = law
        self.reset()

    def reset(self) -> None:
        """Drop the angles that scripts set."""
        self._set_angles: dict[str, float] = {}
        self.turned = True  # whether a script turned them since show()

    def has(self, name: str) -> bool:
        """Return whether `name` is one of the blade joints."""
        return name in self._names

    def turn(self, name: str, angle: float | None = None) -> float:
        """Set the angle (rad) of a blade joint, unless it is None; return the present angle.

        Raises ValueError if `name` is not a blade joint.
        """
        if name not in self._names:
            raise ValueError(f"'{name}' is not a joint; {near_names(name, self._names)}")
        if angle is not None:
            self._set_angles[name] = angle
            self.turned = True
        number = self._names.index(name)
        return self._set_angles.get(name, self._angle(number, self._law().air[number]))

    def _angle(self, number: int, air: float) -> float:
        """Return the angle (rad) of a propeller's blades after `air` metres of air; opposite to the reaction torque."""
        return -self._rotors.kind.rotors[number][1] * _BLADE_TURN * air

    @property
    def angles(self) -> dict[str, float]:
        """Angle (rad, 0 to 2 pi) of each propeller's blades, by URDF joint."""
        return {key: self.turn(name) % (2 * math.pi) for key, name in zip(self._rotors.joints, self._names)}

    def show(self) -> None:
        """Move the blades' visuals to the present angles; they rotate unless a script set their angle."""
        self.turned = False
        rates = [self._angle(number, flow) for number, flow in enumerate(self._law().velocities)]  # rad/s
        turning = [rate * (name not in self._set_angles) for name, rate in zip(self._names, rates)]
        angles, speeds = self.angles, dict(zip(self._rotors.joints, turning))
        places = {}
        for blades in self._rotors.blades:
            rotation = frames.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, angles.get(blades.joint_name, 0.0)))
            place = frames.multiply(frames.multiply(blades.joint, rotation), blades.local)
            places[blades.visual] = Place(place, blades.joint, speeds.get(blades.joint_name, 0.0))
        self._body.place_visuals(places)

    def save_state(self) -> Restore:
        """Return a function that restores the angles that scripts set."""
        return saved(self, "_set_angles")


class Propulsion:
    """The propulsion of one body. The shapes of the drone and its propellers are a single rigid body in the world."""

    def __init__(self, rotors: Rotors, body: Body, suffix: str):
        """Create it; `suffix` is appended to object names. Call `begin` and `attach` before anything else."""
        self.rotors = rotors
        self._body = body
        self._names = [respondable(number) + suffix for number, _ in enumerate(rotors.links, start=1)]
        self._commanded: list[dict[str, Any]] = [{} for _ in self._names]  # parameters of the propellers' scripts
        self._driven = list(self._commanded)  # those that the thrust model follows
        self._drone = DRONE + suffix
        links = dict(zip((self._drone, *self._names), (IDENTITY, *rotors.links)))
        self.shapes: dict[str, Matrix] = {  # inertial frame of the body from each of its dynamic shapes
            name: frames.multiply(body.inertial_from_root, link) for name, link in links.items()
        }
        self.blades = Blades(rotors, body, suffix, lambda: self.law)

    def begin(self, law: PropellerParameters, time_step: float) -> None:
        """Create the thrust model at rest, as at the start of a run."""
        kind, links = self.rotors.kind, self.rotors.links
        points = [frames.position(frames.multiply(self._body.inertial_from_root, link)) for link in links]
        axes = [(link[2], link[6], link[10]) for link in links]
        self.law = kind.thrust_model(law, axes, points, kind.senses, time_step, self._driven)
        self._body.propellers = self.law
        self.blades.reset()

    def attach(self, law: PropellerParameters) -> None:
        """Reset the parameters of the propellers' scripts, and take the commands from these."""
        for parameters in self._commanded:
            parameters.clear()
            parameters.update({PARTICLE_VELOCITY: 0.0, **particles(law)})
        self._driven[:] = self._commanded

    @property
    def script_parameters(self) -> dict[str, dict[str, Any]]:
        """The parameters of the propellers' scripts, by object name."""
        return dict(zip(self._names, self._commanded))

    @property
    def particle_velocities(self) -> tuple[float, ...]:
        """The commanded particle velocities (m/s) of propellers 1, 2, and so on."""
        return tuple([parameters[PARTICLE_VELOCITY] for parameters in self._commanded])

    def disable_thrust_model(self, name: str) -> dict[str, Any] | None:
        """Disable the built-in thrust model of a propeller, whose script applies the forces itself.

        Return the propeller's script parameters; None if `name` is not a propeller.
        """
        if name not in self._names:
            return None
        number = self._names.index(name)
        self._driven[number] = {PARTICLE_VELOCITY: 0.0}
        return self._commanded[number]

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Apply a force (N, world) at a point (m, the shape's frame) and a torque (N m, world) in the next step.

        Both keep their direction through the sub-steps. Raises ValueError if `shape` is not a dynamic shape.
        """
        self._body.add_force(Pushed(shape, force, torque, frames.transform(self._place(shape), offset)))

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Drop the forces, the torques or both that were added to a shape since the last step.

        Raises ValueError if `shape` is not a dynamic shape.
        """
        self._place(shape)
        self._body.drop_forces(shape, forces, torques)

    def _place(self, shape: str) -> Matrix:
        if shape not in self.shapes:
            raise ValueError(f"'{shape}' is not a dynamic shape; must be one of: {', '.join(self.shapes)}")
        return self.shapes[shape]

    def masses(self) -> dict[str, float]:
        """Return the mass (kg) of each shape, by object name."""
        masses = {name: inertial.mass for name, inertial in self._inertials()}
        return {self._drone: self._body.mass - sum(masses.values()), **masses}

    def inertias(self) -> dict[str, Inertia]:
        """Return the inertia of each shape with mass, in that shape's frame, by object name."""
        links = dict(zip(self._names, self.rotors.links))
        inertias = {name: inertial.seen_from(links[name]) for name, inertial in self._inertials() if inertial.mass}
        if sum(inertial.mass for inertial in self.rotors.others):
            inertias[self._drone] = combined(self.rotors.others).seen_from(IDENTITY)
        return inertias

    def _inertials(self) -> list[tuple[str, Inertial]]:
        return list(zip(self._names, self.rotors.inertials))


def particles(law: PropellerParameters) -> dict[str, float]:
    """Return the particle parameters that V-REP's scripts read, under V-REP's names."""
    return {
        "particleCountPerSecond": law.particles_per_second,
        "particleDensity": law.particle_density,
        "particleSize": 1.0,  # a factor, in the stock scripts
    }
