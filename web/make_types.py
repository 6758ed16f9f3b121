#!/usr/bin/env python3
"""Write web/types/generated.d.ts: types of the messages that have records in Python, and of the elements in index.html.

PYTHONPATH=src python web/make_types.py
"""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel

from drone_sim.editing import editor, properties, records, rows
from drone_sim.grading import classroom
from drone_sim.ros.cockpit.scene import scene_state
from drone_sim.ros.core.simulator import ScriptFailure
from drone_sim.ros.node.scene_editing import TreeChange
from drone_sim.ros.tools.commands import Command
from drone_sim.scripting.checking import Finding

WEB = Path(__file__).resolve().parent
FILE = WEB / "types/generated.d.ts"
RECORDS = (
    *records.OPERATIONS, *records.REQUESTS.values(), rows.Row, properties.Property, editor.OfferedDraft,
    editor.EditorState, TreeChange, scene_state.MarkerMessage, scene_state.SceneMessage, Command, ScriptFailure,
    Finding, classroom.Message,
)  # fmt: skip
HEAD = """\
// Written by web/make_types.py: do not edit. Types of the messages that have records in Python, and of the elements in
// index.html. `any` is a value of a scene file, which the simulator checks.
"""
_NAMES: dict[Any, str] = {
    str: "string", bool: "boolean", int: "number", float: "number", type(None): "null", Any: "any",
    **{record: record.__name__ for record in RECORDS},
}  # fmt: skip
_CONTAINERS = {list: "Array<{}>", dict: "Record<{}, {}>", Mapping: "Record<{}, {}>"}


def typescript(kind: Any) -> str:
    """Return the TypeScript type of a Python type's values in JSON. Raise KeyError for an unknown type."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return typescript(arguments[0])
    if origin is Literal:
        return " | ".join("true" if word is True else f'"{word}"' for word in arguments)
    inner = [typescript(argument) for argument in arguments]
    if origin in (Union, types.UnionType):
        return "Operation" if arguments == records.OPERATIONS else " | ".join(dict.fromkeys(inner))
    if origin is tuple:
        return f"[{', '.join(inner)}]"
    return _CONTAINERS[origin].format(*inner) if origin else _NAMES[kind]


def keys_of(record: Any) -> Iterator[tuple[str, Any, bool]]:
    """Yield (key, type, whether it is optional) for each key of a record in JSON."""
    if issubclass(record, BaseModel):
        for name, field in record.model_fields.items():
            yield field.alias or name, field.annotation, not field.is_required()
    else:
        required = getattr(record, "__required_keys__", getattr(record, "_fields", ()))
        for name, kind in get_type_hints(record).items():
            yield name, kind, name not in required


def interface(record: Any) -> str:
    keys = [f"    {key}{'?' * optional}: {typescript(kind)};" for key, kind, optional in keys_of(record)]
    return "\n".join([f"  /** {record.__doc__} */", f"  interface {record.__name__} {{", *keys, "  }"])


class _Elements(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: dict[str, str] = {}

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if name := dict(attrs).get("id"):
            self.tags[name] = tag


def text() -> str:
    """Return the content of generated.d.ts."""
    elements = _Elements()
    elements.feed((WEB / "src/index.html").read_text(encoding="utf-8"))
    operations = " | ".join(record.__name__ for record in records.OPERATIONS)
    ids = [f'  "{name}": HTMLElementTagNameMap["{tag}"];' for name, tag in elements.tags.items()]
    return "\n".join(
        [
            f"{HEAD}declare namespace wire {{",
            f"  type Operation = {operations};",
            *map(interface, RECORDS),
            "}\n",
            "/** The elements of index.html by their ids. */",
            "interface PageElements {",
            *ids,
            "}\n",
        ]
    )


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
