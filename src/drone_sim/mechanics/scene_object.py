"""An object of the scene as scripts see it: a frame that is carried by its parent, or by a body."""

from __future__ import annotations

from typing import Protocol

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.state import Pose, State

KINDS = ("shape", "joint", "dummy", "proximity_sensor", "vision_sensor", "path", "camera", "force_sensor", "script")


class DynamicBody(Protocol):
    """What the tree needs of a body that the dynamics moves."""

    @property
    def state(self) -> State:
        """Pose and velocity of the body's frame."""

    @property
    def matrix(self) -> Matrix:
        """Transform world from the body's frame."""

    def move(self, pose: Pose) -> None:
        """Place the body at a pose, at rest."""


class SceneObject:
    """A frame that is carried by its parent, or by a body."""

    def __init__(
        self,
        names: tuple[str, ...],
        alias: str,
        parent: SceneObject | None,
        local: Matrix = IDENTITY,
        body: DynamicBody | None = None,
        *,
        kind: str = "",
    ):
        """Create an object at `local` in the parent's frame (the world's if None), or at the frame of `body`.

        `names` are unique in the scene (V-REP 3.x), siblings may share the `alias` (4.x paths). `kind` is one of KINDS;
        by default `shape` with a body and `dummy` without.
        """
        self.names = names
        self.alias = alias
        self.parent = parent
        self._first_parent = parent
        self.local = local
        self.body = body
        self.is_model = False  # whether it is the base of a model
        self.size_factor = 1.0  # how much it had been scaled when the simulation began
        self.kind = kind or ("dummy" if body is None else "shape")
        self._cached_parent: Matrix | None = None
        self._cached_local: Matrix | None = None
        self._cached_matrix = IDENTITY

    @property
    def name(self) -> str:
        return self.names[0]

    def is_called(self, name: str) -> bool:
        """Return whether `name` is the object's alias or one of its names, with or without their suffix."""
        return name == self.alias or any(name in (full, plain(full)) for full in self.names)

    @property
    def is_free_child(self) -> bool:
        """Whether the object is a body with a parent, which it follows only when a script moves the parent."""
        return self.body is not None and self.parent is not None

    def is_part_of(self, whole: SceneObject) -> bool:
        """Return whether the object is `whole`, or was added below it, whatever its parent is now."""
        part: SceneObject | None = self
        while part is not None and part is not whole:
            part = part._first_parent
        return part is whole

    def model(self) -> SceneObject | None:
        """Return the base of the model that the object is part of, possibly the object itself, or None."""
        ancestor: SceneObject | None = self
        while ancestor is not None and not ancestor.is_model:
            ancestor = ancestor.parent
        return ancestor

    def is_descendant_of(self, other: SceneObject) -> bool:
        """Return whether `other` is the object's parent or another ancestor."""
        ancestor = self.parent
        while ancestor is not None and ancestor is not other:
            ancestor = ancestor.parent
        return ancestor is not None

    def matrix(self) -> Matrix:
        """Return the transform world from the object's frame."""
        if self.body is not None:
            return self.body.matrix
        if self.parent is None:
            return self.local
        # Scripts read the same few frames several times a step: the product of the same two tuples is cached.
        above, local = self.parent, self.local
        parent = above.below() if above.body is None else above.body.matrix
        if parent is not self._cached_parent or local is not self._cached_local:
            self._cached_parent, self._cached_local = parent, local
            self._cached_matrix = parent if local == IDENTITY else frames.multiply(parent, local)
        return self._cached_matrix

    # Transform world from the frame that children are relative to: the object's frame, except in a joint.
    below = matrix

    def put(self, matrix: Matrix) -> None:
        """Place the object at a transform in the world; the body, if it has one, is then at rest."""
        if self.body is not None:
            self.body.move(Pose(frames.position(matrix), frames.to_quaternion(matrix)))
        elif self.parent is None:
            self.local = matrix
        else:
            self.local = frames.multiply(frames.invert(self.parent.below()), matrix)

    def save_state(self) -> Restore:
        """Return a function that puts the object back where it is now, below its present parent."""
        return saved(self, "parent", "local")

    @property
    def carrier(self) -> DynamicBody | None:
        """The body that moves the object: its own, or its nearest ancestor's; None if no body does."""
        item: SceneObject | None = self
        while item is not None and item.body is None:
            item = item.parent
        return None if item is None else item.body

    def velocity(self) -> tuple[Vector, Vector]:
        """Return the object's linear (m/s) and angular (rad/s) velocity, world frame; zero if no body moves it."""
        carrier = self.carrier
        if carrier is None:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        (x, y, z), _, linear, angular = carrier.state
        m, (wx, wy, wz) = self.matrix(), angular
        x, y, z = m[3] - x, m[7] - y, m[11] - z  # from the body's frame to this one
        return (linear[0] + wy * z - wz * y, linear[1] + wz * x - wx * z, linear[2] + wx * y - wy * x), angular
