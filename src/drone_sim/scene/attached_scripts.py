"""Parameters of the scripts that a scene file attaches to objects."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Annotated, Protocol

from pydantic import Field

from drone_sim.config.types import Checked, FileName, Label, ParameterError, ScriptValue, Switch

MAX_SCRIPTS = 256
MAX_PARAMETERS = 256  # per script


class AttachedScriptParameters(Checked):
    """A child script on the object named `object`, of the scene or of a vehicle.

    `embedded`: `..` in its paths is that object's parent, as up to CoppeliaSim 4.8, and not the object itself.
    """

    object: Label
    script: FileName
    embedded: Switch = False
    parameters: Annotated[dict[Label, ScriptValue], Field(default_factory=dict, max_length=MAX_PARAMETERS)]


AttachedScripts = Annotated[list[AttachedScriptParameters], Field(max_length=MAX_SCRIPTS)]


class RunningScripts(Protocol):
    """Interface to the scripts of the scene's objects, called when objects are added, renamed or removed."""

    def attach(self, objects: Collection[str]) -> object:
        """Attach the scripts of added objects; each is initialised before its first call."""

    def rename(self, name: str, new: str) -> None:
        """Move the script of a renamed object, if it has one, to the object's new name."""

    def end(self, objects: Collection[str]) -> None:
        """Call cleanup and detach the scripts of objects to be removed; a script that is running ends later."""


def check(scripts: Sequence[AttachedScriptParameters]) -> None:
    """Raise ParameterError for an object with two scripts or a script without a file."""
    names: set[str] = set()
    for index, script in enumerate(scripts):
        for key, mistake in (
            ("object", script.object in names and "is used twice"),
            ("script", not script.script and "no file"),
        ):
            if mistake:
                raise ParameterError(mistake, ("scripts", index, key), f"'{getattr(script, key)}'")
        names.add(script.object)
