"""Scripts of objects: attach, create, change and detach."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_sim.config.types import named_in
from drone_sim.files import writing
from drone_sim.run.simulation import Simulation
from drone_sim.scene.scene_parameters import script_from
from drone_sim.scripting.load import script_path

_SUFFIX = {"lua": ".lua", "python": ".py"}
_LUA_TEMPLATE = """\
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
_PYTHON_TEMPLATE = """\
def sysCall_init():
    self.object = sim.getObject('.')


def sysCall_actuation():
    pass


def sysCall_sensing():
    pass


def sysCall_cleanup():
    pass
"""
_TEMPLATES = {"lua": _LUA_TEMPLATE, "python": _PYTHON_TEMPLATE}


def attach(simulation: Simulation, handle: int, file: str, language: str, parameters: Mapping[str, Any]) -> None:
    """Attach a script to an object; without `file`, create one beside the scene. Raises ValueError and OSError."""
    name = simulation.tree[handle].name
    path = (
        named_in(simulation.document.folder, file)
        if file
        else named_in(simulation.document.folder, _create(simulation.document.folder, name, language))
    )
    script_path(str(path))
    script = script_from({"object": name, "script": path, "parameters": dict(parameters)})
    simulation.operations.attach_script(script)


def _create(folder: Path, name: str, language: str) -> str:
    """Write a new script from V-REP's template under an unused file name; return the name."""
    stem = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "script"
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(1000):
        path = folder / f"{stem}{number or ''}{_SUFFIX[language]}"
        if not path.exists():
            writing.write_new(path, _TEMPLATES[language])
            return path.name
    raise ValueError(f"{folder}: already has a thousand scripts named {stem}")


def set_parameters(simulation: Simulation, handle: int, parameters: Any) -> None:
    """Set the parameters of an object's script. Raises ValueError if it has none."""
    name = simulation.tree[handle].name
    script = simulation.scene.scripts.get(name)
    if script is None:
        raise ValueError(f"'{name}' has no script of the scene")
    values = {**script.model_dump(), "script": script.script, "parameters": parameters}
    simulation.operations.attach_script(script_from(values))


def detach(simulation: Simulation, handle: int) -> None:
    """Detach the script of an object. Raises ValueError if it has none."""
    name = simulation.tree[handle].name
    if name not in simulation.scene.scripts:
        raise ValueError(f"'{name}' has no script of the scene")
    simulation.operations.detach_script(name)
