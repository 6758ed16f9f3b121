"""Unsaved changes of a scene, kept on the disk: the next node offers them."""

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
    """The file of the scene, '' where it has none, when the draft was written (s since 1970), and the scene's text."""

    file: str
    saved: float
    text: str


class Drafts:
    """One draft of this node, and that which an earlier one has left."""

    def __init__(self, folder: Path | None):
        """Keep them in a folder, or, for None, nowhere."""
        self._file = folder / "draft.yaml" if folder else None
        self._left = folder / "draft.left.yaml" if folder else None
        self._lock = threading.Lock()
        self._writing: threading.Thread | None = None
        self._number = 0  # of the last text that was to be written
        self._has_failed = False
        self.offered: Draft | None = None
        self.offer()

    def offer(self) -> None:
        """Offer the present draft: the scene that it is of is not open any more."""
        with self._lock, contextlib.suppress(OSError):
            if self._file and self._left:
                self._file.replace(self._left)
        self.offered = _read(self._left) if self._left else None

    def keep(self, file: str, text: str) -> None:
        """Write a draft, in a thread. If that fails, log a warning, unless the draft before failed, too.

        The cockpit shows a warning with the words "no effect" as a notice.
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
        """Wait until what was to be kept is on the disk."""
        if self._writing is not None:
            self._writing.join()

    def clear(self) -> None:
        """Have no draft: all is saved."""
        self._number += 1
        with self._lock, contextlib.suppress(OSError):
            if self._file:
                self._file.unlink(missing_ok=True)

    def take(self) -> Draft:
        """Return the offered draft, and offer it no longer. Raises ValueError where there is none."""
        if self.offered is None or self._left is None:
            raise ValueError("there is no draft of a scene")
        taken, self.offered = self.offered, None
        with contextlib.suppress(OSError):
            self._left.unlink(missing_ok=True)
        return taken


def _read(path: Path) -> Draft | None:
    try:
        saved, text = path.stat().st_mtime, read_bytes(path, MAX_SIZE).decode("utf-8")
    except (OSError, ValueError):
        return None
    head, _, text = text.partition("\n")
    file = head.removeprefix(_HEAD)
    return Draft("" if file == _NO_FILE else file, saved, text) if head.startswith(_HEAD) else None
