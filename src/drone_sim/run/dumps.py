"""Reader for `dynparam dump` files: names of dynamic_reconfigure parameters become keys of config/drone.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.fields import ParameterField
from drone_sim.config.types import ParameterError, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import read_bytes
from drone_sim.hosting.tunable import SCRIPT, common, nested
from drone_sim.message_text import shown
from drone_sim.vehicles.types import TYPES

_FIRST_LINE = b"!!python/object/new:dynamic_reconfigure.encoding.Config"
_VALUES = "dictitems"
_MAX_DEPTH = 8  # nested keys


def read_config(path: Path, below: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a parameter file, which may be a dump. `below`: the parameters that it overrides.

    Raises ParameterError, also for a dump with sensors that `below` does not have.
    """
    try:
        content = read_bytes(path, yaml_files.MAX_SIZE)
    except (OSError, ValueError):
        content = b""
    first_line, _, rest = content.partition(b"\n")
    if first_line.rstrip() != _FIRST_LINE:
        return read_yaml(path)  # also reports what is wrong with the file
    try:
        values = yaml_files.parse("#\n" + rest.decode("utf-8"))  # the `#` keeps the line numbers in messages
    except ValueError as error:
        raise ParameterError(f"{path}: not a valid dynparam dump file: {error}") from None
    values = values.get(_VALUES) if isinstance(values, dict) else None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: a dynparam dump file must have `{_VALUES}:` with a value for each name")
    keys = _nested_keys(values, path)
    unknown = [str(name) for name in keys.get("sensors", ()) if name not in below.get("sensors", ())]
    if unknown:
        reason = f"the dump is of a drone with other sensors: {', '.join(map(shown, unknown[:8]))}"
        raise ParameterError(f"{path}: {reason}; put the file that defines them before it: config:=FILE,{path.name}")
    return keys


def _nested_keys(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    matches = {name: sum(key in common(name) for key in values) for name in TYPES}  # propeller names differ by type
    shared = common(max(matches, key=lambda name: matches[name]))
    known = {**shared, **{name: ParameterField(_location(name), float) for name in values if name not in shared}}
    try:
        return nested(known, {}, values)
    except KeyError as error:
        name = error.args[0]
        raise ParameterError(
            f"{path}: parameter {name}: missing, but other elements of the same list are given"
        ) from None
    except (TypeError, AttributeError):
        raise ParameterError(f"{path}: a parameter name that has a value is also the prefix of other names") from None


def _location(name: str) -> tuple[str, ...]:
    """Return the keys of a parameter that only some vehicles have. A script parameter's name may contain slashes."""
    first, slash, rest = name.partition("/")
    return (first, rest) if slash and first == SCRIPT else tuple(name.split("/", _MAX_DEPTH))
