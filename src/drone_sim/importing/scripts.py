"""Import of scripts: their files, their parameters as values, and the Lua files that they load."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import read_bytes
from drone_sim.importing.folder import Folder
from drone_sim.message_text import MAX_NAME
from drone_sim.vrep_files.model import VrepScript

_NUMBER = re.compile(r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*")
_MAX_PARAMETERS = 256


class ScriptFiles:
    """Writes script files; equal scripts share a file."""

    def __init__(self, folder: Folder):
        """Write into `folder`."""
        self._folder = folder
        self._written: dict[tuple[str, str], str] = {}

    @property
    def lua_names(self) -> set[str]:
        """The names of the Lua files written so far."""
        return {name for name in self._written.values() if name.endswith(".lua")}

    def write(self, name: str, script: VrepScript) -> str:
        """Write a script of the object `name`, unless an equal one is written already; return the file's name."""
        suffix = ".py" if script.language == "python" else ".lua"
        text = script.text if script.text.endswith("\n") else f"{script.text}\n"
        if (text, suffix) not in self._written:
            file = self._folder.free_name(name, suffix)
            self._folder.write(file, text)
            self._written[text, suffix] = file
        return self._written[text, suffix]


def values(parameters: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return script parameters as YAML values: numbers, booleans and strings."""
    named = {name[:MAX_NAME]: _value(value) for name, value in parameters if name.isprintable() and name}
    return dict(list(named.items())[:_MAX_PARAMETERS])


def _value(text: str) -> Any:
    words: Mapping[str, bool] = {"true": True, "false": False}
    if text.strip().lower() in words:
        return words[text.strip().lower()]
    return float(text) if _NUMBER.fullmatch(text) else text


LIST = "MODULES.txt"  # the copied files; they are copied again whenever the scene is loaded
_LOAD_CALL = re.compile(r"""\b(require|dofile|loadfile)\s*\(?\s*["'](?:\./)?([\w\-][\w\-./]{0,150})["']""", re.ASCII)
_MAX_FILES = 64
_MAX_FILE_SIZE = 1024 * 1024  # bytes


def renew(beside: Path, folder: Path) -> None:
    """Copy the files again that `bring` has copied from `beside` into an import's folder. Raises OSError."""
    list_file = folder / LIST
    copied = set(list_file.read_text(encoding="utf-8").split("\n")) if list_file.is_file() else set()
    bring(beside, folder, {path.name for path in folder.glob("*.lua")} - copied)


def bring(beside: Path, folder: Path, own: Collection[str]) -> None:
    """Copy the files that the folder's scripts `own` load, directly or through each other, from `beside` into `folder`.

    A file that does not exist, is not text, or is outside `beside` is not copied: the script will fail to load it. The
    scripts `own` are not overwritten. Raises OSError.
    """
    texts = [(folder / name).read_text(encoding="utf-8", errors="replace") for name in sorted(own)]
    copied: dict[str, None] = {}
    while texts:
        for name in _existing_files(texts.pop(), beside):
            if name in own or name in copied or len(copied) >= _MAX_FILES:
                continue
            text = _text(beside, name)
            if text is not None:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                writing.write(folder / name, text)
                copied[name] = None
                texts.append(text)
    if copied:
        writing.write(folder / LIST, "".join(f"{name}\n" for name in copied))


def asked_for(text: str) -> list[list[str]]:
    """Return the possible file names of each Lua file that a script loads."""
    files = []
    for function, name in _LOAD_CALL.findall(text):
        path = name.replace(".", "/")
        names = [f"{path}.lua", f"{path}/init.lua"] if function == "require" else [name]
        files.append([file for file in names if file.endswith(".lua")])
    return files


def _existing_files(text: str, beside: Path) -> list[str]:
    """Return the names of the files in `beside` that a script loads."""
    return [file for names in asked_for(text) for file in [name for name in names if (beside / name).is_file()][:1]]


def _text(beside: Path, name: str) -> str | None:
    """Return the text of a file below `beside`; None if it must not be copied or cannot be read."""
    path = beside / name
    if ".." in Path(name).parts or not path.resolve().is_relative_to(beside.resolve()):
        return None
    try:
        return read_bytes(path, _MAX_FILE_SIZE).decode("utf-8")
    except (OSError, ValueError):
        return None
