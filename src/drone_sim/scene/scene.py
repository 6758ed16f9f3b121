"""The scene around the vehicles: floor and objects, in the world and in the object tree."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.context import SimulationContext
from drone_sim.mechanics.frames import Matrix, Vector, multiply
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.message_text import near_names
from drone_sim.scene import building, chains
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.bodies import CarriedBody, ShapeInWorld, ShapeObject, bodies_above
from drone_sim.scene.building import Built
from drone_sim.scene.chains import Chain
from drone_sim.scene.entry import EntryParameters, Place, place_of, stands_at
from drone_sim.scene.kinds.force_sensor import ForceSensor, ForceSensorParameters
from drone_sim.scene.kinds.joint import JointParameters
from drone_sim.scene.kinds.kind import KindParameters
from drone_sim.scene.object_drag import ObjectDrag
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import FloorParameters, SceneParameters, check_files
from drone_sim.shapes.visual import Visual
from drone_sim.world.joints import JointDrive

_LOG = logging.getLogger(__name__)
_Key = tuple[Any, ...]  # identifies the content of a body
_AT_REST = (0.0, 0.0, 0.0)


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
        self.entries: dict[int, EntryParameters] = dict(enumerate(parameters.objects))  # by permanent index
        self.scripts: dict[str, AttachedScriptParameters] = {item.object: item for item in parameters.scripts}
        check_files(parameters.floor, parameters.objects)
        self._context, self.tree = context, context.objects
        self._world = context.world
        self._add_floor(parameters.floor)
        self.drag = ObjectDrag(context, self.things, parameters.floor.size)
        self.next_index = len(self.entries)
        self.is_changed = False  # whether any operation (operations.py) changed it
        self.rebuilt = 0  # number of bodies added or removed so far
        self.changed: Counter[int] = Counter()  # versions of entries; incremented to rebuild the body
        self.factors: dict[int, Vector] = {}  # total scale of entries
        self._built: dict[_Key, Built] = {}
        self._places: dict[int, tuple[int, int]] = {}  # body and link of each shape
        self._initial_poses: dict[int, Matrix] = {}  # of the objects, by entry; empty until known
        self._forget_objects()
        _warn(self.entries, self._build()[1])

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
        result = chains.found(self.entries)
        required = {self._key(chain): chain for chain in (*building.alone(self.entries, result.chains), *result.chains)}
        new = {key: chain for key, chain in required.items() if key not in self._built}
        matrices = {index: self._matrix(index) for chain in new.values() for index in chain.members()}
        speeds = {index: self._speed(index) for index in matrices}
        try:
            built = building.build(self._world, self.entries, new.values(), matrices)
        except ValueError as error:
            raise ParameterError(str(error)) from None
        obsolete = self._built.keys() - required.keys()
        for key in obsolete:
            self._remove(self._built.pop(key))
        self.rebuilt += len(obsolete) + len(new)
        self._built.update(zip(new, built))
        self._places = {index: (item.body, link) for item in self._built.values() for index, link in item.links.items()}
        self._add_names()
        for item in built:
            self._restore_velocities(item, speeds)
        return built, result.reasons

    def _key(self, chain: Chain) -> _Key:
        versions = tuple(self.changed[index] for index in chain.members())
        return chain.root, tuple(hung[:3] for hung in chain.hung), versions

    def _matrix(self, index: int) -> Matrix:
        """Return world from an entry's frame, also for an entry without an object."""
        if index in self.objects:
            return self.objects[index].matrix()
        entry = self.entries[index]
        if entry.parent in self.tree:
            return multiply(self.tree[self.tree.handle(entry.parent)].below(), entry.local)
        parent = next((key for key, item in self.entries.items() if entry.parent and item.name == entry.parent), None)
        if parent is None:  # the parent is a vehicle, which is added after the scene
            return entry.local
        return multiply(multiply(self._matrix(parent), building.motion(self.entries[parent])), entry.local)

    def _speed(self, index: int) -> tuple[Vector, Vector, float]:
        """Return the velocities of an entry whose body is replaced: linear (m/s), angular (rad/s), along a joint."""
        item = self.objects.get(index)
        if isinstance(item, Joint):
            return _AT_REST, _AT_REST, item.velocity_along
        body = item.body if item is not None else None
        if body is None:
            return _AT_REST, _AT_REST, 0.0
        _, _, linear, angular = body.state
        return linear, angular, 0.0

    def _restore_velocities(self, built: Built, speeds: Mapping[int, tuple[Vector, Vector, float]]) -> None:
        root = built.chain.root
        if root is not None and getattr(self.entries[root], "moves", False) and any(map(any, speeds[root][:2])):
            self._world.set_velocity(built.body, *speeds[root][:2])
        for hung in built.chain.hung:
            joint, speed = self.entries[hung.joint], speeds[hung.joint][2]
            if speed and isinstance(joint, JointParameters):
                self._world.joints.put(built.body, built.links[hung.shape], joint.value, speed)

    def _remove(self, built: Built) -> None:
        for hung in built.chain.hung:
            item = self.objects.get(hung.joint)
            if isinstance(item, (Joint, ForceSensor)):
                item.release()
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
        for index, (number, link) in self._places.items():
            name = link_names[number, link] = self.entries[index].name
            if link == -1 or number not in names:
                names[number] = (name, name)

    # ---- the tree

    def name_objects(self) -> None:
        """Add all objects to a tree without them, in their initial state.

        Raises ParameterError, with its location, for a name that is used or a parent that does not exist.
        """
        self._forget_objects()
        self._add_objects(self._built.values())
        if not self._initial_poses:
            self._place_free_children(self.objects)
            self._initial_poses = {index: item.matrix() for index, item in self.objects.items()}
        self._follow()

    def rebuild(self, change_tree: Callable[[], None] = lambda: None, bodies: bool = True) -> None:
        """Update world and tree from the entries; `change_tree` is called once the new bodies exist.

        `bodies`: also rebuild bodies. Raises ParameterError; then world and tree have not changed.
        """
        new_bodies = self._build()[0] if bodies else []
        for index in (index for body in new_bodies for index in body.links):
            item = self.objects.get(index)
            if isinstance(item, ShapeObject):
                item.embody(self._solid(index, self.entries[index].local))
        for index in self.objects.keys() - self.entries.keys():
            del self.objects[index], self.changed[index]
            self.factors.pop(index, None)
        change_tree()
        for item in self.objects.values():
            if isinstance(item, ShapeObject):
                item.pass_carriers()
        present = set(self.objects)
        self._add_objects(new_bodies)
        self._place_free_children(self.objects.keys() - present)
        self._follow()

    def replace_object(self, index: int, handle: int, entry: KindParameters, place: Place) -> None:
        """Replace an object by one built from `entry`."""
        made = entry.make(place, self._context)
        made.is_model, made.size_factor = entry.model, entry.size_factor
        before, self.objects[index] = self.objects[index], made
        if isinstance(made, Joint) and isinstance(before, Joint):
            made.turn = before.turn
        self.tree.replace(handle, made)

    def paint(self, index: int, rgba: Sequence[float]) -> None:
        """Set the displayed color of a shape."""
        body, link = self._places[index]
        self._world.set_color(body, rgba, link)

    def _forget_objects(self) -> None:
        self.drag.let_go_of_all()
        for item in getattr(self, "objects", {}).values():
            if isinstance(item, ShapeObject):
                item.release()
        self.objects: dict[int, SceneObject] = {}  # by index of the entry
        self._carried_bases: dict[int, CarriedBody] = {}  # static roots of chains with a parent, by body
        self._context.carried.shapes.clear()
        self._context.carried.bases.clear()

    def _add_objects(self, new_bodies: Iterable[Built]) -> None:
        """Add the missing objects to the tree, and connect the joints and force sensors of new bodies."""
        new = {index: entry for index, entry in self.entries.items() if index not in self.objects}
        for index in building.parents_first(new):
            self.objects[index] = self._add(index)
        for built in new_bodies:
            self._connect_joints(built)

    def _add(self, index: int) -> SceneObject:
        entry = self.entries[index]
        parent = self._parent(index)
        is_orphan = bool(entry.parent) and parent is None  # a removed vehicle: the object keeps its initial pose
        place = Place((entry.name,), entry.shown, parent, self._initial_poses[index] if is_orphan else entry.local)
        if isinstance(entry, KindParameters):
            added = entry.make(place, self._context)
        else:
            follow = self._context.carried.follow
            added = ShapeObject(place, self._world, self._update_carried, follow, self._solid(index, place.local))
        added.is_model, added.size_factor = entry.model, entry.size_factor
        try:
            self.tree.insert(added)
        except ValueError as error:
            raise ParameterError(str(error), ("objects", index, "name")) from None
        return added

    def _solid(self, index: int, local: Matrix) -> ShapeInWorld:
        entry = self.entries[index]
        assert isinstance(entry, ObjectParameters), "only shapes have bodies"
        number, link = self._places[index]
        return ShapeInWorld(number, link, entry.local if link != -1 else local, entry.mass, entry.static)

    def _parent(self, index: int) -> SceneObject | None:
        name = self.entries[index].parent
        if not name:
            return None
        if name in self.tree:
            return self.tree[self.tree.handle(name)]
        if self._initial_poses:  # a vehicle that was removed
            return None
        raise ParameterError(
            f"no object is named '{name}', the parent of '{self.entries[index].name}'; "
            f"{near_names(name, self.tree.names)}",
            ("objects", index, "parent"),
        )

    def _update_carried(self, shape: ShapeObject) -> None:
        """Update the kinematic bodies after a shape's parent or its being static has changed."""
        if shape.name in self.tree:
            self.tree.look_for_loose_ones()
        if shape.parent is None or not shape.is_static:
            self._context.carried.shapes.pop(shape.number, None)
        else:
            self._context.carried.shapes[shape.number] = shape.carried

    def _connect_joints(self, built: Built) -> None:
        for hung in built.chain.hung:
            holder, link = self.objects[hung.joint], built.links[hung.shape]
            if isinstance(holder, ForceSensor):
                holder.hold(self._world, built.body, link)
            elif isinstance(holder, Joint):
                holder.drive = JointDrive(self._world.joints, built.body, link)
                holder.drive.limit(holder.limits)
                holder.drive.command(holder.control)
        if built.chain.root is None:
            first = self.objects[built.chain.hung[0].joint]
            if first.parent is not None:
                self._carried_bases[built.body] = CarriedBody(self._world, built.body, first.parent.below)
                for carrier in bodies_above(first):
                    self._world.collision_filter.let_pass(built.body, carrier)

    def _follow(self) -> None:
        """Move the kinematic bodies to their frames; a chain that hangs on another chain's link follows that chain."""

        def depth(body: int) -> int:
            return len(bodies_above(self.objects[first[body]]))

        first = {built.body: built.chain.hung[0].joint for built in self._built.values() if built.chain.hung}
        bases = self._carried_bases
        self._context.carried.bases = {body: bases[body] for body in sorted(bases, key=depth)}
        self._context.carried.follow()

    def _place_free_children(self, added: Iterable[int]) -> None:
        """Move added free children to their entries' poses relative to the parent, now that it exists."""
        for index in added:
            item = self.objects[index]
            if item.is_free_child and item.parent is not None:
                item.put(multiply(item.parent.below(), self.entries[index].local))

    # ---- present values

    def now(self, index: int) -> dict[str, Any]:
        """Return the present values of an entry's keys for pose, parent, joint and `static`."""
        item, entry = self.objects[index], self.entries[index]
        values = place_of(item)
        if stands_at(entry, values):  # keep the author's numbers
            values.update(position=list(entry.position), rpy=list(entry.rpy))
        if isinstance(item, ShapeObject) and item.mass and not item.is_held:
            is_other = isinstance(entry, ObjectParameters) and item.is_static != entry.static
            values.update({"static": item.is_static} if is_other else {})
        return values

    def current_entry(self, index: int) -> EntryParameters:
        """Return an entry with its present values; the same entry if nothing differs."""
        entry, now = self.entries[index], self.now(index).items()
        values = {key: tuple(value) if isinstance(value, list) else value for key, value in now}
        values = {key: value for key, value in values.items() if getattr(entry, key) != value}
        return entry.model_copy(update=values) if values else entry

    def sync_entries(self, indices: Iterable[int]) -> None:
        """Update entries to the present values of their objects."""
        for index in indices:
            self.entries[index] = self.current_entry(index)

    def write_down_joints(self) -> None:
        """Update all entries to the present values if there are joints or force sensors, whose links may change."""
        if any(isinstance(entry, (JointParameters, ForceSensorParameters)) for entry in self.entries.values()):
            self.sync_entries(self.entries)

    def put_in_order(self) -> None:
        """Sort the entries by their objects' handles, the order in which they were first added."""
        handles = {index: self.tree.handle(entry.name) for index, entry in self.entries.items()}
        self.entries = dict(sorted(self.entries.items(), key=lambda pair: handles[pair[0]]))

    def parameters_now(self) -> SceneParameters:
        """Return the parameters of the scene with their present values."""
        self.sync_entries(self.entries)
        now = {"objects": list(self.entries.values()), "scripts": list(self.scripts.values())}
        return self.parameters.model_copy(update=now)

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores entries and moves kinematic bodies to their frames."""
        entries = dict(self.entries)

        def restore() -> None:
            self.entries.update({index: entry for index, entry in entries.items() if index in self.entries})
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
        names = {place: self.entries[index].name for index, place in self._places.items()}
        return [names.get(place, "") for place in self._world.pictures.places(self._numbers())]

    def _numbers(self) -> list[int]:
        return list(dict.fromkeys(self._places[index][0] for index in sorted(self._places)))


def _warn(entries: Mapping[int, object], reasons: Mapping[int, str]) -> None:
    """Log one warning for each reason, with the joints that the dynamics does not move."""
    for reason in sorted({*reasons.values()}):
        names = [getattr(entries[index], "name", "") for index, other in reasons.items() if other == reason]
        _LOG.warning(
            "only scripts move these joints, because %s: %s",
            reason,
            ", ".join(names[:12]) + (" …" if names[12:] else ""),
        )
