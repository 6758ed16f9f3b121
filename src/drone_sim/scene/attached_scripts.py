"""What a scene file may say of the scripts that are attached to its objects."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Annotated, Protocol

from pydantic import Field

from drone_sim.config.types import Checked, FileName, Label, ParameterError, ScriptValue, Switch

MAX_SCRIPTS = 256
MAX_PARAMETERS = 256  # of one script


class AttachedScriptParameters(Checked):
    """A child script on an object of the scene or of a vehicle, which has the name `object` there.

    `embedded`: `..` in its paths is the parent of that object, as up to CoppeliaSim 4.8, and not the object itself.
    """

    object: Label
    script: FileName
    embedded: Switch = False
    parameters: Annotated[dict[Label, ScriptValue], Field(default_factory=dict, max_length=MAX_PARAMETERS)]


AttachedScripts = Annotated[list[AttachedScriptParameters], Field(max_length=MAX_SCRIPTS)]


class RunningScripts(Protocol):
    """What runs the scripts of the scene's objects, and is told what becomes of these."""

    def attach(self, objects: Collection[str]) -> object:
        """Attach the scripts of objects that have come; they begin before they are called for the first time."""

    def rename(self, name: str, new: str) -> None:
        """Know the script of an object, if it has one, by the object's new name."""

    def end(self, objects: Collection[str]) -> None:
        """Call the cleanup of scripts whose objects are about to go, and let go of them; one that runs ends later."""


def check(scripts: Sequence[AttachedScriptParameters]) -> None:
    """Raise ParameterError where an object has two scripts, or a script no file."""
    names: set[str] = set()
    for index, one in enumerate(scripts):
        for key, mistake in (
            ("object", one.object in names and "is used twice"),
            ("script", not one.script and "no file"),
        ):
            if mistake:
                raise ParameterError(mistake, ("scripts", index, key), f"'{getattr(one, key)}'")
        names.add(one.object)
