"""Which files a flight depends on: it is flown again when one of them changes, and the sandbox shows only them."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from drone_sim.files.resources import locate, read_bytes, resolve
from drone_sim.grading.plan import Plan
from drone_sim.importing.cache import cache_folder
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path
from drone_sim.scripting.python.helpers import BUILT_IN

LARGEST = 64 * 2**20  # bytes, of all files of a script together
_MOST = 1000  # files
_READ_FOR_NAMES = 2**20  # bytes: a longer file names no others
_WORD = re.compile(r"[\w./-]{1,200}")
_ADDRESS = re.compile(r"package://[\w./-]{1,200}")
_SCRIPTS = (".py", ".lua")
_NAMES_OTHERS = (*_SCRIPTS, ".yaml", ".yml", ".urdf", ".dae", ".obj", ".mtl")
_ENDINGS = ("", ".py", ".lua", "/__init__.py", "/init.lua")  # of what `import` and `require` name
_CHILD_SCRIPT = re.compile(r"^(?:(?:async[ \t]+)?def|function)[ \t]+sysCall_|^sysCall_\w+[ \t]*=", re.MULTILINE)


class Unreadable(ValueError):
    """A script, or a file that it names, cannot be read, or may not be; one line says why."""


def of_plan(plan: Plan, changes: Mapping[str, Any]) -> list[Path]:
    """Return the plan's file, its scene and config, and what these and `changes` name, sorted; no script to be graded.

    The files are regular ones. Names are followed inside the folder of each file that the plan leads to. Raises
    FileNotFoundError and ParameterError.
    """
    led_to = [*plan.files, *_values_of(plan, changes)]
    own = {Path(path).resolve() for path in _own_script(plan)}
    found: dict[Path, None] = {}
    for path in dict.fromkeys(path.resolve() for path in led_to):
        if path in own:
            continue
        imported = _import_of(path)
        for one in _regular(imported.rglob("*")) if imported else _followed(path, path.parent, own):
            found[one] = None
            found.update(dict.fromkeys(_of_packages(one)))
    return sorted(found)


def of_script(plan: Plan, script: str) -> list[Path]:
    """Return the file of a script, and then those inside its folder that it names, and so on; [] for a built-in one.

    Other child scripts are left out, even if they are named: they belong to somebody else, or to the plan. So are files
    that cannot be read, and those beyond LARGEST bytes in total, the smallest counted first: any word may happen to be
    a file's name, and one student's files must not spoil another's flight.
    """
    path = Path(script_path(script)).resolve()
    if path.parent == BUILT_IN:
        return []
    others = {Path(one).resolve() for one in _own_script(plan)}
    named = _followed(path, path.parent, others, is_handed_in=True)[1:]
    kept, size = [path], 0
    for one in sorted(named, key=lambda one: (one.stat().st_size, one)):
        size += one.stat().st_size
        if size > LARGEST:
            break
        kept.append(one)
    return kept


def read(path: Path, limit: int = LARGEST) -> bytes:
    """Return what a file holds. Raises Unreadable where it cannot be read, is no regular one or too large."""
    try:
        return read_bytes(path, limit)
    except (OSError, ValueError) as error:
        raise Unreadable(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def given_script(given: str) -> str:
    """Return the path of a script that somebody has handed in; a built-in one's name as it is.

    Raises ScriptError for a script that does not exist, and Unreadable for one that is not a regular file, or is a link
    that leads out of its folder.
    """
    path = Path(os.path.abspath(given))
    try:
        found = script_path(given)
    except ScriptError:
        if Path(given).suffix in _SCRIPTS and os.path.lexists(path):
            raise Unreadable(f"{path}: is not a regular file, nor a link to one") from None
        raise
    if path.is_symlink() and not Path(found).is_relative_to(path.parent.resolve()):
        raise Unreadable(f"{path}: is a link that leads out of its folder")
    return found if Path(given).suffix else given


def _own_script(plan: Plan) -> Iterator[str]:
    """Yield the script of the plan itself: it may be a solution, which other scripts must not see."""
    if plan.script and Path(plan.script).suffix:
        yield str(locate(plan.script_of(None)))


def _values_of(plan: Plan, changes: Mapping[str, Any]) -> Iterator[Path]:
    """Give the files among the values of a plan's parameters: meshes, textures, scripts of the scene."""
    named = changes if any(True for _ in _texts(changes)) else {}
    parameters = plan.parameters(changes=named)
    for text in {*_texts({**vars(parameters), "script": ""}), *_texts(named)}:
        if "/" in text or "." in text:
            try:
                yield resolve(text)
            except FileNotFoundError:
                continue


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for one in value.values():
            yield from _texts(one)
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield from _texts(one)
    elif hasattr(value, "__dict__"):
        yield from _texts(vars(value))


def _import_of(path: Path) -> Path | None:
    """Return the folder of an imported scene in which a file lies."""
    cache = cache_folder().resolve()
    return cache / path.relative_to(cache).parts[0] if path.is_relative_to(cache) and path.parent != cache else None


def _of_packages(path: Path) -> Iterator[Path]:
    """Give the files of ROS packages that a text names, and what a package is found by."""
    if path.suffix.lower() not in (".urdf", ".yaml", ".yml"):
        return
    for name in set(_ADDRESS.findall(_text(path))):
        package = "/".join(name.split("/", 3)[:3])
        for one in (name, f"{package}/package.xml"):
            try:
                yield resolve(one)
            except FileNotFoundError:
                continue


def _followed(path: Path, folder: Path, others: set[Path], is_handed_in: bool = False) -> list[Path]:
    """Return a file, and then those that it names inside a folder, and so on, but none of `others`.

    A word of a text counts as a name where there is such a file beside it: rather one file too many, for which a
    flight is flown again, than one too few. Of what is handed in, a folder that is named counts with all that is in it.
    """
    found = {path: None}
    waiting = [path]
    while waiting and len(found) < _MOST:
        for one in _named_in(waiting.pop(), folder, is_handed_in):
            if one in found or one in others or (is_handed_in and is_child_script(one)):
                continue
            found[one] = None
            waiting.append(one)
    return list(found)


def _named_in(path: Path, folder: Path, is_handed_in: bool) -> Iterator[Path]:
    if path.suffix.lower() not in _NAMES_OTHERS:
        return
    is_script = path.suffix.lower() in _SCRIPTS
    words = _WORD.findall(_text(path))
    forms = {name for word in words for name in (word, word.replace(".", "/"), word.partition(".")[0])}
    names = {os.path.normpath(name) for name in forms if name.strip("./")}
    for place in {path.parent, folder}:
        beside = {entry.name for entry in os.scandir(place)}
        for name in names:
            if any(name.split("/", 1)[0] + ending in beside for ending in _ENDINGS):
                for ending in _ENDINGS if is_script else ("",):
                    yield from _inside(place / f"{name}{ending}", folder, is_handed_in)


def _inside(path: Path, folder: Path, is_handed_in: bool) -> Iterator[Path]:
    """Yield the file at a path, or all files if it is a folder, if it lies in `folder` and no link leads out of it."""
    try:
        real = path.resolve()
        if not real.is_relative_to(folder) or real == folder:
            return
        if is_handed_in and real.is_dir():
            files = list(_regular(real.rglob("*")))
            yield from () if any(map(is_child_script, files)) else files
        else:
            yield from _regular([real])
    except (OSError, ValueError, RuntimeError):  # a link in a circle; a name that is too long
        return


def _regular(paths: Iterable[Path]) -> Iterator[Path]:
    """Give those that are files which can be read, and no links."""
    for path in itertools.islice(paths, _MOST):
        if path.is_file() and not path.is_symlink() and os.access(path, os.R_OK):
            yield path


def is_child_script(path: Path) -> bool:
    """Tell whether a file has a function that a simulation calls. Raises Unreadable."""
    return path.suffix in _SCRIPTS and _CHILD_SCRIPT.search(_text(path)) is not None


def _text(path: Path) -> str:
    if path.stat().st_size > _READ_FOR_NAMES:
        return ""
    return read(path, _READ_FOR_NAMES).decode(errors="replace")
