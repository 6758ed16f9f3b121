"""Follow the line: the nose along it, the drone over it, as the floor camera sees it."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # noqa: F401 -- called as they are

# ruff: noqa: F821 -- `sim`, `simROS` and `self` are there when a child script runs

EVERY = 2  # steps from one picture to the next
SPEED = 0.5  # m/s along the line
DARK = 100  # of 255: the line's pixels are darker
ASIDE, TURN = 1.0, 1.5  # 1/s, speed per metre off the line; rad/s per rad off its direction
FOV = math.radians(60)


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.camera = sim.getObjectHandle("FloorVision")
    self.steps = 0


def sysCall_sensing():
    """Look now and then; then fly as the tutorial does."""
    if self.steps % EVERY == 0:
        steer(seen())
    self.steps += 1
    tutorial.sysCall_sensing()


def seen():
    """Return a mask of the line; the first row is what is farthest ahead."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # the bottom row comes first
    return cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), 0, DARK)


def steer(mask):
    """Fly along the line: to where it leaves the picture's middle, and over it."""
    rows, columns = np.nonzero(mask[: len(mask) // 2])  # the upper half: ahead
    if not len(rows):
        self.vx = self.vy = self.rz = 0  # the end
        return
    height = sim.getObjectPosition(self.d, -1)[2]
    metres = 2 * height * math.tan(FOV / 2) / mask.shape[1]  # of a pixel on the floor
    ahead = (mask.shape[0] / 2 - rows.mean()) * metres
    left = (mask.shape[1] / 2 - columns.mean()) * metres
    self.vx, self.vy, self.rz = SPEED, ASIDE * left, TURN * math.atan2(left, ahead)
