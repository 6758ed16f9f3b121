"""Fields of parameter models: allowed values, and defaults and comments of config/drone.yaml."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

import yaml

from drone_sim.config.types import Checked, Location, Parts, Unit, Within
from drone_sim.files.resources import package_path

_UNIONS = (Union, UnionType)


class ParameterField(NamedTuple):
    """A value of a model, or an element of a list: its location, type and range."""

    location: Location  # keys, then the index for an element of a list
    kind: type  # float, int, bool or str
    part: str = ""  # name of the element
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()  # for a str
    none: float | None = None  # number that represents `none`, if that is allowed
    said: str = ""  # unit and description

    @property
    def name(self) -> str:
        """The keys joined by slashes, with an element's name instead of its index."""
        keys = (*self.location[:-1], self.part) if self.part else self.location
        return "/".join(map(str, keys))


@lru_cache(maxsize=1024)
def fields_of(model: type[Checked], above: Location = ()) -> tuple[ParameterField, ...]:
    """Return the fields of a model whose keys are below `above`; mappings with arbitrary keys are left out."""
    fields = model.model_fields.items()
    return tuple(
        parameter
        for name, field in fields
        for parameter in _fields_in(field.annotation, [*field.metadata, field], ParameterField((*above, name), float))
    )


def _fields_in(annotation: Any, marks: Sequence[Any], here: ParameterField) -> Iterator[ParameterField]:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        yield from _fields_in(arguments[0], [*marks, *arguments[1:]], here)
    elif origin in _UNIONS and type(None) in arguments:
        (inner,) = (kind for kind in arguments if kind is not type(None))
        yield from _fields_in(inner, marks, here._replace(none=0.0))
    elif origin is tuple:
        yield from _elements(arguments, marks, here)
    elif origin is Literal and all(isinstance(word, str) for word in arguments):
        yield here._replace(kind=str, choices=arguments)
    elif isinstance(annotation, type) and issubclass(annotation, Checked):
        yield from fields_of(annotation, here.location)
    elif annotation in (float, int, bool):
        yield _number(annotation, marks, here)


def _number(kind: type, marks: Sequence[Any], here: ParameterField) -> ParameterField:
    within = next((mark for mark in marks if isinstance(mark, Within)), None)
    unit = next((mark.word for mark in marks if isinstance(mark, Unit)), "")
    description = next((mark.description for mark in marks if getattr(mark, "description", None)), "")
    text = ", ".join(filter(None, (unit, description)))
    if within is None:
        return here._replace(kind=kind, said=text)
    low = 0.0 if within.or_zero or here.none is not None else within.low
    return here._replace(kind=kind, low=kind(low), high=kind(within.high), said=text)


def _elements(arguments: Sequence[Any], marks: Sequence[Any], here: ParameterField) -> Iterator[ParameterField]:
    names = next((mark.names for mark in marks if isinstance(mark, Parts)), tuple(map(str, range(len(arguments)))))
    if arguments[-1] is Ellipsis:
        arguments = [arguments[0]] * len(names)
    for index, (name, argument) in enumerate(zip(names, arguments)):
        part = here._replace(location=(*here.location, index), part=name, none=None)
        for parameter in _fields_in(argument, (), part):
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
