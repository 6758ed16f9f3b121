"""Drafts: unsaved changes of a scene, kept on the disk and offered by the next node."""

from __future__ import annotations

import contextlib
import logging
import threading
from pathlib import Path
from typing import NamedTuple

from drone_sim.files import writing
from drone_sim.files.resources import read_bytes
from drone_sim.files.yaml_files import MAX_SIZE

_LOG = logging.getLogger(__name__)
_HEAD = "# A draft of "
_NO_FILE = "a new scene"


class Draft(NamedTuple):
    """A draft: the scene's file ('' if none), the time of writing (s since 1970), and the scene's text."""

    file: str
    saved: float
    text: str


class Drafts:
    """The draft of this node, and the draft that an earlier node left."""

    def __init__(self, folder: Path | None):
        """Keep drafts in a folder; None: do not keep them."""
        self._file = folder / "draft.yaml" if folder else None
        self._left_file = folder / "draft.left.yaml" if folder else None
        self._lock = threading.Lock()
        self._writing: threading.Thread | None = None
        self._number = 0  # of the last text requested to be written
        self._has_failed = False
        self.offered: Draft | None = None
        self.offer()

    def offer(self) -> None:
        """Offer the present draft, whose scene is no longer open."""
        with self._lock, contextlib.suppress(OSError):
            if self._file and self._left_file:
                self._file.replace(self._left_file)
        self.offered = _read(self._left_file) if self._left_file else None

    def keep(self, file: str, text: str) -> None:
        """Write a draft, in a thread. If that fails, log a warning, unless the preceding draft failed, too.

        The cockpit shows a warning that contains "no effect" as a notice.
        """
        path = self._file
        if path is None:
            return
        self._number += 1
        number = self._number

        def write() -> None:
            with self._lock:
                if number != self._number:  # a later draft replaces this one
                    return
                try:
                    path.parent.mkdir(parents=True, exist_ok=True)
                    writing.write(path, f"{_HEAD}{file or _NO_FILE}\n{text}")
                    self._has_failed = False
                except OSError as error:
                    if not self._has_failed:
                        _LOG.warning("draft of unsaved changes: no effect: %s; save the scene", error)
                    self._has_failed = True

        self._writing = threading.Thread(target=write, name="draft")
        self._writing.start()

    def wait(self) -> None:
        if self._writing is not None:
            self._writing.join()

    def clear(self) -> None:
        """Delete the draft: everything is saved."""
        self._number += 1
        with self._lock, contextlib.suppress(OSError):
            if self._file:
                self._file.unlink(missing_ok=True)

    def take(self) -> Draft:
        """Return the offered draft and stop offering it. Raises ValueError if there is none."""
        if self.offered is None or self._left_file is None:
            raise ValueError("there is no draft of a scene")
        draft, self.offered = self.offered, None
        with contextlib.suppress(OSError):
            self._left_file.unlink(missing_ok=True)
        return draft


def _read(path: Path) -> Draft | None:
    try:
        saved, text = path.stat().st_mtime, read_bytes(path, MAX_SIZE).decode("utf-8")
    except (OSError, ValueError):
        return None
    head, _, text = text.partition("\n")
    file = head.removeprefix(_HEAD)
    return Draft("" if file == _NO_FILE else file, saved, text) if head.startswith(_HEAD) else None
