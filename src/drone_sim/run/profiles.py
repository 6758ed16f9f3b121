"""The drivers' profiles in config/profiles, and the topics on which their nodes send commands."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from drone_sim.config.types import ParameterError, read_yaml
from drone_sim.files.resources import package_path
from drone_sim.message_text import near_names, shown
from drone_sim.vehicles.parameters import UNPREFIXED


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
