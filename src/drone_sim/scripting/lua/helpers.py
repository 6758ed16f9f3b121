"""Files in the folder of a Lua child script: helper modules, .lua files and data."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

from drone_sim.message_text import near_names
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.errors import read_source
from drone_sim.scripting.lua.source import LuaSource

_CHUNK_LENGTH = 50  # Lua cuts longer chunk names
_NAME = re.compile(r"[\w-]+(?:[./][\w-]+)*")
_FILE = re.compile(r"[\w-]+(?:[./][\w-]+)*\.lua")
_DATA = re.compile(r"\w[\w .+-]*(?:/\w[\w .+-]*)*")
_LONGEST, _MOST = 200, 1000  # characters of a name; helpers


class LuaHelpers:
    """Reads files for a script: regular files of limited size in its own folder or below it."""

    def __init__(self, script: str):
        self.chunk = self._chunk(Path(script).name)
        self._paths = {self.chunk: script}
        self._folder = Path(script).parent

    def chunk_of(self, path: str) -> str:
        """Return the chunk name of a file; '' for a file outside the script's folder."""
        own = os.path.realpath(self._paths[self.chunk])
        if path == own:
            return self.chunk
        folder = os.path.dirname(own)
        return self._chunk(os.path.relpath(path, folder)) if path.startswith(f"{folder}{os.sep}") else ""

    def path(self, chunk: str) -> str:
        """Return the file of a chunk, or the script's file for an unknown name."""
        return self._paths.get(chunk, self._paths[self.chunk])

    def parse_message(self, text: str) -> tuple[str, int, str]:
        """Return file, line (0: unknown) and text of an error message from Lua."""
        for chunk, path in self._paths.items():
            match = re.match(rf"{re.escape(chunk)}:(\d+): (.*)$", text, re.DOTALL)
            if match:
                return path, int(match.group(1)), match.group(2)
        return self._paths[self.chunk], 0, text

    def read(self, name: bytes) -> tuple[bool, bytes, bytes]:
        """Return True, the text and the chunk name of a module; or False, a message and b''."""
        return self._read("no module", name, self._module)

    def read_file(self, name: bytes) -> tuple[bool, bytes, bytes]:
        """Return True, the text and the chunk name of a .lua file; or False, a message and b''."""
        return self._read("cannot load", name, self._file)

    def read_data(self, name: bytes) -> tuple[bool, bytes, bytes]:
        """Return True, the contents of a file and b''; or False, a message, and b'refused' if it may not be read."""
        shown = name.decode("utf-8", "replace")
        file, why = shown.removeprefix("./"), b"refused"
        try:
            if len(file) > _LONGEST or not _DATA.fullmatch(file):
                raise ValueError("must be a file in the script's folder or a folder in it, such as data/path.csv")
            path, why = str(self._inside(file)), b""
            return True, read_source(path), b""
        except ValueError as error:
            return False, f"{shown[:80]}: {error}".encode("utf-8", "replace"), why

    def _inside(self, file: str) -> Path:
        """Return the path of a file. Raises ValueError if a link leads out of the folder."""
        path = self._folder / file
        if not path.resolve().is_relative_to(self._folder.resolve()):
            raise ValueError("is outside of the script's folder")
        return path

    def _read(self, failure: str, name: bytes, find: Callable[[str], str]) -> tuple[bool, bytes, bytes]:
        try:
            file = find(name.decode("utf-8"))
            path, chunk = self._inside(file), self._chunk(file)
            text = LuaSource(read_source(path)).text
            if len(self._paths) > _MOST:
                raise ValueError(f"a script may have at most {_MOST} modules")
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            return False, f"{failure} '{name.decode('utf-8', 'replace')[:80]}': {why}".encode("utf-8", "replace"), b""
        self._paths[chunk] = str(path)
        return True, text, chunk.encode("utf-8", "replace")

    def _file(self, name: str) -> str:
        file = name.removeprefix("./")
        if len(file) > _LONGEST or not _FILE.fullmatch(file):
            raise ValueError("must be a .lua file in the script's folder or a folder in it, such as helpers/pid.lua")
        if not (self._folder / file).exists():
            near = near_names(file, [path.name for path in self._folder.glob("*.lua")])
            raise ValueError(f"there is no such file in the script's folder; {near}")
        return file

    def _module(self, name: str) -> str:
        if len(name) > _LONGEST or not _NAME.fullmatch(name):
            raise ValueError("the name of a module may contain letters, digits, _ and -, and dots for folders")
        inner = name.replace(".", "/")
        for file in (f"{inner}.lua", f"{inner}/init.lua"):
            if (self._folder / file).exists() and not self._is_script(file):
                return file
        if name in PLUGINS:
            raise ValueError(not_there("", name, ()))
        beside = [path.stem for path in self._folder.glob("*.lua") if str(path) not in self._paths.values()]
        near = near_names(name, beside)
        if self._is_script(f"{inner}.lua"):
            raise ValueError(
                f"{inner}.lua is this script itself; give the helper another name, or put it into {inner}/init.lua"
            )
        raise ValueError(f"there is no file {inner}.lua in the script's folder{f'; {near}' if beside else ''}")

    def _is_script(self, file: str) -> bool:
        """Return whether a file in the folder is the script itself, which is not its own helper."""
        return (self._folder / file) == Path(self._paths[self.chunk])

    @staticmethod
    def _chunk(file: str) -> str:
        return file.encode("utf-8", "replace")[-_CHUNK_LENGTH:].decode("utf-8", "ignore")
