"""Follow the red ball: turn to it, rise with it, and keep a distance, by what the front camera sees."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

EVERY = 2  # steps from one picture to the next
FOV = math.radians(60)
RADIUS, DISTANCE = 0.2, 2.0  # m: of the ball; to keep from it
LOWEST, HIGHEST = (115, 120, 50), (125, 255, 255)  # hue, saturation, value of red where blue and red are exchanged
SMALLEST = 12  # px, a patch that counts
AHEAD, TURN, RISE = 0.8, 2.0, 0.1  # (m/s) per m, (rad/s) per rad, m per m and picture
FASTEST, SEARCH = 1.0, 0.5  # m/s, rad/s


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.camera = sim.getObjectHandle("FrontVision")
    self.steps = 0


def sysCall_sensing():
    """Look now and then; then fly as the tutorial does."""
    if self.steps % EVERY == 0:
        follow(look())
    self.steps += 1
    tutorial.sysCall_sensing()


def look():
    """Return how far ahead, to the left and up the ball is (m, camera's frame); None where it is not seen."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
    # Red lies at both ends of the circle of hues. Read as BGR, what is red is blue, and lies in the middle.
    mask = cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_BGR2HSV), LOWEST, HIGHEST)
    patches, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    patch = max(patches, key=cv2.contourArea, default=None)
    if patch is None or cv2.contourArea(patch) < SMALLEST:
        return None
    (column, row), radius = cv2.minEnclosingCircle(patch)
    focal = width / 2 / math.tan(FOV / 2)  # px
    ahead = RADIUS * focal / radius
    return ahead, ahead * (width / 2 - 0.5 - column) / focal, ahead * (height / 2 - 0.5 - row) / focal


def follow(ball):
    """Turn to the ball, keep the distance, take its height; look round for it where it is not seen."""
    if ball is None:
        self.vx, self.rz = 0, SEARCH
        return
    ahead, left, up = ball
    up -= ahead * math.tan(self.pitch_prev)  # the camera nods with the body
    self.vx = min(max(AHEAD * (ahead - DISTANCE), -FASTEST), FASTEST)
    self.rz = TURN * math.atan2(left, ahead)
    self.zref += RISE * up
