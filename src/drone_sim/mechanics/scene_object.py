"""One object of the scene, as scripts see it: a frame that its parent carries, or a body."""

from __future__ import annotations

from typing import Protocol

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import IDENTITY, Matrix, Vector
from drone_sim.mechanics.object_names import plain
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.mechanics.state import Pose, State

KINDS = ("shape", "joint", "dummy", "proximity_sensor", "vision_sensor", "path", "camera", "force_sensor", "script")


class DynamicBody(Protocol):
    """What the tree asks of something that the dynamics moves."""

    @property
    def state(self) -> State:
        """Pose and velocity of its frame."""

    @property
    def matrix(self) -> Matrix:
        """World from its frame."""

    def move(self, pose: Pose) -> None:
        """Put it there, at rest."""


class SceneObject:
    """One frame: carried by its parent, or by a body."""

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
        """Stand at `local` in the parent's frame (the world's if None), or wherever `body` is.

        Take the names that no other object has (V-REP 3.x), and the alias that siblings may share (4.x paths).
        `kind` is one of KINDS: a shape where it has a body, a dummy where it has none, unless another is given.
        """
        self.names = names
        self.alias = alias
        self.parent = parent
        self._added_below = parent
        self.local = local
        self.body = body
        self.is_model = False  # whether it is the base of a model
        self.size_factor = 1.0  # how much it had been scaled when the simulation began
        self.kind = kind or ("dummy" if body is None else "shape")
        self._above: Matrix | None = None
        self._below: Matrix | None = None
        self._product = IDENTITY

    @property
    def name(self) -> str:
        """The first of its names."""
        return self.names[0]

    def is_called(self, name: str) -> bool:
        """Tell whether that is its alias or one of its names, with or without their suffix."""
        return name == self.alias or any(name in (one, plain(one)) for one in self.names)

    @property
    def is_loose(self) -> bool:
        """Whether it follows its parent only when a script moves that: a free body below another object."""
        return self.body is not None and self.parent is not None

    def is_part_of(self, whole: SceneObject) -> bool:
        """Tell whether it is that object or was added below it, whatever it hangs on now."""
        part: SceneObject | None = self
        while part is not None and part is not whole:
            part = part._added_below
        return part is whole

    def model(self) -> SceneObject | None:
        """Return the base of the model that it is part of, itself perhaps; None where it is part of none."""
        here: SceneObject | None = self
        while here is not None and not here.is_model:
            here = here.parent
        return here

    def hangs_on(self, other: SceneObject) -> bool:
        """Tell whether that object is its parent, or its parent's, and so on."""
        above = self.parent
        while above is not None and above is not other:
            above = above.parent
        return above is not None

    def matrix(self) -> Matrix:
        """Return the transform world from this frame."""
        if self.body is not None:
            return self.body.matrix
        if self.parent is None:
            return self.local
        # Scripts ask for the same few frames several times a step: the same two tuples, the same product.
        above, local = self.parent.below(), self.local
        if above is not self._above or local is not self._below:
            self._above, self._below, self._product = above, local, frames.multiply(above, local)
        return self._product

    # World from the frame in which stands what hangs on it: its own, but for a joint's.
    below = matrix

    def put(self, matrix: Matrix) -> None:
        """Put it at a transform in the world; what carries it goes there, at rest."""
        if self.body is not None:
            self.body.move(Pose(frames.position(matrix), frames.to_quaternion(matrix)))
        elif self.parent is None:
            self.local = matrix
        else:
            self.local = frames.multiply(frames.invert(self.parent.below()), matrix)

    def save_state(self) -> Restore:
        """Return a function that puts it back where it is now, under its present parent."""
        return saved(self, "parent", "local")

    @property
    def carrier(self) -> DynamicBody | None:
        """The body that takes it along: its own, or that of what it hangs on; None where the dynamics moves none."""
        one: SceneObject | None = self
        while one is not None and one.body is None:
            one = one.parent
        return None if one is None else one.body

    def velocity(self) -> tuple[Vector, Vector]:
        """Return linear (m/s) and angular (rad/s) velocity in the world; zero where no body carries it."""
        carrier = self.carrier
        if carrier is None:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        (x, y, z), _, linear, angular = carrier.state
        m, (wx, wy, wz) = self.matrix(), angular
        x, y, z = m[3] - x, m[7] - y, m[11] - z  # from the body's frame to this one
        return (linear[0] + wy * z - wz * y, linear[1] + wz * x - wx * z, linear[2] + wx * y - wy * x), angular
