"""Check that a path is inside a folder, before a file is written there, or a file or tree is removed."""

from __future__ import annotations

import os
import shutil
from pathlib import Path


class OutsideFolder(ValueError):
    """A path is not inside the folder that must contain it. The message is one line."""


def path_below(folder: str | Path, *names: str | Path) -> Path:
    """Return the path of `names` in a folder. Links in its parents are resolved; the path itself may be a link.

    Raises OutsideFolder if the path is the folder itself or is not in it.
    """
    path, root = Path(folder, *names), os.path.realpath(folder)
    resolved = Path(os.path.realpath(path.parent), path.name)
    if path.name in ("", "..") or str(resolved) == root or not resolved.is_relative_to(root):
        raise OutsideFolder(f"{path}: is not below the folder {root}")
    return resolved


def remove(path: str | Path, within: str | Path) -> None:
    """Remove a file, a link, or a folder with its content, if it exists.

    Raises OutsideFolder if the path is not inside the folder `within`, and OSError.
    """
    resolved = path_below(within, Path(path).absolute())
    if not os.path.lexists(resolved):  # false also for a name that no file can have
        return
    if resolved.is_dir() and not resolved.is_symlink():
        shutil.rmtree(resolved)
    else:
        resolved.unlink(missing_ok=True)
