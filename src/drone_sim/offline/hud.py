"""Head-up display: draws a vehicle's state over an image."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from drone_sim.mechanics import frames

_WHITE, _SKY, _GROUND, _WINGS = (255, 255, 255), (200, 130, 60), (50, 90, 130), (0, 220, 255)  # BGR
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LETTER = 22  # px, height of the font at scale 1
_STRIP = 1 / 16  # of the image's height: the dark strips behind the text, at top and bottom
_MIN_STRIP = 16  # px
_STRIP_BRIGHTNESS = 0.45  # factor of the image's brightness in a strip
_DIAL = 2.6  # diameter of the artificial horizon, in heights of a strip
_SHOWN_PITCH = math.radians(45)  # rad, at the horizon's rim


class HudState(NamedTuple):
    time: float  # s
    state: str  # one word
    height: float  # m
    speed: float  # m/s
    roll: float  # rad, as in ROS: positive with the right side down
    pitch: float  # rad, positive with the nose down
    yaw: float  # rad, positive to the left

    @classmethod
    def of(cls, row: Sequence[float], state: str) -> HudState:
        """Return the state in a row of a recording."""
        roll, pitch, yaw = frames.to_rpy(frames.from_quaternion(row[1:4], row[4:8]))
        return cls(row[0], state, row[3], math.hypot(*row[8:11]), roll, pitch, yaw)


def draw(picture: np.ndarray, flight: HudState) -> None:
    """Draw the display over an image, BGR (height, width, 3) uint8, at least 160 x 120."""
    strip = _strip(picture)
    for part in (picture[:strip], picture[-strip:]):
        part[:] = (part * _STRIP_BRIGHTNESS).astype(np.uint8)
    _write(picture[:strip], flight.state, f"t {flight.time:.2f} s")
    degrees = (round(math.degrees(angle)) + 0.0 for angle in flight[4:7])  # + 0.0 turns -0 into 0
    attitude = "roll {:+.0f}  pitch {:+.0f}  yaw {:+.0f} deg".format(*degrees)
    _write(picture[-strip:], f"height {flight.height:.2f} m  speed {flight.speed:.2f} m/s", attitude)
    _horizon(dial(picture), flight)


def dial(picture: np.ndarray) -> np.ndarray:
    """Return the square part of an image that contains the artificial horizon."""
    height, width = picture.shape[:2]
    strip = _strip(picture)
    size = min(round(strip * _DIAL), height // 3)
    top, left = height - strip - size - strip // 2, width - size - strip // 2
    return picture[top : top + size, left : left + size]


def _strip(picture: np.ndarray) -> int:
    return max(_MIN_STRIP, round(len(picture) * _STRIP))


def _write(strip: np.ndarray, left: str, right: str) -> None:
    """Write texts at both ends of a strip, as large as fits."""
    height, width = strip.shape[:2]
    scale = 0.6 * height / _LETTER
    margin = height // 3
    needed = sum(cv2.getTextSize(text, _FONT, scale, 1)[0][0] for text in (left, right))
    scale *= min(1.0, (width - 5 * margin) / needed)
    for text, at_right in ((left, False), (right, True)):
        (text_width, text_height), _ = cv2.getTextSize(text, _FONT, scale, 1)
        position = (width - margin - text_width if at_right else margin, (height + text_height) // 2)
        cv2.putText(strip, text, position, _FONT, scale, _WHITE, 1, cv2.LINE_AA)


def _horizon(square: np.ndarray, flight: HudState) -> None:
    """Draw an artificial horizon: the ground as seen straight ahead, behind a symbol for the drone's wings."""
    size = len(square)
    right, down = np.meshgrid(*[np.linspace(-1, 1, size)] * 2)
    inside = right**2 + down**2 <= 1
    # With the right side down the view rotates to the left; with the nose down it moves up.
    below = down * math.cos(flight.roll) + right * math.sin(flight.roll) > -flight.pitch / _SHOWN_PITCH
    square[inside & ~below] = _SKY
    square[inside & below] = _GROUND
    middle = size // 2
    cv2.line(square, (size // 5, middle), (size - size // 5, middle), _WINGS, max(1, size // 40), cv2.LINE_AA)
    cv2.circle(square, (middle, middle), middle - 1, _WHITE, 1, cv2.LINE_AA)
