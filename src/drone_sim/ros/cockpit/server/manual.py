"""The manual that `./dev.sh docs` has built: the files of one folder, below /manual/."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from drone_sim.files.resources import MEBIBYTE, package_path, read_bytes
from drone_sim.ros.cockpit.server.access_control import MANUAL, Content

_LARGEST = 16 * MEBIBYTE  # bytes of a file
_NOT_BUILT = "The manual has not been built. In a checkout, `./dev.sh docs` builds it."


class Manual:
    """Finds its files by the path that is asked for; any thread may call."""

    def __init__(self, folder: Path | None = None):
        """Read from `folder`; None is where this package's manual is built, or installed."""
        self._folder = (folder or package_path() / "docs/html").resolve()

    def find(self, path: str) -> Content:
        """Return content type and content of a file, None for a path of something else."""
        if not path.startswith(MANUAL):
            return None
        if not self._folder.is_dir():
            return "text/plain; charset=utf-8", _NOT_BUILT.encode()
        file = (self._folder / path.removeprefix(MANUAL)).resolve()
        if not file.is_relative_to(self._folder):
            return None
        kind = mimetypes.guess_type(file.name)[0] or "text/plain"
        try:
            return f"{kind}; charset=utf-8" if kind.startswith("text/") else kind, read_bytes(file, _LARGEST)
        except (OSError, ValueError):
            return None
