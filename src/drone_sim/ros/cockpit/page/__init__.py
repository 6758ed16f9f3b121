"""The page around the scene, as `web/` in the repository builds it: its files, by the path that a browser asks for."""

from __future__ import annotations

from pathlib import Path

_KINDS = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}


class Page:
    """The files of a folder, read once."""

    def __init__(self, folder: Path = Path(__file__).parent):
        """Read them; raises OSError."""
        files = [file for file in sorted(folder.iterdir()) if file.suffix in _KINDS]
        self._files = {f"/{file.name}": (_KINDS[file.suffix], file.read_bytes()) for file in files}

    def find(self, path: str) -> tuple[str, bytes] | None:
        """Return the content type and the content of a path; None for what is not there."""
        return self._files.get("/index.html" if path == "/" else path)
