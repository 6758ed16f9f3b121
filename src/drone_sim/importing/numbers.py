"""Numbers as a scene file shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from drone_sim.mechanics import frames

_DIGITS = 6  # after the point: micrometres and microradians
_NOTHING = [0.0, 0.0, 0.0]


def number(value: float, digits: int = _DIGITS) -> float:
    """Return a number without the noise of its last digits, and without a -0."""
    return round(float(value), digits) + 0.0


def numbers(values: Iterable[float]) -> list[float]:
    """Return a list of such numbers."""
    return [number(value) for value in values]


def shade(color: Iterable[float]) -> list[float]:
    """Return a colour; of one that hides what is behind it, without the opacity."""
    red, green, blue, opacity = (number(value, 3) for value in color)
    return [red, green, blue] if opacity == 1 else [red, green, blue, opacity]


def pose_keys(matrix: Sequence[float]) -> dict[str, Any]:
    """Return `position` and `rpy` of a transform, what is zero left out."""
    keys = {"position": numbers(frames.position(matrix)), "rpy": numbers(frames.to_rpy(matrix))}
    return {key: value for key, value in keys.items() if value != _NOTHING}
