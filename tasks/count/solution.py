"""Turn once around, and count the red balls that the front camera sees; a ball seen twice is at the same place."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

EVERY = 4  # steps from one picture to the next
FOV = math.radians(60)
RADIUS = 0.15  # m, of a ball
LOWEST, HIGHEST = (115, 120, 50), (125, 255, 255)  # hue, saturation, value of red where blue and red are exchanged
SMALLEST = 12  # px, a patch that counts
TURN, BEGIN = 0.5, 1.0  # rad/s; s, when the turn begins
APART = 0.6  # m: what is seen nearer to one another is one ball


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.camera = sim.getObjectHandle("FrontVision")
    self.balls = []  # x, y (m, world), as they were seen first
    self.steps = 0
    self.turned = 0.0  # rad


def sysCall_sensing():
    """Turn once around and look now and then; tell what was seen at the end."""
    if self.turned < 2 * math.pi:
        self.rz = TURN if sim.getSimulationTime() > BEGIN else 0
        self.turned += max(0, sim.getObjectVelocity(self.d)[1][2]) * self.dt
        if self.steps % EVERY == 0:
            look()
        self.steps += 1
    else:
        self.rz = 0
        sim.setIntegerSignal("counted", len(self.balls))
    tutorial.sysCall_sensing()


def look():
    """Take down the balls that were not seen before."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
    # Red lies at both ends of the circle of hues. Read as BGR, what is red is blue, and lies in the middle.
    mask = cv2.inRange(cv2.cvtColor(picture, cv2.COLOR_BGR2HSV), LOWEST, HIGHEST)
    patches, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    focal = width / 2 / math.tan(FOV / 2)  # px
    for patch in patches:
        left, top, wide, high = cv2.boundingRect(patch)
        is_whole = left > 0 and top > 0 and left + wide < width and top + high < height
        if is_whole and cv2.contourArea(patch) >= SMALLEST:
            (column, row), radius = cv2.minEnclosingCircle(patch)
            ahead = RADIUS * focal / radius
            place((width / 2 - 0.5 - column) / focal * ahead, (height / 2 - 0.5 - row) / focal * ahead, ahead)


def place(left, up, ahead):
    """Take down a ball, given in the camera's frame (m), unless one is known near there."""
    ball = sim.multiplyVector(sim.getObjectMatrix(self.camera, -1), [left, up, ahead])
    if all(math.dist(ball[:2], known) > APART for known in self.balls):
        self.balls.append(ball[:2])
