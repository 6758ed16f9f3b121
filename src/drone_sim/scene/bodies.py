"""Shapes of the scene as the object tree sees them: what stands, what is carried, what the dynamics moves."""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, cross
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose, State
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
    """A shape that a joint holds."""

    def __init__(self, world: World, number: int, link: int, local: Matrix):
        """Take the world, the number of the body in it, of its link, and that link's frame from the shape's."""
        self._world = world
        self.number = number
        self._link = link
        self._local = local

    @property
    def state(self) -> State:
        """Pose and velocity."""
        link = self._world.joints.link_state(self.number, self._link)
        matrix = frames.multiply(link.matrix, self._local)
        arm = frames.rotate(link.matrix, frames.position(self._local))
        x, y, z = cross(link.angular_velocity, arm)
        vx, vy, vz = link.linear_velocity
        velocity = vx + x, vy + y, vz + z
        return State(frames.position(matrix), frames.to_quaternion(matrix), velocity, link.angular_velocity)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return frames.multiply(self._world.joints.link_state(self.number, self._link).matrix, self._local)

    def move(self, pose: Pose) -> None:
        """Refuse: its joint says where it is. Raises ValueError."""
        raise ValueError("a shape that a joint holds is put nowhere else")


class HeldShape(SceneObject):
    """A shape that a joint holds: nobody puts it anywhere else."""

    is_loose = False

    def put(self, matrix: Matrix) -> None:
        """Refuse. Raises ValueError."""
        joint = self.parent.name if self.parent is not None else ""
        raise ValueError(f"'{self.name}' is held by the joint '{joint}': set that, or move what it hangs on")


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


class StaticShape(SceneObject):
    """A shape without mass: it stands still in its parent's frame, and its body in the world with it."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix = IDENTITY,
        *,
        world: World,
        number: int,
        hangs: Callable[[StaticShape], None],
        follow: Callable[[], None],
    ):
        """Take the number of its body; `hangs` is told whenever it has another parent, `follow` when it is put."""
        self.number = number
        self._world = world
        self._parent: SceneObject | None = None
        self._hangs, self._follow = hangs, follow
        self._passing: set[int] = set()
        self.carried = Carried(world, number, self.matrix)
        super().__init__(names, alias, parent, local, kind="shape")

    @property
    def parent(self) -> SceneObject | None:  # type: ignore[override]
        """What carries it."""
        return self._parent

    @parent.setter
    def parent(self, parent: SceneObject | None) -> None:
        if parent is self._parent:
            return
        self._parent = parent
        above = bodies_above(self)
        for number in self._passing - above:
            self._world.let_pass(self.number, number, passes=False)
        for number in above - self._passing:
            self._world.let_pass(self.number, number)
        self._passing = above
        self._hangs(self)

    def put(self, matrix: Matrix) -> None:
        """Put it there, and its body."""
        super().put(matrix)
        self.carried.follow()
        self._follow()


def bodies_above(one: SceneObject) -> set[int]:
    """Return the bodies in the world of what carries an object."""
    found = set()
    above = one.parent
    while above is not None:
        carrier = above if isinstance(above, StaticShape) else above.body
        number = getattr(carrier, "number", None)
        if number is not None:
            found.add(number)
        above = above.parent
    return found
