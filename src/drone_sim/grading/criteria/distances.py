"""Criteria of a distance: from a position, from another vehicle or object, and from a path."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from drone_sim.config.types import Fraction, Label, Point
from drone_sim.grading.criteria.criterion import AtMostCriterion, CriterionFailed, FlightPart, Hint, format_figure
from drone_sim.grading.result import Outcome

MAX_CORNERS = 1000
_SAMPLES = 400  # points of a path at which its coverage is computed
_MEASURE_WORDS = {"largest": "up to", "mean": "in the mean", "rms": "in the root mean square"}


class DistanceCriterion(AtMostCriterion):
    """A distance (m) along some axes of the world that must not be larger than `at_most`."""

    axes: Literal["xyz", "xy", "xz", "yz", "x", "y", "z"] = "xyz"
    measure: Literal["largest", "mean", "rms"] = "largest"

    unit = "m"

    def _select_axes(self, vectors: np.ndarray) -> np.ndarray:
        """Return the columns of `vectors` (..., 3) that `axes` names."""
        return vectors[..., ["xyz".index(axis) for axis in self.axes]]

    def _judge_distances(self, distances: np.ndarray, times: np.ndarray, reference: str) -> Outcome:
        """Return the outcome of distances (M,) at times (M,); `reference` names what they are measured from.

        The deciding moment is when the largest allowed distance was first exceeded, otherwise when the distance was
        largest.
        """
        worst = int(distances.argmax())
        value = {
            "largest": float(distances[worst]),
            "mean": float(distances.mean()),
            "rms": float(np.sqrt((distances**2).mean())),
        }[self.measure]
        when = f" at {times[worst]:.2f} s" if self.measure == "largest" else ""
        sentence = f"was {_MEASURE_WORDS[self.measure]} {format_figure(value, 'm')} from {reference}{when}"
        is_exceeded = self.measure == "largest" and value > self.at_most
        decisive = int((distances > self.at_most).argmax()) if is_exceeded else worst
        return self._compare(value, sentence, float(times[decisive]))


class Drift(DistanceCriterion):
    """The distance from the position `from` ([x, y, z] in m, world), by default the vehicle's position at `after`."""

    kind: Literal["drift"]
    hint: Hint = "Command a speed towards the place that grows with the distance to it."
    place: Point | None = Field(default=None, alias="from")

    def _judge_part(self, part: FlightPart) -> Outcome:
        positions = part.positions()
        origin = positions[0] if self.place is None else np.array(self.place)
        reference = "where it began" if self.place is None else "its place"
        distances = np.linalg.norm(self._select_axes(positions - origin), axis=1)
        return self._judge_distances(distances, part.times, reference)


class Formation(DistanceCriterion):
    """The distance from the position that is `offset` (m) from `to`, a vehicle's name or an object's.

    The offset is along the axes of the world, or, with `turns`, along those of a level frame with the yaw of `to`.
    """

    kind: Literal["formation"]
    hint: Hint = "Aim at the place where the other one will be: add its velocity to yours."
    to: Label
    offset: Point = (0.0, 0.0, 0.0)
    turns: bool = False

    @property
    def object_names(self) -> tuple[str, ...]:
        return (self.to,)

    def _judge_part(self, part: FlightPart) -> Outcome:
        poses = part.poses(self.to)
        offsets = np.tile(self.offset, (len(poses), 1))
        if self.turns:
            x, y, z, w = poses[:, 3:7].T
            yaw = np.arctan2(2 * (x * y + z * w), 1 - 2 * (y * y + z * z))
            forward, left, _ = self.offset
            offsets[:, 0] = np.cos(yaw) * forward - np.sin(yaw) * left
            offsets[:, 1] = np.sin(yaw) * forward + np.cos(yaw) * left
        gaps = part.positions() - poses[:, :3] - offsets
        reference = f"its place beside {self.to}" if any(self.offset) else self.to
        return self._judge_distances(np.linalg.norm(self._select_axes(gaps), axis=1), part.times, reference)


class PathFollowing(DistanceCriterion):
    """The distance from a polyline: `along` are its corners, or the name of a path in the scene.

    `closed` adds a line from the last corner to the first. `covers` is the share of the polyline that must be flown:
    the share that the vehicle has been within `at_most` of.
    """

    kind: Literal["path"]
    hint: Hint = "Fly more slowly in the corners, or correct the distance to the path more strongly."
    along: Annotated[list[Point], Field(min_length=2, max_length=MAX_CORNERS)] | Label
    closed: bool = False
    covers: Fraction = 0.0

    @property
    def path_names(self) -> tuple[str, ...]:
        return (self.along,) if isinstance(self.along, str) else ()

    def _judge_part(self, part: FlightPart) -> Outcome:
        positions = self._select_axes(part.positions())
        if not isinstance(self.along, str):
            corners = np.array(self.along)
        elif self.along in part.flight.paths:
            corners = part.flight.paths[self.along]
        else:
            raise CriterionFailed(f"the flight has no path '{self.along}'")
        corners = self._select_axes(corners)
        if self.closed:
            corners = np.vstack((corners, corners[:1]))
        coverage = _coverage(corners, positions, self.at_most) if self.covers else 1.0
        if coverage < self.covers:
            flown, wanted = (format_figure(100 * share, "%") for share in (coverage, self.covers))
            return self.fail(f"flew {flown} of the path; at least {wanted} is wanted")
        return self._judge_distances(distances_to_polyline(positions, corners), part.times, "the path")


def distances_to_polyline(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the distances (M,) from positions (M, D) to the polyline with the corners (K, D), K >= 2."""
    squares = np.full(len(positions), np.inf)
    for start, line in zip(corners[:-1], np.diff(corners, axis=0)):  # one by one: M * K * D values may be too many
        offsets, length = positions - start, float(line @ line)
        share = np.clip(offsets @ line / length, 0, 1) if length else np.zeros(len(positions))
        squares = np.minimum(squares, ((offsets - share[:, None] * line) ** 2).sum(axis=1))
    return np.sqrt(squares)


def _coverage(corners: np.ndarray, positions: np.ndarray, radius: float) -> float:
    """Return the share of a polyline (K, D) that is within a radius of one of the positions (M, D)."""
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    distances = np.concatenate(([0.0], np.cumsum(lengths)))
    at = np.linspace(0, distances[-1], _SAMPLES)
    samples = np.column_stack([np.interp(at, distances, column) for column in corners.T])
    return float(np.mean([((positions - sample) ** 2).sum(axis=1).min() <= radius**2 for sample in samples]))
