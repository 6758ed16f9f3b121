"""The fields of parameters: what each value of a model may be, and what config/drone.yaml says of it."""

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
    """One value of a model, or one part of a list: where it stands, what it may be."""

    location: Location  # keys, and an index for a part of a list
    kind: type  # float, int, bool or str
    part: str = ""  # what that part is called
    low: float = 0.0
    high: float = 0.0
    choices: tuple[str, ...] = ()  # of a str
    none: float | None = None  # stands for a value, or for a list, that may also be none
    said: str = ""  # its unit, and what the model says of it

    @property
    def name(self) -> str:
        """What it is called: its keys with slashes, and a part's name."""
        keys = (*self.location[:-1], self.part) if self.part else self.location
        return "/".join(map(str, keys))


@lru_cache(maxsize=1024)
def fields_of(model: type[Checked], above: Location = ()) -> tuple[ParameterField, ...]:
    """Return the values of a model, whose own keys stand below `above`; mappings of any keys are left out."""
    fields = model.model_fields.items()
    return tuple(
        parameter
        for name, field in fields
        for parameter in _of(field.annotation, [*field.metadata, field], ParameterField((*above, name), float))
    )


def _of(annotation: Any, marks: Sequence[Any], here: ParameterField) -> Iterator[ParameterField]:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        yield from _of(arguments[0], [*marks, *arguments[1:]], here)
    elif origin in _UNIONS and type(None) in arguments:
        (inner,) = (one for one in arguments if one is not type(None))
        yield from _of(inner, marks, here._replace(none=0.0))
    elif origin is tuple:
        yield from _parts(arguments, marks, here)
    elif origin is Literal and all(isinstance(one, str) for one in arguments):
        yield here._replace(kind=str, choices=arguments)
    elif isinstance(annotation, type) and issubclass(annotation, Checked):
        yield from fields_of(annotation, here.location)
    elif annotation in (float, int, bool):
        yield _number(annotation, marks, here)


def _number(kind: type, marks: Sequence[Any], here: ParameterField) -> ParameterField:
    within = next((one for one in marks if isinstance(one, Within)), None)
    unit = next((one.word for one in marks if isinstance(one, Unit)), "")
    description = next((one.description for one in marks if getattr(one, "description", None)), "")
    said = ", ".join(filter(None, (unit, description)))
    if within is None:
        return here._replace(kind=kind, said=said)
    low = 0.0 if within.or_zero or here.none is not None else within.low
    return here._replace(kind=kind, low=kind(low), high=kind(within.high), said=said)


def _parts(arguments: Sequence[Any], marks: Sequence[Any], here: ParameterField) -> Iterator[ParameterField]:
    names = next((one.names for one in marks if isinstance(one, Parts)), tuple(map(str, range(len(arguments)))))
    if arguments[-1] is Ellipsis:
        arguments = [arguments[0]] * len(names)
    for index, (name, argument) in enumerate(zip(names, arguments)):
        part = here._replace(location=(*here.location, index), part=name, none=None)
        for parameter in _of(argument, (), part):
            widest = parameter.high if index else parameter.low  # [lowest, highest] that are none hold nothing back
            yield parameter._replace(none=None if here.none is None else widest)


CONFIG = package_path() / "config" / "drone.yaml"

_ENTRY = re.compile(r"^( *)(\w+):(?: +((?:\"[^\"]*\"|\[.*?\]|\{.*?\}|[^#\s])*))?(?: *# *(.*))?$")
_MORE = re.compile(r"^ +# *(.*)$")


class Row(NamedTuple):
    """A parameter: its name with slashes, its default as the file writes it, what the file says of it."""

    name: str
    default: str
    comment: str


def rows(text: str) -> Iterator[Row]:
    """Yield the parameters of a file such as config/drone.yaml."""
    found: list[list[str]] = []
    above: list[tuple[int, str]] = []
    for line in text.splitlines():
        entry, more = _ENTRY.match(line), _MORE.match(line)
        if entry:
            indent, key, value, comment = len(entry[1]), entry[2], entry[3] or "", entry[4] or ""
            above = [(depth, name) for depth, name in above if depth < indent]
            found.append(["/".join([*(name for _, name in above), key]), value, comment])
            above.append((indent, key))
        elif more and found:
            found[-1][2] += f" {more[1]}"
    groups = {name.rpartition("/")[0] for name, _, _ in found}
    return (Row(*one) for one in found if one[0] not in groups)


@lru_cache(maxsize=1)
def comments() -> Mapping[str, str]:
    """Return what config/drone.yaml says of each of its keys, by names with slashes."""
    return {row.name: row.comment for row in rows(CONFIG.read_text(encoding="utf-8"))}


@lru_cache(maxsize=1)
def _defaults() -> Mapping[str, Any]:
    text = CONFIG.read_text(encoding="utf-8")
    return {row.name: yaml.safe_load(row.default) if row.default else None for row in rows(text)}


def default_of(location: Location) -> Any:
    """Return what config/drone.yaml has at a location; None where it has nothing."""
    return _defaults().get("/".join(map(str, location)))
