"""A flight as a picture: commanded and flown velocities, the drone itself, its path from above, and its propellers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drone_sim.files import writing
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose, Twist
from drone_sim.offline.recording import Recording, SensorSeries
from drone_sim.offline.timeline import Push, Timeline

_BLUE, _ORANGE, _GREEN, _RED = "#1f5fa8", "#d9730d", "#2c8a57", "#a8325e"
_GREY, _GRID, _SHADE = "#707070", "#e4e4e4", "#f2c9c4"
_PROPELLERS = (("1 front left", _BLUE), ("2 back left", _ORANGE), ("3 back right", _GREEN), ("4 front right", _RED))
_VELOCITIES = ("forward $v_x$ [m/s]", "left $v_y$ [m/s]", "up $v_z$ [m/s]", "yaw rate $w_z$ [rad/s]")
_USUAL = (1, 99)  # percentiles of the propellers' velocities, between which their axis shows everything
_SMALLEST_PROPELLER_RANGE = 1.0  # m/s
_SMALLEST_PATH = 1.0  # m
_PLACES = (
    ("vx", "place", "path"),
    ("vy", "height", "path"),
    ("vz", "lean", "propellers"),
    ("wz", "heading", "propellers"),
)
_HEIGHT, _SENSOR_HEIGHT = 9.5, 2.6  # inches, of all above the sensors, and of a row of them
_PANELS, _PANEL_COLUMNS = 12, 3  # of the sensors: at most, and beside each other
_LARGEST = 1e12  # beyond it a sensor has measured nothing
_SMALLEST_RANGE = 0.05  # of an axis, in its unit: less would blow a ripple up to look like a manoeuvre


def check(path: str) -> None:
    """Raise OSError where `path` cannot be written, and ValueError for a format that matplotlib does not have."""
    writing.check(path)
    known = Figure().canvas.get_supported_filetypes()
    ending = Path(path).suffix[1:].lower()
    if ending and ending not in known:
        raise ValueError(f"{path}: matplotlib does not write .{ending}; it writes {', '.join(sorted(known))}")


def save(path: str, recording: Recording, timeline: Timeline, sensors: Sequence[SensorSeries] = ()) -> None:
    """Draw a recording, with the timeline's poses and pushes marked; the path's ending gives the format.

    What sensors measured stands below, as far as there is room. Propellers that are not known are NaN.
    Raises OSError, and ValueError for a format that matplotlib does not have.
    """
    sensors = sensors[:_PANELS]
    figure, axes = _laid_out(len(sensors))
    of_time = {name: ax for name, ax in axes.items() if name != "path"}
    lowest = [axes[name] for name in (*_PLACES[-1], *map(str, range(len(sensors))))]
    velocities, drone, _ = ([axes[name] for name in column] for column in zip(*_PLACES))
    rows = np.array(recording.rows)
    in_track = np.array([_in_track(recording.matrix(index), row[8:11]) for index, row in enumerate(rows)])
    flown = np.column_stack((in_track[:, :3], rows[:, 13]))
    _draw_velocities(velocities, rows[:, 0], rows[:, 14:18], flown)
    _draw_drone(drone, rows, in_track[:, 3:])
    _draw_propellers(axes["propellers"], rows)
    for number, series in enumerate(sensors):
        _draw_sensor(axes[str(number)], series)
    for ax in of_time.values():
        _finish(ax)
        _mark(ax, timeline)
        ax.tick_params(labelbottom=ax in lowest)
    for ax in lowest:
        ax.set_xlabel(f"{recording.clock} [s]")
        ax.set_xlim(0, max(rows[-1, 0], 1e-3))
    _draw_path(axes["path"], rows, timeline)
    with writing.replacing(path, binary=True) as file:
        figure.savefig(file, dpi=120, format=Path(path).suffix[1:] or "png")


def _laid_out(sensors: int) -> tuple[Figure, dict[str, Axes]]:
    """Return an empty figure and its axes by name; the sensors', below the others, have numbers."""
    below = -(-sensors // _PANEL_COLUMNS)
    names = [*map(str, range(sensors)), *["."] * (below * _PANEL_COLUMNS - sensors)]
    # No pyplot: it would look for a display, and keep every figure.
    figure = Figure(figsize=(16, _HEIGHT + _SENSOR_HEIGHT * below), layout="constrained")
    panels = (names[first : first + _PANEL_COLUMNS] for first in range(0, len(names), _PANEL_COLUMNS))
    rows: list[Any] = [*_PLACES, *panels]
    axes = figure.subplot_mosaic(
        rows,
        gridspec_kw={"width_ratios": (1, 1, 1.1), "height_ratios": [_HEIGHT / 4] * 4 + [_SENSOR_HEIGHT] * below},
    )
    for name, ax in axes.items():
        if name not in ("path", "vx"):
            ax.sharex(axes["vx"])
    return figure, axes


def _in_track(matrix: frames.Matrix, velocity: Sequence[float]) -> tuple[float, ...]:
    """Return velocity (m/s) and pitch, roll (rad) in the track frame, as the tutorial has them, and the yaw."""
    yaw = frames.to_euler(matrix)[2]
    track_from_world = frames.from_euler((0.0, 0.0, 0.0), (0.0, 0.0, -yaw))
    alpha, beta, _ = frames.to_euler(frames.multiply(track_from_world, matrix))
    return (*frames.rotate(track_from_world, velocity), beta, -alpha, yaw)


def _draw_velocities(axes: Sequence[Axes], times: np.ndarray, commanded: np.ndarray, flown: np.ndarray) -> None:
    for column, (ax, name) in enumerate(zip(axes, _VELOCITIES)):
        # A command is in force during the step that ends at its row's time.
        ax.step(times, commanded[:, column], where="pre", color=_ORANGE, linestyle="--", label="commanded")
        ax.plot(times, flown[:, column], color=_BLUE, label="flown")
        ax.set_ylabel(name)
    _title(axes[0], "Velocities (track frame)", legend=True)


def _draw_drone(axes: Sequence[Axes], rows: np.ndarray, angles: np.ndarray) -> None:
    place, height, lean, heading = axes
    times = rows[:, 0]
    place.plot(times, rows[:, 1], color=_BLUE, label="$x$")
    place.plot(times, rows[:, 2], color=_ORANGE, label="$y$")
    place.set_ylabel("place $x$, $y$ [m]")
    _title(place, "Drone", legend=True)
    height.plot(times, rows[:, 3], color=_BLUE)
    height.set_ylabel("height $z$ [m]")
    lean.plot(times, angles[:, 0], color=_BLUE, label="pitch (+ nose down)")
    lean.plot(times, angles[:, 1], color=_ORANGE, label="roll (+ to the left)")
    lean.set_ylabel("attitude [rad]")
    _title(lean, legend=True)
    heading.plot(times, np.unwrap(angles[:, 2]), color=_BLUE)
    heading.set_ylabel("yaw [rad]")


def _draw_propellers(ax: Axes, rows: np.ndarray) -> None:
    ax.set_ylabel("propellers [m/s]")
    rows = rows[np.isfinite(rows[:, 18:22]).all(axis=1)]
    if not len(rows):
        ax.text(0.5, 0.5, "not recorded", transform=ax.transAxes, ha="center", color=_GREY)
        return
    for (name, color), velocities in zip(_PROPELLERS, rows[:, 18:22].T):
        ax.step(rows[:, 0], velocities, where="pre", color=color, linewidth=1, label=name)
    commanded = rows[1:, 18:22] if len(rows) > 1 else rows[:, 18:22]  # nothing is, at time 0
    low, high = np.percentile(commanded, _USUAL)
    margin = max(0.5 * (high - low), _SMALLEST_PROPELLER_RANGE / 2)
    least, most = float(commanded.min()), float(commanded.max())
    ax.set_ylim(max(low, least) - margin, min(high, most) + margin)
    if least < low - margin or most > high + margin:
        ax.text(0.99, 0.01, f"goes from {least:.1f} to {most:.1f} m/s", transform=ax.transAxes,
                ha="right", va="bottom", fontsize="small", color=_GREY)  # fmt: skip
    _title(ax, legend=True)


def _draw_sensor(ax: Axes, series: SensorSeries) -> None:
    """Draw what one sensor measured."""
    values = np.where(np.abs(series.values) < _LARGEST, series.values, np.nan)
    for column, color in zip(range(values.shape[1]), (_BLUE, _ORANGE, _GREEN)):
        label = series.labels[column] if series.labels else ""
        ax.plot(series.times, values[:, column], color=color, linewidth=1, label=label)
    ax.set_ylabel(series.unit)
    _title(ax, series.title, legend=bool(series.labels))


def _draw_path(ax: Axes, rows: np.ndarray, timeline: Timeline) -> None:
    """Draw the way over ground, seen from above; where a pose puts the drone elsewhere there is a gap."""
    x, y = rows[:, 1], rows[:, 2]
    jumps = np.searchsorted(rows[:, 0], [one.at for one in timeline.entries if isinstance(one.action, Pose)], "right")
    jumps = jumps[jumps < len(rows)]
    ax.plot(np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan), color=_BLUE)
    ax.plot(x[0], y[0], "o", color=_GREEN, label="start")
    ax.plot(x[-1], y[-1], "s", color=_RED, label="end")
    half = max(np.ptp(x), np.ptp(y), _SMALLEST_PATH) * 0.55
    middle_x, middle_y = (x.min() + x.max()) / 2, (y.min() + y.max()) / 2
    ax.set_xlim(middle_x - half, middle_x + half)
    ax.set_ylim(middle_y - half, middle_y + half)
    ax.set_aspect("equal")
    ax.set_xlabel("$x$ [m]")
    ax.set_ylabel("$y$ [m]")
    _title(ax, "Path from above", legend=True)
    ax.grid(color=_GRID)
    ax.set_axisbelow(True)


def _title(ax: Axes, title: str = "", legend: bool = False) -> None:
    ax.set_title(title, loc="left", fontweight="bold")
    if legend:  # above the axes, where it hides nothing
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=4, fontsize="small", frameon=False, borderpad=0)


def _finish(ax: Axes) -> None:
    low, high = ax.get_ylim()
    missing = _SMALLEST_RANGE - (high - low)
    if missing > 0:
        ax.set_ylim(low - missing / 2, high + missing / 2)
    ax.grid(color=_GRID)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def _mark(ax: Axes, timeline: Timeline) -> None:
    """Shade the pushes, draw a line at the poses, and name them."""
    for entry in timeline.entries:
        if isinstance(entry.action, Twist):
            continue
        if isinstance(entry.action, Push):
            ax.axvspan(entry.at, entry.end, color=_SHADE, linewidth=0, zorder=0)
        else:
            ax.axvline(entry.at, color=_GREY, linestyle=":", zorder=0)
        name = type(entry.action).__name__.lower()
        text = ax.annotate(name, (entry.end, 1), xycoords=("data", "axes fraction"), xytext=(3, -1),
                           textcoords="offset points", va="top", fontsize="x-small", color=_GREY)  # fmt: skip
        text.set_clip_on(True)  # those after the end of the flight
        text.set_in_layout(False)
