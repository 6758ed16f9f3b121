"""Reach: the vehicle comes near to places, such as the centres of gates, one after the other."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from drone_sim.config.types import Point, Switch
from drone_sim.grading.criteria.criterion import Bound, Criterion, FlightPart, Hint, format_figure, label_or
from drone_sim.grading.result import Outcome

MAX_PLACES = 200


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
        track, targets = FlownTrack.of_part(part), self._target_positions(part)
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

    def _target_positions(self, part: FlightPart) -> list[np.ndarray]:
        """Return the position (3,) in m of every place. Raises CriterionFailed."""
        by_path = part.flight.objects_by_path
        targets = itertools.chain.from_iterable(
            by_path.get(place, [place]) if isinstance(place, str) else [place] for place in self.places
        )
        return [part.poses(target)[-1, :3] if isinstance(target, str) else np.array(target) for target in targets]


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
