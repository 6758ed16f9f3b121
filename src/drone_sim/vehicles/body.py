"""A vehicle's body in the world: where it is, how it moves, what pushes it, what it meets."""

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

_NONE: Vector = (0.0, 0.0, 0.0)


class Pushed(NamedTuple):
    """A force (N, world) at a point (m, inertial frame) and a torque (N m, world), on the shape of a name."""

    shape: str
    force: Vector
    torque: Vector
    point: Vector

    def without(self, forces: bool, torques: bool) -> Pushed:
        """Return what is left without its force, its torque, or both."""
        return self._replace(force=_NONE if forces else self.force, torque=_NONE if torques else self.torque)


class Body:
    """One rigid body; its frame is the URDF's root link. It carries the sensors (sensors.sensor.Carrier)."""

    state: State  # after the last sub-step that was looked at, or move
    matrix: Matrix  # world from root link
    _read: State | None = None  # that `matrix` was computed from
    propellers: Propellers  # that drive it, as long as the run lasts

    def __init__(self, rigid: RigidBody, start: Pose, context: SimulationContext):
        """Put it into the world, at rest."""
        self.rigid = rigid
        self.mass, self.gravity = rigid.mass, context.gravity
        self.datum, self.magnetic_field = context.datum, context.magnetic_field
        self.jumps = 0  # how often it was put somewhere else
        self.pushes = 0  # how often a script has pushed it
        self.is_held = False  # in somebody's hand: no part of what snapshots remember, nor of a run
        self._context = context
        self._world = context.world
        self.number = self._world.add_rigid_body(rigid, start)
        self.inertial_from_root: Matrix = frames.invert(self._world.inertial_frame(self.number))
        # Of each link of the URDF but the root: the one above, `base_link` for the root, and where it sits on it.
        self.links = {name: (self._named(above), matrix) for name, (above, matrix) in rigid.parents.items()}
        # Of each visual: the link that it belongs to, and where it sits on that.
        self.visual_places = [(self._named(name), matrix) for name, matrix in rigid.visuals]
        self.start = start  # where it begins
        self.reset()

    def _named(self, link: str) -> str:
        return link if link in self.rigid.parents else "base_link"

    # ---- where it is

    def reset(self) -> None:
        """Return to the start, at rest, with nothing that pushes and nobody who holds it."""
        self.let_go()
        self._world.set_pose(self.number, self.start)
        self._pushed: list[Pushed] = []  # in the next step
        self.refresh()

    def begin_on_floor(self) -> None:
        """Have its start on what is below, the floor's height where nothing is, and be there."""
        (x, y, z), turn = self.start
        below = self._world.queries.ray((x, y, z), (x, y, 0.0), ignoring=self.number)
        ground = z - below.distance if below else 0.0
        self.start = Pose((x, y, z - self._world.queries.lowest(self.number) + ground), turn)
        self.reset()

    def begin_again(self) -> None:
        """Return to the start in the middle of a run, as if it had touched nothing by then."""
        self.jumps += 1
        self._world.part(self.number)
        self.reset()

    def refresh(self) -> None:
        """Read the state back from the world."""
        state = self._world.state(self.number)
        if state is not self._read:
            self._read = self.state = state
            self.matrix = state.matrix

    def move(self, pose: Pose) -> None:
        """Put it somewhere else, at rest."""
        self.jumps += 1
        self._world.set_pose(self.number, pose)
        self.refresh()

    def hold(self) -> None:
        """Let it stand still, whatever pulls at it, until it is let go."""
        if not self.is_held:
            self.is_held = True
            self._world.collision_filter.freeze(self.number, still=True)
            self.refresh()

    def let_go(self) -> None:
        """Let it fly on, from rest."""
        if self.is_held:
            self.is_held = False
            self._world.collision_filter.freeze(self.number, still=False)

    def restored(self) -> None:
        """Follow the world, which was put back to what it had been."""
        self.jumps += 1
        self._pushed = []
        self.refresh()

    def place_visuals(self, places: Mapping[int, Place]) -> None:
        """Move some of its visuals, by index, to other places: looks only."""
        self._world.pictures.place(self.number, places)

    # ---- what pushes it

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""
        return self._context.weather.at(self.state.position)

    @property
    def thrusts(self) -> Sequence[float]:
        """Thrust of each propeller in N, in the last step."""
        return self.propellers.thrusts

    def add_force(self, push: Pushed) -> None:
        """Let a force and a torque act in the next step."""
        self.pushes += 1
        self._pushed.append(push)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Forget the forces on a shape, or the torques, or both, that were added since the last step."""
        self._pushed = [one.without(forces, torques) if one.shape == shape else one for one in self._pushed]

    def take_pushes(self) -> Wrench:
        """Return what scripts push it with in the step that begins, and forget it."""
        wrench, pushed, self._pushed = Wrench(), self._pushed, []
        for _, force, torque, point in pushed:
            wrench.add(force, torque, point)
        return wrench

    def apply(self, force: Force) -> None:
        """Let a force act in the sub-step that comes, as it is at this moment; none moves what somebody holds."""
        if self.is_held:
            return
        self.refresh()
        wrench = Wrench()
        force.add_to(wrench, self)
        self._world.apply(self.number, wrench)

    # ---- what it meets

    def ray(self, start: Vector, end: Vector) -> Hit | None:
        """Return what a ray (m, world) meets first that is not the body itself; None for nothing."""
        hit = self._world.queries.ray(start, end, ignoring=self.number)
        return None if hit is None else Hit(hit.distance, self._context.name_of(hit.body), hit.normal)

    def contacts(self) -> list[Contact]:
        """Return what it touched in the last sub-step."""
        names = self._context.names
        touched = self._world.queries.contacts(self.number)
        return [Contact(names.get(one.body, NOBODY)[0], one.point, one.normal, one.force) for one in touched]
