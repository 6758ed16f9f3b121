"""Plot of a flight: commanded and flown velocities, pose, path from above, propellers, and sensors."""

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
_PERCENTILES = (1, 99)  # of the propellers' velocities: range of their axis, plus a margin
_MIN_PROPELLER_RANGE = 1.0  # m/s
_MIN_PATH_SIZE = 1.0  # m
_LAYOUT = (
    ("vx", "place", "path"),
    ("vy", "height", "path"),
    ("vz", "lean", "propellers"),
    ("wz", "heading", "propellers"),
)
_HEIGHT, _SENSOR_HEIGHT = 9.5, 2.6  # inches, of the part above the sensors, and of a row of sensors
_MAX_PANELS, _PANEL_COLUMNS = 12, 3  # of sensors: at most, and in a row
_MAX_VALUE = 1e12  # larger values mean that a sensor measured nothing
_MIN_AXIS_RANGE = 0.05  # of an axis, in its unit: a smaller range would make a ripple look like a manoeuvre


def check(path: str) -> None:
    """Raise OSError if `path` cannot be written, and ValueError for a format that matplotlib does not support."""
    writing.check_writable(path)
    known = Figure().canvas.get_supported_filetypes()
    ending = Path(path).suffix[1:].lower()
    if ending and ending not in known:
        raise ValueError(f"{path}: matplotlib does not write .{ending}; it writes {', '.join(sorted(known))}")


def save(path: str, recording: Recording, timeline: Timeline, sensors: Sequence[SensorSeries] = ()) -> None:
    """Plot a recording, with the timeline's poses and pushes marked; the path's ending determines the format.

    Sensor series are drawn below, as far as there is room. Unknown propeller velocities are NaN.
    Raises OSError, and ValueError for a format that matplotlib does not support.
    """
    sensors = sensors[:_MAX_PANELS]
    figure, axes = _create_figure(len(sensors))
    time_axes = {name: ax for name, ax in axes.items() if name != "path"}
    bottom_axes = [axes[name] for name in (*_LAYOUT[-1], *map(str, range(len(sensors))))]
    velocities, pose_axes, _ = ([axes[name] for name in column] for column in zip(*_LAYOUT))
    rows = np.array(recording.rows)
    in_track = np.array([_in_track(recording.matrix(index), row[8:11]) for index, row in enumerate(rows)])
    flown = np.column_stack((in_track[:, :3], rows[:, 13]))
    _draw_velocities(velocities, rows[:, 0], rows[:, 14:18], flown)
    _draw_drone(pose_axes, rows, in_track[:, 3:])
    _draw_propellers(axes["propellers"], rows)
    for number, series in enumerate(sensors):
        _draw_sensor(axes[str(number)], series)
    for ax in time_axes.values():
        low, high = ax.get_ylim()
        missing = _MIN_AXIS_RANGE - (high - low)
        if missing > 0:
            ax.set_ylim(low - missing / 2, high + missing / 2)
        ax.grid(color=_GRID)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        _mark(ax, timeline)
        ax.tick_params(labelbottom=ax in bottom_axes)
    for ax in bottom_axes:
        ax.set_xlabel(f"{recording.clock} [s]")
        ax.set_xlim(0, max(rows[-1, 0], 1e-3))
    _draw_path(axes["path"], rows, timeline)
    with writing.replacing(path, binary=True) as file:
        figure.savefig(file, dpi=120, format=Path(path).suffix[1:] or "png")


def _create_figure(sensors: int) -> tuple[Figure, dict[str, Axes]]:
    """Return an empty figure and its axes by name; the sensors' axes, below the others, have numbers."""
    sensor_rows = -(-sensors // _PANEL_COLUMNS)
    names = [*map(str, range(sensors)), *["."] * (sensor_rows * _PANEL_COLUMNS - sensors)]
    # Not pyplot: it would need a display, and keep every figure in memory.
    figure = Figure(figsize=(16, _HEIGHT + _SENSOR_HEIGHT * sensor_rows), layout="constrained")
    panels = (names[first : first + _PANEL_COLUMNS] for first in range(0, len(names), _PANEL_COLUMNS))
    rows: list[Any] = [*_LAYOUT, *panels]
    axes = figure.subplot_mosaic(
        rows,
        gridspec_kw={"width_ratios": (1, 1, 1.1), "height_ratios": [_HEIGHT / 4] * 4 + [_SENSOR_HEIGHT] * sensor_rows},
    )
    for name, ax in axes.items():
        if name not in ("path", "vx"):
            ax.sharex(axes["vx"])
    return figure, axes


def _in_track(matrix: frames.Matrix, velocity: Sequence[float]) -> tuple[float, ...]:
    """Return velocity (m/s), pitch and roll (rad) in the track frame, as in the tutorial, and the yaw (rad)."""
    yaw = frames.to_euler(matrix)[2]
    track_from_world = frames.from_euler((0.0, 0.0, 0.0), (0.0, 0.0, -yaw))
    alpha, beta, _ = frames.to_euler(frames.multiply(track_from_world, matrix))
    return (*frames.rotate(track_from_world, velocity), beta, -alpha, yaw)


def _draw_velocities(axes: Sequence[Axes], times: np.ndarray, commanded: np.ndarray, flown: np.ndarray) -> None:
    for column, (ax, name) in enumerate(zip(axes, _VELOCITIES)):
        # A command applies to the step that ends at its row's time.
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
    commanded = rows[1:, 18:22] if len(rows) > 1 else rows[:, 18:22]  # there is no command at time 0
    low, high = np.percentile(commanded, _PERCENTILES)
    margin = max(0.5 * (high - low), _MIN_PROPELLER_RANGE / 2)
    minimum, maximum = float(commanded.min()), float(commanded.max())
    ax.set_ylim(max(low, minimum) - margin, min(high, maximum) + margin)
    if minimum < low - margin or maximum > high + margin:
        ax.text(0.99, 0.01, f"goes from {minimum:.1f} to {maximum:.1f} m/s", transform=ax.transAxes,
                ha="right", va="bottom", fontsize="small", color=_GREY)  # fmt: skip
    _title(ax, legend=True)


def _draw_sensor(ax: Axes, series: SensorSeries) -> None:
    values = np.where(np.abs(series.values) < _MAX_VALUE, series.values, np.nan)
    for column, color in zip(range(values.shape[1]), (_BLUE, _ORANGE, _GREEN)):
        label = series.labels[column] if series.labels else ""
        ax.plot(series.times, values[:, column], color=color, linewidth=1, label=label)
    ax.set_ylabel(series.unit)
    _title(ax, series.title, legend=bool(series.labels))


def _draw_path(ax: Axes, rows: np.ndarray, timeline: Timeline) -> None:
    """Draw the path seen from above, with a gap where a pose command moves the drone."""
    x, y = rows[:, 1], rows[:, 2]
    jumps = np.searchsorted(
        rows[:, 0], [item.at for item in timeline.entries if isinstance(item.action, Pose)], "right"
    )
    jumps = jumps[jumps < len(rows)]
    ax.plot(np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan), color=_BLUE)
    ax.plot(x[0], y[0], "o", color=_GREEN, label="start")
    ax.plot(x[-1], y[-1], "s", color=_RED, label="end")
    half = max(np.ptp(x), np.ptp(y), _MIN_PATH_SIZE) * 0.55
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
    if legend:  # above the axes, where it covers no data
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=4, fontsize="small", frameon=False, borderpad=0)


def _mark(ax: Axes, timeline: Timeline) -> None:
    """Shade the pushes, draw a line at the poses, and label both."""
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
        text.set_clip_on(True)  # hides labels after the end of the flight
        text.set_in_layout(False)
