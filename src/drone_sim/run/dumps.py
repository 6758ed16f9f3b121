"""What `dynparam dump` writes, as a file of parameters: the names of tuning become the keys of config/drone.yaml."""

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

_BEGIN = b"!!python/object/new:dynamic_reconfigure.encoding.Config"
_VALUES = "dictitems"
_DEEPEST = 8  # keys within each other


def read_config(path: Path, below: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys in a file of parameters, which may be a dump; `below` has those that it is laid over.

    Raises ParameterError.
    """
    try:
        content = read_bytes(path, yaml_files.MAX_SIZE)
    except (OSError, ValueError):
        content = b""
    first, _, rest = content.partition(b"\n")
    if first.rstrip() != _BEGIN:
        return read_yaml(path)  # which also says what is wrong
    try:
        values = yaml_files.parse("#\n" + rest.decode("utf-8"))  # lines are counted from the first
    except ValueError as error:
        raise ParameterError(f"{path}: not a file of dynparam dump: {error}") from None
    values = values.get(_VALUES) if isinstance(values, dict) else None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: a file of dynparam dump has `{_VALUES}:` with a value for each name")
    keys = _keys(values, path)
    strange = [str(one) for one in keys.get("sensors", ()) if one not in below.get("sensors", ())]
    if strange:
        said = f"it was dumped from a drone with other sensors: {', '.join(map(shown, strange[:8]))}"
        raise ParameterError(f"{path}: {said}; give the file that defines them before it, config:=FILE,{path.name}")
    return keys


def _keys(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    of_type = {name: sum(one in common(name) for one in values) for name in TYPES}  # its propellers tell the type
    shared = common(max(of_type, key=lambda name: of_type[name]))
    known = {**shared, **{name: ParameterField(_location(name), float) for name in values if name not in shared}}
    try:
        return nested(known, {}, values)
    except KeyError as missing:
        name = missing.args[0]
        raise ParameterError(
            f"{path}: parameter {name}: missing, but the other numbers of its list are given"
        ) from None
    except (TypeError, AttributeError):
        raise ParameterError(f"{path}: a name with a value of its own is also the beginning of other names") from None


def _location(name: str) -> tuple[str, ...]:
    """Return the keys of what not every vehicle has; a script's parameter may have slashes in its name."""
    first, slash, rest = name.partition("/")
    return (first, rest) if slash and first == SCRIPT else tuple(name.split("/", _DEEPEST))
