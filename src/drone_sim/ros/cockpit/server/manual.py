"""The manual that `./dev.sh docs` builds, served below /manual/."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from drone_sim.files.resources import MEBIBYTE, package_path, read_bytes
from drone_sim.ros.cockpit.server.access_control import MANUAL, Content

_MAX_SIZE = 16 * MEBIBYTE  # bytes of a file
_NOT_BUILT = "The manual has not been built. In a checkout, `./dev.sh docs` builds it."


class Manual:
    """The manual's files by URL path. Thread-safe."""

    def __init__(self, folder: Path | None = None):
        """`folder` contains the files; None means the package's own manual."""
        self._folder = (folder or package_path() / "docs/html").resolve()

    def find(self, path: str) -> Content:
        """Return content type and content of a file; None if there is none with this path."""
        if not path.startswith(MANUAL):
            return None
        if not self._folder.is_dir():
            return "text/plain; charset=utf-8", _NOT_BUILT.encode()
        return find_below(self._folder, path.removeprefix(MANUAL))


def find_below(folder: Path, name: str) -> Content:
    """Return content type and content of the file `name` in a folder; None if there is none, or it is outside."""
    try:
        file = (folder / name).resolve()
        if not file.is_relative_to(folder.resolve()):
            return None
        kind = mimetypes.guess_type(file.name)[0] or "text/plain"
        return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind, read_bytes(file, _MAX_SIZE)
    except (OSError, ValueError):  # ValueError: a NUL in the name
        return None
