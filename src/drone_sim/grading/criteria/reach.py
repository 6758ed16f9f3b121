"""Reach: the vehicle comes near to places, such as the middles of gates, one after the other."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, PlainValidator, TypeAdapter, ValidationError

from drone_sim.config.types import Label, Point, Switch
from drone_sim.grading.criteria.criterion import Bound, Criterion, FlightPart, figure
from drone_sim.grading.result import Outcome

MAX_PLACES = 200


def _place(value: Any) -> Any:
    if isinstance(value, str):
        return TypeAdapter(Label).validate_python(value)
    try:
        return TypeAdapter(Point).validate_python(value)
    except ValidationError:
        raise ValueError("must be 3 numbers, [x, y, z] in m, or the name or path of an object or vehicle") from None


_Place = Annotated[tuple[float, float, float] | str, PlainValidator(_place)]


class Reach(Criterion):
    """`places` [x, y, z] (m) are to be reached in this order, `within` so many metres, before `until`.

    The name of an object or vehicle is where that is at the end of the part; a path, such as /Gate, is where each is
    that it finds at the beginning, in their order. With `partial` every place that is reached in order gives its share
    of the points.
    """

    kind: Literal["reach"]
    places: Annotated[list[_Place], Field(min_length=1, max_length=MAX_PLACES)]
    within: Bound
    partial: Switch = False

    is_lasting = False

    @property
    def others(self) -> tuple[str, ...]:
        """What it asks for."""
        return tuple({one: None for one in self.places if isinstance(one, str)})

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"all within {figure(self.within, 'm')}"

    def _judged(self, part: FlightPart) -> Outcome:
        way, here, places = _way(part), _Here(0, 0.0, 0.0), self._places(part)
        last: float | None = None
        for number, there in enumerate(places):
            here = _first_within(way, here, there, self.within)
            if here.distance > self.within:
                near, allowed = figure(here.distance, "m"), figure(self.within, "m")
                said = f"it came to {near} of place {number + 1}, at most {allowed} is allowed"
                return self._reached(number, len(places), f"reached {number} of {len(places)}; {said}", last)
            last = way.time(here)
        return self._reached(len(places), len(places), f"reached all {len(places)}, the last at {last:.2f} s", last)

    def _places(self, part: FlightPart) -> list[np.ndarray]:
        """Return every place, (3,) in m. Raises Missed."""
        found = part.flight.found
        each = (found.get(one, [one]) if isinstance(one, str) else [one] for one in self.places)
        return [
            part.poses(one)[-1, :3] if isinstance(one, str) else np.array(one)
            for one in itertools.chain.from_iterable(each)
        ]

    def _reached(self, reached: int, of: int, said: str, at: float | None) -> Outcome:
        outcome = self._outcome(reached == of, said, float(reached), "places", at)
        return replace(outcome, points=self.points * reached / of) if self.partial else outcome


class _Here(NamedTuple):
    """Where on the way: behind which row, which share of the way to the next, and how far (m) from a place."""

    row: int
    share: float
    distance: float


class _FlownWay(NamedTuple):
    """Rows of a flight: times (M,), places (M, 3), and from each the step (M, 3) to the next."""

    times: np.ndarray
    places: np.ndarray
    steps: np.ndarray
    puts: np.ndarray  # rows in which it has been put elsewhere since the one before

    def time(self, here: _Here) -> float:
        following = self.times[min(here.row + 1, len(self.times) - 1)]
        return float(self.times[here.row] + here.share * (following - self.times[here.row]))


def _way(part: FlightPart) -> _FlownWay:
    """Return the way in a part of a flight; where the vehicle was put elsewhere, it stays until it is there."""
    places = part.places()
    steps = np.zeros_like(places)
    steps[:-1] = np.diff(places, axis=0)
    puts = part.flight.puts - np.arange(len(part.flight.rows))[part.rows][0]
    puts = puts[(puts > 0) & (puts < len(places))]
    steps[puts - 1] = 0
    return _FlownWay(part.times, places, steps, puts)


def _first_within(way: _FlownWay, here: _Here, place: np.ndarray, radius: float) -> _Here:
    """Return where the way, from here on, first comes within a radius of a place, or else nearest to it."""
    to, steps = place - way.places[here.row :], way.steps[here.row :]
    squares = (steps**2).sum(axis=1)
    shares = np.clip((to * steps).sum(axis=1) / np.where(squares > 0, squares, 1), 0, 1)
    shares[0] = max(shares[0], here.share)
    distances = np.linalg.norm(to - shares[:, None] * steps, axis=1)
    for row in way.puts[way.puts >= here.row] - here.row:  # who was put there has not arrived: it has to come back
        away = np.flatnonzero(distances[row:] > radius)
        distances[row : row + away[0] if len(away) else None] = np.inf
    near = np.flatnonzero(distances <= radius)
    index = int(near[0]) if len(near) else int(distances.argmin())
    return _Here(here.row + index, float(shares[index]), float(distances[index]))
