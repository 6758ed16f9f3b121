"""Cache of imported .ttt files: `scene:=FILE.ttt` flies in a copy imported into its own folder below ~/.cache.

The folder's name contains a hash of the file's content, so a changed file is imported again. The whole cache may be
deleted at any time. XDG_CACHE_HOME replaces ~/.cache.
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
_FORMAT_VERSION = b"9"  # of the written files; after a change, every file is imported again


def imported_scene(path: Path) -> Path:
    """Return the scene file imported from a V-REP file, now or earlier. Raises VrepFileError and OSError."""
    from drone_sim.importing.scene_folder import LIST, SCENE  # slow import: loads readers and writers
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
    """Return the folder that contains the imported scenes."""
    return cache_path() / "scenes"


def _folder(path: Path) -> Path:
    try:
        content = read_bytes(path, MAX_SIZE)
    except (OSError, ValueError) as error:
        raise VrepFileError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    digest = hashlib.sha256(_FORMAT_VERSION + content).hexdigest()[:16]
    return cache_folder() / f"{word(path.stem, 'scene')}-{digest}"


def _import_into(path: Path, folder: Path) -> None:
    """Import into a temporary folder and rename it when complete: another process may import the same file."""
    from drone_sim.importing.scene_folder import SCENE, import_file

    folder.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        import_file(path, unfinished)
        unfinished.rename(folder)
    except OSError:
        if not (folder / SCENE).is_file():  # no other process has imported it either
            raise
    finally:
        with contextlib.suppress(OSError):
            remove(unfinished, within=folder.parent)
