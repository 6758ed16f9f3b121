"""The scripts of a file as files, their parameters as values, and the files of Lua beside it that they ask for."""

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
_MOST_PARAMETERS = 256


class ScriptFiles:
    """Writes scripts; those that are alike share a file."""

    def __init__(self, folder: Folder):
        """Take where they go."""
        self._folder = folder
        self._written: dict[tuple[str, str], str] = {}

    @property
    def lua_names(self) -> set[str]:
        """Names of the files of Lua that it has written."""
        return {name for name in self._written.values() if name.endswith(".lua")}

    def write(self, name: str, script: VrepScript) -> str:
        """Return the name of the file with a script of the object `name`."""
        suffix = ".py" if script.language == "python" else ".lua"
        text = script.text if script.text.endswith("\n") else f"{script.text}\n"
        if (text, suffix) not in self._written:
            file = self._folder.free_name(name, suffix)
            self._folder.write(file, text)
            self._written[text, suffix] = file
        return self._written[text, suffix]


def without_comments(script: VrepScript) -> str:
    """Return a script's text without comments."""
    if script.language == "python":
        return re.sub(r"#[^\n]*", "", script.text)
    return re.sub(r"--(?:\[(=*)\[.*?(?:\]\1\]|\Z)|[^\n]*)", "", script.text, flags=re.DOTALL)


def values(parameters: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return a script's parameters as YAML has them: numbers, true or false, and texts."""
    named = {name[:MAX_NAME]: _value(value) for name, value in parameters if name.isprintable() and name}
    return dict(list(named.items())[:_MOST_PARAMETERS])


def _value(text: str) -> Any:
    words: Mapping[str, bool] = {"true": True, "false": False}
    if text.strip().lower() in words:
        return words[text.strip().lower()]
    return float(text) if _NUMBER.fullmatch(text) else text


LIST = "MODULES.txt"  # what was brought: it is renewed whenever the scene is asked for
_ASKED = re.compile(r"""\b(require|dofile|loadfile)\s*\(?\s*["'](?:\./)?([\w\-][\w\-./]{0,150})["']""", re.ASCII)
_MOST = 64
_LARGEST = 1024 * 1024  # bytes


def renew(beside: Path, folder: Path) -> None:
    """Copy again, as they are now, the files that `bring` has copied into an import's folder. Raises OSError."""
    listed = folder / LIST
    before = set(listed.read_text(encoding="utf-8").split("\n")) if listed.is_file() else set()
    bring(beside, folder, {path.name for path in folder.glob("*.lua")} - before)


def bring(beside: Path, folder: Path, own: Collection[str]) -> None:
    """Copy what the folder's `own` scripts ask for, and those files in turn, from another folder.

    What is not there, is no text, or leads out of that other folder is left to the script to complain about; its own
    files stay as they are. Raises OSError.
    """
    texts = [(folder / name).read_text(encoding="utf-8", errors="replace") for name in sorted(own)]
    brought: dict[str, None] = {}
    while texts:
        for name in _asked(texts.pop(), beside):
            if name in own or name in brought or len(brought) >= _MOST:
                continue
            text = _text(beside, name)
            if text is not None:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                writing.write(folder / name, text)
                brought[name] = None
                texts.append(text)
    if brought:
        writing.write(folder / LIST, "".join(f"{name}\n" for name in brought))


def asked_for(text: str) -> list[list[str]]:
    """Return the files of Lua that a script asks for, the names that each may have."""
    found = []
    for how, name in _ASKED.findall(text):
        inner = name.replace(".", "/")
        files = [f"{inner}.lua", f"{inner}/init.lua"] if how == "require" else [name]
        found.append([file for file in files if file.endswith(".lua")])
    return found


def _asked(text: str, beside: Path) -> list[str]:
    """Return the names of the files beside it that a script asks for."""
    return [file for files in asked_for(text) for file in [one for one in files if (beside / one).is_file()][:1]]


def _text(beside: Path, name: str) -> str | None:
    """Return what is in a file below a folder, None for what may not be brought."""
    path = beside / name
    if ".." in Path(name).parts or not path.resolve().is_relative_to(beside.resolve()):
        return None
    try:
        return read_bytes(path, _LARGEST).decode("utf-8")
    except (OSError, ValueError):
        return None
