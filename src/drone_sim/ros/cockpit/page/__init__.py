"""The page around the scene, as `web/` in the repository builds it: its files, by the path that a browser asks for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}


Found = tuple[str, bytes] | None


class Page:
    """The files of a folder, read once, and what is found `beside` them, such as pictures."""

    def __init__(self, folder: Path = Path(__file__).parent, beside: Callable[[str], Found] = lambda _: None):
        """Read them; raises OSError."""
        self._beside = beside
        files = [file for file in sorted(folder.iterdir()) if file.suffix in _KINDS]
        self._files = {f"/{file.name}": (_KINDS[file.suffix], file.read_bytes()) for file in files}

    def find(self, path: str) -> Found:
        """Return the content type and the content of a path; None for what is not there."""
        return self._files.get("/index.html" if path == "/" else path) or self._beside(path)
