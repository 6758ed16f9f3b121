"""Objects as a text that is copied and pasted: YAML as in a scene file, whoever has written it."""

from __future__ import annotations

import copy
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.config.types import FoundFile, ParameterError
from drone_sim.files import yaml_files
from drone_sim.files.yaml_text import dumped
from drone_sim.message_text import near_names, shown
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.entry import EntryParameters

_KEYS = {"objects": list, "scripts": list, "vehicles": dict}
_LIKE = "must be objects as in a scene file, such as - {shape: box, size: [1, 1, 1], position: [0, 0, 0.5]}"
_DEEPEST = 40  # spaces before the lines of a part of a file
_Content = dict[str, Any]


def written(
    entries: Sequence[EntryParameters],
    scripts: Sequence[AttachedScriptParameters],
    vehicles: Mapping[str, Any],
    folder: Path,
) -> str:
    """Return the text; the files in it have names by which a scene in any folder finds them.

    Vehicles are as they are said in a scene file in `folder`.
    """
    plain: _Content = {
        "objects": [models.in_order(models.plain(one, None)) for one in entries],
        "scripts": [models.plain(one, None) for one in scripts],
        "vehicles": copy.deepcopy(dict(vehicles)),
    }
    scene_parameters.find_files_beside(folder, {"vehicles": plain["vehicles"]})
    content = _with_files(plain, lambda file: file.seen_from(None))
    return dumped({key: several for key, several in content.items() if several})


def read(text: str, folder: Path) -> _Content:
    """Return `objects`, `scripts` and `vehicles` of a text, those of its files that are in `folder` named from there.

    It has these keys, or is a list of objects, or one object. Raises ValueError, in one line, for what is none.
    """
    said = _parsed(text)
    if isinstance(said, dict) and not {"shape", "kind"}.isdisjoint(said):
        said = [said]
    content = {"objects": said} if isinstance(said, list) else said
    if not isinstance(content, dict) or not (content.keys() - {"scripts"}):
        raise ParameterError(f"the pasted text {shown(text)}: {_LIKE}")
    for key, several in content.items():
        if key not in _KEYS:
            raise ParameterError(f"the pasted text: unknown key {shown(key)}; {near_names(str(key), _KEYS)}")
        if not isinstance(several, _KEYS[key]) or not all(isinstance(one, dict) for one in _entries(several)):
            raise ParameterError(f"the pasted text: {key} = {shown(several)}: {_LIKE}")
    scene_parameters.find_files_beside(folder, {"scene": content, "vehicles": content.get("vehicles")})
    return {**{key: kind() for key, kind in _KEYS.items()}, **_with_files(content, lambda file: _nearer(file, folder))}


def _entries(several: Any) -> list[Any]:
    return [*several.values()] if isinstance(several, dict) else several


def _parsed(text: str) -> Any:
    """Return what a text says, also where it is a part of a file, its lines indented, the first one perhaps cut."""
    first, _, rest = text.lstrip().partition("\n")
    most = min((len(line) - len(line.lstrip()) for line in rest.splitlines() if line.strip()), default=0)
    most = min(most, _DEEPEST)
    cut = [f"{' ' * indent}{first}\n{rest}" for indent in range(most, 0, -1)]
    troubles = []
    for one in (text, textwrap.dedent(text), *cut):
        try:
            return yaml_files.parse(one)
        except yaml_files.YamlError as error:
            troubles.append(error)
    raise ParameterError(f"the pasted text {shown(text)} is not YAML ({troubles[0]}): it {_LIKE}")


def _with_files(value: Any, name: Callable[[FoundFile], str]) -> Any:
    """Return values whose files have other names."""
    if isinstance(value, Mapping):
        return {key: _with_files(one, name) for key, one in value.items()}
    if isinstance(value, list):
        return [_with_files(one, name) for one in value]
    return name(value) if isinstance(value, FoundFile) else value


def _nearer(file: FoundFile, folder: Path) -> str:
    path = Path(file)
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else file.given
