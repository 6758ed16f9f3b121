"""The files that a flight depends on: it is flown again when one of them changes, and the sandbox shows only them."""

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

MAX_SIZE = 64 * 2**20  # bytes, of all files of a script together
_MAX_FILES = 1000
_MAX_TEXT = 2**20  # bytes; larger files are not searched for names of files
_WORD = re.compile(r"[\w./-]{1,200}")
_PACKAGE_URL = re.compile(r"package://[\w./-]{1,200}")
_SCRIPT_SUFFIXES = (".py", ".lua")
_TEXT_SUFFIXES = (*_SCRIPT_SUFFIXES, ".yaml", ".yml", ".urdf", ".dae", ".obj", ".mtl")
_ENDINGS = ("", ".py", ".lua", "/__init__.py", "/init.lua")  # of the names in `import` and `require`
_CHILD_SCRIPT = re.compile(r"^(?:(?:async[ \t]+)?def|function)[ \t]+sysCall_|^sysCall_\w+[ \t]*=", re.MULTILINE)


class Unreadable(ValueError):
    """A script, or a file that it names, cannot be read, or must not be; one line says why."""


def of_plan(plan: Plan, changes: Mapping[str, Any]) -> list[Path]:
    """Return the plan's file, its scene and config, and the files that these and `changes` name, sorted.

    All are regular files; the plan's own script is not among them. Names are followed inside the folder of each file
    that the plan names. Raises FileNotFoundError and ParameterError.
    """
    excluded, cache = _plan_script(plan), cache_folder().resolve()
    found: dict[Path, None] = {}
    for path in dict.fromkeys(path.resolve() for path in (*plan.files, *_parameter_files(plan, changes))):
        if path in excluded:
            continue
        if path.is_relative_to(cache) and path.parent != cache:  # of an imported scene
            files = list(_regular_files((cache / path.relative_to(cache).parts[0]).rglob("*")))
        else:
            files = _follow(path, path.parent, excluded)
        for file in files:
            found[file] = None
            found.update(dict.fromkeys(_package_files(file)))
    return sorted(found)


def of_script(plan: Plan, script: str) -> list[Path]:
    """Return a script's file and, recursively, the files inside its folder that it names; [] for a built-in script.

    Other child scripts are left out even if they are named: they belong to somebody else, or to the plan. Unreadable
    files are left out, too, and the largest files if all together have more than MAX_SIZE bytes, because any word may
    happen to be a file's name, and one student's files must not spoil another's flight.
    """
    path = Path(script_path(script)).resolve()
    if path.parent == BUILT_IN:
        return []
    named = _follow(path, path.parent, _plan_script(plan), is_submission=True)[1:]
    kept, size = [path], 0
    for file in sorted(named, key=lambda file: (file.stat().st_size, file)):
        size += file.stat().st_size
        if size > MAX_SIZE:
            break
        kept.append(file)
    return kept


def read(path: Path, limit: int = MAX_SIZE) -> bytes:
    """Return a file's content. Raises Unreadable if the file cannot be read, is not a regular file or is too large."""
    try:
        return read_bytes(path, limit)
    except (OSError, ValueError) as error:
        raise Unreadable(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def submission_path(name: str) -> str:
    """Return the path of a submitted script, or the unchanged name of a built-in one.

    Raises ScriptError for a script that does not exist, and Unreadable if it is not a regular file, or is a link that
    leads out of its folder.
    """
    path = Path(os.path.abspath(name))
    try:
        found = script_path(name)
    except ScriptError:
        if Path(name).suffix in _SCRIPT_SUFFIXES and os.path.lexists(path):
            raise Unreadable(f"{path}: is not a regular file, nor a link to one") from None
        raise
    if path.is_symlink() and not Path(found).is_relative_to(path.parent.resolve()):
        raise Unreadable(f"{path}: is a link that leads out of its folder")
    return found if Path(name).suffix else name


def _plan_script(plan: Plan) -> set[Path]:
    """Return the plan's own script: it may be a solution, which submissions must not see."""
    return {locate(plan.script_of(None)).resolve()} if plan.script and Path(plan.script).suffix else set()


def _parameter_files(plan: Plan, changes: Mapping[str, Any]) -> Iterator[Path]:
    """Yield the files among the values of a plan's parameters: meshes, textures, scripts of the scene."""
    changes = changes if any(True for _ in _texts(changes)) else {}  # changes of numbers name no files
    parameters = plan.parameters(changes=changes)
    for text in {*_texts({**vars(parameters), "script": ""}), *_texts(changes)}:
        if "/" in text or "." in text:
            try:
                yield resolve(text)
            except FileNotFoundError:
                continue


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _texts(item)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _texts(item)
    elif hasattr(value, "__dict__"):
        yield from _texts(vars(value))


def _package_files(path: Path) -> Iterator[Path]:
    """Yield the files of ROS packages that a text names, and the package.xml by which each package is found."""
    if path.suffix.lower() not in (".urdf", ".yaml", ".yml"):
        return
    for name in set(_PACKAGE_URL.findall(_read_text(path))):
        package = "/".join(name.split("/", 3)[:3])
        for url in (name, f"{package}/package.xml"):
            try:
                yield resolve(url)
            except FileNotFoundError:
                continue


def _follow(path: Path, folder: Path, excluded: set[Path], is_submission: bool = False) -> list[Path]:
    """Return a file and, recursively, the files inside a folder that it names, without those in `excluded`.

    Every word of a text counts as a name if there is such a file: a file too many only causes another flight, but a
    file too few would give a wrong result. In a submission, the name of a folder stands for all files in it.
    """
    found = {path: None}
    pending = [path]
    while pending and len(found) < _MAX_FILES:
        for file in _named_files(pending.pop(), folder, is_submission):
            if file in found or file in excluded or (is_submission and is_child_script(file)):
                continue
            found[file] = None
            pending.append(file)
    return list(found)


def _named_files(path: Path, folder: Path, is_submission: bool) -> Iterator[Path]:
    if path.suffix.lower() not in _TEXT_SUFFIXES:
        return
    is_script = path.suffix.lower() in _SCRIPT_SUFFIXES
    words = _WORD.findall(_read_text(path))
    forms = {name for word in words for name in (word, word.replace(".", "/"), word.partition(".")[0])}
    names = {os.path.normpath(name) for name in forms if name.strip("./")}
    for place in {path.parent, folder}:
        beside = {entry.name for entry in os.scandir(place)}
        for name in names:
            if any(name.split("/", 1)[0] + ending in beside for ending in _ENDINGS):
                for ending in _ENDINGS if is_script else ("",):
                    yield from _files_at(place / f"{name}{ending}", folder, is_submission)


def _files_at(path: Path, folder: Path, is_submission: bool) -> Iterator[Path]:
    """Yield the file at a path, or all files of a folder in a submission, if no link leads out of `folder`."""
    try:
        real = path.resolve()
        if not real.is_relative_to(folder) or real == folder:
            return
        if is_submission and real.is_dir():
            files = list(_regular_files(real.rglob("*")))
            yield from () if any(map(is_child_script, files)) else files
        else:
            yield from _regular_files([real])
    except (OSError, ValueError, RuntimeError):  # circular links; too long names
        return


def _regular_files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the readable regular files among some paths, without links."""
    for path in itertools.islice(paths, _MAX_FILES):
        if path.is_file() and not path.is_symlink() and os.access(path, os.R_OK):
            yield path


def is_child_script(path: Path) -> bool:
    """Return whether a file defines a function that a simulation calls. Raises Unreadable."""
    return path.suffix in _SCRIPT_SUFFIXES and _CHILD_SCRIPT.search(_read_text(path)) is not None


def _read_text(path: Path) -> str:
    if path.stat().st_size > _MAX_TEXT:
        return ""
    return read(path, _MAX_TEXT).decode(errors="replace")
