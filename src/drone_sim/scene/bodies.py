"""Scene shapes in the object tree, and their bodies in the world: static, kinematic or dynamic."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector, cross
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.saved_state import Restore, in_turn
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose, State
from drone_sim.scene.entry import Place
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.world import World


class SceneBody:
    """A free dynamic body of the scene, for the object tree."""

    def __init__(self, world: World, number: int):
        self._world = world
        self.number = number

    @property
    def state(self) -> State:
        return self._world.state(self.number)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return self.state.matrix

    def move(self, pose: Pose) -> None:
        self._world.set_pose(self.number, pose)


class LinkBody:
    """The body of a shape that a joint or a force sensor holds, for the object tree."""

    def __init__(self, world: World, number: int, link: int, local: Matrix):
        """Create it for a link of body `number`; `local` is link from shape."""
        self._world = world
        self.number = number
        self.link = link
        self.local = local

    @property
    def state(self) -> State:
        link = self._world.joints.link_state(self.number, self.link)
        matrix = frames.multiply(link.matrix, self.local)
        arm = frames.rotate(link.matrix, frames.position(self.local))
        x, y, z = cross(link.angular_velocity, arm)
        vx, vy, vz = link.linear_velocity
        velocity = vx + x, vy + y, vz + z
        return State(frames.position(matrix), frames.to_quaternion(matrix), velocity, link.angular_velocity)

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""
        return frames.multiply(self._world.joints.link_state(self.number, self.link).matrix, self.local)

    def inertia(self) -> Inertia:
        """Return mass and inertia in the shape's frame."""
        inertia = self._world.inertia(self.number, self.link)
        return inertia._replace(frame=frames.multiply(frames.invert(self.local), inertia.frame))

    def move(self, pose: Pose) -> None:
        """Raise ValueError: the joint determines the pose."""
        raise ValueError("a joint holds this shape, so it cannot be moved")


class CarriedBody:
    """A kinematic body without mass that follows a frame."""

    def __init__(self, world: World, number: int, frame: Callable[[], Matrix]):
        """Create it for body `number` of the world; `frame` returns world from body."""
        self._world = world
        self._number = number
        self._frame = frame
        self._last_matrix: Matrix | None = None

    def follow(self) -> None:
        """Move the body to its frame if the frame has moved."""
        matrix = self._frame()
        if matrix != self._last_matrix:
            self._last_matrix = matrix
            self._world.set_pose(self._number, Pose(frames.position(matrix), frames.to_quaternion(matrix)))

    def reapply_pose(self) -> None:
        """Move the body to its frame after the world's state was restored, if it was ever moved."""
        if self._last_matrix is not None:
            self._last_matrix = None
            self.follow()


class ShapeObject(SceneObject):
    """A shape: free if it has mass, held if its parent is a joint, otherwise fixed in its parent's frame."""

    number: int  # of its body in the world
    link: int  # of that body, -1 for the root
    mass: float  # kg; 0: always static

    def __init__(
        self,
        place: Place,
        world: World,
        changed: Callable[[ShapeObject], None],
        follow: Callable[[], None],
        entry: ObjectParameters,
        body: tuple[int, int],
    ):
        """Create it at a place in the tree, with a body in the world: its number, and the link (-1: the root).

        `changed` is called after its parent, its body or its being static has changed; `follow` after put().
        """
        self._world = world
        self._parent = place.parent
        self._changed, self._follow = changed, follow
        super().__init__(*place, kind="shape")
        self.embody(entry, body, place.local)
        self.pass_carriers()

    def embody(self, entry: ObjectParameters, body: tuple[int, int], local: Matrix) -> None:
        """Use another body in the world; call `pass_carriers` next.

        `local` is the pose in the parent's frame. If a joint holds the shape, the entry's pose counts, in the moved
        frame of the joint.
        """
        (self.number, self.link), self.mass = body, entry.mass
        self._not_colliding: set[int] = set()
        self.carried = CarriedBody(self._world, self.number, self.matrix)
        if self.is_held:
            self.local = IDENTITY
            self.body = LinkBody(self._world, self.number, self.link, entry.local)
        else:
            self.local = local
            self.body = SceneBody(self._world, self.number) if entry.moves else None
            if entry.static and self.mass:
                self._world.collision_filter.freeze(self.number, still=True)
        self._changed(self)

    @property
    def is_held(self) -> bool:
        """Whether a joint or a force sensor holds it; it can then not be moved on its own."""
        return self.link != -1

    @property
    def is_free_child(self) -> bool:
        """Whether it is a free child: it follows its parent only when a script moves that parent."""
        return not self.is_held and super().is_free_child

    @property
    def parent(self) -> SceneObject | None:  # type: ignore[override]
        """The parent in the tree; a static shape follows it."""
        return self._parent

    @parent.setter
    def parent(self, parent: SceneObject | None) -> None:
        if parent is not self._parent:
            self._parent = parent
            self._update()

    def inertia(self) -> Inertia | None:
        """Return mass and inertia in its frame; None if it is static."""
        if isinstance(self.body, LinkBody):
            return self.body.inertia() if self.mass else None
        return None if self.is_static else self._world.inertia(self.number)

    @property
    def is_static(self) -> bool:
        return self.body is None

    def set_static(self, static: bool) -> None:
        """Make it static or dynamic. Raises ValueError if it has no mass in the scene file."""
        if static == self.is_static or self.is_held:
            return
        if not self.mass:
            raise ValueError(f"'{self.name}' has no mass in the scene file, so it stays static")
        matrix = self.matrix()
        self.body = None if static else SceneBody(self._world, self.number)
        self._world.collision_filter.freeze(self.number, static)
        self._update()
        self.put(matrix)

    def put(self, matrix: Matrix) -> None:
        """Move it and its body to `matrix` (world). Raises ValueError if it is held."""
        if self.is_held:
            holder = self.parent.name if self.parent is not None else ""
            raise ValueError(f"'{self.name}' is held by '{holder}': set that joint, or move the joint's parent")
        super().put(matrix)
        if self.is_static:
            self.carried.follow()
            self._follow()

    def push(self, force: Vector, torque: Vector) -> None:
        """Apply a force (N) at its centre of mass and a torque (N m) in the next step, both in the world frame.

        A static shape ignores them.
        """
        if not self.is_static:
            self._world.shape_forces.add(self.number, self.link, force, torque)

    def drop_pushes(self, forces: bool, torques: bool) -> None:
        """Drop the forces, the torques or both that were added since the last step."""
        self._world.shape_forces.drop(self.number, self.link, forces, torques)

    def release(self) -> None:
        """Make it dynamic again, if it has mass, and remove its parent, before another object takes its place."""
        if self.mass:
            self.set_static(False)
        self.parent = None

    def save_state(self) -> Restore:
        return in_turn(partial(self.set_static, self.is_static), super().save_state())

    def forget_body(self, number: int) -> None:
        """Forget a removed body from the set of those with which it does not collide."""
        self._not_colliding.discard(number)

    def _update(self) -> None:
        self.pass_carriers()
        self._changed(self)

    def pass_carriers(self) -> None:
        """Disable collisions with the bodies that carry it."""
        carriers = bodies_above(self) if self.is_static else set()
        for number in self._not_colliding - carriers:
            self._world.collision_filter.let_pass(self.number, number, passes=False)
        for number in carriers - self._not_colliding:
            self._world.collision_filter.let_pass(self.number, number)
        self._not_colliding = carriers


def bodies_above(child: SceneObject) -> set[int]:
    """Return the numbers of the bodies of an object's ancestors."""
    numbers = set()
    ancestor = child.parent
    while ancestor is not None:
        body = ancestor if isinstance(ancestor, ShapeObject) else ancestor.body
        number = getattr(body, "number", None)
        if number is not None:
            numbers.add(number)
        ancestor = ancestor.parent
    return numbers
