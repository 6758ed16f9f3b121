"""Reads paths: in 3.x an object with control points, in 4.x points in a data block of a dummy."""

from __future__ import annotations

import math

from drone_sim.mechanics.path import METRES_PER_RADIAN
from drone_sim.vrep_files.chunks import Level, Texts, finite, level, position_first, singles, unpack
from drone_sim.vrep_files.model import VrepControlPoint, VrepFileError, VrepPath

_BLOCK = "Cdt"  # name and content, each preceded by its length
_PATH = b"PATH"
_POINT = 7 * 8  # bytes: position and quaternion x, y, z, w, as doubles
_MAX_POINTS = 10_000
CLOSED, AUTOMATIC, FLAT, VELOCITY_PROFILE, X_UP = 0x04, 0x08, 0x40, 0x300, 0x800  # flags of a path of 3.x
_DEFAULT = 0x01 | 0x02 | AUTOMATIC | 0x20 | 0x80 | 0x400


def read_path(data: bytes | None) -> tuple[tuple[float, ...], ...]:
    """Return the points of a path of 4.x, in its frame, from its object's data blocks; none if it is not a path.

    Each point is x, y, z (m) and a quaternion x, y, z, w. Raises VrepFileError.
    """
    content = _block(data, _PATH)
    count = len(content) // _POINT
    if count > _MAX_POINTS:
        raise VrepFileError(f"PATH: {count} points; at most {_MAX_POINTS} are allowed")
    numbers = finite(unpack(f"<{7 * count}d", content, "PATH"), "PATH")
    return tuple(numbers[at : at + 7] for at in range(0, 7 * count, 7))


def _block(data: bytes | None, name: bytes) -> bytes:
    for chunk in () if data is None else level(data).chunks:
        if chunk.tag == _BLOCK:
            parts = Texts(chunk.data, _BLOCK)
            if parts.bytes() == name:
                return parts.bytes()
    return b""


def read_path_object(class_level: Level) -> VrepPath:
    """Return a path of 3.x from its class level. Raises VrepFileError."""
    data = class_level.find("Ntp")
    path = Level() if data is None else level(data)
    points = [chunk.data for chunk in path.chunks if chunk.tag == "Pat"]
    if len(points) > _MAX_POINTS:
        raise VrepFileError(f"Pat: {len(points)} control points; at most {_MAX_POINTS} are allowed")
    all_points = [_control_point(level(data)) for data in points]
    valid = tuple(point for point in all_points if point is not None)
    per_radian, counts = finite(_mixed(path, "_v3", "Av3", "1", "i") or (METRES_PER_RADIAN, 5), "Av3")
    (per_pause,) = path.numbers("_v9", "Av9", 1) or (1.0,)
    along = path.numbers("_m2", "Jm2", 1) or (0.0,)
    return VrepPath(
        points=valid,
        broken=len(all_points) - len(valid),
        switches=path.integer("At2", default=_DEFAULT),
        counts=int(counts),
        metres_per_radian=per_radian,
        metres_per_pause=per_pause,
        along=along[0],
        has_surface=bool(class_level.bits("Var") & 1),
    )


def _control_point(point: Level) -> VrepControlPoint | None:
    """Return a control point; None if its position is NaN, as some planners wrote. Raises VrepFileError."""
    numbers = _mixed(point, "_t2", "At2", "9", "i1")
    if numbers is None or not all(map(math.isfinite, numbers)):
        return None
    finite(numbers, "At2")
    (pause,) = point.numbers("_t3", "At3", 1) or (0.0,)
    flags, *channels = finite(_mixed(point, "_t4", "At4", "", "H4") or (0, 0.0, 0.0, 0.0, 0.0), "At4")
    return VrepControlPoint(
        pose=position_first(numbers[:7], "At2"),
        before=numbers[7],
        after=numbers[8],
        count=int(numbers[9]),
        speed=numbers[10],
        pause=pause,
        flags=int(flags),
        channels=tuple(channels),
    )


def _mixed(chunks: Level, double: str, single: str, before: str, after: str) -> tuple[float, ...] | None:
    """Return numbers with an integer among them: `before` numbers, the integer's format, and more numbers (`after`).

    The numbers are doubles if the tag `double` exists, else floats. Raises VrepFileError.
    """
    for tag, letter in ((double, "d"), (single, "f")):
        data = chunks.find(tag)
        if data is not None:
            integer, more = after[:1], after[1:]
            form = f"<{before}{letter if before else ''}{integer}{more}{letter if more else ''}"
            return singles(form, data, tag) if letter == "f" else unpack(form, data, tag)
    return None
