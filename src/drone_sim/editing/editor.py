"""The scene's editor: requests as records, carried out on the living scene; undo, redo, revisions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from drone_sim.config.errors import checked
from drone_sim.config.types import Checked
from drone_sim.editing import records, scripts
from drone_sim.editing.changes import SceneChange, carry_out, change_between
from drone_sim.editing.document import SceneDocument
from drone_sim.editing.history import History, Step
from drone_sim.editing.object_edits import ObjectEdits
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.editing.vehicle_edits import FLOOR, VehicleEdits
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix, Quaternion
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.mechanics.state import Pose
from drone_sim.run.player import Player

_SHORTEST = 0.1  # of a quaternion


class SceneEditor:
    """One for a simulation, whose thread calls all of this: what windows and scripts ask for, they ask of it."""

    def __init__(self, player: Player):
        """Edit the scene of the simulation that `player` plays."""
        self._player = player
        self.simulation = player.simulation
        self.scene = SceneAccess(self.simulation)
        self.document = SceneDocument(self.scene)
        self.history = History()
        self.revision = 0  # another number after every edit
        self._saved = 0  # the revision that is in the file
        self._started = 0, False  # the revision with which it runs, and whether that is not in the file
        self._run = -1  # whose edits stop takes back, -1 while it is stopped
        self._objects, self._vehicles = ObjectEdits(self.scene), VehicleEdits(self.scene)
        self._read = -1
        self.follow()

    @property
    def is_modified(self) -> bool:
        """Whether the file does not say what the scene is."""
        return self.revision != self._saved

    @property
    def scene_file(self) -> str:
        """The file of the scene, '' where it has none."""
        return str(self.document.file or "")

    def described(self) -> dict[str, Any]:
        """Return what a window shows of the scene as a whole."""
        return {
            "revision": self.revision,
            "file": self.scene_file,
            "modified": self.is_modified,
            "read_only": self.document.is_read_only,
            "state": self._player.state,
            "undo": self.history.undo_name,
            "redo": self.history.redo_name,
            "draft": None,
        }

    def follow(self) -> None:
        """Know what start, stop, and who has read another scene have done meanwhile."""
        simulation = self.simulation
        if simulation.scenes_read != self._read:
            self._read = simulation.scenes_read
            self.document.read()
            self._begin_anew()
        run = simulation.run if simulation.running else -1
        if run != self._run:
            if self._run != -1:
                self._stop()
            if run != -1:
                self.history.start()
                self._started = self.revision, self.is_modified
            self._run = run

    def _begin_anew(self) -> None:
        self.history.clear()
        self.revision += 1
        self._saved = self.revision

    def _stop(self) -> None:
        """What was edited since the start has been undone."""
        before, was_modified = self._started
        self.history.stop()
        if self.revision != before:
            self.revision += 1
            self._saved = self._saved if was_modified else self.revision

    def answer(self, said: Any) -> dict[str, Any]:
        """Do what a message asks for; return the answer. Raises ValueError and OSError, where nothing has changed."""
        self.follow()
        kind = records.request_of(said)
        request: Any = checked(kind, said)
        does: Mapping[type[Checked], Callable[[Any], dict[str, Any]]] = {
            records.Edit: self._edit,
            records.Undo: lambda _: self._go(self.history.undone, self.history.redone, "undone"),
            records.Redo: lambda _: self._go(self.history.redone, self.history.undone, "redone"),
            records.Text: lambda _: self._text(),
            records.Write: self._write,
            records.New: lambda _: self._open(None),
            records.Open: lambda one: self._open(one.open),
            records.Save: self._save,
            records.SaveModel: self._save_model,
            records.Draft: lambda one: self._draft(one.draft),
        }
        return does[kind](request)

    # ---- edits

    def _edit(self, request: records.Edit) -> dict[str, Any]:
        name = request.name or _name(request.edit)
        return self._change(name, lambda: [one for op in request.edit for one in self._do(op)], request.merge)

    def _change(self, name: str, change: Callable[[], list[int]], merge: str = "") -> dict[str, Any]:
        """Carry something out as a whole, or, where it fails, not at all."""
        before = self.scene.content()
        try:
            handles = change()
        except (ValueError, OSError):
            self._carry_out(change_between(self.scene.content(), before))
            raise
        done = change_between(before, self.scene.content())
        if not done.is_empty:
            self.history.add(Step(name, merge, done))
            self.revision += 1
        return self._answer(name, handles=[one for one in handles if self.scene.tree.get(one) is not None])

    def _carry_out(self, change: SceneChange) -> None:
        if not change.is_empty:
            carry_out(self.simulation, change, self.scene.arrange)

    def _answer(self, said: str, **more: Any) -> dict[str, Any]:
        return {"revision": self.revision, "said": said, "until_stop": self.simulation.running, **more}

    def _go(self, step: Callable[[], Step], back: Callable[[], Step], word: str) -> dict[str, Any]:
        """Undo or redo; `back` lets the history be as it was."""
        there = step()
        change = there.change.reversed if word == "undone" else there.change
        before = self.scene.content()
        try:
            self._carry_out(change)
        except ValueError as error:
            self._carry_out(change_between(self.scene.content(), before))
            back()
            raise ValueError(f"'{there.name}' cannot be {word}: {error}") from None
        self.revision += 1
        handles = [one for one in change.entries if self.scene.tree.get(one) is not None]
        return self._answer(f"{word}: {there.name}", handles=handles)

    def _do(self, op: Any) -> list[int]:
        """Carry out one operation; return the handles of what it has made or touched."""
        does: Mapping[type[Checked], Callable[[Any], list[int] | None]] = {
            records.Add: self._objects.add,
            records.AddModel: self._objects.add_model,
            records.AddVehicle: self._vehicles.add,
            records.Remove: self._remove,
            records.Move: self._move,
            records.Rename: self._rename,
            records.Reparent: self._reparent,
            records.Set: self._set,
            records.Scale: lambda one: self._objects.scale(self._handles(one.objects), one.factors),
            records.Copy: self._objects.copy,
            records.Group: lambda one: self._objects.group(self._handles(one.objects), one.name, one.as_),
            records.Ungroup: lambda one: self._objects.ungroup(self.scene.handle(one.object)),
            records.AttachScript: self._attach_script,
            records.DetachScript: lambda one: scripts.detach(self.scene, self.scene.handle(one.object)),
        }
        touched = [self.scene.handle(op.object)] if hasattr(op, "object") else self._touched(op)
        made = does[type(op)](op)
        return touched if made is None else made

    def _touched(self, op: Any) -> list[int]:
        return self._handles(op.objects) if isinstance(op, (records.Scale, records.Reparent)) else []

    def _handles(self, objects: list[Any]) -> list[int]:
        return [self.scene.handle(one) for one in objects]

    def _is_of_scene(self, handle: int) -> bool:
        return self.scene.vehicle_of(handle) is None and self.scene.tree[handle].name != FLOOR

    def _remove(self, op: records.Remove) -> list[int]:
        handles = self._handles(op.objects)
        own = [one for one in handles if self._is_of_scene(one)]
        if own:
            self._objects.remove(own, op.below)
        for one in handles:
            if one not in own:
                self._vehicles.remove(one)
        return []

    def _move(self, op: records.Move) -> None:
        tree, handle = self.scene.tree, self.scene.handle(op.object)
        words = {"world": WORLD, "parent": PARENT}
        known = isinstance(op.relative_to, str) and op.relative_to in words
        frame = words[str(op.relative_to)] if known else self.scene.handle(op.relative_to)
        matrix = _placed(op, tree.matrix(handle, frame))
        if self._is_of_scene(handle):
            self._objects.put(handle, frame, matrix)
        else:
            self._vehicles.move(handle, frame, matrix)

    def _rename(self, op: records.Rename) -> list[int]:
        handle = self.scene.handle(op.object)
        of_scene = self._is_of_scene(handle)
        return self._objects.rename(handle, op.name) if of_scene else self._vehicles.rename(handle, op.name)

    def _reparent(self, op: records.Reparent) -> None:
        parent = WORLD if op.parent == WORLD else self.scene.handle(op.parent)
        for one in self._handles(op.objects):
            edits = self._objects if self._is_of_scene(one) else self._vehicles
            edits.reparent(one, parent, op.keep)

    def _set(self, op: records.Set) -> None:
        handle = self.scene.handle(op.object)
        (self._objects if self._is_of_scene(handle) else self._vehicles).set(handle, op.values)

    def _attach_script(self, op: records.AttachScript) -> None:
        handle = self.scene.handle(op.object)
        if self.scene.is_root(handle):
            if not op.script:
                raise ValueError("a vehicle's script is its key `script`: attach_script needs the file")
            self._vehicles.set(handle, {"script": op.script})
        else:
            scripts.attach(self.scene, handle, op.script, op.language, op.parameters)

    # ---- texts and files

    def _text(self) -> dict[str, Any]:
        return self._answer("text", text=self.document.text(), file=self.scene_file)

    def _write(self, request: records.Write) -> dict[str, Any]:
        if request.revision not in (None, self.revision):
            raise ValueError(f"the scene has changed meanwhile (revision {self.revision}): look at its text again")
        before = self.document.base
        wanted = self.document.content_of(request.write)

        def change() -> list[int]:
            self._carry_out(change_between(self.scene.content(), wanted))
            return []

        answer = self._change("Edit text", change)
        if self.document.base == before:
            self.document.base = request.write
        return answer

    def _open(self, file: str | None) -> dict[str, Any]:
        self._player.stop()
        self.document.open(file)
        if file is None:
            self._begin_anew()
        self.follow()
        return self._answer("new scene" if file is None else f"opened {file}", file=self.scene_file)

    def _save(self, request: records.Save) -> dict[str, Any]:
        path = self.document.save(None if request.save is True else str(request.save))
        self._saved = self.revision
        return self._answer(f"saved {path}", file=str(path))

    def _save_model(self, request: records.SaveModel) -> dict[str, Any]:
        path = self.document.save_model(self.scene.handle(request.save_model), request.file)
        return self._answer(f"saved {path}", file=str(path))

    def _draft(self, word: str) -> dict[str, Any]:
        raise ValueError("there is no draft")


def _unit(quaternion: Quaternion) -> Quaternion:
    length = math.hypot(*quaternion)
    if length < _SHORTEST:
        raise ValueError(f"quaternion: has the length {length:g}: must be about 1")
    x, y, z, w = (one / length for one in quaternion)
    return x, y, z, w


def _placed(op: records.Move, now: Matrix) -> Matrix:
    position = frames.position(now) if op.position is None else op.position
    if op.quaternion is not None:
        return Pose(position, _unit(op.quaternion)).matrix
    rpy = frames.to_rpy(now) if op.rpy is None else op.rpy
    turned = frames.from_rpy(position, rpy)
    if op.rpy is None:  # as it is, to the last bit
        x, y, z = position
        m0, m1, m2, _, m4, m5, m6, _, m8, m9, m10, _ = now
        turned = (m0, m1, m2, x, m4, m5, m6, y, m8, m9, m10, z)
    return turned


def _name(operations: list[Any]) -> str:
    first = operations[0]
    word = str(first.do).replace("_", " ").capitalize()
    objects = getattr(first, "objects", None)
    if len(operations) > 1 or (isinstance(objects, list) and len(objects) > 1):
        return f"{word} {max(len(operations), len(objects or []))} objects"
    return word
