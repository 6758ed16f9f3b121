"""The scripts of a simulation, by handle and by the object that each is attached to.

A propeller with the built-in law has one, too, instead of V-REP's script: it has parameters, but no functions to call.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from drone_sim.message_text import near_names
from drone_sim.scripting.api.script import Script

ScriptParameters = dict[str, Any]  # what getScriptSimulationParameter reads

FIRST = 500_000  # the first handle: no object has one that large
DEEPEST = 8  # scripts that wait for each other


class Attachment:
    """A script on an object; `script` is set while it is loaded."""

    def __init__(self, handle: int, name: str, parameters: ScriptParameters, is_law: bool):
        """Take its handle, the name of its object, and its parameters, which stay the same mapping.

        `is_law`: it stands for a built-in law, which reads these parameters and no others.
        """
        self.handle = handle
        self.name = name
        self.parameters = parameters
        self.read: frozenset[str] = frozenset(parameters)
        self.asked: set[str] = set()  # names that scripts have asked for since it was attached
        self.is_law = is_law
        self.is_embedded = False  # whether `..` in its paths is the parent of its object, as up to CoppeliaSim 4.8
        self.began = 0.0  # s, simulated, when it was loaded
        self.script: Script | None = None

    def loaded(self, script: Script, time: float) -> None:
        """Take the script, which begins at a simulated time (s)."""
        self.script, self.began = script, time


PermitCall = Callable[[Attachment, Attachment, str], None]


def _all_permitted(_caller: Attachment, _callee: Attachment, _function: str) -> None:
    pass


class Scripts:
    """Attachments by handle (a number that nothing else of the run has had) and by object.

    `are_own`: whether the caller is one of them; a client outside is not, and its paths begin at no object.
    """

    are_own = True

    def __init__(self) -> None:
        """Start with none."""
        # Raises ValueError if a script (the first) may not call a function of another; '' stands for running a text.
        self.permit: PermitCall = _all_permitted
        self.clear()

    def clear(self) -> None:
        """Forget all; handles are given out anew."""
        self._by_handle: dict[int, Attachment] = {}
        self._by_name: dict[str, Attachment] = {}
        self._numbers = itertools.count(FIRST)
        self.asked = 0  # parameters that somebody has asked for
        self._waiting: list[Attachment] = []  # callers, and what they called

    def add(self, name: str, parameters: ScriptParameters, *, is_law: bool = False) -> Attachment:
        """Attach a script to an object, in the place of a law; return what stands for it."""
        before = self._by_name.get(name)
        handle = next(self._numbers) if before is None else before.handle
        made = Attachment(handle, name, parameters, is_law)
        self._by_handle[handle] = self._by_name[name] = made
        return made

    def remove(self, name: str) -> None:
        """Forget the script of an object, if there is one."""
        gone = self._by_name.pop(name, None)
        if gone is not None:
            del self._by_handle[gone.handle]

    def rename(self, name: str, new: str) -> None:
        """Know the script of an object by the object's new name."""
        renamed = self._by_name[new] = self._by_name.pop(name)
        renamed.name = new

    def __iter__(self) -> Iterator[Attachment]:
        """Yield all, in the order of their handles."""
        return iter(self._by_handle.values())

    def __contains__(self, name: str) -> bool:
        """Tell whether a script is attached to an object."""
        return name in self._by_name

    def get(self, handle: int) -> Attachment | None:
        """Return what has a handle, None for nothing."""
        return self._by_handle.get(handle)

    def __getitem__(self, handle: int) -> Attachment:
        """Return what has a handle; raises ValueError."""
        if handle not in self._by_handle:
            raise ValueError(f"there is no script with the handle {handle}")
        return self._by_handle[handle]

    def attached_to(self, name: str) -> Attachment:
        """Return the script of an object; raises ValueError that lists the near names."""
        if name not in self._by_name:
            raise ValueError(f"no script is attached to '{name}'; {near_names(name, self._by_name)}")
        return self._by_name[name]

    def law_parameters(self) -> Mapping[str, Any]:
        """Return the parameters that built-in laws read, by name."""
        return {name: None for one in self if one.is_law for name in one.read}

    def ask(self, attachment: Attachment, name: str) -> None:
        """Note that a script reads a parameter: parameters that no script reads need not be offered for tuning."""
        if name not in attachment.asked:
            attachment.asked.add(name)
            self.asked += 1

    def is_own(self, caller: Attachment, callee: Attachment) -> bool:
        """Tell whether a script calls itself."""
        return caller is callee

    def call(self, caller: Attachment, callee: Attachment, call: Callable[[Script], Any]) -> Any:
        """Let a script call another, or itself. Raises ValueError for one that waits for this call, or is too deep."""
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
