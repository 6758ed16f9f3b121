"""Parameter files besides config/drone.yaml: the drivers' profiles, and dumps of dynamic_reconfigure.

In a `dynparam dump`, names of dynamic_reconfigure parameters stand for the keys of config/drone.yaml.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from drone_sim.config.fields import ParameterField
from drone_sim.config.types import ParameterError, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, read_bytes
from drone_sim.hosting.tunable import SCRIPT, common, nested
from drone_sim.message_text import near_names, shown
from drone_sim.vehicles.parameters import UNPREFIXED
from drone_sim.vehicles.types import TYPES

_FIRST_LINE_OF_DUMP = b"!!python/object/new:dynamic_reconfigure.encoding.Config"
_DUMPED_VALUES = "dictitems"
_MAX_DEPTH = 8  # nested keys


def profiles() -> dict[str, Path]:
    """Return the files of config/profiles by name."""
    return {file.stem: file for file in sorted((package_path() / "config" / "profiles").glob("*.yaml"))}


def profile_files(name: str) -> list[str]:
    """Return the file of a profile, [] for ''; a name with a slash or an ending is a file. Raises ParameterError."""
    if not name or "/" in name or Path(name).suffix:
        return [name]
    known = profiles()
    if name not in known:
        why = f"no such profile; {near_names(name, known)}; a file of your own has an ending, such as {name}.yaml"
        raise ParameterError(why, ("profile",), shown(name))
    return [str(known[name])]


@lru_cache(maxsize=1)
def command_topics() -> Mapping[str, list[str]]:
    """Return the topics on which nodes command a driver, such as /bebop/cmd_vel, with the names of the profiles."""
    found: dict[str, list[str]] = {}
    for name, file in profiles().items():
        values = read_yaml(file)
        vehicle = values.get("drone", {}).get("name", UNPREFIXED)
        entries = [entry for entry in values["topics"].values() if entry.get("takes") and not entry.get("service")]
        topics = {entry["topic"] for entry in entries} | {"cmd_vel", "takeoff", "land"}
        if vehicle == UNPREFIXED:  # whose names are ours
            topics = {topic for topic in topics if topic.startswith("/")}
        for topic in topics:
            found.setdefault(topic if topic.startswith("/") else f"/{vehicle}/{topic}", []).append(name)
    return found


def profile_cure(topic: str) -> str:
    """Return what makes a command on an unheard topic arrive, if it is a driver's; '' for other topics."""
    names = command_topics().get(topic, ())
    return " or ".join(f"start with profile:={name}" if not index else name for index, name in enumerate(names))


# ---- dumps


def read_config(path: Path, below: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a parameter file, which may be a dump. `below`: the parameters that it overrides.

    Raises ParameterError, also for a dump with sensors that `below` does not have.
    """
    try:
        content = read_bytes(path, yaml_files.MAX_SIZE)
    except (OSError, ValueError):
        content = b""
    first_line, _, rest = content.partition(b"\n")
    if first_line.rstrip() != _FIRST_LINE_OF_DUMP:
        return read_yaml(path)  # also reports what is wrong with the file
    try:
        values = yaml_files.parse("#\n" + rest.decode("utf-8"))  # the `#` keeps the line numbers in messages
    except ValueError as error:
        raise ParameterError(f"{path}: not a valid dynparam dump file: {error}") from None
    values = values.get(_DUMPED_VALUES) if isinstance(values, dict) else None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: a dynparam dump file must have `{_DUMPED_VALUES}:` with a value for each name")
    keys = _nested_keys(values, path)
    unknown = [str(name) for name in keys.get("sensors", ()) if name not in below.get("sensors", ())]
    if unknown:
        reason = f"the dump is of a drone with other sensors: {', '.join(map(shown, unknown[:8]))}"
        raise ParameterError(f"{path}: {reason}; put the file that defines them before it: config:=FILE,{path.name}")
    return keys


def _nested_keys(values: Mapping[str, Any], path: Path) -> dict[str, Any]:
    matches = {name: sum(key in common(name) for key in values) for name in TYPES}  # propeller names differ by type
    shared = common(max(matches, key=lambda name: matches[name]))
    known = dict(shared)
    for name in values:
        if (
            name not in shared
        ):  # a parameter that only some vehicles have; a script parameter's name may contain slashes
            first, slash, rest = name.partition("/")
            location = (first, rest) if slash and first == SCRIPT else tuple(name.split("/", _MAX_DEPTH))
            known[name] = ParameterField(location, float)
    try:
        return nested(known, {}, values)
    except KeyError as error:
        name = error.args[0]
        raise ParameterError(
            f"{path}: parameter {name}: missing, but other elements of the same list are given"
        ) from None
    except (TypeError, AttributeError):
        raise ParameterError(f"{path}: a parameter name that has a value is also the prefix of other names") from None
