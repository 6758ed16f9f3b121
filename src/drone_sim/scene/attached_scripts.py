"""What a scene file may say of the scripts that are attached to its objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Field

from drone_sim.config.types import Checked, FileName, Label, ParameterError, ScriptValue

MAX_SCRIPTS = 256
MAX_PARAMETERS = 256  # of one script


class AttachedScriptParameters(Checked):
    """A child script on an object of the scene or of a vehicle, which has the name `object` there."""

    object: Label
    script: FileName
    parameters: Annotated[dict[Label, ScriptValue], Field(default_factory=dict, max_length=MAX_PARAMETERS)]


AttachedScripts = Annotated[list[AttachedScriptParameters], Field(max_length=MAX_SCRIPTS)]


def check(scripts: Sequence[AttachedScriptParameters]) -> None:
    """Raise ParameterError where an object has two scripts, or a script no file."""
    names: set[str] = set()
    for index, one in enumerate(scripts):
        for key, mistake in (
            ("object", one.object in names and "comes twice"),
            ("script", not one.script and "no file"),
        ):
            if mistake:
                location = ("scene", "scripts", index, key)
                value: Any = getattr(one, key)
                raise ParameterError(f"parameter scene/scripts/{index}/{key} = '{value}': {mistake}", location)
        names.add(one.object)
