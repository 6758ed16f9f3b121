"""Objects that a user drags: moved while the simulation runs, and frozen until they are released."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scene.bodies import ShapeObject


class ObjectDrag:
    """The objects of one scene that are being dragged. Restoring a snapshot releases them."""

    def __init__(self, context: SimulationContext, things: Callable[[], Mapping[str, SceneObject]], floor: float):
        """Create it; `things` returns the objects that can be dragged, by name; `floor` is the floor's side (m)."""
        self.held: dict[str, int] = {}  # object name -> frozen body
        self._world, self._objects = context.world, context.objects
        self._things = things
        self.floor = floor

    def hold(self, name: str) -> None:
        """Freeze an object's body, whatever forces act on it. Raises ValueError for an unknown name."""
        whole = _movable_root(self._find(name))
        number = whole.number if isinstance(whole, ShapeObject) else getattr(whole.body, "number", None)
        if name not in self.held and number is not None and whole.body is not None:
            self._world.collision_filter.freeze(number, still=True)
            self.held[name] = number

    def let_go(self, name: str) -> None:
        """Release an object: its body moves again, from rest."""
        number = self.held.pop(name, None)
        shapes = (item for item in self._things().values() if isinstance(item, ShapeObject) and item.number == number)
        if number is None or number in self.held.values() or any(shape.is_static for shape in shapes):
            return  # a script may have made a shape static
        self._world.collision_filter.freeze(number, still=False)

    def forget(self, number: int) -> None:
        """Release the objects of a body that was removed."""
        self.held = {name: body for name, body in self.held.items() if body != number}

    def let_go_of_all(self) -> None:
        for name in tuple(self.held):
            self.let_go(name)

    def put(self, name: str, matrix: Matrix) -> None:
        """Move an object to a transform in the world, with everything fixed to it and its children.

        Raises ValueError for an unknown name, or for a position off the floor that is farther out than the present one.
        """
        item = self._find(name)
        half, now, wanted = self.floor / 2, frames.position(item.matrix()), frames.position(matrix)
        for axis, before, value, low, high in zip("xyz", now, wanted, (-half, -half, 0.0), (half, half, self.floor)):
            if not min(low, before) <= value <= max(high, before):
                raise ValueError(f"position.{axis} = {value:g}: must be from {low:g} to {high:g} m on this floor")
        whole = _movable_root(item)
        matrix = frames.multiply(matrix, frames.relative(item.matrix(), whole.matrix()))
        self._objects.set_matrix(self._objects.handle(whole.name), WORLD, matrix)

    def _find(self, name: str) -> SceneObject:
        things = self._things()
        if name not in things:
            raise ValueError(f"no object named '{name}'; {near_names(name, things)}")
        return things[name]


def _movable_root(item: SceneObject) -> SceneObject:
    """Return the object to move: itself, or the root shape if joints hold it. Raises ValueError if there is none."""
    root: SceneObject | None = item
    if isinstance(item, ShapeObject) and item.is_held:
        while root is not None and (not isinstance(root, ShapeObject) or root.is_held):
            root = root.parent
    if root is None:
        raise ValueError(f"'{item.name}' cannot be dragged: joints hold it, and no free shape holds these joints")
    return root
