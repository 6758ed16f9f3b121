"""The scene around the vehicles: floor and objects in the world, and in the tree of objects."""

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
_Key = tuple[Any, ...]  # of what a body is made of
_AT_REST = (0.0, 0.0, 0.0)


class Scene:
    """What stands in the world besides the vehicles: entries as in a scene file, their bodies, their objects.

    Entries may come, go and change at any time (operations.py): `renew` builds what they describe and is not there yet,
    and removes what they do not describe any more; everything else goes on unchanged.
    """

    def __init__(self, parameters: SceneParameters, context: SimulationContext):
        """Put floor and objects into the empty world of `context`, and the bodies' names into its names.

        Raises ParameterError for a file that cannot be used.
        """
        self.parameters = parameters  # as it began
        self.entries: dict[int, EntryParameters] = dict(enumerate(parameters.objects))  # by a number that stays theirs
        self.scripts: dict[str, AttachedScriptParameters] = {one.object: one for one in parameters.scripts}  # by object
        check_files(parameters.floor, parameters.objects)
        self._context, self.tree = context, context.objects
        self._world = context.world
        self._add_floor(parameters.floor)
        self.drag = ObjectDrag(context, self.things, parameters.floor.size)
        self.next_index = len(self.entries)
        self.is_changed = False  # whether anything has been done to it (operations.py) since it was made
        self.rebuilt = 0  # bodies that have come or gone by now
        self.changed: Counter[int] = Counter()  # how often an entry has become other than its body is
        self.factors: dict[int, Vector] = {}  # by which entries were scaled
        self._built: dict[_Key, Built] = {}
        self._places: dict[int, tuple[int, int]] = {}  # body and link of each shape
        self._began: dict[int, Matrix] = {}  # where the objects were at the beginning, by entry; empty before
        self._forget_objects()
        _warn(self.entries, self._build()[1])

    def lay_floor(self, floor: FloorParameters) -> None:
        """Let another floor take the last one's place. Raises ParameterError for a file that cannot be used."""
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
        """Let there be the bodies that the entries ask for, and no others.

        Returns the new ones, and why joints are not moved, by entry. Raises ParameterError, where all is as it was, for
        a file that cannot be read.
        """
        found = chains.found(self.entries)
        wanted = {self._key(one): one for one in (*building.alone(self.entries, found.chains), *found.chains)}
        new = {key: one for key, one in wanted.items() if key not in self._built}
        matrices = {index: self._matrix(index) for one in new.values() for index in one.members()}
        speeds = {index: self._speed(index) for index in matrices}
        try:
            made = building.build(self._world, self.entries, new.values(), matrices)
        except ValueError as error:
            raise ParameterError(str(error)) from None
        gone = self._built.keys() - wanted.keys()
        for key in gone:
            self._remove(self._built.pop(key))
        self.rebuilt += len(gone) + len(new)
        self._built.update(zip(new, made))
        self._places = {index: (one.body, link) for one in self._built.values() for index, link in one.links.items()}
        self._add_names()
        for one in made:
            self._set_moving(one, speeds)
        return made, found.reasons

    def _key(self, chain: Chain) -> _Key:
        versions = tuple(self.changed[index] for index in chain.members())
        return chain.root, tuple(one[:3] for one in chain.hung), versions

    def _matrix(self, index: int) -> Matrix:
        """Return the world from the frame of an entry, of what is not there yet, too."""
        if index in self.objects:
            return self.objects[index].matrix()
        entry = self.entries[index]
        if entry.parent in self.tree:
            return multiply(self.tree[self.tree.handle(entry.parent)].below(), entry.local)
        above = next((other for other, one in self.entries.items() if entry.parent and one.name == entry.parent), None)
        if above is None:  # it hangs on a vehicle, which comes after the scene
            return entry.local
        return multiply(multiply(self._matrix(above), building.motion(self.entries[above])), entry.local)

    def _speed(self, index: int) -> tuple[Vector, Vector, float]:
        """Return how fast an entry is that is about to have another body: m/s, rad/s, and along a joint."""
        one = self.objects.get(index)
        if isinstance(one, Joint):
            return _AT_REST, _AT_REST, one.velocity_along
        body = one.body if one is not None else None
        if body is None:
            return _AT_REST, _AT_REST, 0.0
        _, _, linear, angular = body.state
        return linear, angular, 0.0

    def _set_moving(self, built: Built, speeds: Mapping[int, tuple[Vector, Vector, float]]) -> None:
        root = built.chain.root
        if root is not None and getattr(self.entries[root], "moves", False) and any(map(any, speeds[root][:2])):
            self._world.set_velocity(built.body, *speeds[root][:2])
        for hung in built.chain.hung:
            joint, speed = self.entries[hung.joint], speeds[hung.joint][2]
            if speed and isinstance(joint, JointParameters):
                self._world.joints.put(built.body, built.links[hung.shape], joint.value, speed)

    def _remove(self, gone: Built) -> None:
        for hung in gone.chain.hung:
            one = self.objects.get(hung.joint)
            if isinstance(one, (Joint, ForceSensor)):
                one.release()
        self._world.remove(gone.body)
        self._context.names.pop(gone.body, None)
        for link in gone.links.values():
            self._context.link_names.pop((gone.body, link), None)
        for carried in (self._context.carried.shapes, self._context.carried.bases, self._carried_bases):
            carried.pop(gone.body, None)
        self.drag.forget(gone.body)
        for one in self.objects.values():
            if isinstance(one, ShapeObject):
                one.forget_body(gone.body)

    def _add_names(self) -> None:
        names, link_names = self._context.names, self._context.link_names
        for index, (number, link) in self._places.items():
            name = link_names[number, link] = self.entries[index].name
            if link == -1 or number not in names:
                names[number] = (name, name)

    # ---- the tree

    def name_objects(self) -> None:
        """Let scripts find the objects, as they were at the beginning, in a tree without them.

        Raises ParameterError, with its place, for a name that is taken, or a parent that is not there.
        """
        self._forget_objects()
        self._add_objects(self._built.values())
        if not self._began:
            self._place_loose_ones(self.objects)
            self._began = {index: one.matrix() for index, one in self.objects.items()}
        self._follow()

    def renew(self, change_tree: Callable[[], None] = lambda: None, bodies: bool = True) -> None:
        """Let world and tree be what the entries say by now; `change_tree` is called when there are the new bodies.

        `bodies`: bodies may have to be rebuilt, too. Raises ParameterError, where world and tree are as they were.
        """
        made = self._build()[0] if bodies else []
        for index in (index for one in made for index in one.links):
            one = self.objects.get(index)
            if isinstance(one, ShapeObject):
                one.embody(self._solid(index, self.entries[index].local))
        for index in self.objects.keys() - self.entries.keys():
            del self.objects[index], self.changed[index]
            self.factors.pop(index, None)
        change_tree()
        for one in self.objects.values():
            if isinstance(one, ShapeObject):
                one.pass_carriers()
        there = set(self.objects)
        self._add_objects(made)
        self._place_loose_ones(self.objects.keys() - there)
        self._follow()

    def exchange(self, index: int, handle: int, entry: KindParameters, place: Place) -> None:
        """Make an object anew of an entry, in the place of the one that is there."""
        made = entry.make(place, self._context)
        made.is_model, made.size_factor = entry.model, entry.size_factor
        before, self.objects[index] = self.objects[index], made
        if isinstance(made, Joint) and isinstance(before, Joint):
            made.turn = before.turn
        self.tree.exchange(handle, made)

    def paint(self, index: int, rgba: Sequence[float]) -> None:
        """Show a shape in another color."""
        body, link = self._places[index]
        self._world.set_color(body, rgba, link)

    def _forget_objects(self) -> None:
        self.drag.let_go_of_all()
        for one in getattr(self, "objects", {}).values():
            if isinstance(one, ShapeObject):
                one.release()
        self.objects: dict[int, SceneObject] = {}  # by entry
        self._carried_bases: dict[int, CarriedBody] = {}  # those of chains whose first joint has a parent, by body
        self._context.carried.shapes.clear()
        self._context.carried.bases.clear()

    def _add_objects(self, made: Iterable[Built]) -> None:
        """Let the tree have the objects that it has not, and the dynamics move the joints of new bodies."""
        new = {index: one for index, one in self.entries.items() if index not in self.objects}
        for index in building.parents_first(new):
            self.objects[index] = self._add(index)
        for built in made:
            self._hold(built)

    def _add(self, index: int) -> SceneObject:
        one = self.entries[index]
        parent = self._parent(index)
        gone = bool(one.parent) and parent is None  # a vehicle: it stays where it began
        place = Place((one.name,), one.shown, parent, self._began[index] if gone else one.local)
        if isinstance(one, KindParameters):
            added = one.make(place, self._context)
        else:
            follow = self._context.carried.follow
            added = ShapeObject(place, self._world, self._changed, follow, self._solid(index, place.local))
        added.is_model, added.size_factor = one.model, one.size_factor
        try:
            self.tree.insert(added)
        except ValueError as error:
            raise ParameterError(str(error), ("objects", index, "name")) from None
        return added

    def _solid(self, index: int, local: Matrix) -> ShapeInWorld:
        one = self.entries[index]
        assert isinstance(one, ObjectParameters), "only shapes have bodies"
        number, link = self._places[index]
        return ShapeInWorld(number, link, one.local if link != -1 else local, one.mass, one.static)

    def _parent(self, index: int) -> SceneObject | None:
        name = self.entries[index].parent
        if not name:
            return None
        if name in self.tree:
            return self.tree[self.tree.handle(name)]
        if self._began:  # a vehicle that has gone
            return None
        raise ParameterError(
            f"no object is named '{name}', the parent of '{self.entries[index].name}'; "
            f"{near_names(name, self.tree.names)}",
            ("objects", index, "parent"),
        )

    def _changed(self, shape: ShapeObject) -> None:
        """Follow what carries a shape from now on, or follow it no longer."""
        if shape.name in self.tree:
            self.tree.look_for_loose_ones()
        if shape.parent is None or not shape.is_static:
            self._context.carried.shapes.pop(shape.number, None)
        else:
            self._context.carried.shapes[shape.number] = shape.carried

    def _hold(self, built: Built) -> None:
        """Let the dynamics move the joints of a chain, and force sensors measure."""
        for hung in built.chain.hung:
            one, link = self.objects[hung.joint], built.links[hung.shape]
            if isinstance(one, ForceSensor):
                one.hold(self._world, built.body, link)
            elif isinstance(one, Joint):
                one.drive = JointDrive(self._world.joints, built.body, link)
                one.drive.limit(one.limits)
                one.drive.command(one.control)
        if built.chain.root is None:
            first = self.objects[built.chain.hung[0].joint]
            if first.parent is not None:
                self._carried_bases[built.body] = CarriedBody(self._world, built.body, first.parent.below)
                for above in bodies_above(first):
                    self._world.collision_filter.let_pass(built.body, above)

    def _follow(self) -> None:
        """Put what is carried where it is carried to, a chain that hangs on another one's link after that."""

        def depth(body: int) -> int:
            return len(bodies_above(self.objects[first[body]]))

        first = {built.body: built.chain.hung[0].joint for built in self._built.values() if built.chain.hung}
        bases = self._carried_bases
        self._context.carried.bases = {body: bases[body] for body in sorted(bases, key=depth)}
        self._context.carried.follow()

    def _place_loose_ones(self, added: Iterable[int]) -> None:
        """Put what hangs on vehicles where they are, now that they are there."""
        for index in added:
            one = self.objects[index]
            if one.is_loose and one.parent is not None:
                one.put(multiply(one.parent.below(), self.entries[index].local))

    # ---- as it is now

    def now(self, index: int) -> dict[str, Any]:
        """Return the keys of an entry that say where it is, what it hangs on, how a joint stands, what is static."""
        one, entry = self.objects[index], self.entries[index]
        values = place_of(one)
        if stands_at(entry, values):  # its numbers are its author's
            values.update(position=list(entry.position), rpy=list(entry.rpy))
        if isinstance(one, ShapeObject) and one.mass and not one.is_held:
            is_other = isinstance(entry, ObjectParameters) and one.is_static != entry.static
            values.update({"static": one.is_static} if is_other else {})
        return values

    def entry_now(self, index: int) -> EntryParameters:
        """Return an entry as it is now: itself, where it says that already."""
        entry, now = self.entries[index], self.now(index).items()
        values = {key: tuple(value) if isinstance(value, list) else value for key, value in now}
        values = {key: value for key, value in values.items() if getattr(entry, key) != value}
        return entry.model_copy(update=values) if values else entry

    def write_down(self, indices: Iterable[int]) -> None:
        """Let entries say where they are now."""
        for index in indices:
            self.entries[index] = self.entry_now(index)

    def write_down_joints(self) -> None:
        """Update the entries to where objects are now, if there are joints that may be about to hold other objects."""
        if any(isinstance(one, (JointParameters, ForceSensorParameters)) for one in self.entries.values()):
            self.write_down(self.entries)

    def put_in_order(self) -> None:
        """Let entries stand in the order of their objects' handles, as they came first."""
        handles = {index: self.tree.handle(one.name) for index, one in self.entries.items()}
        self.entries = dict(sorted(self.entries.items(), key=lambda pair: handles[pair[0]]))

    def parameters_now(self) -> SceneParameters:
        """Return what a file would say of the scene as it is now."""
        self.write_down(self.entries)
        now = {"objects": list(self.entries.values()), "scripts": list(self.scripts.values())}
        return self.parameters.model_copy(update=now)

    def save_state(self) -> Callable[[], None]:
        """Return a function that puts bodies without mass back where the tree has them."""
        kept = dict(self.entries)

        def restore() -> None:
            self.entries.update({index: one for index, one in kept.items() if index in self.entries})
            statics = [one.carried for one in self.objects.values() if isinstance(one, ShapeObject) and not one.is_held]
            for one in (*self._carried_bases.values(), *statics):
                one.renew()

        return restore

    # ---- what it looks like

    def things(self) -> dict[str, SceneObject]:
        """Return what one can see and move, by name."""
        return {one.name: one for one in self.objects.values() if one.kind in ("shape", "dummy", "path")}

    def visuals(self) -> tuple[list[Visual], np.ndarray]:
        """Return how the objects look, the floor aside, and the poses world from visual, (N, 4, 4)."""
        numbers = self._numbers()
        return self._world.pictures.visuals(numbers), self._world.pictures.visual_poses(numbers)

    def categories(self) -> dict[str, str]:
        """Return the categories of the objects that are given one, by name."""
        return {one.name: one.category for one in self.entries.values() if one.category}

    def visual_names(self) -> list[str]:
        """Return for each of the visuals the name of its object, as in `things`."""
        names = {place: self.entries[index].name for index, place in self._places.items()}
        return [names.get(place, "") for place in self._world.pictures.places(self._numbers())]

    def _numbers(self) -> list[int]:
        return list(dict.fromkeys(self._places[index][0] for index in sorted(self._places)))


def _warn(entries: Mapping[int, object], reasons: Mapping[int, str]) -> None:
    """Say in one line for each reason which joints the dynamics does not move."""
    for reason in sorted({*reasons.values()}):
        names = [getattr(entries[index], "name", "") for index, one in reasons.items() if one == reason]
        _LOG.warning(
            "only scripts move these joints, because %s: %s",
            reason,
            ", ".join(names[:12]) + (" …" if names[12:] else ""),
        )
