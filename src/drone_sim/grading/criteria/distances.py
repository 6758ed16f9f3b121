"""Criteria of positions: the distance from a position, a vehicle, an object or a path, and places to be reached."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from drone_sim.config.types import Fraction, Label, Point, Switch
from drone_sim.grading.criteria.criterion import (
    AtMostCriterion,
    Bound,
    Criterion,
    CriterionFailed,
    FlightPart,
    Hint,
    format_figure,
    label_or,
)
from drone_sim.grading.result import Outcome

MAX_CORNERS = 1000
MAX_PLACES = 200
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


# ---- places

_Place = Annotated[
    tuple[float, float, float] | str,
    label_or(Point, "must be 3 numbers, [x, y, z] in m, or the name or path of an object or vehicle"),
]


class Reach(Criterion):
    """The vehicle comes `within` so many metres of each of the `places` in this order.

    A place is [x, y, z] (m), or the name of an object or vehicle, which stands for its position at the end of the part.
    A path, such as /Gate, stands for all objects that it finds at the beginning, in their order. With `partial` every
    place that is reached in order gives its share of the points.
    """

    kind: Literal["reach"]
    hint: Hint = "Print the distance to the next place, and go on only when you are near enough."
    places: Annotated[list[_Place], Field(min_length=1, max_length=MAX_PLACES)]
    within: Bound
    partial: Switch = False

    is_lasting = False

    @property
    def object_names(self) -> tuple[str, ...]:
        return tuple({place: None for place in self.places if isinstance(place, str)})

    @property
    def allowed(self) -> str:
        return f"all within {format_figure(self.within, 'm')}"

    def _judge_part(self, part: FlightPart) -> Outcome:
        track = FlownTrack.of_part(part)
        by_path = part.flight.objects_by_path
        places = itertools.chain.from_iterable(
            by_path.get(place, [place]) if isinstance(place, str) else [place] for place in self.places
        )
        targets = [part.poses(place)[-1, :3] if isinstance(place, str) else np.array(place) for place in places]
        here, reached = TrackPoint(0, 0.0, 0.0), 0
        reached_at: float | None = None
        for target in targets:
            here = track.approach(here, target, self.within)
            if here.distance > self.within:
                break
            reached, reached_at = reached + 1, track.time_at(here)
        if reached == len(targets):
            sentence = f"reached all {reached}, the last at {reached_at:.2f} s"
        else:
            nearest, allowed = format_figure(here.distance, "m"), format_figure(self.within, "m")
            sentence = (
                f"reached {reached} of {len(targets)}; "
                f"it came to {nearest} of place {reached + 1}, at most {allowed} is allowed"
            )
        outcome = self._make_outcome(reached == len(targets), sentence, float(reached), "places", reached_at)
        return replace(outcome, points=self.points * reached / len(targets)) if self.partial else outcome


class TrackPoint(NamedTuple):
    """A point of a flown track, between a row and the next one, and its distance to a target."""

    row: int
    share: float  # of the way to the next row
    distance: float  # m


class FlownTrack(NamedTuple):
    """The polyline that a vehicle flew in a part of a flight."""

    times: np.ndarray  # (M,) in s
    positions: np.ndarray  # (M, 3) in m
    steps: np.ndarray  # (M, 3), from each position to the next
    teleports: np.ndarray  # rows before which the vehicle was moved to another position

    @classmethod
    def of_part(cls, part: FlightPart) -> FlownTrack:
        """Return the track of a part of a flight; before a teleport the vehicle stays where it is."""
        positions = part.positions()
        steps = np.zeros_like(positions)
        steps[:-1] = np.diff(positions, axis=0)
        teleports = part.flight.teleports - np.arange(len(part.flight.rows))[part.rows][0]
        teleports = teleports[(teleports > 0) & (teleports < len(positions))]
        steps[teleports - 1] = 0
        return cls(part.times, positions, steps, teleports)

    def time_at(self, point: TrackPoint) -> float:
        """Return the simulated time (s) of a point."""
        following = self.times[min(point.row + 1, len(self.times) - 1)]
        return float(self.times[point.row] + point.share * (following - self.times[point.row]))

    def approach(self, start: TrackPoint, target: np.ndarray, radius: float) -> TrackPoint:
        """Return the first point after `start` within `radius` of the target, or the nearest if there is none."""
        offsets, steps = target - self.positions[start.row :], self.steps[start.row :]
        squares = (steps**2).sum(axis=1)
        shares = np.clip((offsets * steps).sum(axis=1) / np.where(squares > 0, squares, 1), 0, 1)
        shares[0] = max(shares[0], start.share)
        distances = np.linalg.norm(offsets - shares[:, None] * steps, axis=1)
        for row in self.teleports[self.teleports >= start.row] - start.row:
            # A vehicle that was moved to the target has not reached it: it must leave, and come back.
            outside = np.flatnonzero(distances[row:] > radius)
            distances[row : row + outside[0] if len(outside) else None] = np.inf
        within = np.flatnonzero(distances <= radius)
        index = int(within[0]) if len(within) else int(distances.argmin())
        return TrackPoint(start.row + index, float(shares[index]), float(distances[index]))
