"""The script that flies: its name, and whether it listens to commands, as its text says."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from drone_sim.files.resources import read_bytes
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path

_LARGEST = 1 << 20  # bytes
_DEEPEST = 8  # modules that import each other
_COMMENT = re.compile(r"^\s*(?:#|--).*$", re.MULTILINE)
_IMPORT = re.compile(r"^\s*(?:import|from)\s+(\w+)|\brequire\s*\(?\s*['\"](\w+)['\"]", re.MULTILINE)
_LISTENS = re.compile(r"subscrib\w*\s*\(\s*[a-z]?['\"][^'\"]*\bcmd_vel['\"]", re.IGNORECASE)


def listens_to_commands(script_text: str) -> bool:
    """Whether a script, in Python or Lua, subscribes to `cmd_vel`: whether keys and sticks move what it flies."""
    return bool(_LISTENS.search(_COMMENT.sub("", script_text)))


class FlownScript:
    """What is known of the script that flies; it is read anew when it has changed."""

    def __init__(self) -> None:
        """Know nothing."""
        self._seen: tuple[Any, ...] = ()
        self.said: dict[str, Any] = {"name": "", "listens": True}

    def look(self, script: str) -> dict[str, Any]:
        """Return name of file and whether it listens, for what the node's parameter `script` is."""
        try:
            path = Path(script_path(script))
            seen = path, path.stat().st_mtime_ns
        except (OSError, ScriptError, ValueError):
            self._seen, self.said = (), {"name": "", "listens": True}
            return self.said
        if seen != self._seen:
            text = "\n".join(_texts(path, _DEEPEST))
            self._seen = seen
            self.said = {"name": path.name, "listens": listens_to_commands(text)}
        return self.said


def _texts(path: Path, deep: int) -> Iterator[str]:
    """Yield the text of a script, and of what it imports from beside it."""
    try:
        text = read_bytes(path, _LARGEST).decode("utf-8", "replace")
    except (OSError, ValueError):
        return
    yield text
    for found in _IMPORT.finditer(text) if deep else ():
        beside = path.with_name((found[1] or found[2]) + path.suffix)
        if beside != path and beside.is_file():
            yield from _texts(beside, deep - 1)
