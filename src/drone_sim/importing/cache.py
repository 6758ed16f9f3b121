"""What `scene:=FILE.ttt` flies in: the file, imported into a folder of its own below ~/.cache.

The folder's name has a hash of the file's content: a file that was written anew is imported anew. All of it may be
deleted at any time. XDG_CACHE_HOME names another place than ~/.cache.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import tempfile
from pathlib import Path

from drone_sim.files.containment import remove
from drone_sim.files.resources import cache_path, read_bytes
from drone_sim.importing.folder import word
from drone_sim.vrep_files.container import MAX_SIZE
from drone_sim.vrep_files.model import VrepFileError

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_FORM = b"8"  # of what is written: another one, and files are imported anew


def imported_scene(path: Path) -> Path:
    """Return the scene file that a file of V-REP's was made into, now or before. Raises VrepFileError and OSError."""
    from drone_sim.importing.scene_folder import LIST, SCENE  # which reads and makes all kinds of things
    from drone_sim.importing.scripts import renew

    folder = _folder(path)
    if not (folder / SCENE).is_file():
        _import_into(path, folder)
    else:
        renew(path.parent, folder)
    if (folder / LIST).is_file():
        _LOG.warning("%s: imported into %s; it differs from the file in some ways, listed in %s", path, folder, LIST)
    else:
        _LOG.info("%s: imported into %s", path, folder)
    return folder / SCENE


def cache_folder() -> Path:
    """Return the folder below which imported scenes lie."""
    return cache_path() / "scenes"


def _folder(path: Path) -> Path:
    try:
        content = read_bytes(path, MAX_SIZE)
    except (OSError, ValueError) as error:
        raise VrepFileError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    digest = hashlib.sha256(_FORM + content).hexdigest()[:16]
    return cache_folder() / f"{word(path.stem, 'scene')}-{digest}"


def _import_into(path: Path, folder: Path) -> None:
    """Import beside the folder, and give it its name when all is there: another process may be at it, too."""
    from drone_sim.importing.scene_folder import SCENE, import_file

    folder.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        import_file(path, unfinished)
        unfinished.rename(folder)
    except OSError:
        if not (folder / SCENE).is_file():  # nor has another process made it
            raise
    finally:
        with contextlib.suppress(OSError):
            remove(unfinished, within=folder.parent)
