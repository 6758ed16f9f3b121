"""The common part of all entries of `objects`: name, parent and pose in the parent's frame; present values of these."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from drone_sim.config.types import Angles, Checked, Finite, Label, ParameterError, Point, Switch, Within
from drone_sim.context import SimulationContext
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, from_rpy, to_quaternion
from drone_sim.mechanics.joint import FORCE, POSITION, SPHERICAL, VELOCITY, Joint
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.mechanics.state import Pose

_TOLERANCE = 1e-7  # m and rotation matrix element; rounding error of the pose of an object that was not moved


class Place(NamedTuple):
    """Names, parent and pose of an object in the tree."""

    names: tuple[str, ...]
    alias: str
    parent: SceneObject | None
    local: Matrix


class EntryParameters(Checked):
    """An entry; `position` (m) and `rpy` (rad) are in the frame of the object named `parent` ('': the world).

    `name` (V-REP 3.x) is unique; siblings may share an `alias` (4.x), which defaults to the name. `model`: the object
    is the base of a model, at which paths with a colon (`:/`) begin. `category`: label of its pixels and boxes in a
    camera's ground truth; the default is the name without its number. sim.getObjectSizeFactor returns `size_factor`; it
    does not scale anything.
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
        """Raise ParameterError for an entry without a name that needs one."""
        if (self.parent or self.alias) and not self.name:
            key, value = ("parent", self.parent) if self.parent else ("alias", self.alias)
            raise ParameterError("an entry with a parent or alias needs a `name`", (key,), f"'{value}'")

    @property
    def pose(self) -> Pose:
        """Its pose in the parent's frame."""
        x, y, z = self.position
        return Pose((x, y, z), to_quaternion(from_rpy((0, 0, 0), self.rpy)))

    @property
    def local(self) -> Matrix:
        """Parent from object frame."""
        return from_rpy(self.position, self.rpy)

    @property
    def shown(self) -> str:
        """The name that 4.x paths use: the alias, or else the name."""
        return self.alias or self.name


class KindParameters(EntryParameters):
    """An entry of `objects` that is not a shape."""

    name: Annotated[Label, Field(min_length=1)]
    position: Point = (0.0, 0.0, 0.0)
    kind: str

    @abstractmethod
    def make(self, place: Place, context: SimulationContext) -> SceneObject:
        """Return the object."""


# ---- present values


def place_of(item: SceneObject) -> dict[str, Any]:
    """Return the present values of an entry's keys for pose, parent and the state of a joint."""
    parent = item.parent
    matrix = item.matrix() if parent is None else frames.relative(parent.below(), item.matrix())
    values: dict[str, Any] = {**pose_keys(matrix), "parent": "" if parent is None else parent.name}
    if isinstance(item, Joint):
        control = item.control
        values.update(mode=control.mode, max_force=control.max_force)
        targets = {POSITION: control.position, VELOCITY: control.velocity, FORCE: control.force}
        if control.mode in targets:
            values["target"] = targets[control.mode]
        if item.limits is not None:
            values["limits"] = list(item.limits)
        low, high = item.limits or (-math.inf, math.inf)
        if item.motion != SPHERICAL:
            values["value"] = min(max(item.value, low), high)
    return values


def rounded(values: Iterable[float], decimals: int = 9) -> list[float]:
    """Return values as files have them: rounded, and 0 instead of -0."""
    return [round(float(value), decimals) + 0.0 for value in values]


def pose_keys(matrix: Sequence[float], decimals: int = 9) -> dict[str, list[float]]:
    """Return the keys `position` (m) and `rpy` (rad) of a transform."""
    return {"position": rounded(frames.position(matrix), decimals), "rpy": rounded(frames.to_rpy(matrix), decimals)}


def stands_at(entry: EntryParameters, place: Mapping[str, Any]) -> bool:
    """Return whether an entry has this place already, to 1e-7 m and 1e-7 of the rotation matrix."""
    if entry.parent != place["parent"]:
        return False
    matrix = from_rpy(place["position"], place["rpy"])
    return all(abs(value - other) < _TOLERANCE for value, other in zip(entry.local, matrix))


def placed(entry: EntryParameters, parent: str, matrix: Matrix) -> EntryParameters:
    """Return the entry with another parent and pose in the parent's frame."""
    place = {key: tuple(values) for key, values in pose_keys(matrix).items()}
    return entry.model_copy(update={"parent": parent, **place})
