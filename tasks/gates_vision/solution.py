"""Find the gate by its hue, move before it, nose straight ahead, and fly through; then the next one."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

EVERY = 2  # steps from one picture to the next
FOV = 1.57  # rad
WIDTH, HEIGHT = 1.64, 1.82  # m, of a gate, bars and all; its middle is MIDDLE high
MIDDLE = 1.1  # m
HUES = [(115, 125), (5, 20)]  # of red and blue, where red and blue are exchanged: red then is no end of the circle
SMALLEST = 20  # px, a patch that counts
SIDEWAYS, AHEAD = 0.8, 0.5  # (m/s) per m, m/s
ALIGNED = 0.12  # m: so far from the gate's middle line, the drone may go on
CLOSE, BEHIND = 1.4, 0.8  # m: so near, the gate is flown through; so far behind it
TURN, SEARCH = 1.0, 0.4  # (rad/s) per rad, m/s


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.camera = sim.getObjectHandle("FrontVision")
    self.begin = sim.getObjectPosition(self.d, -1)
    self.gates = list(HUES)  # still to be flown through
    self.until = None  # x (m, world), while the drone flies through one
    self.steps = 0


def sysCall_sensing():
    """Look now and then; then fly as the tutorial does."""
    x, y, _ = sim.getObjectPosition(self.d, -1)
    self.rz = -TURN * sim.getObjectOrientation(self.d, -1)[2]
    rise = 0.5 * self.dt
    self.zref += min(max(MIDDLE - self.zref, -rise), rise)
    if self.until is not None and x > self.until:
        self.until = None
        self.gates.pop(0)
    if self.steps % EVERY == 0 and self.until is None:
        self.vx = self.vy = 0
        if self.gates:
            approach(look(*self.gates[0]), x, y)
    self.steps += 1
    tutorial.sysCall_sensing()


def look(lowest, highest):
    """Return how far ahead and to the left the gate of some hues is (m); None where it is not seen."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
    mask = cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_BGR2HSV), (lowest, 120, 50), (highest, 255, 255))
    patches, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    patch = max(patches, key=cv2.contourArea, default=None)
    if patch is None or cv2.contourArea(patch) < SMALLEST:
        return None
    left, _, wide, high = cv2.boundingRect(patch)
    focal = width / 2 / math.tan(FOV / 2)  # px
    ahead = HEIGHT * focal / high
    to_left, to_right = (ahead * (width / 2 - column) / focal for column in (left, left + wide))
    if left == 0:  # it goes on beyond the picture's edge
        to_left = to_right + WIDTH
    elif left + wide == width:
        to_right = to_left - WIDTH
    return ahead, (to_left + to_right) / 2


def approach(gate, x, y):
    """Move before the gate, and towards it; look for it from the middle of the course where it is not seen."""
    if gate is None:
        self.vy = math.copysign(SEARCH, self.begin[1] - y)
        return
    ahead, left = gate
    self.vy = min(max(SIDEWAYS * left, -AHEAD), AHEAD)
    self.vx = AHEAD if abs(left) < ALIGNED or ahead > 2 * CLOSE else 0
    if ahead < CLOSE and abs(left) < ALIGNED:
        self.until = x + ahead + BEHIND
        self.vx, self.vy = AHEAD, 0
