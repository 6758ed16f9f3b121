"""What can be done to a scene in one edit: records, as they come from outside, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictInt, StrictStr

from drone_sim.config.types import Angles, Checked, Finite, Label, ParameterError, Point, Switch, Within, one_of
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.message_text import shown

MAX_OPERATIONS = 2000
MAX_COPIES = 1000


def _named(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, str)):
        raise ValueError("must be an object's handle or name")
    return value


Object = Annotated[StrictInt | StrictStr, BeforeValidator(_named)]
_Objects = Annotated[list[Object], Field(min_length=1, max_length=MAX_OPERATIONS)]
_Quaternion = Annotated[
    tuple[Finite, Finite, Finite, Finite], Field(description="4 numbers, a quaternion [x, y, z, w]")
]
_Factor = Annotated[Finite, Within(1e-6, 1e6)]
_Count = Annotated[int, Within(1, MAX_COPIES)]


class Add(Checked):
    """Entries as in a scene file, under free names; `position` is where the lowest point of the first lands."""

    do: Literal["add"]
    objects: Annotated[list[dict[str, Any]], Field(min_length=1, max_length=MAX_OPERATIONS)]
    scripts: Annotated[list[dict[str, Any]], Field(default_factory=list)]
    position: Point | None = None
    yaw: Finite = 0.0


class AddModel(Checked):
    """A model of the package's by its name, or a file; its origin lands at `position`, in the world."""

    do: Literal["add_model"]
    model: str
    position: Point = (0.0, 0.0, 0.0)
    yaw: Finite = 0.0


class AddSign(Checked):
    """A board with a text, whose picture is written beside the scene; its foot is at `position`."""

    do: Literal["add_sign"]
    text: Annotated[str, Field(min_length=1, max_length=40, pattern=r"^[ -~]+$")]
    position: Point = (0.0, 0.0, 0.0)
    yaw: Finite = 0.0


class AddVehicle(Checked):
    """A vehicle with all that it carries, so high above a place."""

    do: Literal["add_vehicle"]
    type: str = "quadricopter"
    name: Label = ""
    position: Point
    height: Annotated[Finite, Within(0, 1e4)] = 0.0
    yaw: Finite = 0.0
    values: Annotated[dict[str, Any], Field(default_factory=dict)]


class Remove(Checked):
    """What hangs on the objects stays, except on models; with `below` it is removed from all of them."""

    do: Literal["remove"]
    objects: _Objects
    below: Switch = False


class Move(Checked):
    """To a place relative to the world, to the parent, or to another object; what is left out stays."""

    do: Literal["move"]
    object: Object
    position: Point | None = None
    rpy: Angles | None = None
    quaternion: _Quaternion | None = None
    relative_to: Object = "world"


class Rename(Checked):
    """Another name, and alias."""

    do: Literal["rename"]
    object: Object
    name: Annotated[Label, Field(min_length=1)]


class Reparent(Checked):
    """Another parent, -1 for the world; the pose in the world stays, or that relative to the parent."""

    do: Literal["reparent"]
    objects: _Objects
    parent: Object = WORLD
    keep: Literal["pose", "relative"] = "pose"


class Set(Checked):
    """Keys of its entry in the scene file; null is the default again."""

    do: Literal["set"]
    object: Object
    values: Annotated[dict[str, Any], Field(min_length=1)]


class Scale(Checked):
    """So many times as large along their own axes."""

    do: Literal["scale"]
    objects: _Objects
    factors: tuple[_Factor, _Factor, _Factor]


class Copy(Checked):
    """With what hangs on them: in a row, a grid, or in place; the originals count."""

    do: Literal["copy"]
    objects: _Objects
    counts: tuple[_Count, _Count, _Count] = (2, 1, 1)
    steps: Point = (0.0, 0.0, 0.0)


class Paste(Checked):
    """Objects and vehicles of a text, as `text_of` gives it, under free names; beside what stands where they would."""

    do: Literal["paste"]
    text: str


class Group(Checked):
    """One model of several, below a dummy, or one rigid shape."""

    do: Literal["group"]
    objects: _Objects
    name: Label = ""
    as_: Annotated[Literal["model", "shape"], Field(alias="as")] = "model"


class Ungroup(Checked):
    """A rigid shape into its parts; a model into objects that do not belong together."""

    do: Literal["ungroup"]
    object: Object


class AttachScript(Checked):
    """A script on it; without a file, a new one in V-REP's form."""

    do: Literal["attach_script"]
    object: Object
    script: str = ""
    language: Literal["lua", "python"] = "lua"
    parameters: Annotated[dict[str, Any], Field(default_factory=dict)]


class DetachScript(Checked):
    """No script on it; the file stays."""

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
    """Several operations that are done as a whole; those of the same `merge`, in a row, are one step of undo."""

    edit: Annotated[list[Operation], Field(min_length=1, max_length=MAX_OPERATIONS)]
    name: Label = ""
    merge: Label = ""


class Undo(Checked):
    """Undo the last edit, or that of this `merge`, whatever others have done since."""

    undo: Literal[True]
    merge: Label = ""


class Redo(Checked):
    """The edit that was undone last is done again."""

    redo: Literal[True]


class Text(Checked):
    """The scene as its file would say it."""

    text: Literal[True]


class TextOf(Checked):
    """Objects with what hangs on them, and vehicles, as a scene file would say them."""

    text_of: _Objects


class Write(Checked):
    """The scene becomes what a text says, which was made from the text of a `revision`."""

    write: str
    revision: int | None = None


class New(Checked):
    """A floor, and nobody flies."""

    new: Literal[True]


class Open(Checked):
    """The scene of a file."""

    open: str


class Save(Checked):
    """Write its file, or another one, which is its file then."""

    save: Literal[True] | str


class SaveModel(Checked):
    """Write an object, and all that hangs on it, into a file of its own."""

    save_model: Object
    file: str


class Draft(Checked):
    """What an earlier node left unsaved: take it, or drop it."""

    draft: Literal["take", "drop"]


_REQUESTS = (Edit, Undo, Redo, Text, TextOf, Write, New, Open, Save, SaveModel, Draft)
REQUESTS: dict[str, type[Checked]] = {next(iter(one.model_fields)): one for one in _REQUESTS}


def request_of(said: Any) -> type[Checked]:
    """Return what a message asks for. Raises ParameterError."""
    for word, kind in REQUESTS.items():
        if isinstance(said, Mapping) and word in said:
            return kind
    raise ParameterError(f"{shown(said)}: must be a mapping with one of {', '.join(REQUESTS)}")
