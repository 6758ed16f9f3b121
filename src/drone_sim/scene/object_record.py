"""The record of one object of the scene: its entry, its body in the world, and its object in the tree."""

from __future__ import annotations

from dataclasses import dataclass

from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene.bodies import ShapeObject
from drone_sim.scene.entry import EntryParameters, place_of, stands_at
from drone_sim.scene.object_parameters import ObjectParameters


@dataclass(eq=False)
class ObjectRecord:
    """An object of the scene. Its object in the tree, and a shape's body, are made from the entry."""

    entry: EntryParameters
    version: int = 0  # incremented to rebuild the body
    body: tuple[int, int] | None = None  # of a shape: number and link in the world
    item: SceneObject | None = None  # in the object tree
    start: Matrix | None = None  # world pose in the initial scene; None if the object was added later
    factors: Vector = (1.0, 1.0, 1.0)  # total scale along x, y and z

    @property
    def present(self) -> EntryParameters:
        """The entry with the present pose, parent, joint state and `static`; `entry` itself if nothing differs."""
        entry, item = self.entry, self.item
        if item is None:
            return entry
        values = place_of(item)
        if stands_at(entry, values):  # keep the author's numbers
            del values["position"], values["rpy"]
        if isinstance(item, ShapeObject) and isinstance(entry, ObjectParameters) and item.mass and not item.is_held:
            values["static"] = item.is_static
        values = {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
        values = {key: value for key, value in values.items() if getattr(entry, key) != value}
        return entry.model_copy(update=values) if values else entry
