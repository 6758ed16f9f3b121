"""A vehicle's body in the world: where it is, how it moves, what pushes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drone_sim.forces.force import Force
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import Pose, State
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.mechanics.wrench import Wrench
from drone_sim.world import World


class Body:
    """One rigid body; its frame is the URDF's root link."""

    state: State  # after the last sub-step that was looked at, or move
    matrix: Matrix  # world from root link

    def __init__(self, rigid: RigidBody, start: Pose, world: World):
        """Put it into the world, at rest."""
        self.rigid = rigid
        self.mass = rigid.mass
        self.jumps = 0  # how often it was put somewhere else
        self.number = world.add_rigid_body(rigid, start)
        self.inertial_from_root: Matrix = frames.invert(world.inertial_frame(self.number))
        self._links = {name: (self._named(above), matrix) for name, (above, matrix) in rigid.parents.items()}
        self._start = start
        self._world = world
        self.air: Callable[[Vector], Vector] = lambda place: (0.0, 0.0, 0.0)  # its velocity (m/s, world) at a place
        self.reset()

    def reset(self) -> None:
        """Return to the start, at rest, with nothing that pushes."""
        self._world.set_pose(self.number, self._start)
        self.wrench = Wrench()  # of the next step
        self.refresh()

    def begin_on_floor(self) -> None:
        """Have its start on what is below, the floor's height where nothing is, and be there."""
        (x, y, z), turn = self._start
        below = self._world.ray((x, y, z), (x, y, 0.0), ignoring=self.number)
        ground = z - below.distance if below else 0.0
        self._start = Pose((x, y, z - self._world.lowest(self.number) + ground), turn)
        self.reset()

    def begin_again(self) -> None:
        """Return to the start in the middle of a run, as if it had touched nothing by then."""
        self.jumps += 1
        self._world.part(self.number)
        self.reset()

    def refresh(self) -> None:
        """Read the state back from the world."""
        self.state = self._world.state(self.number)
        self.matrix = self.state.matrix

    def move(self, pose: Pose) -> None:
        """Put it somewhere else, at rest."""
        self.jumps += 1
        self._world.set_pose(self.number, pose)
        self.refresh()

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""
        return self.air(self.state.position)

    @property
    def links(self) -> dict[str, tuple[str, Matrix]]:
        """Of each link of the URDF but the root: the one above, `base_link` for the root, and where it sits on it."""
        return self._links

    @property
    def visual_places(self) -> list[tuple[str, Matrix]]:
        """Of each visual: the link that it belongs to, and where it sits on that."""
        return [(self._named(name), matrix) for name, matrix in self.rigid.visuals]

    def _named(self, link: str) -> str:
        return link if link in self.rigid.parents else "base_link"

    def place_visuals(self, places: Mapping[int, Matrix]) -> None:
        """Move some of its visuals, by index, to other places in the root link's frame: looks only."""
        self._world.place_visuals(self.number, places)

    def restored(self) -> None:
        """Follow the world, which was put back to what it had been."""
        self.jumps += 1
        self.wrench = Wrench()
        self.refresh()

    def add_force(self, force: Vector, torque: Vector, point: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m, inertial frame), and a torque (N m, world)."""
        self.wrench.add(force, torque, point)

    def apply(self, force: Force) -> None:
        """Let a force act in the sub-step that comes, as it is at this moment."""
        self.refresh()
        wrench = Wrench()
        force.add_to(wrench, self)
        self._world.apply(self.number, wrench)
