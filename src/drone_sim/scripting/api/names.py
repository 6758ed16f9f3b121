"""`sim`: objects by V-REP 3.x names and CoppeliaSim 4.x paths (object_paths.py).

    Quadricopter_base  Quadricopter_base#  Quadricopter_base#0     3.x; the suffix distinguishes copies of a model

A name without a suffix means the object in the script's own copy of the model, as in V-REP: in the script of Drone#0,
Quadricopter_base is Quadricopter_base#0. If there is no such object, it means an object of the scene, such as Floor,
but not one in the model that Drone#0 is a copy of. `name#` is always the object without a suffix.

Since CoppeliaSim 4.9, a script is an object of its own, a child of the model, so `..` is the model; before, a script
was part of its object, so `.` is the model. In the drone's script, both mean the drone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from drone_sim.mechanics.object_names import NO_SUFFIX, plain, split, suffixed
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.message_text import near_names
from drone_sim.scripting.api import object_paths
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS, bare
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.types import Handle, Name, numbers

_SELF = CONSTANTS["handle_self"]
_SUFFIXED = re.compile(r"(.+)#(\d*)", re.DOTALL)


class NameFunctions:
    """Objects by their names.

    A name without a suffix means the copy of the model that the script belongs to."""

    def __init__(self, host: Host):
        self._objects = host.context.objects
        self._host = host  # its object may be renamed
        self.suffix = split(host.own_script)[1]  # added to names without a suffix

    @sim("5")
    def getObject(self, path: Name, options: Mapping[str, Any] | None = None) -> int:
        """Return the handle of an object by path or name; -1 for none with the option noError, or name@silentError.

        If a path means several objects, the option `index` selects one, from 0; `proxy` is the object where relative
        paths begin, instead of the script's own. sim.handle_self is the object that the script is on.
        """
        if path == _SELF:
            return self._objects.handle(self._host.own_script)
        options = options or {}
        name, _, flag = path.partition("@") if isinstance(path, str) else (path, "", "")  # @alt (4.x) is not needed
        try:
            return self._find(name, int(options.get("index", 0)), options.get("proxy", WORLD))
        except ValueError:
            if options.get("noError") or flag == "silentError":
                return -1
            raise

    def _find(self, name: str, index: int, proxy: int) -> int:
        objects, own_name = self._objects, self._host.own_script
        if not (isinstance(name, str) and object_paths.is_path(name)):
            return find(objects, name, own_name, self.suffix)
        scripts = self._host.context.scripts
        own = objects[objects.handle(own_name)] if scripts.are_own else None
        is_embedded = own is not None and scripts.attached_to(own_name, self._host.script_type).is_embedded
        if proxy != WORLD:
            own, is_embedded = objects[proxy], True
        above = own.parent if own is not None and is_embedded else own
        found = object_paths.find(objects, name, own, above, max(0, index))
        if found is None:
            known = [*objects.names, *(objects.path(handle) for handle in objects)]
            shown = f"{name}' with the index {index}, from 0" if index > 0 else f"{name}'"
            raise ValueError(f"there is no object '{shown}; {near_names(name, known)}")
        return objects.handle_of(found)

    @sim("345")
    def getObjectHandle(self, path: Name, options: Mapping[str, Any] | None = None) -> int:
        """Return the handle of an object by name (3.x) or path."""
        return self.getObject(path, options)

    @sim("345")
    def getObjectName(self, handle: Handle) -> str:
        """Return the 3.x name of an object, with its suffix; with sim.handleflag_altname, the path (4.2)."""
        return self._objects.path(bare(handle)) if handle != bare(handle) else self._objects[handle].name

    @sim("5")
    def getObjectAlias(self, handle: Handle, options: int = -1) -> str:
        """Return the 4.x alias of an object.

        `options`: -1 the alias, 0 with its index ('propeller[1]'), 1, 2 and 5 the path from the root, 3 and 4 with its
        handle ('propeller__42__'; 3: if the alias is not unique).
        """
        alias = self._objects[handle].alias
        if options in (1, 2, 5):
            return self._objects.path(handle)
        if options == 0:
            last = self._objects.path(handle).rpartition("/")[2]
            return last if last.endswith("]") else f"{last}[0]"
        is_shared = sum(self._objects[one].alias == alias for one in self._objects) > 1
        return f"{alias}__{int(handle)}__" if options == 4 or (options == 3 and is_shared) else alias

    @sim("345")
    def getNameSuffix(self, name: Name | None = None) -> int | tuple[int, str]:
        """Return the suffix in a name such as 'Drone#0', -1 for none, and the name without it.

        Without a name, return the suffix of the script's own objects.
        """
        if name is None:
            return self.suffix
        bare, suffix = split(name)
        return suffix, bare.removesuffix("#")

    @sim("345")
    def setNameSuffix(self, suffix: int) -> None:
        """Set the suffix that is added to names without one, -1 for none."""
        self.suffix = max(NO_SUFFIX, int(numbers((suffix,), 1)[0]))

    def save_state(self) -> Restore:
        """Return a function that restores the suffix that setNameSuffix has set."""
        return saved(self, "suffix")


def find(objects: ObjectTree, name: str, own: str, suffix: int) -> int:
    """Return the handle that a name means in the script of the object `own`, with this suffix for names.

    Raises ValueError, which lists similar names.
    """
    if not isinstance(name, str):
        raise TypeError("a name must be a string")
    return objects.handle(_full_name(objects, name, own, suffix))


def _full_name(objects: ObjectTree, name: str, own: str, suffix: int) -> str:
    """Return the complete name that a name in a script means, whether the object exists or not."""
    match = _SUFFIXED.fullmatch(name)
    if match is None:
        full = suffixed(name, suffix)
        if full in objects:
            return full
        is_default = suffix == split(own)[1]  # not changed by setNameSuffix
        candidates = (suffixed(name, split(own_name)[1]) for own_name in _names(objects, own) if is_default)
        found = next((candidate for candidate in candidates if candidate in objects and candidate != name), None)
        if found or not _is_of_the_scene(objects, name, own):
            return found or full
        return name if name in objects else _only_copy(objects, name, own)
    # A script from a scene with several models uses suffixes for its own objects.
    is_complete = name in objects or (match.group(2) and objects.is_copied(match.group(1)))
    return name if is_complete else match.group(1)


def _names(objects: ObjectTree, own: str) -> tuple[str, ...]:
    """Return the names of a script's object; in an imported scene, its copy may have another suffix."""
    return objects[objects.handle(own)].names if own in objects else ()


def _is_of_the_scene(objects: ObjectTree, name: str, own: str) -> bool:
    """Return whether the object with a name is not in the original model of `own`."""
    original = plain(own)
    if name not in objects or original not in objects or not objects.is_copied(original):
        return True
    root = objects[objects.handle(original)]
    return not objects[objects.handle(name)].is_part_of(root.model() or root)


def _only_copy(objects: ObjectTree, name: str, own: str) -> str:
    """Return the object that a script named `own` means by `name`, if an import has renamed only that object's tree.

    An import adds a suffix to all names of a tree if one of them exists already (importing/scene_folder.py). Return the
    first name with a suffix that no copy of `own` has; if there is none, return `name`.
    """
    is_copied = objects.is_copied(name)
    suffixes = sorted(split(other)[1] for other in objects.names if plain(other) == name) if is_copied else []
    return next((suffixed(name, suffix) for suffix in suffixes if suffixed(own, suffix) not in objects), name)
