"""What sensors measured, as rows of small plots below the flight's."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

PANELS = 12  # at most
COLUMNS = 3  # of the figure
_LARGEST = 1e12  # beyond it nothing was measured
_COLORS = ("#1f5fa8", "#d9730d", "#2c8a57")  # x, y, z


class Series(NamedTuple):
    """What one sensor measured of one thing."""

    title: str  # its topic
    unit: str  # with the quantity, such as "range [m]"
    times: np.ndarray  # (n,), s of the flight
    values: np.ndarray  # (n, k), in that unit; not finite where there was nothing to measure
    labels: tuple[str, ...] = ()  # of the k columns, if there is more than one


def rows_of(count: int) -> int:
    """Return how many rows so many plots take, of which PANELS are drawn."""
    return math.ceil(min(count, PANELS) / COLUMNS)


def draw(ax: Axes, series: Series) -> None:
    """Draw one."""
    values = np.where(np.abs(series.values) < _LARGEST, series.values, np.nan)
    for column, color in zip(range(values.shape[1]), _COLORS):
        label = series.labels[column] if series.labels else ""
        ax.plot(series.times, values[:, column], color=color, linewidth=1, label=label)
    ax.set_ylabel(series.unit)
    ax.set_title(series.title, loc="left", fontweight="bold")
    if series.labels:
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=3, fontsize="small", frameon=False, borderpad=0)
