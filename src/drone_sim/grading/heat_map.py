"""A sweep as a picture: a curve over one parameter, colours over two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from drone_sim.files import writing
from drone_sim.grading.ranges import Range

if TYPE_CHECKING:
    from drone_sim.grading.sweep import Trial

_FIGURES_IN_CELLS = 150  # cells at most that have room for a number


def save(path: str, title: str, ranges: Sequence[Range], trials: Sequence[Trial], figure_of: str = "") -> None:
    """Draw the trials' mean points, or a criterion's mean figure, over one parameter or two. Raises OSError."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    label = figure_of or "points"
    shown = [(one.values, one.figures[figure_of] if figure_of else one.points) for one in trials]
    if len(ranges) == 1:
        _curve(axes, ranges[0], shown, label)
    else:
        _map(figure, axes, ranges, shown, label)
    axes.set_title(title)
    with writing.replacing(path, binary=True) as file:
        figure.savefig(file, format=Path(path).suffix[1:], dpi=120)


def _curve(axes: Any, one: Range, shown: Sequence[tuple[tuple[Any, ...], float | None]], label: str) -> None:
    points = sorted((values[0], np.nan if figure is None else figure) for values, figure in shown)
    axes.plot(*zip(*points), "o-")
    axes.set_xlabel(one.key)
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)


def _map(figure: Any, axes: Any, ranges: Sequence[Range], shown: Sequence[Any], label: str) -> None:
    """Draw a cell for every combination; of an optimiser's scattered trials, a dot for each."""
    rows, columns = (sorted({values[index] for values, _ in shown}) for index in (0, 1))
    if len(rows) * len(columns) == len(shown):
        cells = np.full((len(rows), len(columns)), np.nan)
        for (row, column), value in shown:
            cells[rows.index(row), columns.index(column)] = np.nan if value is None else value
        drawn = axes.imshow(cells, origin="lower", aspect="auto")
        _name_cells(axes, cells, rows, columns)
    else:
        known = [(column, row, value) for (row, column), value in shown if value is not None]
        across, up, colours = zip(*known)
        drawn = axes.scatter(across, up, c=colours)
    axes.set_ylabel(ranges[0].key)
    axes.set_xlabel(ranges[1].key)
    figure.colorbar(drawn, label=label)


def _name_cells(axes: Any, cells: np.ndarray, rows: Sequence[Any], columns: Sequence[Any]) -> None:
    for axis, values in ((axes.yaxis, rows), (axes.xaxis, columns)):
        axis.set_major_locator(MaxNLocator(nbins=min(12, len(values)), integer=True))
        axis.set_major_formatter(lambda at, _, values=values: _named(at, values))
    if cells.size <= _FIGURES_IN_CELLS:
        middle = (np.nanmin(cells) + np.nanmax(cells)) / 2 if np.isfinite(cells).any() else 0.0
        for (row, column), value in np.ndenumerate(cells):
            if np.isfinite(value):
                colour = "black" if value > middle else "white"
                axes.text(column, row, f"{value:.3g}", ha="center", va="center", color=colour, fontsize=8)


def _named(at: float, values: Sequence[Any]) -> str:
    if at != int(at) or not 0 <= at < len(values):
        return ""
    value = values[int(at)]
    return f"{value:.4g}" if isinstance(value, float) else str(value)
