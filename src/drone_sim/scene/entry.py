"""What all entries of `objects` have in common: a name, a parent, a place in the parent's frame, also as it is now."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from drone_sim.config.types import Angles, Checked, Finite, Label, ParameterError, Point, Switch, Within
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, from_rpy, to_quaternion
from drone_sim.mechanics.joint import FORCE, POSITION, SPHERICAL, VELOCITY, Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose

_STANDS = 1e-7  # m, by which what has not been moved may seem to be elsewhere


class Place(NamedTuple):
    """Where an object belongs in the tree."""

    names: tuple[str, ...]
    alias: str
    parent: SceneObject | None
    local: Matrix


class EntryParameters(Checked):
    """An entry; `position` (m) and `rpy` (rad) are in the frame of the object named `parent`, '' the world.

    No other object has its `name` (V-REP 3.x); siblings may share the `alias` (4.x), which is the name where none is
    given. `model`: it is the base of a model, from which paths with a colon begin (`:/`). `category`: of its pixels and
    boxes in a camera's truth, the name without its number where none is given. `size_factor` is what
    sim.getObjectSizeFactor returns; it scales nothing.
    """

    name: Label = ""
    alias: Label = ""
    model: Switch = False
    category: Label = ""
    parent: Label = ""
    position: Point
    rpy: Angles = (0.0, 0.0, 0.0)
    size_factor: Annotated[Finite, Within(1e-6, 1e6)] = 1.0

    def model_post_init(self, _context: Any) -> None:
        """Refuse what scripts could not find under a name."""
        if (self.parent or self.alias) and not self.name:
            key, value = ("parent", self.parent) if self.parent else ("alias", self.alias)
            raise ParameterError("an entry with a parent or alias needs a `name`", (key,), f"'{value}'")

    @property
    def pose(self) -> Pose:
        """Where it stands in its parent's frame."""
        x, y, z = self.position
        return Pose((x, y, z), to_quaternion(from_rpy((0, 0, 0), self.rpy)))

    @property
    def local(self) -> Matrix:
        """Its parent's frame from its own."""
        return from_rpy(self.position, self.rpy)

    @property
    def shown(self) -> str:
        """What 4.x paths call it."""
        return self.alias or self.name


# ---- as it is now


def place_of(one: SceneObject) -> dict[str, Any]:
    """Return the keys of an entry that say where an object is now, what it hangs on, and how a joint stands."""
    above = one.parent
    matrix = one.matrix() if above is None else frames.relative(above.below(), one.matrix())
    values = place_at(matrix, "" if above is None else above.name)
    return {**values, **_joint(one)} if isinstance(one, Joint) else values


def place_at(matrix: Matrix, parent: str) -> dict[str, Any]:
    """Return the keys of an entry that say where it is in the frame of its parent, to 1e-9 m and rad."""
    position, turn = (
        [round(one, 9) + 0.0 for one in three] for three in (frames.position(matrix), frames.to_rpy(matrix))
    )
    return {"position": position, "rpy": turn, "parent": parent}  # without a -0.0


def stands_at(entry: EntryParameters, place: Mapping[str, Any]) -> bool:
    """Tell whether an entry says already, to 1e-7 m and 1e-7 of a turn's matrix, what `place_of` says."""
    if entry.parent != place["parent"]:
        return False
    now = from_rpy(place["position"], place["rpy"])
    return all(abs(one - other) < _STANDS for one, other in zip(entry.local, now))


def placed(entry: EntryParameters, parent: str, matrix: Matrix) -> EntryParameters:
    """Return an entry in another place, in the frame of its parent."""
    place = place_at(matrix, parent)
    return entry.model_copy(update={"parent": parent, **{key: tuple(place[key]) for key in ("position", "rpy")}})


def _joint(joint: Joint) -> dict[str, Any]:
    control = joint.control
    values: dict[str, Any] = {"mode": control.mode, "max_force": control.max_force}
    targets = {POSITION: control.position, VELOCITY: control.velocity, FORCE: control.force}
    if control.mode in targets:
        values["target"] = targets[control.mode]
    if joint.limits is not None:
        values["limits"] = list(joint.limits)
    low, high = joint.limits or (-math.inf, math.inf)
    if joint.motion != SPHERICAL:
        values["value"] = min(max(joint.value, low), high)
    return values
