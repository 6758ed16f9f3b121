"""A head-up display: what the drone does, written over a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.mechanics import frames

_WHITE, _SKY, _GROUND, _WINGS = (255, 255, 255), (200, 130, 60), (50, 90, 130), (0, 220, 255)  # BGR
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LETTER = 22  # px, the height of the font at scale 1
_STRIP = 1 / 16  # of the picture's height: each of the dark strips that the text stands on
_SMALLEST_STRIP = 16  # px
_DARKENED = 0.45  # how much of the picture is left under a strip
_DIAL = 2.6  # strips, the diameter of the artificial horizon
_SHOWN_PITCH = math.radians(45)  # at the horizon's rim


class HudState(NamedTuple):
    """What is shown: of one moment."""

    time: float  # s
    state: str  # in a word
    height: float  # m
    speed: float  # m/s
    roll: float  # rad, as ROS counts: right side down
    pitch: float  # rad, nose down
    yaw: float  # rad, to the left

    @classmethod
    def of(cls, row: Sequence[float], state: str) -> HudState:
        """Return that of a row of a recording."""
        roll, pitch, yaw = frames.to_rpy(frames.from_quaternion(row[1:4], row[4:8]))
        return cls(row[0], state, row[3], math.hypot(*row[8:11]), roll, pitch, yaw)


def draw(picture: np.ndarray, flight: HudState) -> None:
    """Draw it over a picture, BGR (height, width, 3) uint8, at least 160 x 120."""
    strip = _strip(picture)
    for part in (picture[:strip], picture[-strip:]):
        part[:] = (part * _DARKENED).astype(np.uint8)
    _write(picture[:strip], flight.state, f"t {flight.time:.2f} s")
    attitude = "roll {:+.0f}  pitch {:+.0f}  yaw {:+.0f} deg".format(*map(_degrees, flight[4:7]))
    _write(picture[-strip:], f"height {flight.height:.2f} m  speed {flight.speed:.2f} m/s", attitude)
    _horizon(dial(picture), flight)


def dial(picture: np.ndarray) -> np.ndarray:
    """Return the square of a picture in which the artificial horizon stands."""
    height, width = picture.shape[:2]
    strip = _strip(picture)
    size = min(round(strip * _DIAL), height // 3)
    top, left = height - strip - size - strip // 2, width - size - strip // 2
    return picture[top : top + size, left : left + size]


def _strip(picture: np.ndarray) -> int:
    return max(_SMALLEST_STRIP, round(len(picture) * _STRIP))


def _degrees(angle: float) -> float:
    return round(math.degrees(angle)) + 0.0  # which makes a 0 of -0


def _write(strip: np.ndarray, left: str, right: str) -> None:
    """Write at both ends of a strip, as large as fits."""
    height, width = strip.shape[:2]
    scale = 0.6 * height / _LETTER
    margin = height // 3
    needed = sum(cv2.getTextSize(text, _FONT, scale, 1)[0][0] for text in (left, right))
    scale *= min(1.0, (width - 5 * margin) / needed)
    for text, at_right in ((left, False), (right, True)):
        (wide, high), _ = cv2.getTextSize(text, _FONT, scale, 1)
        place = (width - margin - wide if at_right else margin, (height + high) // 2)
        cv2.putText(strip, text, place, _FONT, scale, _WHITE, 1, cv2.LINE_AA)


def _horizon(square: np.ndarray, flight: HudState) -> None:
    """Draw an artificial horizon: the ground as it would be seen straight ahead, behind the wings of the drone."""
    size = len(square)
    right, down = np.meshgrid(*[np.linspace(-1, 1, size)] * 2)
    inside = right**2 + down**2 <= 1
    # Right side down turns what is seen to the left; nose down moves it up.
    below = down * math.cos(flight.roll) + right * math.sin(flight.roll) > -flight.pitch / _SHOWN_PITCH
    square[inside & ~below] = _SKY
    square[inside & below] = _GROUND
    middle = size // 2
    cv2.line(square, (size // 5, middle), (size - size // 5, middle), _WINGS, max(1, size // 40), cv2.LINE_AA)
    cv2.circle(square, (middle, middle), middle - 1, _WHITE, 1, cv2.LINE_AA)
