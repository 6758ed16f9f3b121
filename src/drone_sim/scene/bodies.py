"""Shapes of the scene as the object tree sees them: what stands, what is carried, what the dynamics moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector, cross
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose, State
from drone_sim.scene.entry import Place
from drone_sim.world import World


class ShapeInWorld(NamedTuple):
    """What a shape is in the world: a link (-1: the root) of a body, how heavy (kg), and whether it stands still.

    local: the shape's frame in its parent's; of what is held, in that of its joint, as it has moved.
    """

    number: int
    link: int
    local: Matrix
    mass: float
    static: bool = False


class SceneBody:
    """One object of the scene that the dynamics moves, as the object tree sees it."""

    def __init__(self, world: World, number: int):
        """Take the world and the number of the body in it."""
        self._world = world
        self.number = number

    @property
    def state(self) -> State:
        """Pose and velocity."""
        return self._world.state(self.number)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return self.state.matrix

    def move(self, pose: Pose) -> None:
        """Put it there, at rest."""
        self._world.set_pose(self.number, pose)


class LinkBody:
    """A shape that a joint or a force sensor holds."""

    def __init__(self, world: World, number: int, link: int, local: Matrix):
        """Take the world, the number of the body in it, of its link, and that link's frame from the shape's."""
        self._world = world
        self.number = number
        self.link = link
        self._local = local

    @property
    def state(self) -> State:
        """Pose and velocity."""
        link = self._world.joints.link_state(self.number, self.link)
        matrix = frames.multiply(link.matrix, self._local)
        arm = frames.rotate(link.matrix, frames.position(self._local))
        x, y, z = cross(link.angular_velocity, arm)
        vx, vy, vz = link.linear_velocity
        velocity = vx + x, vy + y, vz + z
        return State(frames.position(matrix), frames.to_quaternion(matrix), velocity, link.angular_velocity)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return frames.multiply(self._world.joints.link_state(self.number, self.link).matrix, self._local)

    def inertia(self) -> Inertia:
        """Return how its mass lies in its frame."""
        found = self._world.inertia(self.number, self.link)
        return found._replace(frame=frames.multiply(frames.invert(self._local), found.frame))

    def move(self, pose: Pose) -> None:
        """Refuse: its joint says where it is. Raises ValueError."""
        raise ValueError("a joint holds this shape, so it cannot be moved")


class CarriedBody:
    """A body without mass that follows the frame that carries it."""

    def __init__(self, world: World, number: int, frame: Callable[[], Matrix]):
        """Take the world, the number of the body in it, and what returns world from its frame."""
        self._world = world
        self._number = number
        self._frame = frame
        self._at: Matrix | None = None

    def follow(self) -> None:
        """Put it where its frame is, unless it is there."""
        matrix = self._frame()
        if matrix != self._at:
            self._at = matrix
            self._world.set_pose(self._number, Pose(frames.position(matrix), frames.to_quaternion(matrix)))

    def renew(self) -> None:
        """Put it where its frame is, if it was ever put anywhere: the world's state may have been restored."""
        if self._at is not None:
            self._at = None
            self.follow()


class ShapeObject(SceneObject):
    """A shape: free where it has a mass, held where it hangs on a joint, else it stands still in its parent's frame."""

    number: int  # its body in the world
    link: int  # its link there, -1 for the root
    mass: float  # kg, 0 for what never moves

    def __init__(
        self,
        place: Place,
        world: World,
        changed: Callable[[ShapeObject], None],
        follow: Callable[[], None],
        solid: ShapeInWorld,
    ):
        """Take where it is in the tree, and as what in the world.

        `changed` is told whenever it hangs on something else, or has become static or dynamic; `follow` when it is put.
        """
        self._world = world
        self._parent = place.parent
        self._changed, self._follow = changed, follow
        super().__init__(*place, kind="shape")
        self.embody(solid)
        self.pass_carriers()

    def embody(self, solid: ShapeInWorld) -> None:
        """Use this body in the world from now on; `pass_carriers` has to be called next."""
        self.number, self.link, local, self.mass, static = solid
        self._passing: set[int] = set()
        self.carried = CarriedBody(self._world, self.number, self.matrix)
        if self.is_held:
            self.local = IDENTITY
            self.body = LinkBody(self._world, self.number, self.link, local)
        else:
            self.local = local
            self.body = SceneBody(self._world, self.number) if self.mass and not static else None
            if static and self.mass:
                self._world.collision_filter.freeze(self.number, still=True)
        self._changed(self)

    @property
    def is_held(self) -> bool:
        """Whether a joint or a force sensor holds it: nobody puts it anywhere else."""
        return self.link != -1

    @property
    def is_loose(self) -> bool:
        """Whether it follows its parent only when a script moves that parent."""
        return not self.is_held and super().is_loose

    @property
    def parent(self) -> SceneObject | None:  # type: ignore[override]
        """What carries it, where it has no mass."""
        return self._parent

    @parent.setter
    def parent(self, parent: SceneObject | None) -> None:
        if parent is not self._parent:
            self._parent = parent
            self._renew()

    def inertia(self) -> Inertia | None:
        """Return how its mass lies in it, None where the dynamics leaves it alone."""
        if isinstance(self.body, LinkBody):
            return self.body.inertia() if self.mass else None
        return None if self.is_static else self._world.inertia(self.number)

    @property
    def is_static(self) -> bool:
        """Whether the dynamics leaves it alone."""
        return self.body is None

    def set_static(self, static: bool) -> None:
        """Let the dynamics leave it alone, or move it again. Raises ValueError for what has never had a mass."""
        if static == self.is_static or self.is_held:
            return
        if not self.mass:
            raise ValueError(f"'{self.name}' has no mass in the scene file, so it stays static")
        matrix = self.matrix()
        self.body = None if static else SceneBody(self._world, self.number)
        self._world.collision_filter.freeze(self.number, static)
        self._renew()
        self.put(matrix)

    def put(self, matrix: Matrix) -> None:
        """Put it there, and its body. Raises ValueError for what is held."""
        if self.is_held:
            above = self.parent.name if self.parent is not None else ""
            raise ValueError(f"'{self.name}' is held by '{above}': set that joint, or move the joint's parent")
        super().put(matrix)
        if self.is_static:
            self.carried.follow()
            self._follow()

    def push(self, force: Vector, torque: Vector) -> None:
        """Let a force (N) at its centre of mass and a torque (N m) act in the next step, both in the world frame.

        What the dynamics leaves alone feels nothing.
        """
        if not self.is_static:
            self._world.shape_forces.add(self.number, self.link, force, torque)

    def drop_pushes(self, forces: bool, torques: bool) -> None:
        """Forget the forces, or the torques, or both, that have pushed it since the last step."""
        self._world.shape_forces.drop(self.number, self.link, forces, torques)

    def release(self) -> None:
        """Move by the dynamics again, and without a carrier, before another object takes its place."""
        if self.mass:
            self.set_static(False)
        self.parent = None

    def save_state(self) -> Callable[[], None]:
        """Return a function that puts it back where it is now, as static as it is."""
        put_back, static = super().save_state(), self.is_static

        def restore() -> None:
            self.set_static(static)
            put_back()

        return restore

    def forget_body(self, number: int) -> None:
        """Forget a removed body with which it did not collide."""
        self._passing.discard(number)

    def _renew(self) -> None:
        self.pass_carriers()
        self._changed(self)

    def pass_carriers(self) -> None:
        """Do not collide with what carries it."""
        above = bodies_above(self) if self.is_static else set()
        for number in self._passing - above:
            self._world.collision_filter.let_pass(self.number, number, passes=False)
        for number in above - self._passing:
            self._world.collision_filter.let_pass(self.number, number)
        self._passing = above


def bodies_above(one: SceneObject) -> set[int]:
    """Return the bodies in the world of what carries an object."""
    found = set()
    above = one.parent
    while above is not None:
        carrier = above if isinstance(above, ShapeObject) else above.body
        number = getattr(carrier, "number", None)
        if number is not None:
            found.add(number)
        above = above.parent
    return found
