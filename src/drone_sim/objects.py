"""The objects of the scene, under their V-REP names: a tree of frames that scripts reach by handle."""

from __future__ import annotations

import difflib
from typing import Dict, Iterable, Optional, Protocol

from drone_sim import frames
from drone_sim.frames import IDENTITY, Matrix, Vector
from drone_sim.state import Pose, State

WORLD = -1  # V-REP's handle for the world, where an object or a parent is expected


class Body(Protocol):
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

    def __init__(self, name: str, parent: Optional[SceneObject], local: Matrix, body: Optional[Body]):
        """Stand at `local` in the parent's frame (the world's if None), or wherever `body` is."""
        self.name = name
        self.parent = parent
        self.local = local
        self.body = body

    @property
    def matrix(self) -> Matrix:
        """World from this frame."""
        if self.body is not None:
            return self.body.matrix
        return self.local if self.parent is None else frames.multiply(self.parent.matrix, self.local)

    @matrix.setter
    def matrix(self, matrix: Matrix) -> None:
        if self.body is not None:
            self.body.move(Pose(frames.position(matrix), frames.to_quaternion(matrix)))
        elif self.parent is None:
            self.local = matrix
        else:
            self.local = frames.multiply(frames.invert(self.parent.matrix), matrix)

    @property
    def velocity(self) -> tuple[Vector, Vector]:
        """Linear (m/s) and angular (rad/s) velocity in the world; zero where no body carries it."""
        carrier = self
        while carrier.body is None:
            if carrier.parent is None:
                return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            carrier = carrier.parent
        state = carrier.body.state
        here = frames.position(self.matrix)
        arm = tuple(a - b for a, b in zip(here, state.position))
        swing = frames.cross(state.angular_velocity, arm)
        linear = state.linear_velocity
        return (linear[0] + swing[0], linear[1] + swing[1], linear[2] + swing[2]), state.angular_velocity


class ObjectTree:
    """All objects, by handle (a small integer, stable for the run) and by name."""

    def __init__(self) -> None:
        """Start empty."""
        self._objects: Dict[int, SceneObject] = {}
        self._handles: Dict[str, int] = {}

    def add(
        self, name: str, parent: Optional[str] = None, local: Matrix = IDENTITY, body: Optional[Body] = None
    ) -> int:
        """Add an object at `local` in the frame of the object named `parent`; return its handle."""
        handle = len(self._objects)
        self._objects[handle] = SceneObject(name, self._objects[self._handles[parent]] if parent else None, local, body)
        self._handles[name] = handle
        return handle

    def handle(self, name: str) -> int:
        """Return the handle of a name; raises ValueError that lists the near names."""
        if name in self._handles:
            return self._handles[name]
        raise ValueError(f"no object named '{name}'; {near_names(name, self._handles)}")

    def __contains__(self, name: str) -> bool:
        """Tell whether an object has that name."""
        return name in self._handles

    def handle_of(self, sought: Optional[SceneObject]) -> int:
        """Return the handle of an object, WORLD for None."""
        return WORLD if sought is None else self._handles[sought.name]

    def __getitem__(self, handle: int) -> SceneObject:
        """Return the object of a handle; raises ValueError."""
        if handle not in self._objects:
            raise ValueError(f"no object has the handle {handle}")
        return self._objects[handle]

    def matrix(self, handle: int, relative_to: int = WORLD) -> Matrix:
        """Return the transform of an object relative to another, or to the world."""
        matrix = self[handle].matrix
        if relative_to == WORLD:
            return matrix
        return frames.multiply(frames.invert(self[relative_to].matrix), matrix)

    def set_matrix(self, handle: int, relative_to: int, matrix: Matrix) -> None:
        """Put an object at a transform relative to another, or to the world."""
        if relative_to != WORLD:
            matrix = frames.multiply(self[relative_to].matrix, matrix)
        self[handle].matrix = matrix

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Hang an object on another (WORLD for none): it stays where it is, or keeps its local transform.

        Raises ValueError where that would make a loop.
        """
        moved = self[handle]
        new = None if parent == WORLD else self[parent]
        ancestor = new
        while ancestor is not None:
            if ancestor is moved:
                raise ValueError(f"'{moved.name}' cannot be its own ancestor")
            ancestor = ancestor.parent
        matrix = moved.matrix
        moved.parent = new
        if keep_in_place and moved.body is None:
            moved.matrix = matrix


def near_names(name: str, known: Iterable[str]) -> str:
    """Return 'near names are a, b' for an error message, or all that is known where nothing is near."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=4, cutoff=0.5)
    return f"near names are {', '.join(near)}" if near else f"known are {', '.join(known)}"
