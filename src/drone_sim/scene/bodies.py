"""Shapes of the scene as the object tree sees them: what stands, what is carried, what the dynamics moves."""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, cross
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose, State
from drone_sim.scene.entry import Place
from drone_sim.world import World


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
        raise ValueError("a shape that a joint holds is put nowhere else")


class HeldShape(SceneObject):
    """A shape that a joint or a force sensor holds: nobody puts it anywhere else."""

    is_loose = False
    is_held = True
    mass = 0.0  # kg

    def inertia(self) -> Inertia | None:
        """Return how its mass lies in it, None where it has none."""
        return self.body.inertia() if isinstance(self.body, LinkBody) and self.mass else None

    def put(self, matrix: Matrix) -> None:
        """Refuse. Raises ValueError."""
        above = self.parent.name if self.parent is not None else ""
        raise ValueError(f"'{self.name}' is held by '{above}': set that joint, or move what it hangs on")


class Carried:
    """A body without mass that goes where the frame goes that carries it."""

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
        """Put it where its frame is, if it ever was put anywhere: the world may have been put back since."""
        if self._at is not None:
            self._at = None
            self.follow()


class Shape(SceneObject):
    """A shape that no joint holds: free where it has a mass, else it stands still in its parent's frame."""

    def __init__(
        self,
        place: Place,
        *,
        world: World,
        number: int,
        mass: float,
        changed: Callable[[Shape], None],
        follow: Callable[[], None],
    ):
        """Take where it is, the number of its body, and its mass (kg).

        `changed` is told whenever it hangs on something else, or has become static or dynamic; `follow` when it is put.
        """
        self.number = number
        self._world = world
        self.mass = mass
        self._parent: SceneObject | None = None
        self._changed, self._follow = changed, follow
        self._passing: set[int] = set()
        self.carried = Carried(world, number, self.matrix)
        self.body = None
        super().__init__(*place, SceneBody(world, number) if mass else None, kind="shape")
        self._renew()

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
        return None if self.is_static else self._world.inertia(self.number)

    @property
    def is_static(self) -> bool:
        """Whether the dynamics leaves it alone."""
        return self.body is None

    def set_static(self, static: bool) -> None:
        """Let the dynamics leave it alone, or move it again. Raises ValueError for what has never had a mass."""
        if static == self.is_static:
            return
        if not self.mass:
            raise ValueError(f"'{self.name}' has no mass in the scene file: it stays static")
        matrix = self.matrix()
        self.body = None if static else SceneBody(self._world, self.number)
        self._world.solidity.freeze(self.number, static)
        self._renew()
        self.put(matrix)

    def put(self, matrix: Matrix) -> None:
        """Put it there, and its body."""
        super().put(matrix)
        if self.is_static:
            self.carried.follow()
            self._follow()

    def release(self) -> None:
        """Be in the world as at the beginning, before another object takes its place."""
        if self.mass:
            self.set_static(False)
        self.parent = None

    def remember(self) -> Callable[[], None]:
        """Return a function that puts it back where it is now, as static as it is."""
        put_back, static = super().remember(), self.is_static

        def recall() -> None:
            self.set_static(static)
            put_back()

        return recall

    def _renew(self) -> None:
        """Do not collide with what carries it, and tell that something has changed."""
        above = bodies_above(self) if self.is_static else set()
        for number in self._passing - above:
            self._world.solidity.let_pass(self.number, number, passes=False)
        for number in above - self._passing:
            self._world.solidity.let_pass(self.number, number)
        self._passing = above
        self._changed(self)


def bodies_above(one: SceneObject) -> set[int]:
    """Return the bodies in the world of what carries an object."""
    found = set()
    above = one.parent
    while above is not None:
        carrier = above if isinstance(above, Shape) else above.body
        number = getattr(carrier, "number", None)
        if number is not None:
            found.add(number)
        above = above.parent
    return found
