"""A vehicle's rigid body: pose and velocity, applied forces, rays and contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drone_sim.context import NOBODY, SimulationContext
from drone_sim.forces.force import Force
from drone_sim.forces.propellers import Propellers
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import Pose, State
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.mechanics.wrench import Wrench
from drone_sim.sensors.sensor import Contact, Hit
from drone_sim.world.pictures import Place

_ZERO: Vector = (0.0, 0.0, 0.0)


class Pushed(NamedTuple):
    """A script's force (N, world) at a point (m, inertial frame) and torque (N m, world) on the named shape."""

    shape: str
    force: Vector
    torque: Vector
    point: Vector

    def without(self, forces: bool, torques: bool) -> Pushed:
        """Return a copy with the force, the torque or both set to zero."""
        return self._replace(force=_ZERO if forces else self.force, torque=_ZERO if torques else self.torque)


class Body:
    """One rigid body, in the frame of the URDF's root link. Sensors are mounted on it (sensors.sensor.Carrier)."""

    state: State  # as of the last refresh() or move()
    matrix: Matrix  # world from root link
    _last_read: State | None = None  # the state from which `matrix` was computed
    propellers: Propellers  # of the current run

    def __init__(self, rigid: RigidBody, start: Pose, context: SimulationContext):
        """Add the body to the world at `start`, at rest."""
        self.rigid = rigid
        self.mass, self.gravity = rigid.mass, context.gravity
        self.datum, self.magnetic_field = context.datum, context.magnetic_field
        self.teleports = 0  # number of teleports
        self.pushes = 0  # number of forces that scripts added
        self.is_held = False  # dragged by a user; not saved in snapshots
        self._context = context
        self._world = context.world
        self.number = self._world.add_rigid_body(rigid, start)
        self.inertial_from_root: Matrix = frames.invert(self._world.inertial_frame(self.number))
        # URDF link, except the root -> its parent link (`base_link` for the root) and its pose in the parent's frame
        self.links = {name: (self._link_name(parent), matrix) for name, (parent, matrix) in rigid.parents.items()}
        # for each visual: its link, and its pose in that link's frame
        self.visual_places = [(self._link_name(name), matrix) for name, matrix in rigid.visuals]
        self.start = start
        self.reset()

    def _link_name(self, link: str) -> str:
        return link if link in self.rigid.parents else "base_link"

    # ---- pose

    def reset(self) -> None:
        """Return to the start pose at rest; drop the scripts' forces and end a drag."""
        self.let_go()
        self._world.set_pose(self.number, self.start)
        self.pending: list[Pushed] = []  # by scripts; acts in the next step
        self.refresh()

    def begin_on_floor(self) -> None:
        """Move the start pose onto the surface below, or to z = 0 if there is none, and reset to it."""
        (x, y, z), orientation = self.start
        below = self._world.queries.ray((x, y, z), (x, y, 0.0), ignoring=self.number)
        ground = z - below.distance if below else 0.0
        self.start = Pose((x, y, z - self._world.queries.lowest(self.number) + ground), orientation)
        self.reset()

    def begin_again(self) -> None:
        """Return to the start pose during a run, and forget the body's contacts."""
        self.teleports += 1
        self._world.part(self.number)
        self.reset()

    def refresh(self) -> None:
        """Read the state back from the world."""
        state = self._world.state(self.number)
        if state is not self._last_read:
            self._last_read = self.state = state
            self.matrix = frames.from_quaternion(state.position, state.orientation)

    def move(self, pose: Pose) -> None:
        self.teleports += 1
        self._world.set_pose(self.number, pose)
        self.refresh()

    def hold(self) -> None:
        """Freeze the body, whatever forces act on it, until let_go()."""
        if not self.is_held:
            self.is_held = True
            self._world.collision_filter.freeze(self.number, still=True)
            self.refresh()

    def let_go(self) -> None:
        """End hold(): the body moves again, from rest."""
        if self.is_held:
            self.is_held = False
            self._world.collision_filter.freeze(self.number, still=False)

    def restored(self) -> None:
        """Read the state after the world was restored from a snapshot."""
        self.teleports += 1
        self.pending = []
        self.refresh()

    def place_visuals(self, places: Mapping[int, Place]) -> None:
        """Move some of the visuals, by index; this does not affect the dynamics."""
        self._world.pictures.place(self.number, places)

    # ---- forces

    @property
    def wind(self) -> Vector:
        """Wind velocity at the body's position (m/s, world)."""
        return self._context.weather.at(self.state.position)

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N, in the last step."""
        return self.propellers.thrusts

    def add_force(self, push: Pushed) -> None:
        """Add a force and a torque that act during the next step."""
        self.pushes += 1
        self.pending.append(push)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Drop the forces, the torques or both that were added to a shape since the last step."""
        self.pending = [push.without(forces, torques) if push.shape == shape else push for push in self.pending]

    def take_pushes(self, wrench: Wrench) -> None:
        """Add the scripts' forces to the wrench of the step that begins, and clear them."""
        for _, force, torque, point in self.pending:
            wrench.add(force, torque, point)
        self.pending = []

    def apply(self, forces: Sequence[Force]) -> None:
        """Apply forces, evaluated at the state of the last refresh(), in the next sub-step; not while it is held."""
        if not self.is_held:
            wrench = Wrench()
            for force in forces:
                force.add_to(wrench, self)
            self._world.apply(self.number, wrench)

    # ---- rays and contacts

    def ray(self, start: Vector, end: Vector) -> Hit | None:
        """Return the first hit of a ray (m, world), ignoring the body itself; None if there is none."""
        hit = self._world.queries.ray(start, end, ignoring=self.number)
        return None if hit is None else Hit(hit.distance, self._context.name_of(hit.body), hit.normal)

    def contacts(self) -> list[Contact]:
        """Return the body's contacts in the last sub-step."""
        names = self._context.names
        contacts = self._world.queries.contacts(self.number)
        return [Contact(names.get(hit.body, NOBODY)[0], hit.point, hit.normal, hit.force) for hit in contacts]
