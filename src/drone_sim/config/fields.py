"""Fields of parameter models: types and allowed values; defaults and comments in config/drone.yaml."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin

import yaml
from pydantic.fields import FieldInfo

from drone_sim.config.types import Checked, Location, Parts, Unit, Within
from drone_sim.files.resources import package_path

_Mark = TypeVar("_Mark")


class ValueType(NamedTuple):
    """The type of a value without Annotated and `| None`, the marks of Annotated (outer ones first), and whether the
    value may be None.
    """

    kind: Any
    marks: tuple[Any, ...] = ()
    has_none: bool = False

    @property
    def words(self) -> tuple[Any, ...]:
        """The values of a Literal; empty for other types."""
        return get_args(self.kind) if get_origin(self.kind) is Literal else ()

    @property
    def elements(self) -> tuple[Any, ...]:
        """The types of a tuple's elements; empty for other types."""
        return get_args(self.kind) if get_origin(self.kind) is tuple else ()

    @property
    def fields(self) -> dict[str, FieldInfo]:
        """The fields of a model, by their keys; empty for other types."""
        fields = getattr(self.kind, "model_fields", {})
        return {field.alias or name: field for name, field in fields.items()}

    @property
    def description(self) -> str:
        """The description of a field or an annotation, '' if there is none."""
        return next((str(mark.description) for mark in self.marks if getattr(mark, "description", None)), "")

    def mark(self, kind: type[_Mark]) -> _Mark | None:
        return next((mark for mark in self.marks if isinstance(mark, kind)), None)


def value_type(annotation: Any, marks: tuple[Any, ...] = ()) -> ValueType:
    """Return the type of the values of an annotation; `marks` are those around it."""
    has_none = False
    while True:
        arguments = get_args(annotation)
        others = [inner for inner in arguments if inner is not NoneType]
        if get_origin(annotation) is Annotated:
            annotation, marks = arguments[0], (*marks, *arguments[1:])
        elif get_origin(annotation) in (Union, UnionType) and len(others) == 1:
            annotation, has_none = others[0], True
        else:
            return ValueType(annotation, marks, has_none)


def field_type(field: FieldInfo) -> ValueType:
    return value_type(field.annotation, (*field.metadata, field))


# ---- fields


class ParameterField(NamedTuple):
    """A value of a model, or an element of a list: its location, type and range."""

    location: Location  # keys, then the index for an element of a list
    kind: type  # float, int, bool or str
    part: str = ""  # name of the element
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()  # for a str
    none: float | None = None  # number that represents `none`, if that is allowed
    description: str = ""  # unit and description

    @property
    def name(self) -> str:
        """The keys joined by slashes, with an element's name instead of its index."""
        keys = (*self.location[:-1], self.part) if self.part else self.location
        return "/".join(map(str, keys))


@lru_cache(maxsize=1024)
def fields_of(model: type[Checked], above: Location = ()) -> tuple[ParameterField, ...]:
    """Return the fields of a model whose keys are below `above`; mappings with arbitrary keys are left out."""
    return tuple(
        parameter
        for name, field in model.model_fields.items()
        for parameter in _fields_in(field_type(field), ParameterField((*above, name), float))
    )


def _fields_in(value: ValueType, here: ParameterField) -> Iterator[ParameterField]:
    here = here._replace(none=0.0) if value.has_none else here
    if value.elements:
        yield from _elements(value, here)
    elif value.words and all(isinstance(word, str) for word in value.words):
        yield here._replace(kind=str, choices=value.words)
    elif isinstance(value.kind, type) and issubclass(value.kind, Checked):
        yield from fields_of(value.kind, here.location)
    elif value.kind in (float, int, bool):
        kind, within, unit = value.kind, value.mark(Within), value.mark(Unit)
        text = ", ".join(filter(None, (unit.word if unit else "", value.description)))
        here = here._replace(kind=kind, description=text)
        if within is not None:
            low = 0.0 if within.or_zero or here.none is not None else within.low
            here = here._replace(low=kind(low), high=kind(within.high))
        yield here


def _elements(value: ValueType, here: ParameterField) -> Iterator[ParameterField]:
    elements, parts = value.elements, value.mark(Parts)
    names = parts.names if parts else tuple(map(str, range(len(elements))))
    if elements[-1] is Ellipsis:
        elements = elements[:1] * len(names)
    for index, (name, element) in enumerate(zip(names, elements)):
        part = here._replace(location=(*here.location, index), part=name, none=None)
        for parameter in _fields_in(value_type(element), part):
            widest = parameter.high if index else parameter.low  # limits [lowest, highest] that are `none` do not limit
            yield parameter._replace(none=None if here.none is None else widest)


CONFIG = package_path() / "config" / "drone.yaml"

_ENTRY = re.compile(r"^( *)(\w+):(?: +((?:\"[^\"]*\"|\[.*?\]|\{.*?\}|[^#\s])*))?(?: *# *(.*))?$")
_CONTINUATION = re.compile(r"^ +# *(.*)$")


class Row(NamedTuple):
    """A parameter in a file: its name with slashes, its default as written, and its comment."""

    name: str
    default: str
    comment: str


def rows(text: str) -> Iterator[Row]:
    """Yield the parameters of a file such as config/drone.yaml."""
    entries: list[list[str]] = []
    parents: list[tuple[int, str]] = []
    for line in text.splitlines():
        entry, continuation = _ENTRY.match(line), _CONTINUATION.match(line)
        if entry:
            indent, key, value, comment = len(entry[1]), entry[2], entry[3] or "", entry[4] or ""
            parents = [(depth, name) for depth, name in parents if depth < indent]
            entries.append(["/".join([*(name for _, name in parents), key]), value, comment])
            parents.append((indent, key))
        elif continuation and entries:
            entries[-1][2] += f" {continuation[1]}"
    groups = {name.rpartition("/")[0] for name, _, _ in entries}
    return (Row(*row) for row in entries if row[0] not in groups)


@lru_cache(maxsize=1)
def comments() -> Mapping[str, str]:
    """Return the comments of config/drone.yaml, by key names joined by slashes."""
    return {row.name: row.comment for row in rows(CONFIG.read_text(encoding="utf-8"))}


@lru_cache(maxsize=1)
def _defaults() -> Mapping[str, Any]:
    text = CONFIG.read_text(encoding="utf-8")
    return {row.name: yaml.safe_load(row.default) if row.default else None for row in rows(text)}


def default_of(location: Location) -> Any:
    """Return the value in config/drone.yaml at a location; None if there is none."""
    return _defaults().get("/".join(map(str, location)))
