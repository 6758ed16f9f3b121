"""A chart of numbers over time, as the panel has them."""

from __future__ import annotations

from typing import Any

import numpy as np

EVERY = 10  # ticks between two drawings, each of which sends up to 70 kB
_SCALES = {"x": {"time": False, "auto": True}, "y": {"auto": True}}
_COLORS = ("#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf")


def add_chart(gui: Any, title: str, names: tuple[str, ...]) -> Any:
    """Draw an empty chart with a line for each name; its `data` are the times (s) and each line's values."""
    empty = tuple(np.array([0.0, 1.0]) for _ in range(len(names) + 1))
    lines = [{"label": name, "stroke": color, "width": 1.5} for name, color in zip(names, _COLORS)]
    return gui.add_uplot(empty, ({"label": "t, s"}, *lines), title=title, height=150, scales=_SCALES)
