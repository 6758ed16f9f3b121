"""Follow the line: the nose along it and the drone over it, by what the floor camera sees."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

EVERY = 2  # steps from one picture to the next
SPEED = 0.5  # m/s, along the line
DARK = 100  # of 255: the line's pixels are darker
TURN, ASIDE = 1.5, 0.5  # (rad/s) per rad off its direction, (m/s) per m off it
FOV = math.radians(60)


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.camera = sim.getObjectHandle("FloorVision")
    self.steps = 0


def sysCall_sensing():
    """Look now and then; then fly as the tutorial does."""
    if self.steps % EVERY == 0:
        steer(look())
    self.steps += 1
    tutorial.sysCall_sensing()


def look():
    """Return a mask of the line, the top row first: that is what is farthest ahead."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
    return cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), 0, DARK)


def steer(mask):
    """Turn to where the line goes on, and move over it; stop where it ends."""
    rows, columns = np.nonzero(mask[: len(mask) // 2])  # the upper half: ahead
    if not len(rows):
        self.vx = self.vy = self.rz = 0
        return
    point = floor_point(columns.mean(), rows.mean(), *mask.shape[::-1])
    there = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    ahead, left, _ = sim.multiplyVector(there, [*point, 0])
    self.vx, self.vy, self.rz = SPEED, ASIDE * left, TURN * math.atan2(left, ahead)


def floor_point(column, row, width, height):
    """Return where the floor is that a pixel shows (x, y in m, world).

    The camera leans with the body: so the ray through the pixel is turned into the world, and followed down to z = 0.
    """
    focal = width / 2 / math.tan(FOV / 2)  # px
    ray = [(width / 2 - 0.5 - column) / focal, (height / 2 - 0.5 - row) / focal, 1]  # x left, y up, z forward
    matrix = sim.getObjectMatrix(self.camera, -1)
    x, y, z = matrix[3], matrix[7], matrix[11]
    far = sim.multiplyVector(matrix, ray)
    share = z / (z - far[2])
    return [x + share * (far[0] - x), y + share * (far[1] - y)]
