"""Paths: of 3.x, an object with control points; of 4.x, points in a block of a dummy's data."""

from __future__ import annotations

import math

from drone_sim.mechanics.controlled_path import METRES_PER_RADIAN
from drone_sim.vrep_files.chunks import Level, Texts, finite, level, position_first, singles, unpack
from drone_sim.vrep_files.model import VrepControlPoint, VrepFileError, VrepPath

_BLOCK = "Cdt"  # name and content, each after its length
_PATH = b"PATH"
_POINT = 7 * 8  # bytes: position and quaternion x, y, z, w, as doubles
_MOST_POINTS = 10_000
CLOSED, AUTOMATIC, FLAT, VELOCITY_PROFILE, X_UP = 0x04, 0x08, 0x40, 0x300, 0x800  # switches of a path of 3.x
_DEFAULT = 0x01 | 0x02 | AUTOMATIC | 0x20 | 0x80 | 0x400


def read_path(data: bytes | None) -> tuple[tuple[float, ...], ...]:
    """Return the points of a path of 4.x, in its frame, from the blocks of its object; none where it is no path.

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


def read_path_object(own: Level) -> VrepPath:
    """Return a path of 3.x, from its own level. Raises VrepFileError."""
    data = own.find("Ntp")
    line = Level() if data is None else level(data)
    points = [chunk.data for chunk in line.chunks if chunk.tag == "Pat"]
    if len(points) > _MOST_POINTS:
        raise VrepFileError(f"Pat: {len(points)} control points; at most {_MOST_POINTS} are read")
    found = [_control_point(level(one)) for one in points]
    whole = tuple(one for one in found if one is not None)
    per_radian, counts = finite(_mixed(line, "_v3", "Av3", "1", "i") or (METRES_PER_RADIAN, 5), "Av3")
    (per_pause,) = line.numbers("_v9", "Av9", 1) or (1.0,)
    along = line.numbers("_m2", "Jm2", 1) or (0.0,)
    return VrepPath(
        points=whole,
        broken=len(found) - len(whole),
        switches=line.integer("At2", default=_DEFAULT),
        counts=int(counts),
        metres_per_radian=per_radian,
        metres_per_pause=per_pause,
        along=along[0],
        has_surface=bool(own.bits("Var") & 1),
    )


def _control_point(own: Level) -> VrepControlPoint | None:
    """Return a control point; None for one that is nowhere, as planners have left some (NaN). Raises VrepFileError."""
    found = _mixed(own, "_t2", "At2", "9", "i1")
    if found is None or not all(map(math.isfinite, found)):
        return None
    finite(found, "At2")
    (pause,) = own.numbers("_t3", "At3", 1) or (0.0,)
    flags, *channels = finite(_mixed(own, "_t4", "At4", "", "H4") or (0, 0.0, 0.0, 0.0, 0.0), "At4")
    return VrepControlPoint(
        pose=position_first(found[:7], "At2"),
        before=found[7],
        after=found[8],
        count=int(found[9]),
        speed=found[10],
        pause=pause,
        flags=int(flags),
        channels=tuple(channels),
    )


def _mixed(own: Level, double: str, single: str, before: str, after: str) -> tuple[float, ...] | None:
    """Return numbers with an integer among them: so many numbers `before` that, and what comes `after`.

    Numbers are doubles where their tag is there, otherwise floats. Raises VrepFileError.
    """
    for tag, letter in ((double, "d"), (single, "f")):
        data = own.find(tag)
        if data is not None:
            whole, more = after[:1], after[1:]
            form = f"<{before}{letter if before else ''}{whole}{more}{letter if more else ''}"
            return singles(form, data, tag) if letter == "f" else unpack(form, data, tag)
    return None
