"""What `sweep --param` says: a key of config/drone.yaml and the values that it takes in turn."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drone_sim.config.types import read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path
from drone_sim.wording import near_names, shown

MAX_VALUES = 10_000  # of one parameter
_FREE = "script_parameters."  # whatever a script's own are called
_FORM = "must be KEY=START:STOP:COUNT or KEY=A,B,..., such as Kzref=1:10:10"


class RangeError(ValueError):
    """A range is wrong; one line that names it and what is allowed."""


@dataclass(frozen=True)
class Range:
    """A key, dots between its parts, and values."""

    key: str
    values: tuple[Any, ...]

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition(".")[2]

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value. Raises RangeError where they are no numbers, or the same."""
        if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.values):
            raise RangeError(f"--param {self.name}: --optimize looks among numbers only")
        low, high = float(min(self.values)), float(max(self.values))
        if low == high:
            raise RangeError(f"--param {self.name}: --optimize needs two values to look between, such as 1:10:2")
        return low, high


def read(texts: Sequence[str]) -> list[Range]:
    """Return the ranges of several `KEY=VALUES`. Raises RangeError."""
    known = list(_leaves(read_yaml(package_path() / "config" / "drone.yaml")))
    found = [_range(text, known) for text in texts]
    for key in {one.key for one in found}:
        if sum(one.key == key for one in found) > 1:
            raise RangeError(f"--param {key}: is given twice")
    return found


def combinations(ranges: Sequence[Range]) -> Iterator[tuple[Any, ...]]:
    """Give every combination of values, the last parameter's changing fastest."""
    return itertools.product(*(one.values for one in ranges))


def changes(ranges: Sequence[Range], values: Sequence[Any]) -> dict[str, Any]:
    """Return the nested mapping that gives each key its value."""
    made: dict[str, Any] = {}
    for one, value in zip(ranges, values):
        *above, last = one.key.split(".")
        place = made
        for part in above:
            place = place.setdefault(part, {})
        place[last] = value
    return made


def _range(text: str, known: Sequence[str]) -> Range:
    key, equals, values = text.partition("=")
    if not equals or not key or not values:
        raise RangeError(f"--param {shown(text)}: {_FORM}")
    return Range(_full_key(key, known), tuple(_values(text, values)))


def _full_key(key: str, known: Sequence[str]) -> str:
    if key in known or (key.startswith(_FREE) and key.removeprefix(_FREE).isidentifier()):
        return key
    ending = [one for one in known if one.endswith(f".{key}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        raise RangeError(f"--param {shown(key)}: may be {' or '.join(ending[:5])}: name one of them")
    plain = {one.rpartition(".")[2] for one in known}
    said = near_names(key, known if "." in key else plain)
    raise RangeError(f"--param {shown(key)}: no such key in config/drone.yaml; {said}")


def _values(text: str, values: str) -> Sequence[Any]:
    if ":" in values:
        return _evenly(text, values.split(":"))
    try:
        found = [yaml_files.parse(one) for one in values.split(",")]
    except yaml_files.YamlError as error:
        raise RangeError(f"--param {shown(text)}: {error}") from None
    if any(isinstance(one, (dict, list)) or one is None for one in found) or len(found) > MAX_VALUES:
        raise RangeError(f"--param {shown(text)}: {_FORM}")
    return found


def _evenly(text: str, parts: Sequence[str]) -> list[float]:
    """Return COUNT values from START to STOP, both among them."""
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
        is_right = len(parts) == 3 and math.isfinite(start) and math.isfinite(stop) and 1 <= count <= MAX_VALUES
    except (ValueError, IndexError):
        is_right = False
    if not is_right:
        raise RangeError(f"--param {shown(text)}: {_FORM}; COUNT is from 1 to {MAX_VALUES}")
    return [float(f"{value:.12g}") for value in np.linspace(start, stop, count)]  # 0.3, not 0.30000000000000004


def _leaves(values: Mapping[str, Any], above: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from _leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}"
