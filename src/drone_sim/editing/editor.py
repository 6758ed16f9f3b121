"""The scene editor: executes requests on the simulated scene; undo, redo, revisions, drafts."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypedDict

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked
from drone_sim.editing import records
from drone_sim.editing.changes import History, SceneChange, Step, apply_change, change_between
from drone_sim.editing.drafts import Drafts
from drone_sim.editing.edit_operations import EditOperations
from drone_sim.editing.scene_files import SceneFiles
from drone_sim.files.yaml_writing import YamlText
from drone_sim.run.pacing import Throttle
from drone_sim.run.player import Player
from drone_sim.run.scene_document import as_between
from drone_sim.scripting.errors import ScriptError

_LOG = logging.getLogger(__name__)
_DRAFT_PERIOD = 1.0  # s of real time


class OfferedDraft(TypedDict):
    """A draft as windows show it."""

    file: str  # of its scene; '' if it has none
    saved: float  # s since 1970


class EditorState(TypedDict):
    """The state of the editor for windows."""

    revision: int
    file: str  # of the scene; '' if it has none
    new: bool  # begun here, and without a file yet
    modified: bool
    read_only: bool
    state: str  # of the simulation
    undo: str  # the name of the step; '' if there is none
    redo: str
    draft: OfferedDraft | None


class SceneEditor:
    """The editor of one simulation for all requests of windows and scripts; call it only in the simulation's thread."""

    def __init__(self, player: Player, drafts: Path | None = None):
        """Edit the scene of `player`'s simulation; unsaved changes are kept as drafts in the folder `drafts`."""
        self._player = player
        self.simulation = player.simulation
        self.files = SceneFiles(self.simulation)
        self.history = History()
        self._drafts, self._last_draft = Drafts(drafts), (0, False)
        self._draft_throttle = Throttle(_DRAFT_PERIOD)
        self.revision = 0  # changes with every edit
        self._saved = 0  # the revision in the file
        self._saved_content = self.simulation.content()
        self._started = 0, False  # revision at the start of the run, and whether it was modified
        self._run = -1  # number of the run, -1 while stopped
        self._operations = EditOperations(self.simulation)
        self._scenes_read, self._is_opening = -1, False
        self._is_new = False  # begun here, and without a file yet
        self.follow()

    @property
    def is_modified(self) -> bool:
        return self.revision != self._saved

    @property
    def scene_file(self) -> str:
        """The file of the scene, '' if it has none."""
        return str(self.simulation.document.file or "")

    def described(self) -> EditorState:
        offered = self._drafts.offered
        return {
            "revision": self.revision,
            "file": self.scene_file,
            "new": self._is_new and not self.scene_file,
            "modified": self.is_modified,
            "read_only": self.files.is_read_only,
            "state": self._player.state,
            "undo": self.history.undo_name,
            "redo": self.history.redo_name,
            "draft": {"file": offered.file, "saved": offered.saved} if offered else None,
        }

    def follow(self) -> None:
        """Update the state after a start, a stop, or the loading of another scene."""
        simulation = self.simulation
        if simulation.scenes_read != self._scenes_read:
            self._scenes_read, self._is_new = simulation.scenes_read, False
            is_modified = self.is_modified if self._run == -1 else self._started[1]  # stop reverts the other edits
            if is_modified and not self._is_opening and simulation.replaced:  # loaded over unsaved changes
                document, content = simulation.replaced
                self._drafts.keep(str(document.file or ""), document.text(content))
                self._drafts.wait()
                self._drafts.offer()
            self._reset()
        run = simulation.run if simulation.running else -1
        if run == -1 and not self.is_modified and self.simulation.document.is_changed_on_disk:
            simulation.read_at_start()
        if run != self._run:
            if self._run != -1:
                # Stop has reverted the edits made since the start.
                before, was_modified = self._started
                self.history.stop()
                if self.revision != before:
                    self.revision += 1
                    self._saved = self._saved if was_modified else self.revision
            if run != -1:
                self.history.start()
                self._started = self.revision, self.is_modified
            self._run = run

    def _reset(self) -> None:
        self.history.clear()
        self.revision += 1
        self._saved, self._run = self.revision, -1  # stop does not revert edits of another scene
        self._saved_content = self.simulation.content()

    def answer(self, message: Any) -> dict[str, Any]:
        """Execute a request and return the answer. Raises ValueError and OSError; then nothing has changed."""
        self.follow()
        kind = records.request_of(message)
        request: Any = checked(kind, message)
        handlers: Mapping[type[Checked], Callable[[Any], dict[str, Any]]] = {
            records.Edit: self._edit,
            records.Undo: self._undo,
            records.Redo: lambda _: self._step(self.history.redone, self.history.undone, "redone"),
            records.Text: lambda _: self._text(),
            records.TextOf: lambda it: self._answer("text of objects", text=self._operations.text_of(it)),
            records.Write: self._write,
            records.New: lambda _: self._open(None),
            records.Open: lambda it: self._open(it.open),
            records.Save: self._save,
            records.SaveModel: self._save_model,
            records.Draft: lambda it: self._draft(it.draft),
        }
        return handlers[kind](request)

    # ---- edits

    def _edit(self, request: records.Edit) -> dict[str, Any]:
        name = request.name or _name(request.edit)
        return self._change(name, lambda: self._operations.do(request.edit), request.merge)

    def _change(self, name: str, change: Callable[[], list[int]], merge: str = "") -> dict[str, Any]:
        """Call `change` atomically and add it to the history; if it fails, the scene is restored."""
        before = self.simulation.content()
        try:
            handles = change()
        except Exception:  # any exception: restore the scene
            self._apply(change_between(self.simulation.content(), before))
            raise
        done = change_between(before, self.simulation.content())
        if not done.is_empty:
            self.history.add(Step(name, merge, done))
            self.revision += 1
        return self._answer(name, handles=[key for key in handles if key in self.simulation.tree.by_handle])

    def _apply(self, change: SceneChange) -> list[int]:
        """Apply a change; return the handles of its objects."""
        if not change.is_empty:
            apply_change(self.simulation, change)
        return [*change.entries]

    def _answer(self, message: str, **more: Any) -> dict[str, Any]:
        return {"revision": self.revision, "said": message, "until_stop": self.simulation.running, **more}

    def _undo(self, request: records.Undo) -> dict[str, Any]:
        """Undo the last step or, for a `merge` key, the step with this key; later edits of others are kept."""
        if not request.merge or self.history.is_last(request.merge):
            return self._step(self.history.undone, self.history.redone, "undone")
        step = self.history.of(request.merge)
        change, now = step.change.reversed, self.simulation.document.settings
        settings = now, as_between(now, *change.settings)
        return self._change(f"Revert: {step.name}", lambda: self._apply(change._replace(settings=settings)))

    def _step(self, step: Callable[[], Step], back: Callable[[], Step], word: str) -> dict[str, Any]:
        """Undo or redo a step; `back` restores the history if that fails."""
        entry = step()
        change = entry.change.reversed if word == "undone" else entry.change
        before = self.simulation.content()
        try:
            self._apply(change)
        except (ValueError, OSError, ScriptError) as error:
            self._apply(change_between(self.simulation.content(), before))
            back()
            raise ValueError(f"'{entry.name}' cannot be {word}: {error}") from None
        self.revision += 1
        is_saved = change_between(self._saved_content, self.simulation.content()).is_empty
        if is_saved and not self.simulation.running:
            self._saved = self.revision
        handles = [handle for handle in change.entries if handle in self.simulation.tree.by_handle]
        return self._answer(f"{word}: {entry.name}", handles=handles)

    # ---- texts and files

    def _text(self) -> dict[str, Any]:
        return self._answer("text", text=self.files.text(), file=self.scene_file)

    def _write(self, request: records.Write) -> dict[str, Any]:
        if request.revision not in (None, self.revision):
            raise ValueError(
                f"the scene has changed since this text was read (revision {self.revision}): read its text again"
            )
        return self._take_text(request.write)

    def _take_text(self, written: str) -> dict[str, Any]:
        text = YamlText(written)
        new_content = self.files.content_of(text)

        def change() -> list[int]:
            self._apply(change_between(self.simulation.content(), new_content))
            return []

        answer = self._change("Edit text", change)
        self.simulation.document.take_text(text, self.simulation.object_handles)
        return answer

    def _open(self, file: str | None) -> dict[str, Any]:
        try:
            self._player.stop()
        except ScriptError as error:  # in a script's cleanup; open the file nevertheless
            _LOG.error("%s", error)
        self._is_opening = True
        try:
            self.files.open(file)
            if file is None:
                self._reset()
            self.follow()
            self._is_new = file is None
        finally:
            self._is_opening = False
        return self._answer("new scene" if file is None else f"opened {file}", file=self.scene_file)

    def _save(self, request: records.Save) -> dict[str, Any]:
        path = self.files.save(None if request.save is True else str(request.save))
        if self.simulation.running:
            is_copy = path != self.simulation.document.file
            note = ". This is a copy: to save the scene itself, stop the simulation first" if is_copy else ""
            return self._answer(f"saved the scene as it is in flight to {path}{note}", file=str(path))
        self._saved, self._saved_content = self.revision, self.simulation.content()
        return self._answer(f"saved {path}", file=str(path))

    def _save_model(self, request: records.SaveModel) -> dict[str, Any]:
        path = self.files.save_model(self.simulation.tree.resolve(request.save_model), request.file)
        return self._answer(f"saved {path}", file=str(path))

    # ---- drafts

    def keep_draft(self) -> None:
        """Write a draft of unsaved changes, rate-limited; not during a run, since stop reverts its edits."""
        state = self.revision, self.is_modified
        if state == self._last_draft or self.simulation.running or not self._draft_throttle.passes():
            return
        self._last_draft = state
        if self.is_modified:
            self._drafts.keep(self.scene_file, self.files.text())
        else:
            self._drafts.clear()

    def _draft(self, word: str) -> dict[str, Any]:
        draft = self._drafts.take()
        if word == "drop":
            return self._answer("the draft was discarded")
        self._open(draft.file if draft.file and Path(draft.file).is_file() else None)
        self._take_text(draft.text)
        return self._answer("the draft was opened", file=self.scene_file)


def _name(operations: list[Any]) -> str:
    first = operations[0]
    label = str(first.do).replace("_", " ").capitalize()
    objects = getattr(first, "objects", None)
    if len(operations) > 1 or (isinstance(objects, list) and len(objects) > 1):
        return f"{label} {max(len(operations), len(objects or []))} objects"
    return label
