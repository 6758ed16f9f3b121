"""The scripts of a file as files of their own, and their parameters as values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from drone_sim.importing.folder import Folder
from drone_sim.vrep_files.model import Script
from drone_sim.wording import MAX_NAME

_NUMBER = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*")
_MOST_PARAMETERS = 256
_IDLE = "-- The file's own scripts push this drone: nothing else is to.\nfunction sysCall_init()\nend\n"


class ScriptFiles:
    """Writes scripts; those that are alike share a file."""

    def __init__(self, folder: Folder):
        """Take where they go."""
        self._folder = folder
        self._written: dict[tuple[str, str], str] = {}

    @property
    def names(self) -> list[str]:
        """Names of the files that it has written."""
        return list(self._written.values())

    def write(self, name: str, script: Script) -> str:
        """Return the name of the file with a script of the object `name`."""
        suffix = ".py" if script.language == "python" else ".lua"
        return self._file(name, script.text if script.text.endswith("\n") else f"{script.text}\n", suffix)

    def idle(self) -> str:
        """Return the name of a script that does nothing."""
        return self._file("idle", _IDLE, ".lua")

    def _file(self, name: str, text: str, suffix: str) -> str:
        if (text, suffix) not in self._written:
            file = self._folder.free_name(name, suffix)
            self._folder.write(file, text)
            self._written[text, suffix] = file
        return self._written[text, suffix]


def values(parameters: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return a script's parameters as YAML has them: numbers, true or false, and texts."""
    named = {name[:MAX_NAME]: _value(value) for name, value in parameters if name.isprintable() and name}
    return dict(list(named.items())[:_MOST_PARAMETERS])


def _value(text: str) -> Any:
    words: Mapping[str, bool] = {"true": True, "false": False}
    if text.strip().lower() in words:
        return words[text.strip().lower()]
    return float(text) if _NUMBER.fullmatch(text) else text
