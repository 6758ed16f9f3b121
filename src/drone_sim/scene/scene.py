"""The scene around the vehicles: floor and objects, in the world and in the object tree."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Matrix, Vector, multiply
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.object_collections import Item
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scene import chains
from drone_sim.scene.bodies import CarriedBody, ShapeObject, bodies_above
from drone_sim.scene.chains import Built, Chain
from drone_sim.scene.entry import EntryParameters, KindParameters, Place, place_of, stands_at
from drone_sim.scene.kinds.dummy import DummyLinks
from drone_sim.scene.kinds.joints import ForceSensor, ForceSensorParameters, JointParameters
from drone_sim.scene.object_drag import ObjectDrag
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters, FloorParameters, SceneParameters, check_files
from drone_sim.shapes.visual import Visual
from drone_sim.world.joints import JointDrive

_LOG = logging.getLogger(__name__)
_Key = tuple[Any, ...]  # identifies the content of a body
_AT_REST = (0.0, 0.0, 0.0)


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


class Scene:
    """The world without vehicles: entries as in a scene file, their bodies and their objects.

    Entries may be added, removed and changed at any time (operations.py): `rebuild` then builds missing bodies and
    objects and removes those without an entry; everything else continues unchanged.
    """

    def __init__(self, parameters: SceneParameters, context: SimulationContext):
        """Add floor and objects to the empty world of `context`, and the bodies' names to its names.

        Raises ParameterError for a file that cannot be used.
        """
        self.parameters = parameters  # initial ones
        self.records = {index: ObjectRecord(entry) for index, entry in enumerate(parameters.objects)}  # permanent keys
        self.scripts: dict[str, AttachedScriptParameters] = {item.object: item for item in parameters.scripts}
        check_files(parameters.floor, parameters.objects)
        self._context, self.tree = context, context.objects
        self._world = context.world
        self._add_floor(parameters.floor)
        self.drag = ObjectDrag(context, self.things, parameters.floor.size)
        self._links = DummyLinks(context.world)
        self.next_index = len(self.records)
        self.is_changed = False  # whether any operation (operations.py) changed it
        self.rebuilt = 0  # number of bodies added or removed so far
        self._built: dict[_Key, Built] = {}
        self._holders: dict[int, list[Joint | ForceSensor]] = {}  # of the links of each body
        self._forget_objects()
        reasons = self._build()[1]
        for reason in sorted({*reasons.values()}):
            names = [self.records[index].entry.name for index, other in reasons.items() if other == reason]
            some = ", ".join(names[:12]) + (" …" if names[12:] else "")
            _LOG.warning("only scripts move these joints, because %s: %s", reason, some)

    @property
    def entries(self) -> dict[int, EntryParameters]:
        """The entries of all objects, by the keys of `records`."""
        return {index: record.entry for index, record in self.records.items()}

    @property
    def objects(self) -> dict[int, SceneObject]:
        """The objects in the tree, by the keys of `records`."""
        return {index: record.item for index, record in self.records.items() if record.item is not None}

    def set_floor(self, floor: FloorParameters) -> None:
        """Replace the floor. Raises ParameterError for a file that cannot be used."""
        check_files(floor, self.entries.values())
        self._world.remove(self.floor)
        del self._context.names[self.floor]
        self._add_floor(floor)
        self.drag.floor = floor.size
        self.parameters = self.parameters.model_copy(update={"floor": floor})

    def _add_floor(self, floor: FloorParameters) -> None:
        self.floor = self._world.add_floor(floor.size, floor.texture, ground=not floor.edge)
        self._context.names[self.floor] = ("Floor", "Floor")

    # ---- bodies

    def _build(self) -> tuple[list[Built], dict[int, str]]:
        """Create missing bodies and remove those without an entry.

        Return the new bodies, and for each joint that the dynamics cannot move the reason, by entry. Raises
        ParameterError for a file that cannot be read; then nothing has changed.
        """
        entries = self.entries
        present, reasons = chains.found(entries)
        required = {self._key(chain): chain for chain in present}
        new = {key: chain for key, chain in required.items() if key not in self._built}
        matrices = {index: self._matrix(index) for chain in new.values() for index in chain.members()}
        speeds = {index: self._speed(index) for index in matrices}
        try:
            built = chains.build(self._world, entries, new.values(), matrices)
        except ValueError as error:
            raise ParameterError(str(error)) from None
        obsolete = self._built.keys() - required.keys()
        for key in obsolete:
            self._remove(self._built.pop(key))
        self.rebuilt += len(obsolete) + len(new)
        self._built.update(zip(new, built))
        for item in built:
            for index, link in item.links.items():
                self.records[index].body = item.body, link
            self._restore_velocities(item, speeds)
        self._add_names()
        return built, reasons

    def _key(self, chain: Chain) -> _Key:
        versions = tuple(self.records[index].version for index in chain.members())
        return chain.root, tuple(hung[:3] for hung in chain.hung), versions

    def _matrix(self, index: int) -> Matrix:
        """Return world from an entry's frame, also for an entry without an object."""
        entry, item = self.records[index].entry, self.records[index].item
        if item is not None:
            return item.matrix()
        if not entry.parent:
            return entry.local
        if entry.parent in self.tree:
            return multiply(self.tree[self.tree.handle(entry.parent)].below(), entry.local)
        parent = next((key for key, other in self.records.items() if other.entry.name == entry.parent), None)
        if parent is None:  # the parent is a vehicle, which is added after the scene
            return entry.local
        return multiply(multiply(self._matrix(parent), chains.motion(self.records[parent].entry)), entry.local)

    def _speed(self, index: int) -> tuple[Vector, Vector, float]:
        """Return the velocities of an entry whose body is replaced: linear (m/s), angular (rad/s), along a joint."""
        item = self.records[index].item
        if isinstance(item, Joint):
            return _AT_REST, _AT_REST, item.velocity_along
        body = item.body if item is not None else None
        if body is None:
            return _AT_REST, _AT_REST, 0.0
        _, _, linear, angular = body.state
        return linear, angular, 0.0

    def _restore_velocities(self, built: Built, speeds: Mapping[int, tuple[Vector, Vector, float]]) -> None:
        root = built.chain.root
        if root is not None and getattr(self.records[root].entry, "moves", False) and any(map(any, speeds[root][:2])):
            self._world.set_velocity(built.body, *speeds[root][:2])
        for hung in built.chain.hung:
            joint, speed = self.records[hung.joint].entry, speeds[hung.joint][2]
            if speed and isinstance(joint, JointParameters):
                self._world.joints.put(built.body, built.links[hung.shape], joint.value, speed)

    def _remove(self, built: Built) -> None:
        for holder in self._holders.pop(built.body, ()):
            holder.release()
        self._world.remove(built.body)
        self._context.names.pop(built.body, None)
        for link in built.links.values():
            self._context.link_names.pop((built.body, link), None)
        for carried in (self._context.carried.shapes, self._context.carried.bases, self._carried_bases):
            carried.pop(built.body, None)
        self.drag.forget(built.body)
        for item in self.objects.values():
            if isinstance(item, ShapeObject):
                item.forget_body(built.body)

    def _add_names(self) -> None:
        names, link_names = self._context.names, self._context.link_names
        for built in self._built.values():
            for index, link in built.links.items():
                name = link_names[built.body, link] = self.records[index].entry.name
                if link == -1 or built.body not in names:
                    names[built.body] = (name, name)

    # ---- the tree

    def name_objects(self) -> None:
        """Add all objects to a tree without them, in their initial state.

        Raises ParameterError, with its location, for a name that is used or a parent that does not exist.
        """
        self._forget_objects()
        self._add_objects(self._built.values())
        if all(record.start is None for record in self.records.values()):
            self._place_free_children(chains.parents_first(self.entries))
            for record in self.records.values():
                record.start = record.item.matrix() if record.item is not None else None
        self._follow()
        self._world.rigid_links.set({})  # so that all runs begin equal to the last bit
        self._links.is_stale = True
        self._add_collections()

    def _add_collections(self) -> None:
        """Add the collections of the objects that exist; log a warning for each missing object."""
        for collection in self.parameters.collections:
            handle = self._context.collections.add(collection.name)
            for item in collection.items:
                try:
                    of = -1 if item.what == "all" else self.tree.handle(item.object)
                except ValueError as error:
                    _LOG.warning("collection %s: %s", collection.name, error)
                    continue
                self._context.collections.extend(handle, Item(item.what, of, item.removes, item.without))

    def rebuild(self, change_tree: Callable[[], None] = lambda: None, bodies: bool = True) -> None:
        """Update world and tree from the entries; `change_tree` is called once the new bodies exist.

        `bodies`: also rebuild bodies. Raises ParameterError; then world and tree have not changed.
        """
        new_bodies = self._build()[0] if bodies else []
        for index in (index for body in new_bodies for index in body.links):
            entry, body, item = self.records[index].entry, self.records[index].body, self.records[index].item
            if isinstance(item, ShapeObject) and isinstance(entry, ObjectParameters) and body is not None:
                item.embody(entry, body, entry.local)
        change_tree()
        for shape in self.objects.values():
            if isinstance(shape, ShapeObject):
                shape.pass_carriers()
        self._place_free_children(self._add_objects(new_bodies))
        self._follow()
        self._links.is_stale = True

    def replace_object(self, record: ObjectRecord, handle: int, entry: KindParameters, place: Place) -> None:
        """Replace an object by one built from `entry`."""
        made = entry.make(place, self._context)
        made.is_model, made.size_factor = entry.model, entry.size_factor
        before, record.item = record.item, made
        if isinstance(made, Joint) and isinstance(before, Joint):
            made.turn = before.turn
        self.tree.replace(handle, made)

    def paint(self, record: ObjectRecord, rgba: Sequence[float]) -> None:
        """Set the displayed color of a shape."""
        assert record.body is not None, "only shapes have a color"
        self._world.set_color(record.body[0], rgba, record.body[1])

    def _forget_objects(self) -> None:
        self.drag.let_go_of_all()
        for record in self.records.values():
            if isinstance(record.item, ShapeObject):
                record.item.release()
            record.item = None
        self._carried_bases: dict[int, CarriedBody] = {}  # static roots of chains with a parent, by body
        self._context.carried.shapes.clear()
        self._context.carried.bases.clear()

    def _add_objects(self, new_bodies: Iterable[Built]) -> list[int]:
        """Add the missing objects to the tree, and connect joints and force sensors of new bodies; return the new."""
        new = chains.parents_first({key: record.entry for key, record in self.records.items() if record.item is None})
        for index in new:
            self.records[index].item = self._add(index)
        for built in new_bodies:
            self._connect_joints(built)
        return new

    def _add(self, index: int) -> SceneObject:
        record = self.records[index]
        entry, parent = record.entry, self._parent(index)
        is_orphan = bool(entry.parent) and parent is None  # a removed vehicle: the object keeps its initial pose
        local = record.start if is_orphan and record.start is not None else entry.local
        place = Place((entry.name,), entry.shown, parent, local)
        if isinstance(entry, KindParameters):
            added = entry.make(place, self._context)
        else:
            assert isinstance(entry, ObjectParameters) and record.body is not None, "a shape has a body"
            follow = self._context.carried.follow
            added = ShapeObject(place, self._world, self._update_carried, follow, entry, record.body)
        added.is_model, added.size_factor = entry.model, entry.size_factor
        try:
            self.tree.insert(added)
        except ValueError as error:
            raise ParameterError(str(error), ("objects", index, "name")) from None
        return added

    def _parent(self, index: int) -> SceneObject | None:
        record = self.records[index]
        name = record.entry.parent
        if not name:
            return None
        if name in self.tree:
            return self.tree[self.tree.handle(name)]
        if record.start is not None:  # a vehicle that was removed
            return None
        raise ParameterError(
            f"no object is named '{name}', the parent of '{record.entry.name}'; {near_names(name, self.tree.names)}",
            ("objects", index, "parent"),
        )

    def _update_carried(self, shape: ShapeObject) -> None:
        """Update the kinematic bodies after a shape's parent or its being static has changed."""
        if shape.name in self.tree:
            self.tree.refresh_free_children()
        if shape.parent is None or not shape.is_static:
            self._context.carried.shapes.pop(shape.number, None)
        else:
            self._context.carried.shapes[shape.number] = shape.carried

    def _connect_joints(self, built: Built) -> None:
        holders = self._holders[built.body] = []
        for hung in built.chain.hung:
            holder, link = self.records[hung.joint].item, built.links[hung.shape]
            if isinstance(holder, ForceSensor):
                holders.append(holder)
                holder.hold(self._world, built.body, link)
            elif isinstance(holder, Joint):
                holders.append(holder)
                holder.drive = JointDrive(self._world.joints, built.body, link)
                holder.drive.limit(holder.limits)
                holder.drive.command(holder.control)
        if built.chain.root is None:
            first = self.records[built.chain.hung[0].joint].item
            if first is not None and first.parent is not None:
                self._carried_bases[built.body] = CarriedBody(self._world, built.body, first.parent.below)
                for carrier in bodies_above(first):
                    self._world.collision_filter.let_pass(built.body, carrier)

    def _follow(self) -> None:
        """Move the kinematic bodies to their frames; a chain that hangs on another chain's link follows that chain."""
        objects, bases = self.objects, self._carried_bases
        first = {built.body: built.chain.hung[0].joint for built in self._built.values() if built.chain.hung}
        nearest_first = sorted(bases, key=lambda body: len(bodies_above(objects[first[body]])))
        self._context.carried.bases = {body: bases[body] for body in nearest_first}
        self._context.carried.follow()

    def hold_linked_dummies(self) -> None:
        """Link the bodies of linked dummies in the world, before a step."""
        if self._links.is_stale:
            self._links.find((record.entry, record.item) for record in self.records.values())
        if self._links.pairs:
            self._links.hold()

    def _place_free_children(self, added: Iterable[int]) -> None:
        """Move added free children to their entries' poses relative to the parent, now that it exists."""
        for index in added:
            item = self.records[index].item
            if item is not None and item.is_free_child and item.parent is not None:
                item.put(multiply(item.parent.below(), self.records[index].entry.local))

    # ---- present values

    def sync(self) -> None:
        """Update all entries to the present values."""
        for record in self.records.values():
            record.entry = record.present

    def sync_chains(self) -> None:
        """Update all entries to the present values if there are joints or force sensors, whose links may change."""
        records = self.records.values()
        if any(isinstance(record.entry, (JointParameters, ForceSensorParameters)) for record in records):
            self.sync()

    def put_in_order(self) -> None:
        """Sort the objects by their handles, the order in which they were first added."""
        self.records = dict(sorted(self.records.items(), key=lambda pair: self.tree.handle(pair[1].entry.name)))

    def parameters_now(self) -> SceneParameters:
        """Return the parameters of the scene with their present values."""
        now = {"objects": [record.present for record in self.records.values()], "scripts": list(self.scripts.values())}
        return self.parameters.model_copy(update=now)

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores entries and moves kinematic bodies to their frames."""
        entries = self.entries

        def restore() -> None:
            for index, record in self.records.items():
                record.entry = entries.get(index, record.entry)
            self._links.is_stale = True
            shapes = [it.carried for it in self.objects.values() if isinstance(it, ShapeObject) and not it.is_held]
            for body in (*self._carried_bases.values(), *shapes):
                body.reapply_pose()

        return restore

    # ---- appearance

    def things(self) -> dict[str, SceneObject]:
        """Return the objects that a user can see and move, by name."""
        return {item.name: item for item in self.objects.values() if item.kind in ("shape", "dummy", "path")}

    def visuals(self) -> tuple[list[Visual], np.ndarray]:
        """Return the visuals of the objects, without the floor, and their poses world from visual, (N, 4, 4)."""
        numbers = self._numbers()
        return self._world.pictures.visuals(numbers), self._world.pictures.visual_poses(numbers)

    def categories(self) -> dict[str, str]:
        """Return the categories of the objects that have one, by name."""
        return {entry.name: entry.category for entry in self.entries.values() if entry.category}

    def visual_names(self) -> list[str]:
        """Return the object's name for each of the visuals, as in `things`."""
        names = {record.body: record.entry.name for record in self.records.values()}
        return [names.get(place, "") for place in self._world.pictures.places(self._numbers())]

    def _numbers(self) -> list[int]:
        bodies = (self.records[index].body for index in sorted(self.records))
        return list(dict.fromkeys(body[0] for body in bodies if body is not None))
