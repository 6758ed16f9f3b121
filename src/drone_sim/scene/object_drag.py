"""Objects that a user drags: moved while the simulation goes on, and held still until they are released."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scene.bodies import ShapeObject


class ObjectDrag:
    """The objects of one scene that are being dragged. They are not part of snapshots: restoring one releases them."""

    def __init__(self, context: SimulationContext, things: Callable[[], Mapping[str, SceneObject]], floor: float):
        """Take the context, what returns all objects that can be dragged, by name, and the floor's side (m)."""
        self.held: dict[str, int] = {}  # the body that stands still, by what is held of it
        self._world, self._objects = context.world, context.objects
        self._things = things
        self.floor = floor

    def hold(self, name: str) -> None:
        """Let an object stand still, whatever pulls at it. Raises ValueError for one that is not there."""
        whole = _whole(self._find(name))
        number = whole.number if isinstance(whole, ShapeObject) else getattr(whole.body, "number", None)
        if name not in self.held and number is not None and whole.body is not None:
            self._world.collision_filter.freeze(number, still=True)
            self.held[name] = number

    def let_go(self, name: str) -> None:
        """Let an object fall, or go on, at rest where it is."""
        number = self.held.pop(name, None)
        if number is None or number in self.held.values() or self._is_static(number):
            return
        self._world.collision_filter.freeze(number, still=False)

    def forget(self, number: int) -> None:
        """Release what belongs to a body that was removed."""
        self.held = {name: one for name, one in self.held.items() if one != number}

    def let_go_of_all(self) -> None:
        """Hold nothing."""
        for name in tuple(self.held):
            self.let_go(name)

    def put(self, name: str, matrix: Matrix) -> None:
        """Put an object at a transform in the world, with all that is fixed to it or hangs on it.

        Raises ValueError where there is no such object, or it could not be there.
        """
        one = self._find(name)
        self._check(frames.position(one.matrix()), frames.position(matrix))
        whole = _whole(one)
        matrix = frames.multiply(matrix, frames.relative(one.matrix(), whole.matrix()))
        self._objects.set_matrix(self._objects.handle(whole.name), WORLD, matrix)

    def _find(self, name: str) -> SceneObject:
        things = self._things()
        if name not in things:
            raise ValueError(f"no object named '{name}'; {near_names(name, things)}")
        return things[name]

    def _is_static(self, number: int) -> bool:
        """Tell whether a script has made it so."""
        return any(
            isinstance(one, ShapeObject) and one.number == number and one.is_static for one in self._things().values()
        )

    def _check(self, now: Vector, wanted: Vector) -> None:
        """Refuse places off the floor, but for what is farther away already."""
        half = self.floor / 2
        for axis, before, value, low, high in zip("xyz", now, wanted, (-half, -half, 0.0), (half, half, self.floor)):
            if not min(low, before) <= value <= max(high, before):
                raise ValueError(f"position.{axis} = {value:g}: must be from {low:g} to {high:g} m on this floor")


def _whole(one: SceneObject) -> SceneObject:
    """Return what moves with an object: itself, or the shape to which joints hold it. Raises ValueError for none."""
    whole: SceneObject | None = one
    if isinstance(one, ShapeObject) and one.is_held:
        while whole is not None and (not isinstance(whole, ShapeObject) or whole.is_held):
            whole = whole.parent
    if whole is None:
        raise ValueError(f"'{one.name}' cannot be dragged: joints hold it, and no free shape holds these joints")
    return whole
