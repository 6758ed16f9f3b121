"""Scripts that the editor may open: those of the package, read-only, and those in the user's folder."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drone_sim.files import writing
from drone_sim.files.resources import package_path, read_bytes
from drone_sim.grading import tasks
from drone_sim.scripting.python.helpers import BUILT_IN

OWN, SOLUTIONS = "mine", "solutions"
_ENDINGS = (".py", ".lua")
_MAX_NAME = 100  # characters of a name
_MAX_SCRIPTS = 1000  # in one group
_MAX_REMOVED = 20  # deleted scripts kept in memory
_START = "start.py"  # starting point of a task
_LAST_STAGE = "6_ros.py"  # the tutorial's complete controller
LARGEST = 1 << 20  # bytes
_LARGEST_COPY = 1 << 26  # bytes of a script that another program has replaced


class ScriptStoreError(ValueError):
    """A request to the script store that cannot be executed; its message has one line."""


class NoSuchScript(ScriptStoreError):
    """No script has this name (any more)."""


@dataclass(frozen=True)
class ScriptFile:
    """A script's name in the browser, and its file."""

    name: str  # such as tutorial/1_thrust.py
    path: Path
    is_own: bool  # whether it may be written

    @property
    def group(self) -> str:
        """The script's group: built-in, tutorial, solutions, tasks or mine."""
        return self.name.partition("/")[0]

    @property
    def file_name(self) -> str:
        """The name without its group, such as 1_thrust.py."""
        return self.name.partition("/")[2]


class ScriptStore:
    """Scripts by name, such as `built-in/pilot.py` or `mine/first.lua`; no other file is read or written."""

    def __init__(self, folder: Path, shipped: Mapping[str, Callable[[], dict[str, Path]]] | None = None):
        """`folder` is the user's, created by the first copy; `shipped` lists the package's scripts of each group."""
        self.folder = folder
        self._shipped = shipped_with_the_package() if shipped is None else shipped
        self._originals: dict[str, str] = {}  # text of the user's scripts before the first change
        self._copies: dict[tuple[str, str], tuple[ScriptFile, str]] = {}  # with their versions, by script and draft
        self._removed: dict[str, bytes] = {}  # content of the scripts deleted last, by name
        self._writing = threading.Lock()  # two browsers may save at once

    # ---- list

    def scripts(self) -> list[ScriptFile]:
        shipped = [
            ScriptFile(f"{group}/{name}", path, False)
            for group, files in self._shipped.items()
            for name, path in files().items()
        ]
        return [*shipped, *(self._own(name) for name in scripts_in(self.folder))]

    def find(self, name: Any) -> ScriptFile:
        """Return a script by its name. Raises ScriptStoreError."""
        script = next((script for script in self.scripts() if script.name == name), None)
        if script is None:
            raise NoSuchScript(f"{str(name)[:80]!r}: no such script")
        self._resolve(script)
        return script

    def _resolve(self, script: ScriptFile) -> Path:
        """Return a script's file, with links resolved. Raises ScriptStoreError if it is outside the user's folder."""
        if not script.is_own:
            return script.path
        try:
            path = Path(os.path.realpath(script.path))
        except ValueError as error:
            raise ScriptStoreError(f"{script.name!r}: {error}") from None
        if path.parent != self.folder.resolve():
            raise ScriptStoreError(f"{script.name}: is a link to a file outside of {self.folder}, so it is not changed")
        return path

    def of_file(self, path: str) -> ScriptFile | None:
        """Return the script stored in a file, None if there is none."""
        return next((script for script in self.scripts() if str(script.path) == path), None)

    def digest(self) -> str:
        """Return a text that changes whenever a script is added or removed."""
        names = "\n".join(script.name for script in self.scripts())
        return hashlib.sha1(names.encode("utf-8", "surrogatepass"), usedforsecurity=False).hexdigest()[:12]

    def version(self, name: Any) -> str:
        """Return the current version of a script's file; '' if it was deleted."""
        script = next((script for script in self.scripts() if script.name == name), None)
        return _version_of(script.path) if script else ""

    # ---- text

    def read(self, script: ScriptFile) -> tuple[str, str]:
        r"""Return a script's text, with \n as line ends, and its version, which changes with the file.

        Raises ScriptStoreError.
        """
        version = _version_of(script.path)
        with _naming_errors(script.name):
            content = read_bytes(script.path, LARGEST)
        try:
            return content.decode("utf-8").replace("\r\n", "\n"), version
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            raise ScriptStoreError(f"{script.name}: line {line}: is not UTF-8, so it cannot be edited here") from None

    def save(self, script: ScriptFile, text: str, version: str, draft: str = "") -> tuple[ScriptFile, str] | None:
        """Write a script; a script of the package is copied to the user's folder.

        `draft` names the page's draft: a page that was left before it knew of its copy sends the draft again, later,
        and it belongs into that copy. Return the written script and its version. Return None, without writing, if the
        file no longer has `version`. Raises ScriptStoreError.
        """
        with self._writing:
            if not script.is_own:
                return self._save_copy(script, text, draft)
            if version != _version_of(script.path):
                return None
            path = self._resolve(script)
            self._originals.setdefault(script.name, self.read(script)[0])
            return script, _write_text(script.name, path, text)

    def save_as(self, name: Any, text: str) -> tuple[ScriptFile, str]:
        """Write a new script of the user's; return it and its version. Raises ScriptStoreError."""
        script = self._own(_valid_name(name))
        with self._writing:
            if os.path.lexists(script.path):
                raise ScriptStoreError(f"{script.name}: is there already; take another name")
            version = _write_text(script.name, script.path, text, is_new=True)
            self._originals[script.name] = text
            return script, version

    def keep_both(self, name: Any, text: str, mine: bool) -> tuple[ScriptFile, str, str]:
        """Resolve a conflict about a user's script: either `text` or the file's content goes into a second file.

        If `mine` is true, or there is no file, `text` is written to the script's own file; otherwise this file does
        not change. Return the script, its version, and the name of the second script ('' for none). Raises
        ScriptStoreError.
        """
        file_name = str(name).removeprefix(f"{OWN}/")
        script = self._own(file_name if file_name in scripts_in(self.folder) else _valid_name(file_name))
        with self._writing:
            path = self._resolve(script)
            if not os.path.lexists(path):
                return script, _write_text(script.name, path, text, is_new=True), ""
            second = self._copy_of(script)
            if mine:
                with _naming_errors(script.name):  # as bytes: it need not be text
                    writing.write_new(second.path, read_bytes(path, _LARGEST_COPY))
                return script, _write_text(script.name, path, text), second.name
            _write_text(second.name, second.path, text, is_new=True)
            return script, _version_of(script.path), second.name

    # ---- files

    def rename(self, script: ScriptFile, name: Any) -> tuple[ScriptFile, str]:
        """Rename a script of the user's; return it and its version. Raises ScriptStoreError."""
        new = self._own(_valid_name(name))
        with self._writing:
            path = self._own_path(script)
            with _naming_errors(script.name):
                try:
                    os.link(path, new.path, follow_symlinks=False)  # unlike rename, replaces no file
                except FileExistsError:
                    raise ScriptStoreError(f"{new.name}: is there already; take another name") from None
                os.unlink(path)
            if script.name in self._originals:
                self._originals[new.name] = self._originals.pop(script.name)
            return new, _version_of(new.path)

    def duplicate(self, script: ScriptFile, text: str) -> tuple[ScriptFile, str]:
        """Write `text`, a browser's version of a script, to a new script; return it and its version.

        Raises ScriptStoreError.
        """
        with self._writing:
            copy = self._copy_of(script)
            return copy, _write_text(copy.name, copy.path, text, is_new=True)

    def remove(self, script: ScriptFile) -> None:
        """Delete a script of the user's; `bring_back` restores it. Raises ScriptStoreError."""
        with self._writing:
            path = self._own_path(script)
            with _naming_errors(script.name):
                content = read_bytes(path, LARGEST)
                os.unlink(path)
            self._removed.pop(script.name, None)
            self._removed[script.name] = content
            for oldest in list(self._removed)[:-_MAX_REMOVED]:
                del self._removed[oldest]

    def bring_back(self, name: Any) -> tuple[ScriptFile, str]:
        """Restore a deleted script under its name or, if that is taken, under a new one; return it and its version.

        Raises ScriptStoreError.
        """
        with self._writing:
            if name not in self._removed:
                raise ScriptStoreError(
                    f"{str(name)[:80]!r}: cannot be brought back: it was not deleted here, or too long ago"
                )
            script = self._own(str(name).removeprefix(f"{OWN}/"))
            if os.path.lexists(script.path):
                script = self._copy_of(script)
            with _naming_errors(script.name):
                self.folder.mkdir(parents=True, exist_ok=True)
                writing.write_new(script.path, self._removed.pop(name))
            return script, _version_of(script.path)

    def _own_path(self, script: ScriptFile) -> Path:
        """Return the path of a user's script, links not resolved. Raises ScriptStoreError."""
        if not script.is_own:
            raise ScriptStoreError(f"{script.name}: belongs to the package and cannot be changed; duplicate it")
        self._resolve(script)
        return script.path

    def original(self, script: ScriptFile) -> str:
        """Return a script's text before its first change. Raises ScriptStoreError."""
        original = self._originals.get(script.name)
        return self.read(script)[0] if original is None else original

    def _own(self, file_name: str) -> ScriptFile:
        return ScriptFile(f"{OWN}/{file_name}", self.folder / file_name, True)

    def _save_copy(self, script: ScriptFile, text: str, draft: str) -> tuple[ScriptFile, str]:
        """Write a text to the draft's copy of a script of the package, or to a new one."""
        copy, written = self._copies.get((script.name, draft), (None, ""))
        if copy is not None and written == _version_of(copy.path):
            written = _write_text(copy.name, self._resolve(copy), text)
        else:
            original, copy = self.read(script)[0], self._copy_of(script)
            written = _write_text(copy.name, copy.path, text, is_new=True)
            self._originals[copy.name] = original
        if draft:
            self._copies[script.name, draft] = copy, written
        return copy, written

    def _copy_of(self, script: ScriptFile) -> ScriptFile:
        """Return a new script of the user's, with the name of `script` and a number if it is taken."""
        stem, ending = Path(script.file_name).stem, script.path.suffix
        names = [stem, *(f"{stem}_{number}" for number in range(2, _MAX_SCRIPTS))]
        name = next((name for name in names if not os.path.lexists(self.folder / f"{name}{ending}")), None)
        if name is None:
            raise ScriptStoreError(f"{script.name}: there are too many copies in {self.folder}")
        return self._own(f"{name}{ending}")


def shipped_with_the_package() -> dict[str, Callable[[], dict[str, Path]]]:
    """Return for each group a function that lists the package's scripts by name."""
    tutorial = package_path() / "docs" / "tutorial"
    return {
        "built-in": lambda: scripts_in(BUILT_IN),
        # The folder also holds tools; the names of stages begin with a digit.
        "tutorial": lambda: {name: file for name, file in scripts_in(tutorial).items() if name[0].isdigit()},
        SOLUTIONS: lambda: scripts_in(tutorial / "solutions"),
        "tasks": lambda: _starts(tutorial / _LAST_STAGE),
    }


def scripts_in(folder: Path) -> dict[str, Path]:
    """Return the scripts in a folder by name."""
    try:
        files = sorted(folder.iterdir())[: 10 * _MAX_SCRIPTS]
    except OSError:  # it does not exist yet
        return {}
    named = {file.name: file for file in files if file.suffix in _ENDINGS and not file.name.startswith(("_", "."))}
    return dict(list(named.items())[:_MAX_SCRIPTS])


def _starts(last_stage: Path) -> dict[str, Path]:
    """Return the starting script of each task: its start.py, or the tutorial's last stage."""
    own = {name: folder / _START for name, folder in sorted(tasks.folders().items())}
    starts = {f"{name}.py": file if file.is_file() else last_stage for name, file in own.items()}
    return {name: file for name, file in starts.items() if file.is_file()}


def _valid_name(name: Any) -> str:
    """Return `name` if a script may have it. Raises ScriptStoreError."""
    if not isinstance(name, str) or not 0 < len(name) <= _MAX_NAME:
        raise ScriptStoreError(f"{str(name)[:80]!r}: a name has 1 to {_MAX_NAME} characters")
    if Path(name).suffix not in _ENDINGS:
        raise ScriptStoreError(f"{name!r}: a script's name ends in {' or '.join(_ENDINGS)}")
    if "/" in name or name.startswith(("_", ".")) or not name.isprintable():
        raise ScriptStoreError(
            f"{name!r}: a name may contain letters, digits, '-' and '_', and must not begin with '_' or '.'"
        )
    return name


def _write_text(name: str, path: Path, text: str, is_new: bool = False) -> str:
    r"""Write a file and return its version; most lines ended by \r\n stay so.

    Links are not followed, even if `path` becomes one meanwhile. `is_new`: an existing file is not replaced. Raises
    ScriptStoreError.
    """
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        raise ScriptStoreError(
            f"{name}: line {line}: contains half of a character pair (a lone surrogate), which cannot be saved"
        ) from None
    if len(content) > LARGEST:
        raise ScriptStoreError(f"{name}: has {len(content)} bytes; at most {LARGEST} are allowed")
    if not is_new:
        with contextlib.suppress(OSError, ValueError):
            before = read_bytes(path, LARGEST)
            if 2 * before.count(b"\r\n") > before.count(b"\n"):
                text = text.replace("\n", "\r\n")
    with _naming_errors(name):
        path.parent.mkdir(parents=True, exist_ok=True)
        writing.write_new(path, text) if is_new else writing.write(path, text, through_links=False)
    return _version_of(path)


def _version_of(path: Path) -> str:
    """Return a text that changes whenever the file does; '' if there is no file."""
    try:
        state = path.stat()
    except (OSError, ValueError):
        return ""
    return f"{state.st_mtime_ns}-{state.st_size}-{state.st_ino}"


@contextlib.contextmanager
def _naming_errors(name: str) -> Iterator[None]:
    """Convert errors of a file to a ScriptStoreError with one line."""
    try:
        yield
    except OSError as error:
        message = f"{error.filename}: {os.strerror(error.errno)}" if error.errno and error.filename else str(error)
        raise ScriptStoreError(f"{name}: {message}") from None
    except ValueError as error:
        raise ScriptStoreError(f"{name}: {error}") from None
