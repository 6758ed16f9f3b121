"""Records of edit requests and operations, checked on input."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictInt, StrictStr

from drone_sim.config.types import Angles, Checked, Finite, Label, ParameterError, Point, Switch, Within, one_of
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.message_text import shown

MAX_OPERATIONS = 2000
MAX_COPIES = 1000


def _check_object(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, str)):
        raise ValueError("must be an object's handle or name")
    return value


Object = Annotated[StrictInt | StrictStr, BeforeValidator(_check_object)]
_Objects = Annotated[list[Object], Field(min_length=1, max_length=MAX_OPERATIONS)]
_Quaternion = Annotated[
    tuple[Finite, Finite, Finite, Finite], Field(description="4 numbers, a quaternion [x, y, z, w]")
]
_Factor = Annotated[Finite, Within(1e-6, 1e6)]
_Count = Annotated[int, Within(1, MAX_COPIES)]


class Add(Checked):
    """Add entries as in a scene file, under unused names; the first entry's lowest point is put at `position`."""

    do: Literal["add"]
    objects: Annotated[list[dict[str, Any]], Field(min_length=1, max_length=MAX_OPERATIONS)]
    scripts: Annotated[list[dict[str, Any]], Field(default_factory=list)]
    position: Point | None = None
    yaw: Finite = 0.0


class AddModel(Checked):
    """Add a model of the package by name, or a file, with its origin at `position` in the world."""

    do: Literal["add_model"]
    model: str
    position: Point = (0.0, 0.0, 0.0)
    yaw: Finite = 0.0


class AddSign(Checked):
    """Add a sign with a text, standing at `position`; its image is written beside the scene file."""

    do: Literal["add_sign"]
    text: Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[ -~]+$")]
    position: Point = (0.0, 0.0, 0.0)
    yaw: Finite = 0.0


class AddVehicle(Checked):
    """Add a vehicle with its equipment at `position`, raised by `height` (m)."""

    do: Literal["add_vehicle"]
    type: str = "quadricopter"
    name: Label = ""
    position: Point
    height: Annotated[Finite, Within(0, 1e4)] = 0.0
    yaw: Finite = 0.0
    values: Annotated[dict[str, Any], Field(default_factory=dict)]


class Remove(Checked):
    """Remove objects; their children stay, except those of models. With `below`, all descendants are removed."""

    do: Literal["remove"]
    objects: _Objects
    below: Switch = False


class Move(Checked):
    """Move an object relative to the world, its parent or another object; omitted values stay the same."""

    do: Literal["move"]
    object: Object
    position: Point | None = None
    rpy: Angles | None = None
    quaternion: _Quaternion | None = None
    relative_to: Object = "world"


class Rename(Checked):
    """Rename an object and reset its alias."""

    do: Literal["rename"]
    object: Object
    name: Annotated[Label, Field(min_length=1)]


class Reparent(Checked):
    """Set the parent (-1: the world); `keep`: the pose in the world, or relative to the parent."""

    do: Literal["reparent"]
    objects: _Objects
    parent: Object = WORLD
    keep: Literal["pose", "relative"] = "pose"


class Set(Checked):
    """Set keys of the object's entry in the scene file; null restores the default."""

    do: Literal["set"]
    object: Object
    values: Annotated[dict[str, Any], Field(min_length=1)]


class Scale(Checked):
    """Scale objects along their own axes."""

    do: Literal["scale"]
    objects: _Objects
    factors: tuple[_Factor, _Factor, _Factor]


class Copy(Checked):
    """Copy objects with their descendants in a row, in a grid or in place; `counts` includes the originals."""

    do: Literal["copy"]
    objects: _Objects
    counts: tuple[_Count, _Count, _Count] = (2, 1, 1)
    steps: Point = (0.0, 0.0, 0.0)


class Paste(Checked):
    """Add the objects and vehicles of a text as from `text_of`, under unused names, moved off occupied positions."""

    do: Literal["paste"]
    text: str


class Group(Checked):
    """Group objects into a model below a new dummy, or into one rigid shape."""

    do: Literal["group"]
    objects: _Objects
    name: Label = ""
    as_: Annotated[Literal["model", "shape"], Field(alias="as")] = "model"


class Ungroup(Checked):
    """Split a rigid shape into its parts, or a model into independent objects."""

    do: Literal["ungroup"]
    object: Object


class AttachScript(Checked):
    """Attach a script to an object; without a file, create one from V-REP's template."""

    do: Literal["attach_script"]
    object: Object
    script: str = ""
    language: Literal["lua", "python"] = "lua"
    parameters: Annotated[dict[str, Any], Field(default_factory=dict)]


class DetachScript(Checked):
    """Detach the script of an object; its file stays."""

    do: Literal["detach_script"]
    object: Object


OPERATIONS = (
    Add,
    AddModel,
    AddSign,
    AddVehicle,
    Remove,
    Move,
    Rename,
    Reparent,
    Set,
    Scale,
    Copy,
    Paste,
    Group,
    Ungroup,
    AttachScript,
    DetachScript,
)

if TYPE_CHECKING:
    Operation = Checked
else:
    Operation = one_of(*OPERATIONS, key="do")


class Edit(Checked):
    """Execute operations atomically; consecutive edits with the same `merge` key are one step of undo."""

    edit: Annotated[list[Operation], Field(min_length=1, max_length=MAX_OPERATIONS)]
    name: Label = ""
    merge: Label = ""


class Undo(Checked):
    """Undo the last step, or the one with this `merge` key even if others have edited since."""

    undo: Literal[True]
    merge: Label = ""


class Redo(Checked):
    """Redo the step that was undone last."""

    redo: Literal[True]


class Text(Checked):
    """Get the scene as text of a scene file."""

    text: Literal[True]


class TextOf(Checked):
    """Get objects with their descendants, and vehicles, as text of a scene file."""

    text_of: _Objects


class Write(Checked):
    """Replace the scene by that of a text; refused if the scene has changed since `revision`."""

    write: str
    revision: int | None = None


class New(Checked):
    """Open a new scene: a floor without vehicles."""

    new: Literal[True]


class Open(Checked):
    """Open the scene of a file."""

    open: str


class Save(Checked):
    """Write the scene to its file, or to another one, which becomes its file."""

    save: Literal[True] | str


class SaveModel(Checked):
    """Write an object and its descendants to a model file."""

    save_model: Object
    file: str


class Draft(Checked):
    """Open (`take`) or discard (`drop`) the unsaved changes of an earlier node."""

    draft: Literal["take", "drop"]


_REQUESTS = (Edit, Undo, Redo, Text, TextOf, Write, New, Open, Save, SaveModel, Draft)
REQUESTS: dict[str, type[Checked]] = {next(iter(kind.model_fields)): kind for kind in _REQUESTS}


def request_of(message: Any) -> type[Checked]:
    """Return the request class of a message. Raises ParameterError."""
    for word, kind in REQUESTS.items():
        if isinstance(message, Mapping) and word in message:
            return kind
    raise ParameterError(f"{shown(message)}: must be a mapping with one of {', '.join(REQUESTS)}")
