"""A flight's figures for the plots and the replay, out of its table."""

from __future__ import annotations

import contextlib
import itertools
from pathlib import Path
from typing import NamedTuple

import numpy as np

from drone_sim.grading.flown import columns_of
from drone_sim.offline import tables
from drone_sim.offline.recording import COLUMNS

_MOST = 6000  # rows: five minutes of the usual step; longer flights are thinned
_DIGITS = 4  # after the point: 0.1 mm
_COLUMNS = (
    *("t", "x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "wz"),
    *("command_vx", "command_vy", "command_vz", "command_wz"),
    *("propeller1", "propeller2", "propeller3", "propeller4"),
)


class Figures(NamedTuple):
    """Columns by name, as criteria have them, all equally long, or none; and what to say of them."""

    columns: dict[str, list[float]]
    note: str = ""


def figures_of(table: Path) -> Figures:
    """Return the figures of a table that `fly --csv` wrote; none, and why, where it cannot be read."""
    try:
        rows = _rows(table)
    except (OSError, tables.TableRefused) as error:
        return Figures({}, " ".join(str(error).split()))
    if not len(rows):
        return Figures({}, "nothing was flown")
    every = -(-len(rows) // _MOST)
    thinned = columns_of(rows[::every])
    columns = {name: list(map(float, np.round(thinned[name], _DIGITS))) for name in _COLUMNS}
    first = f" of the first {len(rows)}" if len(rows) == tables.MAX_ROWS else ""
    return Figures(columns, f"one row in {every}{first} is shown" if every > 1 else "")


def _rows(table: Path) -> np.ndarray:
    """Return a table's rows (N, 22); numpy reads a good one ten times as fast. Raises what tables.read does."""
    with open(table, encoding="utf-8", errors="replace") as file:
        is_ours = file.readline().rstrip("\n").split(",") == list(COLUMNS)
        lines = list(itertools.islice(file, tables.MAX_ROWS)) if is_ours else []
    if is_ours and not lines:
        return np.empty((0, len(COLUMNS)))
    with contextlib.suppress(ValueError):
        rows = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.empty((0, 0))
        if rows.shape[1] == len(COLUMNS) and (np.abs(rows) < tables.LARGEST).all():
            return rows
    return np.array(tables.read(table).rows)  # says what is wrong
