"""What scripts have written into an object of 4.x: blocks of bytes, of which a path keeps its points in one."""

from __future__ import annotations

from drone_sim.vrep_files.chunks import Texts, finite, level, unpack
from drone_sim.vrep_files.errors import VrepFileError

_BLOCK = "Cdt"  # name and content, each after its length
_PATH = b"PATH"
_POINT = 7 * 8  # bytes: position and quaternion x, y, z, w, as doubles
_MOST_POINTS = 10_000


def read_path(data: bytes | None) -> tuple[tuple[float, ...], ...]:
    """Return the points of a path, in its frame, from the blocks of its object; none where it is no path.

    Each is x, y, z (m) and a quaternion x, y, z, w.

    Raises VrepFileError.
    """
    content = _block(data, _PATH)
    count = len(content) // _POINT
    if count > _MOST_POINTS:
        raise VrepFileError(f"PATH: {count} points; at most {_MOST_POINTS} are read")
    numbers = finite(unpack(f"<{7 * count}d", content, "PATH"), "PATH")
    return tuple(numbers[at : at + 7] for at in range(0, 7 * count, 7))


def _block(data: bytes | None, name: bytes) -> bytes:
    for chunk in () if data is None else level(data).chunks:
        if chunk.tag == _BLOCK:
            parts = Texts(chunk.data, _BLOCK)
            if parts.bytes() == name:
                return parts.bytes()
    return b""
