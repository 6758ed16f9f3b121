"""The history of edits, for undo and redo."""

from __future__ import annotations

from typing import NamedTuple

from drone_sim.editing.changes import SceneChange

MOST = 100  # steps of undo


class Step(NamedTuple):
    """One step of undo: its name, the `merge` key that its edits share, and the change."""

    name: str
    merge: str
    change: SceneChange


class History:
    """The steps that can be undone and redone."""

    def __init__(self) -> None:
        self._done: list[Step] = []
        self._undone: list[Step] = []
        self._at_start: tuple[list[Step], list[Step]] | None = None  # both lists at the start of the simulation

    @property
    def undo_name(self) -> str:
        """The name of the next step to undo, '' if there is none."""
        return self._done[-1].name if self._done else ""

    @property
    def redo_name(self) -> str:
        """The name of the next step to redo, '' if there is none."""
        return self._undone[-1].name if self._undone else ""

    def is_last(self, merge: str) -> bool:
        """Return whether the last step has this `merge` key."""
        return bool(self._done) and self._done[-1].merge == merge

    def of(self, merge: str) -> Step:
        """Return the newest step with this `merge` key. Raises ValueError if there is none."""
        for step in reversed(self._done):
            if step.merge == merge:
                return step
        raise ValueError("there is nothing to undo")

    def add(self, step: Step) -> None:
        """Add a step and clear the steps to redo; steps with the same `merge` key in a row become one."""
        self._undone.clear()
        last = self._done[-1] if self._done else None
        if last is not None and step.merge and last.merge == step.merge:
            self._done[-1] = last._replace(change=last.change.followed_by(step.change))
            if self._done[-1].change.is_empty:
                self._done.pop()
            return
        self._done = [*self._done, step][-MOST:]

    def undone(self) -> Step:
        """Return the step to undo, and move it to those to redo. Raises ValueError if there is none."""
        if not self._done:
            raise ValueError("there is nothing to undo")
        self._undone.append(self._done.pop())
        return self._undone[-1]

    def redone(self) -> Step:
        """Return the step to redo, and move it to those to undo. Raises ValueError if there is none."""
        if not self._undone:
            raise ValueError("there is nothing to redo")
        self._done.append(self._undone.pop()._replace(merge=""))
        return self._done[-1]

    def clear(self) -> None:
        """Clear the history, for another scene."""
        self._done, self._undone, self._at_start = [], [], None

    def start(self) -> None:
        """Begin a run: stop() drops the steps made after this."""
        self._at_start = [*self._done], [*self._undone]

    def stop(self) -> None:
        """End a run: restore the history to that at the start."""
        if self._at_start is not None:
            self._done, self._undone = self._at_start
            self._at_start = None
