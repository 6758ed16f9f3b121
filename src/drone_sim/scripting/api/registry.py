"""Scripts of a simulation, by handle and by the object that each is attached to.

A propeller with the built-in thrust model also has an entry, in place of V-REP's script: it has parameters, but no
functions.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from drone_sim.message_text import near_names
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.script import Script

ScriptParameters = dict[str, Any]  # read by getScriptSimulationParameter

CHILD, CUSTOMIZATION = (CONSTANTS[f"scripttype_{kind}script"] for kind in ("child", "customization"))
FIRST = 500_000  # the first handle, which is larger than those of objects
DEEPEST = 8  # nested calls between scripts


class Attachment:
    """The script of an object; `script` is set while it is loaded."""

    def __init__(self, handle: int, name: str, parameters: ScriptParameters, is_law: bool, kind: int = CHILD):
        """`name` is the object's name; `parameters` is not copied. `kind`: CHILD or CUSTOMIZATION.

        `is_law`: it represents a built-in thrust model, which reads only these parameters.
        """
        self.handle = handle
        self.name = name
        self.kind = kind
        self.parameters = parameters
        self.read: frozenset[str] = frozenset(parameters)
        self.asked: set[str] = set()  # names of parameters that scripts have read
        self.is_law = is_law
        self.is_embedded = False  # whether `..` in its paths means the parent of its object, as up to CoppeliaSim 4.8
        self.began = 0.0  # simulated time (s) when it was loaded
        self.script: Script | None = None

    def loaded(self, script: Script, time: float) -> None:
        """Set the loaded script, and the simulated time (s)."""
        self.script, self.began = script, time


PermitCall = Callable[[Attachment, Attachment, str], None]


def _all_permitted(_caller: Attachment, _callee: Attachment, _function: str) -> None:
    pass


class Scripts:
    """Attachments by handle, which is unique in a run, and by object.

    `are_own`: whether the caller is one of these scripts; a remote client is not, and has no object for relative paths.
    """

    are_own = True

    def __init__(self) -> None:
        # Raises ValueError if a script (the first argument) may not call a function of another; '' means executing a
        # text.
        self.permit: PermitCall = _all_permitted
        self.clear()

    def clear(self) -> None:
        """Remove all; handles start again."""
        self.by_handle: dict[int, Attachment] = {}
        self._by_name: dict[tuple[str, int], Attachment] = {}
        self._numbers = itertools.count(FIRST)
        self.asked = 0  # number of parameters that scripts have read
        self._waiting: list[Attachment] = []  # callers in the present nested calls

    def add(self, name: str, parameters: ScriptParameters, *, is_law: bool = False, kind: int = CHILD) -> Attachment:
        """Attach a script to an object; it replaces a built-in thrust model there. Return its attachment."""
        existing = self._by_name.get((name, kind))
        handle = next(self._numbers) if existing is None else existing.handle
        attachment = Attachment(handle, name, parameters, is_law, kind)
        self.by_handle[handle] = self._by_name[name, kind] = attachment
        return attachment

    def remove(self, name: str, kind: int = CHILD) -> None:
        """Remove the script of an object, if there is one."""
        removed = self._by_name.pop((name, kind), None)
        if removed is not None:
            del self.by_handle[removed.handle]

    def rename(self, name: str, new: str, kind: int = CHILD) -> None:
        renamed = self._by_name[new, kind] = self._by_name.pop((name, kind))
        renamed.name = new

    def __iter__(self) -> Iterator[Attachment]:
        """Return an iterator in the order of handles."""
        return iter(self.by_handle.values())

    def __contains__(self, name: str) -> bool:
        """Return whether a child script is attached to an object."""
        return (name, CHILD) in self._by_name

    def __getitem__(self, handle: int) -> Attachment:
        """Return the script with a handle. Raises ValueError for an unknown handle."""
        if handle not in self.by_handle:
            raise ValueError(f"there is no script with the handle {handle}")
        return self.by_handle[handle]

    def find(self, name: str, kind: int = CHILD) -> Attachment | None:
        """Return the script of an object, None if there is none."""
        return self._by_name.get((name, kind))

    def attached_to(self, name: str, kind: int = CHILD) -> Attachment:
        """Return the script of an object. Raises ValueError, which lists similar names."""
        if (name, kind) not in self._by_name:
            known = [other for other, of_kind in self._by_name if of_kind == kind]
            what = "customization script" if kind == CUSTOMIZATION else "script"
            raise ValueError(f"no {what} is attached to '{name}'; {near_names(name, known)}")
        return self._by_name[name, kind]

    def law_parameters(self) -> Mapping[str, Any]:
        """Return the parameters that built-in thrust models read, by name."""
        return {name: None for attachment in self if attachment.is_law for name in attachment.read}

    def ask(self, attachment: Attachment, name: str) -> None:
        """Record that a script reads a parameter; only such parameters are offered for tuning."""
        if name not in attachment.asked:
            attachment.asked.add(name)
            self.asked += 1

    def is_own(self, caller: Attachment, callee: Attachment) -> bool:
        """Return whether a script calls itself."""
        return caller is callee

    def call(self, caller: Attachment, callee: Attachment, call: Callable[[Script], Any]) -> Any:
        """Let a script call another, or itself.

        Raises ValueError if it is not loaded, waits itself, or is nested too deeply.
        """
        if callee.script is None:
            why = (
                "is the built-in thrust model, which has no functions"
                if callee.is_law
                else "is not loaded yet: it is loaded after this one"
            )
            raise ValueError(f"the script of '{callee.name}' {why}")
        if callee is not caller and callee in self._waiting:
            raise ValueError(
                f"the script of '{callee.name}' is already waiting for this call to end, so it cannot be called back"
            )
        if len(self._waiting) >= DEEPEST:
            raise ValueError(f"scripts call each other more than {DEEPEST} levels deep")
        self._waiting.append(caller)
        try:
            return call(callee.script)
        finally:
            self._waiting.pop()
