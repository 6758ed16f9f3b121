"""Text of copied objects: YAML as in a scene file, also pasted from other programs."""

from __future__ import annotations

import copy
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.config.types import FoundFile, ParameterError
from drone_sim.files import yaml_files
from drone_sim.files.yaml_writing import dump
from drone_sim.message_text import near_names, shown
from drone_sim.scene import models, scene_parameters
from drone_sim.scene.entry import EntryParameters
from drone_sim.scene.scene_parameters import AttachedScriptParameters

_KEYS = {"objects": list, "scripts": list, "vehicles": dict}
_EXPECTED = "must be objects as in a scene file, such as - {shape: box, size: [1, 1, 1], position: [0, 0, 0.5]}"
_MAX_INDENT = 40  # spaces
_Content = dict[str, Any]


def written(
    entries: Sequence[EntryParameters],
    scripts: Sequence[AttachedScriptParameters],
    vehicles: Mapping[str, Any],
    folder: Path,
) -> str:
    """Return the text of objects; its file names are valid for a scene in any folder.

    `vehicles` are entries as in a scene file in `folder`.
    """
    plain: _Content = {
        "objects": [models.in_order(models.plain(entry, None)) for entry in entries],
        "scripts": [models.plain(script, None) for script in scripts],
        "vehicles": copy.deepcopy(dict(vehicles)),
    }
    scene_parameters.find_files_beside(folder, {"vehicles": plain["vehicles"]})
    content = scene_parameters.renamed_files(plain, lambda file: file.seen_from(None))
    return dump({key: section for key, section in content.items() if section}, "scene")


def read(text: str, folder: Path) -> _Content:
    """Return `objects`, `scripts` and `vehicles` of a text; names of files in `folder` become relative to it.

    The text has these keys or is a list of objects or one object. Otherwise raises ParameterError, in one line.
    """
    value = _parsed(text)
    if isinstance(value, dict) and not {"shape", "kind"}.isdisjoint(value):
        value = [value]
    content = {"objects": value} if isinstance(value, list) else value
    if not isinstance(content, dict) or not (content.keys() - {"scripts"}):
        raise ParameterError(f"the pasted text {shown(text)}: {_EXPECTED}")
    for key, part in content.items():
        if key not in _KEYS:
            raise ParameterError(f"the pasted text: unknown key {shown(key)}; {near_names(str(key), _KEYS)}")
        entries = part.values() if isinstance(part, dict) else part
        if not isinstance(part, _KEYS[key]) or not all(isinstance(entry, dict) for entry in entries):
            raise ParameterError(f"the pasted text: {key} = {shown(part)}: {_EXPECTED}")
    scene_parameters.find_files_beside(folder, {"scene": content, "vehicles": content.get("vehicles")})
    renamed = scene_parameters.renamed_files(content, lambda file: _relative(file, folder))
    return {**{key: kind() for key, kind in _KEYS.items()}, **renamed}


def _parsed(text: str) -> Any:
    """Parse a text; it may be an indented part of a file whose first line has lost its indentation."""
    first, _, rest = text.lstrip().partition("\n")
    indentation = min((len(line) - len(line.lstrip()) for line in rest.splitlines() if line.strip()), default=0)
    indentation = min(indentation, _MAX_INDENT)
    candidates = [f"{' ' * indent}{first}\n{rest}" for indent in range(indentation, 0, -1)]
    errors = []
    for candidate in (text, textwrap.dedent(text), *candidates):
        try:
            return yaml_files.parse(candidate)
        except yaml_files.YamlError as error:
            errors.append(error)
    raise ParameterError(f"the pasted text {shown(text)} is not YAML ({errors[0]}): it {_EXPECTED}")


def _relative(file: FoundFile, folder: Path) -> str:
    path = Path(file)
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else file.given
