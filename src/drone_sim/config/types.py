"""Types of values in YAML files, and the error with its one-line message for invalid values."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Union, get_args

from annotated_types import Ge, GroupedMetadata, Le
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    PlainValidator,
    Tag,
    WrapValidator,
)

from drone_sim.files import yaml_files
from drone_sim.files.resources import resolve
from drone_sim.message_text import MAX_NAME, shown

MAX_FILE_NAME = 4096  # characters
MOST = 8  # problems in a message
LONG = 900  # characters in a message after which no further problem is added
_EXPONENT = re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+$")


Key = int | str
Location = tuple[Key, ...]  # path of keys and indices to a value


class ParameterProblem(NamedTuple):
    """Invalid value: its location, the reason, and the value as messages show it ('' if there is none)."""

    location: Location
    reason: str
    value: str = ""
    or_above: bool = False  # whether the enclosing mapping may be at fault instead of the key

    @property
    def text(self) -> str:
        """Location, value and reason."""
        words = [" = ".join(filter(None, (readable_key(self.location), self.value))), self.reason]
        return ": ".join(filter(None, words))

    @property
    def sentence(self) -> str:
        """The text, beginning with `parameter` if it has a location."""
        return f"parameter {self.text}" if self.location else self.text


class ParameterError(ValueError):
    """Error of invalid parameters. Its text is one line with key, value and what is allowed, for each problem."""

    def __init__(self, reason: str, location: Location = (), value: str = ""):
        """Create the error of one problem: a reason, the location of the value, and the value as messages show it."""
        self._set_problems([ParameterProblem(location, reason, value)], "")

    @classmethod
    def of(cls, problems: Sequence[ParameterProblem], line: str = "") -> ParameterError:
        """Return the error of several problems; `line` replaces the default message, such as one with line numbers."""
        error = cls("")
        error._set_problems(problems, line)
        return error

    def _set_problems(self, problems: Sequence[ParameterProblem], line: str) -> None:
        self.problems = tuple(problems)
        self.text = line or one_line([(None, problem.text) for problem in problems])  # without the word `parameter`
        self.args = (line or one_line([(None, problem.sentence) for problem in problems]),)

    @property
    def location(self) -> Location:
        """Location of the first invalid value; () if there is none."""
        return self.problems[0].location if self.problems else ()

    def below(self, *keys: Key) -> ParameterError:
        """Return the same error with these keys prepended to the location of every problem."""
        return self.of([problem._replace(location=(*keys, *problem.location)) for problem in self.problems])


def one_line(placed: Sequence[tuple[int | None, str]], file: str = "") -> str:
    """Return one line with the problems: those with a line number, sorted by it, then the others."""
    inside = sorted(((line, text) for line, text in placed if line is not None), key=lambda pair: pair[0])
    words = [f"line {line}: {text}" for line, text in inside]
    words += [text for line, text in placed if line is None]
    lengths = itertools.accumulate(map(len, words), initial=0)  # characters before each problem
    first = [word for word, before in zip(words, lengths) if before < LONG][:MOST]
    more = f"; and {len(words) - len(first)} more" if len(first) < len(words) else ""
    return (f"{file}: " if file else "") + "; ".join(first) + more


def readable_key(location: Location) -> str:
    """Return the path to a value for a message, on one line; long parts are shortened."""
    return "/".join(part if part.isprintable() and len(part) < 80 else shown(part) for part in map(str, location))


# ---- numbers


def numeric(value: Any) -> Any:
    """Accept only a number, or a string such as `1e3`, which YAML 1.1 (rosparam) does not read as a number."""
    if isinstance(value, str) and len(value) < MAX_NAME and _EXPONENT.match(value):
        return float(value)
    if isinstance(value, (bool, str)):
        raise ValueError("input should be a valid number")
    if isinstance(value, int) and abs(value) > 1e300:
        return 1e300 if value > 0 else -1e300  # beyond every range, and still a float
    return value


@dataclass(frozen=True)
class Within(GroupedMetadata):
    """Constraint on a `float` or `int` in Annotated: finite, from `low` to `high`, or also 0 if `or_zero`."""

    low: float
    high: float
    or_zero: bool = False

    def __iter__(self) -> Iterator[Any]:
        """Yield the validators for pydantic."""
        if self.or_zero:
            yield Ge(0)
            yield AfterValidator(self._check)
        else:
            yield Ge(self.low)
            yield Le(self.high)
        yield BeforeValidator(numeric)

    def _check(self, value: float) -> float:
        if value != 0 and not self.low <= value <= self.high:
            raise ValueError(f"must be 0, or from {self.low:g} to {self.high:g}")
        return value


@dataclass(frozen=True)
class Parts:
    """Names of a tuple's elements, in Annotated, for uses that treat each element as a parameter."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Unit:
    """Unit of a number, in Annotated, for user interfaces."""

    word: str


def increasing(pair: tuple[float, float] | None) -> tuple[float, float] | None:
    if pair is not None and not pair[0] < pair[1]:
        raise ValueError("must be [lowest, highest] with lowest < highest")
    return pair


def _none_from_word(value: Any) -> Any:
    # ROS's parameter server cannot hold YAML's null.
    return None if isinstance(value, (str, list)) and value in ("none", "null", "", []) else value


def _opaque(color: Any) -> Any:
    return (*color, 1.0) if isinstance(color, (list, tuple)) and len(color) == 3 else color


Finite = Annotated[float, AllowInfNan(False)]
Coordinate = Annotated[Finite, Within(-1e5, 1e5)]  # m
Angle = Annotated[Finite, Within(-1e3, 1e3), Unit("rad")]
Length = Annotated[Finite, Within(1e-4, 1e4), Unit("m")]  # size of an object
Mass = Annotated[Finite, Within(1e-6, 1e6, or_zero=True), Unit("kg")]
Gain = Annotated[Finite, Within(0, 1e4)]
Velocity = Annotated[Finite, Within(-1e4, 1e4)]  # m/s
Point = Annotated[tuple[Coordinate, Coordinate, Coordinate], Field(description="3 numbers, [x, y, z] in m")]
Angles = Annotated[tuple[Angle, Angle, Angle], Field(description="3 numbers, [roll, pitch, yaw] in rad")]
Fraction = Annotated[Finite, Within(0, 1)]
Color = Annotated[
    tuple[Fraction, Fraction, Fraction, Fraction],
    BeforeValidator(_opaque),
    Field(description="3 or 4 numbers from 0 to 1, [red, green, blue] or [red, green, blue, opacity]"),
]
MarginOrNone = Annotated[Annotated[Finite, Within(0.001, 1)] | None, BeforeValidator(_none_from_word)]  # rad
Limits = Annotated[
    tuple[Velocity, Velocity] | None,
    BeforeValidator(_none_from_word),
    AfterValidator(increasing),
    Parts(("lowest", "highest")),
    Field(description="2 numbers, [lowest, highest] in m/s, or none"),
]
Switch = Annotated[bool, Field(strict=True)]

# ---- strings

NAME = r"^[A-Za-z][A-Za-z0-9_]*$"
TOPIC = r"^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*$"
FOREIGN_TOPIC = r"^/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*$"
MESSAGE_TYPE = r"^[a-z][a-z0-9_]*/[A-Za-z][A-Za-z0-9_]*$"
ADDRESS = r"^(\*|[A-Za-z0-9.:\[\]-]+)$"
PATTERNS = {
    NAME: "must begin with a letter and contain only letters, digits and _",
    TOPIC: "must be like rear/image: letters, digits and _, beginning with a letter, separated by /",
    FOREIGN_TOPIC: "must be like /cmd_vel or rear/image: letters, digits and _, separated by /",
    MESSAGE_TYPE: "must be like geometry_msgs/Pose: a package and the name of a message in it",
    ADDRESS: "must be an address such as 127.0.0.1, or * for all addresses of this machine",
}
Name = Annotated[str, Field(pattern=NAME, max_length=MAX_NAME)]


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be printable")
    return text


Label = Annotated[str, Field(max_length=MAX_NAME), AfterValidator(_printable)]


class FoundFile(str):
    """Absolute path of an existing file; `given` is its name as the user wrote it, relative to `folder`."""

    given: str
    folder: str

    def seen_from(self, folder: Path | None) -> str:
        """Return a name for use in a file in `folder` (None: any folder): `given` if that resolves to this file."""
        absolute = self.given.startswith(("package://", "~", "/"))
        is_beside = folder is not None and Path(self.folder or ".").resolve() == folder.resolve()
        return self.given if absolute or is_beside else str(self)


def _keep_found(value: Any, check: Callable[[Any], str]) -> str:
    checked = check(value)
    return value if isinstance(value, FoundFile) else checked  # it also holds the name as given


FileName = Annotated[
    str, Field(max_length=MAX_FILE_NAME), AfterValidator(_printable), WrapValidator(_keep_found), PlainSerializer(str)
]


def named_in(folder: Path, name: str) -> FoundFile:
    """Return the file that a file in `folder` calls `name`, without checking that it exists."""
    absolute = name.startswith(("package://", "~", "/"))
    file = FoundFile(name if absolute else folder / name)
    file.given, file.folder = name, str(folder)
    return file


def _existing_file(allow_none: bool) -> Callable[[Any], str]:
    def check(value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError("input should be a valid string")
        if len(value) > MAX_FILE_NAME:
            raise ValueError(f"must have at most {MAX_FILE_NAME} characters")
        if allow_none and not value:
            return ""
        try:
            file = FoundFile(resolve(value))
        except FileNotFoundError as error:
            raise ValueError(str(error)) from None
        file.given, file.folder = getattr(value, "given", str(value)), getattr(value, "folder", "")
        return file

    return check


File = Annotated[str, PlainValidator(_existing_file(False)), PlainSerializer(str)]
OptionalFile = Annotated[str, PlainValidator(_existing_file(True)), PlainSerializer(str)]


# ---- script parameters


def _script_value(value: Any) -> Any:
    """Accept a number, a bool, a string, or a list of numbers."""
    if isinstance(value, (bool, str)):
        return value
    items = value if isinstance(value, (list, tuple)) else [value]
    if not all(isinstance(each, (int, float)) and not isinstance(each, bool) and math.isfinite(each) for each in items):
        raise ValueError("must be a finite number, true, false, a string, or a list of numbers")
    return tuple(map(float, value)) if isinstance(value, (list, tuple)) else float(value)


ScriptValue = Annotated[Any, PlainValidator(_script_value)]


# ---- mappings


def merged(base: Any, overrides: Any) -> Any:
    """Return nested mappings in which `overrides` replace the values of `base`."""
    if not (isinstance(base, Mapping) and isinstance(overrides, Mapping)):
        return overrides
    result = dict(base)
    for key, value in overrides.items():
        result[key] = merged(base[key], value) if key in base else value
    return result


def nested(values: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return a nested mapping from values with dotted keys. The last value of a repeated key is used."""
    result: dict[str, Any] = {}
    for key, value in values:
        *parents, last = key.split(".")
        mapping = result
        for parent in parents:
            if not isinstance(mapping.get(parent), dict):
                mapping[parent] = {}
            mapping = mapping[parent]
        mapping[last] = value
    return result


def flattened(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of a nested mapping with dotted keys: the inverse of `nested`."""
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from flattened(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


class Checked(BaseModel):
    """Base of parameter models: unknown keys are refused, values validated, instances frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)  # most models are never instantiated


@dataclass(frozen=True)
class Word:
    """Discriminator of a union of models: the word under `key`, or under the alternative `or_key`."""

    key: str
    or_key: str
    __name__: ClassVar[str] = "word"  # name in pydantic's messages

    def __call__(self, value: Any) -> str | None:
        """Return the word in a mapping or model; None if there is none."""
        if not isinstance(value, Mapping):
            return next((str(getattr(value, key)) for key in (self.key, self.or_key) if hasattr(value, key)), None)
        word = value.get(self.or_key if self.or_key in value else self.key)
        return word if isinstance(word, str) else None


def one_of(*models: type[Checked], key: str = "kind", or_key: str = "") -> Any:
    """Return the union of models, which the word under `key`, or `or_key`, tells apart."""
    if len(models) == 1:
        return models[0]
    if not or_key:
        return Annotated[Union[models], Field(discriminator=key)]  # noqa: UP007 -- it is built from a tuple
    tagged = tuple(Annotated[model, Tag(word_of(model, key, or_key))] for model in models)
    return Annotated[Union[tagged], Discriminator(Word(key, or_key))]  # noqa: UP007


def word_of(model: type[Checked], *keys: str) -> str:
    """Return the word that selects a model: that of the first of `keys` that the model has."""
    (key, *_) = (key for key in keys if key in model.model_fields)
    return str(get_args(model.model_fields[key].annotation)[0])


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Return the mapping in a YAML file. Raises ParameterError, in one line, if it contains none."""
    try:
        values = yaml_files.read(path)
    except yaml_files.YamlError as error:
        raise ParameterError(str(error)) from None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: must hold `key: value` lines, not {type(values).__name__}")
    return values


_Tesla = Annotated[Finite, Within(-1, 1)]
MagneticField = Annotated[
    tuple[_Tesla, _Tesla, _Tesla], Field(description="3 numbers, [east, north, up] in T, as the world's x, y, z")
]


class DatumParameters(Checked):
    """Origin of the world in WGS 84; the world's x axis points east there, y north, z up (REP-103)."""

    latitude: Annotated[Finite, Within(-90, 90)]  # degrees, as in sensor_msgs/NavSatFix
    longitude: Annotated[Finite, Within(-180, 180)]  # degrees
    altitude: Annotated[Finite, Within(-500, 9000)]  # m above the ellipsoid
