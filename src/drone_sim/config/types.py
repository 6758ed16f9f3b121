"""What a value in a YAML file may be, and the one-line message for a wrong one."""

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
MOST = 8  # problems that are told
LONG = 900  # characters after which no other is
_EXPONENT = re.compile(r"[-+]?[0-9]+[eE][-+]?[0-9]+$")


Key = int | str
Location = tuple[Key, ...]  # the keys and indices on the way to a value


class ParameterProblem(NamedTuple):
    """A wrong value: the keys above it, what is wrong, and the value as messages show it, if it is one."""

    location: Location
    reason: str
    value: str = ""
    or_above: bool = False  # whether the key may be left out, and what is around it is as wrong

    @property
    def text(self) -> str:
        """What a message says of it."""
        words = [" = ".join(filter(None, (readable_key(self.location), self.value))), self.reason]
        return ": ".join(filter(None, words))

    @property
    def sentence(self) -> str:
        """The text, with what it speaks of."""
        return f"parameter {self.text}" if self.location else self.text


class ParameterError(ValueError):
    """Parameters are wrong: where, and why. As a text it is one line that names key, value and what is allowed."""

    def __init__(self, reason: str, location: Location = (), value: str = ""):
        """Take what is wrong; for a wrong value also the keys above it, and the value as messages show it."""
        self._take([ParameterProblem(location, reason, value)], "")

    @classmethod
    def of(cls, problems: Sequence[ParameterProblem], line: str = "") -> ParameterError:
        """Return the error of several problems, for which one line may be ready that says where they stand."""
        error = cls("")
        error._take(problems, line)
        return error

    def _take(self, problems: Sequence[ParameterProblem], line: str) -> None:
        self.problems = tuple(problems)
        self.text = line or one_line([(None, one.text) for one in problems])  # where it is plain that it is a parameter
        self.args = (line or one_line([(None, one.sentence) for one in problems]),)

    @property
    def location(self) -> Location:
        """The keys above the first wrong value; none where it is not one."""
        return self.problems[0].location if self.problems else ()

    def below(self, *keys: Key) -> ParameterError:
        """Return the same error, with these keys in front of the location of every problem."""
        return self.of([one._replace(location=(*keys, *one.location)) for one in self.problems])


def one_line(placed: Sequence[tuple[int | None, str]], file: str = "") -> str:
    """Return what is wrong in one line: what has a line of a file with it, then the rest."""
    inside = sorted(((line, text) for line, text in placed if line is not None), key=lambda one: one[0])
    words = [f"line {line}: {text}" for line, text in inside]
    words += [text for line, text in placed if line is None]
    lengths = itertools.accumulate(map(len, words), initial=0)  # of all that comes before
    first = [word for word, before in zip(words, lengths) if before < LONG][:MOST]
    more = f"; and {len(words) - len(first)} more" if len(first) < len(words) else ""
    return (f"{file}: " if file else "") + "; ".join(first) + more


def readable_key(location: Location) -> str:
    """Return the path to a value as a message shows it: cut, and on one line."""
    return "/".join(part if part.isprintable() and len(part) < 80 else shown(part) for part in map(str, location))


# ---- numbers


def numeric(value: Any) -> Any:
    """Accept only a number, or a text such as `1e3`: YAML 1.1, which rosparam reads, takes that for a text."""
    if isinstance(value, str) and len(value) < MAX_NAME and _EXPONENT.match(value):
        return float(value)
    if isinstance(value, (bool, str)):
        raise ValueError("input should be a valid number")
    if isinstance(value, int) and abs(value) > 1e300:
        return 1e300 if value > 0 else -1e300  # beyond every range, and still a float
    return value


@dataclass(frozen=True)
class Within(GroupedMetadata):
    """Beside `float` or `int` in Annotated: a finite number from `low` to `high`, or also 0."""

    low: float
    high: float
    or_zero: bool = False

    def __iter__(self) -> Iterator[Any]:
        """Give what pydantic is to check."""
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
    """Beside a tuple in Annotated: what its numbers are called where each stands alone."""

    names: tuple[str, ...]


@dataclass(frozen=True)
class Unit:
    """Beside a number in Annotated: its unit, for windows that show it."""

    word: str


def _increasing(pair: tuple[float, float] | None) -> tuple[float, float] | None:
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
Angle = Annotated[Finite, Within(-1e3, 1e3)]  # rad
Length = Annotated[Finite, Within(1e-4, 1e4)]  # m, of a thing
Mass = Annotated[Finite, Within(1e-6, 1e6, or_zero=True)]  # kg
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
    AfterValidator(_increasing),
    Parts(("lowest", "highest")),
    Field(description="2 numbers, [lowest, highest] in m/s, or none"),
]
Switch = Annotated[bool, Field(strict=True)]

# ---- words

NAME = r"^[A-Za-z][A-Za-z0-9_]*$"
TOPIC = r"^[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*$"
ADDRESS = r"^(\*|[A-Za-z0-9.:\[\]-]+)$"
PATTERNS = {
    NAME: "must begin with a letter and contain only letters, digits and _",
    TOPIC: "must be like rear/image: letters, digits and _, beginning with a letter, separated by /",
    ADDRESS: "must be an address such as 127.0.0.1, or * for all addresses of this machine",
}
Name = Annotated[str, Field(pattern=NAME, max_length=MAX_NAME)]


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be printable")
    return text


Label = Annotated[str, Field(max_length=MAX_NAME), AfterValidator(_printable)]


class FoundFile(str):
    """The absolute path of a file that is there; `given` is its name as the user wrote it, seen from `folder`."""

    given: str
    folder: str

    def seen_from(self, folder: Path | None) -> str:
        """Return the name of this file for a file in `folder` (None: any folder): as given, where that leads to it."""
        absolute = self.given.startswith(("package://", "~", "/"))
        is_beside = folder is not None and Path(self.folder or ".").resolve() == folder.resolve()
        return self.given if absolute or is_beside else str(self)


def _as_found(value: Any, check: Callable[[Any], str]) -> str:
    checked = check(value)
    return value if isinstance(value, FoundFile) else checked  # which knows how it was given


FileName = Annotated[
    str, Field(max_length=MAX_FILE_NAME), AfterValidator(_printable), WrapValidator(_as_found), PlainSerializer(str)
]


def named_in(folder: Path, name: str) -> FoundFile:
    """Return a file as a file in `folder` names it, without looking whether it is there."""
    absolute = name.startswith(("package://", "~", "/"))
    found = FoundFile(name if absolute else folder / name)
    found.given, found.folder = name, str(folder)
    return found


def _existing_file(allow_none: bool) -> Callable[[Any], str]:
    def check(value: Any) -> str:
        if not isinstance(value, str):
            raise ValueError("input should be a valid string")
        if len(value) > MAX_FILE_NAME:
            raise ValueError(f"must have at most {MAX_FILE_NAME} characters")
        if allow_none and not value:
            return ""
        try:
            found = FoundFile(resolve(value))
        except FileNotFoundError as error:
            raise ValueError(str(error)) from None
        found.given, found.folder = getattr(value, "given", str(value)), getattr(value, "folder", "")
        return found

    return check


File = Annotated[str, PlainValidator(_existing_file(False)), PlainSerializer(str)]
OptionalFile = Annotated[str, PlainValidator(_existing_file(True)), PlainSerializer(str)]


# ---- what a script is given


def _script_value(value: Any) -> Any:
    """Accept a number, true or false, a text, or a list of numbers."""
    if isinstance(value, (bool, str)):
        return value
    several = value if isinstance(value, (list, tuple)) else [value]
    if not all(isinstance(one, (int, float)) and not isinstance(one, bool) and math.isfinite(one) for one in several):
        raise ValueError("must be a finite number, true, false, a text, or a list of numbers")
    return tuple(map(float, value)) if isinstance(value, (list, tuple)) else float(value)


ScriptValue = Annotated[Any, PlainValidator(_script_value)]


# ---- mappings


def merged(base: Any, overrides: Any) -> Any:
    """Return nested mappings with other values laid over them."""
    if not (isinstance(base, Mapping) and isinstance(overrides, Mapping)):
        return overrides
    laid = dict(base)
    for key, value in overrides.items():
        laid[key] = merged(base[key], value) if key in base else value
    return laid


def nested(values: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Return a nested mapping of keys with dots between their parts; of several for one key the last one counts."""
    made: dict[str, Any] = {}
    for key, value in values:
        *parents, last = key.split(".")
        place = made
        for parent in parents:
            if not isinstance(place.get(parent), dict):
                place[parent] = {}
            place = place[parent]
        place[last] = value
    return made


def flattened(values: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield what `nested` makes a nested mapping of."""
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from flattened(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


class Checked(BaseModel):
    """Every key is known, every value checked, and nothing changes after that."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)  # of most kinds none is ever made


@dataclass(frozen=True)
class Word:
    """Which of several models a value is one of: the word that stands under a key, or under another one."""

    key: str
    or_key: str
    __name__: ClassVar[str] = "word"  # by which pydantic speaks of it

    def __call__(self, value: Any) -> str | None:
        """Return the word; None where there is none."""
        if not isinstance(value, Mapping):
            return next((str(getattr(value, key)) for key in (self.key, self.or_key) if hasattr(value, key)), None)
        word = value.get(self.used_in(value))
        return word if isinstance(word, str) else None

    def used_in(self, value: Any) -> str:
        """Return the key under which a value has its word, or should have."""
        return self.or_key if isinstance(value, Mapping) and self.or_key in value else self.key


def one_of(*models: type[Checked], key: str = "kind", or_key: str = "") -> Any:
    """Return the type of a value that is one of these, which the word under `key`, or `or_key`, tells apart."""
    if len(models) == 1:
        return models[0]
    if not or_key:
        return Annotated[Union[models], Field(discriminator=key)]  # noqa: UP007 -- of a tuple
    tagged = tuple(Annotated[one, Tag(word_of(one, key, or_key))] for one in models)
    return Annotated[Union[tagged], Discriminator(Word(key, or_key))]  # noqa: UP007


def word_of(model: type[Checked], *keys: str) -> str:
    """Return the word under the first of some keys that a model has, by which it is chosen."""
    (key, *_) = (key for key in keys if key in model.model_fields)
    return str(get_args(model.model_fields[key].annotation)[0])


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Return the mapping in a YAML file; raises ParameterError, in one line, where there is none."""
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
    """The world's origin in WGS 84; the world's x is east there, y north, z up (REP-103)."""

    latitude: Annotated[Finite, Within(-90, 90)]  # degrees, as in sensor_msgs/NavSatFix
    longitude: Annotated[Finite, Within(-180, 180)]  # degrees
    altitude: Annotated[Finite, Within(-500, 9000)]  # m above the ellipsoid
