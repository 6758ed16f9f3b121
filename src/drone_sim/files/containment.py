"""Paths that must lie below a folder: checked before a file is written there, or a file or tree is removed."""

from __future__ import annotations

import os
import shutil
from pathlib import Path


class Outside(ValueError):
    """A path does not lie below the folder that it must lie in; one line."""


def below(folder: str | Path, *names: str | Path) -> Path:
    """Return the path that `names` lead to from a folder, with links in its parents resolved; the last is not followed.

    Raises Outside for a path that is the folder itself or is not in it.
    """
    path, around = Path(folder, *names), os.path.realpath(folder)
    place = Path(os.path.realpath(path.parent), path.name)
    if path.name in ("", "..") or str(place) == around or not place.is_relative_to(around):
        raise Outside(f"{path}: is not below the folder {around}")
    return place


def remove(path: str | Path, within: str | Path) -> None:
    """Remove a file, a link, or a folder with everything in it; a path where nothing is, is left alone.

    Raises Outside for a path that does not lie below the folder `within`, and OSError.
    """
    place = below(within, Path(path).absolute())
    if not os.path.lexists(place):  # also for a name that no file can have
        return
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    else:
        place.unlink(missing_ok=True)
