"""Plots of a sweep: a curve over one parameter, a heat map over two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from drone_sim.files import writing

_MAX_LABELLED_CELLS = 150  # more cells have no room for numbers

_Trial = tuple[tuple[Any, ...], float | None]  # a value for each key, and a figure


def save(path: str, title: str, keys: Sequence[str], trials: Sequence[_Trial], label: str) -> None:
    """Plot the trials' figures, named `label`, over one or two parameters. Raises OSError."""
    drawing = Figure(figsize=(7, 5), layout="constrained")
    axes = drawing.subplots()
    if len(keys) == 1:
        points = sorted((values[0], np.nan if figure is None else figure) for values, figure in trials)
        axes.plot(*zip(*points), "o-")
        axes.set_xlabel(keys[0])
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    else:
        _draw_map(drawing, axes, keys, trials, label)
    axes.set_title(title)
    with writing.replacing(path, binary=True) as file:
        drawing.savefig(file, format=Path(path).suffix[1:], dpi=120)


def _draw_map(figure: Any, axes: Any, keys: Sequence[str], trials: Sequence[_Trial], label: str) -> None:
    """Draw a cell for every combination of a grid, or a dot for every trial of an optimisation."""
    rows, columns = (sorted({values[index] for values, _ in trials}) for index in (0, 1))
    if len(rows) * len(columns) == len(trials):
        cells = np.full((len(rows), len(columns)), np.nan)
        for (row, column), value in trials:
            cells[rows.index(row), columns.index(column)] = np.nan if value is None else value
        mappable = axes.imshow(cells, origin="lower", aspect="auto")
        _label_cells(axes, cells, rows, columns)
    else:
        x, y, colours = zip(*((column, row, value) for (row, column), value in trials if value is not None))
        mappable = axes.scatter(x, y, c=colours)
    axes.set_ylabel(keys[0])
    axes.set_xlabel(keys[1])
    figure.colorbar(mappable, label=label)


def _label_cells(axes: Any, cells: np.ndarray, rows: Sequence[Any], columns: Sequence[Any]) -> None:
    for axis, values in ((axes.yaxis, rows), (axes.xaxis, columns)):
        axis.set_major_locator(MaxNLocator(nbins=min(12, len(values)), integer=True))
        axis.set_major_formatter(lambda at, _, values=values: _tick_label(at, values))
    if cells.size <= _MAX_LABELLED_CELLS:
        middle = (np.nanmin(cells) + np.nanmax(cells)) / 2 if np.isfinite(cells).any() else 0.0
        for (row, column), value in np.ndenumerate(cells):
            if np.isfinite(value):
                colour = "black" if value > middle else "white"
                axes.text(column, row, f"{value:.3g}", ha="center", va="center", color=colour, fontsize=8)


def _tick_label(at: float, values: Sequence[Any]) -> str:
    if at != int(at) or not 0 <= at < len(values):
        return ""
    value = values[int(at)]
    return f"{value:.4g}" if isinstance(value, float) else str(value)
