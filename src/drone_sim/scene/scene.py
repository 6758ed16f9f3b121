"""The scene around the vehicles: floor and objects in the world, and in the tree of objects."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.frames import IDENTITY, Matrix, multiply
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scene import building, chains, order, scene_files
from drone_sim.scene.bodies import Carried, HeldShape, LinkBody, SceneBody, Shape, bodies_above
from drone_sim.scene.distances import Distances
from drone_sim.scene.drive import JointDrive
from drone_sim.scene.entry import Place
from drone_sim.scene.grip import Grip
from drone_sim.scene.kinds.force_sensor import ForceSensor
from drone_sim.scene.kinds.kind import Around, KindParameters, Look
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import SceneParameters
from drone_sim.shapes.visual import Visual
from drone_sim.wording import near_names
from drone_sim.world import World

_LOG = logging.getLogger(__name__)


class Scene:
    """What stands in the world besides the vehicles."""

    def __init__(self, parameters: SceneParameters, world: World, look: Look, names: dict[int, tuple[str, str]]):
        """Put floor and objects into an empty world. Raises ParameterError for a file that cannot be used.

        `look` takes pictures; `names` has for each body in the world what a person calls it, and its name among the
        objects of scripts, or '': those of the scene are added.
        """
        self.parameters = parameters
        scene_files.check(parameters)
        self._world, self._names = world, names
        floor = parameters.floor
        self.floor = world.add_floor(floor.size, floor.texture, ground=not floor.edge)
        self._entries = parameters.objects
        found = chains.found(self._entries)
        _warn(self._entries, found.reasons)
        self._chains = found.chains
        try:
            built = building.build(world, self._entries, self._chains, order.matrices(self._entries))
        except ValueError as error:
            raise ParameterError(str(error)) from None
        self._places, self._bases = built.places, built.chains
        self._around = Around(world, look, self._name_of, self.follow)
        self.nearest = Distances(self._around, self.floor).nearest
        self.bodies = [self._body(index) for index in sorted(self._places)]  # of the shapes, as the file has them
        self._add_names()
        self._began: dict[int, Matrix] = {}  # where the objects were at the beginning, by entry; empty before
        self._tree = ObjectTree()
        self.grip = Grip(world, self.things, floor.size)
        self._forget_objects()

    def _body(self, index: int) -> SceneBody | LinkBody:
        number, link = self._places[index]
        if link == -1:
            return SceneBody(self._world, number)
        return LinkBody(self._world, number, link, self._entries[index].local)

    def _add_names(self) -> None:
        self._link_names = {place: self._entries[index].name for index, place in self._places.items()}
        self._names[self.floor] = ("Floor", "Floor")
        for index, (number, link) in self._places.items():
            name = self._entries[index].name
            if link == -1 or number not in self._names:
                self._names[number] = (self._called(index), name)

    def _name_of(self, body: int, link: int) -> str:
        """Return what scripts call a body's link (-1: its root), ''  for what they do not know."""
        name = self._link_names.get((body, link))
        return self._names.get(body, ("", ""))[1] if name is None else name

    def _called(self, index: int) -> str:
        """Return what a person calls an entry."""
        return self._entries[index].name or f"objects/{index}"

    # ---- the tree

    def name_objects(self, objects: ObjectTree) -> None:
        """Let scripts find the objects that have a name, as they were at the beginning.

        Raises ParameterError, with its place, for a name that is taken, or a parent that is not there.
        """
        self._forget_objects()
        self._tree = self.grip.tree = objects
        for index in order.parents_first(self._entries):
            if self._entries[index].name:
                self._objects[index] = self._add(objects, index)
        self._hold_chains()
        if not self._began:
            self._place_loose_ones()
            self._began = {index: one.matrix() for index, one in self._objects.items()}
        self.follow()

    def _forget_objects(self) -> None:
        self.grip.let_go_of_all()
        for one in getattr(self, "_objects", {}).values():
            if isinstance(one, Shape):
                one.release()
        self._objects: dict[int, SceneObject] = {}  # by entry
        self._hanging: dict[int, Carried] = {}  # static shapes that have a parent, by body
        self._carried_bases: list[Carried] = []  # those of chains whose first joint has one
        self.carries = False  # whether there is anything to `follow`: asked for in every step

    def _add(self, objects: ObjectTree, index: int) -> SceneObject:
        one = self._entries[index]
        parent = self._parent(objects, index)
        gone = bool(one.parent) and parent is None  # a vehicle: it stays where it began
        place = Place((one.name,), one.alias or one.name, parent, self._began[index] if gone else one.local)
        added = self._object(index, place)
        try:
            objects.insert(added)
        except ValueError as error:
            raise ParameterError(str(error), ("objects", index, "name")) from None
        return added

    def _parent(self, objects: ObjectTree, index: int) -> SceneObject | None:
        name = self._entries[index].parent
        if not name:
            return None
        if name in objects:
            return objects[objects.handle(name)]
        if self._began:  # a vehicle that has gone
            return None
        raise ParameterError(
            f"no object is named '{name}', the parent of '{self._entries[index].name}'; "
            f"{near_names(name, objects.names)}",
            ("objects", index, "parent"),
        )

    def _object(self, index: int, place: Place) -> SceneObject:
        one = self._entries[index]
        if isinstance(one, KindParameters):
            return one.make(place, self._around)
        number, link = self._places[index]
        if link != -1:
            held = HeldShape(*place[:3], IDENTITY, self._body(index))
            held.mass = getattr(one, "mass", 0.0)
            return held
        mass = one.mass if isinstance(one, ObjectParameters) else 0.0
        return Shape(place, world=self._world, number=number, mass=mass, changed=self._changed, follow=self.follow)

    def _changed(self, shape: Shape) -> None:
        """Follow what carries a shape from now on, or follow it no longer."""
        if shape.name in self._tree:
            self._tree.look_for_loose_ones()
        if shape.parent is None or not shape.is_static:
            self._hanging.pop(shape.number, None)
        else:
            self._hanging[shape.number] = shape.carried
        self._look_what_is_carried()

    def _hold_chains(self) -> None:
        """Let the dynamics move the joints of chains, and force sensors measure."""
        for chain, body in zip(self._chains, self._bases):
            for hung in chain.hung:
                self._hold(self._objects[hung.joint], *self._places[hung.shape])
            first = self._objects[chain.hung[0].joint]
            if chain.root is None and first.parent is not None:
                self._carried_bases.append(Carried(self._world, body, first.parent.below))
                for above in bodies_above(first):
                    self._world.solidity.let_pass(body, above)
        self._look_what_is_carried()

    def _hold(self, one: SceneObject, body: int, link: int) -> None:
        if isinstance(one, ForceSensor):
            one.hold(self._world, body, link)
        elif isinstance(one, Joint):
            one.drive = JointDrive(self._world, body, link)
            one.drive.limit(one.limits)
            one.drive.command(one.control)

    def _place_loose_ones(self) -> None:
        """Put what hangs on vehicles where they are, now that they are there."""
        for index, one in self._objects.items():
            if one.is_loose and one.parent is not None:
                matrix = multiply(one.parent.below(), self._entries[index].local)
                one.put(matrix)

    # ---- what is carried

    def _look_what_is_carried(self) -> None:
        self.carries = bool(self._hanging or self._carried_bases)

    def follow(self) -> None:
        """Put every body without mass to where what carries it has gone."""
        for base in self._carried_bases:
            base.follow()
        for shape in self._hanging.values():
            shape.follow()

    def remember(self) -> Callable[[], None]:
        """Return a function that puts bodies without mass back where the tree has them."""

        def recall() -> None:
            statics = [one.carried for one in self._objects.values() if isinstance(one, Shape)]
            for one in (*self._carried_bases, *statics):
                one.renew()

        return recall

    # ---- what it looks like

    def objects_now(self) -> Mapping[int, SceneObject]:
        """Return the objects that scripts find, by entry of the scene file."""
        return self._objects

    def bodies_by_entry(self) -> Mapping[int, SceneBody | LinkBody]:
        """Return the bodies of the shapes, by entry of the scene file."""
        return dict(zip(sorted(self._places), self.bodies))

    def things(self) -> dict[str, SceneObject]:
        """Return what one can see and move, by name; a shape without one is called objects/ and its number."""
        seen = {one.name: one for one in self._objects.values() if one.kind in ("shape", "dummy", "path")}
        for index in self._places.keys() - self._objects.keys():
            name = self._called(index)
            seen.setdefault(name, SceneObject((name,), name, None, IDENTITY, self._body(index)))
        return seen

    def visuals(self) -> tuple[list[Visual], np.ndarray]:
        """Return how the objects look, the floor aside, and the poses world from visual, (N, 4, 4)."""
        numbers = self._numbers()
        return self._world.visuals(numbers), self._world.visual_poses(numbers)

    def visual_names(self) -> list[str]:
        """Return whose each of the visuals is, as `things` calls it."""
        names = {place: self._called(index) for index, place in self._places.items()}
        return [names.get(place, "") for place in self._world.visual_places(self._numbers())]

    def _numbers(self) -> list[int]:
        return list(dict.fromkeys(self._places[index][0] for index in sorted(self._places)))


def _warn(entries: Sequence[object], reasons: Mapping[int, str]) -> None:
    """Say in one line for each reason which joints the dynamics does not move."""
    for reason in sorted({*reasons.values()}):
        names = [getattr(entries[index], "name", "") for index, one in reasons.items() if one == reason]
        _LOG.warning("moved by scripts alone, as %s: %s", reason, ", ".join(names[:12]) + (" …" if names[12:] else ""))
