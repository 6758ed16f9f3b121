"""Files of Lua beside a scene that its scripts ask for: brought beside the scripts, where they are looked for."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path

from drone_sim.files import writing
from drone_sim.files.resources import read_bytes

LIST = "MODULES.txt"  # what was brought: it is renewed whenever the scene is asked for
_ASKED = re.compile(r"""\b(require|dofile|loadfile)\s*\(?\s*["'](?:\./)?([\w\-][\w\-./]{0,150})["']""", re.ASCII)
_MOST = 64
_LARGEST = 1024 * 1024  # bytes


def renew(beside: Path, folder: Path) -> None:
    """Bring once more what was brought into the folder of an import, as it is by now. Raises OSError."""
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


def _asked(text: str, beside: Path) -> list[str]:
    """Return the names of the files that a script asks for."""
    found = []
    for how, name in _ASKED.findall(text):
        inner = name.replace(".", "/")
        files = [f"{inner}.lua", f"{inner}/init.lua"] if how == "require" else [name]
        found += [file for file in files if file.endswith(".lua") and (beside / file).is_file()][:1]
    return found


def _text(beside: Path, name: str) -> str | None:
    """Return what is in a file below a folder, None for what may not be brought."""
    path = beside / name
    if ".." in Path(name).parts or not path.resolve().is_relative_to(beside.resolve()):
        return None
    try:
        return read_bytes(path, _LARGEST).decode("utf-8")
    except (OSError, ValueError):
        return None
