"""Scripts on objects: attached, made anew, taken away."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import named_in
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.files import writing
from drone_sim.scene.scene_parameters import script_from
from drone_sim.scripting.load import script_path

_SUFFIX = {"lua": ".lua", "python": ".py"}
_LUA = """\
function sysCall_init()
    object = sim.getObject('.')
end

function sysCall_actuation()
end

function sysCall_sensing()
end

function sysCall_cleanup()
end
"""
_PYTHON = """\
def sysCall_init():
    self.object = sim.getObject('.')


def sysCall_actuation():
    pass


def sysCall_sensing():
    pass


def sysCall_cleanup():
    pass
"""
_TEXTS = {"lua": _LUA, "python": _PYTHON}


def attach(scene: SceneAccess, handle: int, file: str, language: str, parameters: Mapping[str, Any]) -> None:
    """Attach a script to an object; without a file, a new one beside the scene. Raises ValueError and OSError."""
    name = scene.tree[handle].name
    found = named_in(scene.folder, file) if file else named_in(scene.folder, _new(scene.folder, name, language))
    script_path(str(found))
    script = script_from({"object": name, "script": found, "parameters": dict(parameters)})
    scene.operations.attach_script(script)


def _new(folder: Path, name: str, language: str) -> str:
    """Write a script in V-REP's form, with a name that no file has; return that."""
    stem = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "script"
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(1000):
        path = folder / f"{stem}{number or ''}{_SUFFIX[language]}"
        if not path.exists():
            writing.write_new(path, _TEXTS[language])
            return path.name
    raise ValueError(f"{folder}: already has a thousand scripts named {stem}")


def set_parameters(scene: SceneAccess, handle: int, parameters: Any) -> None:
    """Let the script of an object have other parameters. Raises ValueError."""
    name = scene.tree[handle].name
    script = scene.simulation.scene.scripts.get(name)
    if script is None:
        raise ValueError(f"'{name}' has no script of the scene")
    said = {**script.model_dump(), "script": script.script, "parameters": parameters}
    scene.operations.attach_script(script_from(said))


def detach(scene: SceneAccess, handle: int) -> None:
    """Let an object have no script. Raises ValueError."""
    name = scene.tree[handle].name
    if name not in scene.simulation.scene.scripts:
        raise ValueError(f"'{name}' has no script of the scene")
    scene.operations.detach_script(name)
