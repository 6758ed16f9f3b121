"""The results of a benchmark run as one picture."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot

from drone_sim.files import writing


def draw(results: dict[str, Any], file: str) -> None:
    """Draw what there is: frame times, real-time factors, growth."""
    figure, places = pyplot.subplot_mosaic("AC;BC", figsize=(12, 7), layout="constrained")
    frames, speeds, right = places["A"], places["B"], places["C"]
    _bars(frames, results.get("render", []), "median_ms", "frame, 640 x 480 [ms]")
    factors = results.get("loop", []) + [row for row in results.get("node", []) if "factor" in row]
    _bars(speeds, factors, "factor", "simulated seconds per second")
    speeds.set_xscale("log")
    speeds.set_xlim(left=1, right=6000)
    for name, key in (("size", "pixels"), ("bodies", "bodies"), ("triangles", "triangles")):
        rows = [row for row in results.get("growth", []) if row["name"] == name]
        amounts = [row.get(key, row.get("width", 0) * row.get("height", 0)) for row in rows]
        right.loglog(amounts, [row["median_ms"] for row in rows], "o-", label=f"number of {key}")
    right.set_xlabel("number")
    right.set_ylabel("frame [ms]")
    right.legend(loc="upper left")
    right.grid(alpha=0.3)
    figure.suptitle(results.get("machine", ""))
    with writing.replacing(file, binary=True) as picture:
        figure.savefig(picture, dpi=90, format=Path(file).suffix[1:] or "png")


def _bars(axes: Any, rows: Any, key: str, label: str) -> None:
    names = [row["name"] for row in rows]
    values = [row[key] for row in rows]
    colors = ["#7f8c8d" if "PyBullet" in name else "#c0392b" for name in names]
    bars = axes.barh(names, values, color=colors)
    axes.bar_label(bars, [f"{value:.0f}" if value >= 100 else f"{value:.3g}" for value in values], padding=3)
    axes.invert_yaxis()
    axes.set_xlim(0, max(values, default=1) * 1.3)
    axes.set_xlabel(label)
