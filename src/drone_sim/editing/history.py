"""Undo and redo."""

from __future__ import annotations

from typing import NamedTuple

from drone_sim.editing.changes import SceneChange

MOST = 100  # steps back


class Step(NamedTuple):
    """What one step of undo takes back: its name, the edits that belong together, and what has changed."""

    name: str
    merge: str
    change: SceneChange


class History:
    """What was done, and what was undone of it."""

    def __init__(self) -> None:
        """Begin with nothing done."""
        self._done: list[Step] = []
        self._undone: list[Step] = []
        self._kept: tuple[list[Step], list[Step]] | None = None  # as they were when the simulation started

    @property
    def undo_name(self) -> str:
        """The name of what would be undone, '' for nothing."""
        return self._done[-1].name if self._done else ""

    @property
    def redo_name(self) -> str:
        """The name of what would be done again, '' for nothing."""
        return self._undone[-1].name if self._undone else ""

    def is_last(self, merge: str) -> bool:
        """Tell whether the last step is that of some edits that belong together."""
        return bool(self._done) and self._done[-1].merge == merge

    def of(self, merge: str) -> Step:
        """Return the step of some edits that belong together. Raises ValueError where there is none."""
        for step in reversed(self._done):
            if step.merge == merge:
                return step
        raise ValueError("there is nothing to undo")

    def add(self, step: Step) -> None:
        """Take an edit that was done; what was undone before is gone."""
        self._undone.clear()
        last = self._done[-1] if self._done else None
        if last is not None and step.merge and last.merge == step.merge:
            self._done[-1] = last._replace(change=last.change.followed_by(step.change))
            if self._done[-1].change.is_empty:
                self._done.pop()
            return
        self._done = [*self._done, step][-MOST:]

    def undone(self) -> Step:
        """Return what is to be undone, which can be done again then. Raises ValueError where there is nothing."""
        if not self._done:
            raise ValueError("there is nothing to undo")
        self._undone.append(self._done.pop())
        return self._undone[-1]

    def redone(self) -> Step:
        """Return what is to be done again. Raises ValueError where there is nothing."""
        if not self._undone:
            raise ValueError("there is nothing to redo")
        self._done.append(self._undone.pop()._replace(merge=""))
        return self._done[-1]

    def clear(self) -> None:
        """Forget everything: it is of another scene."""
        self._done, self._undone, self._kept = [], [], None

    def start(self) -> None:
        """Know that stop takes back what comes from now on."""
        self._kept = [*self._done], [*self._undone]

    def stop(self) -> None:
        """Know that what came since the start has been taken back."""
        if self._kept is not None:
            self._done, self._undone = self._kept
            self._kept = None
