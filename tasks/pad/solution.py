"""Climb until the floor camera sees the pad, fly over it, and descend on it."""

import math

import cv2
import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are

TAG = 7
EVERY = 4  # steps from one picture to the next
FOV = math.radians(60)
CLIMB, HIGHEST = 0.5, 3.0  # m/s, m
APPROACH, FASTEST = 0.5, 0.6  # 1/s, m/s
OVER, SLOW = 0.08, 0.08  # m, m/s: over the pad, and near to standing
DESCENT = 0.25  # m/s
STANDS, STANDS_FOR = 0.05, 0.5  # m/s, s: so slow so long in the descent, it has landed


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # twice the tutorial's: it swings less (its stage 4)
    self.camera = sim.getObjectHandle("FloorVision")
    self.find_tags = finder()
    self.pad = None  # x, y (m, world), once it has been seen
    self.still = 0.0  # s
    self.work = search
    self.steps = 0


def sysCall_sensing():
    """Look now and then, and do what is to be done next; the tutorial's script flies."""
    if self.steps % EVERY == 0:
        self.pad = look() or self.pad
    self.steps += 1
    self.work()
    tutorial.sysCall_sensing()
    if self.work is rest:
        self.thrust = 0


def finder():
    """Return what finds tags in a grey picture: their corners, their numbers, and what is none."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    if hasattr(cv2.aruco, "ArucoDetector"):
        return cv2.aruco.ArucoDetector(dictionary).detectMarkers
    return lambda grey: cv2.aruco.detectMarkers(grey, dictionary)  # OpenCV 4.6, as Debian 12 has it


def look():
    """Return where the pad is (x, y in m, world), None where it is not seen."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    picture = np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
    corners, tags, _ = self.find_tags(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
    for quad, tag in zip(corners, [] if tags is None else tags.ravel()):
        if tag == TAG:
            return floor_point(*quad.reshape(4, 2).mean(axis=0), width, height)
    return None


def search():
    """Climb until it is seen."""
    z = sim.getObjectPosition(self.d, -1)[2]
    self.vz = CLIMB if z < HIGHEST else 0
    if self.pad:
        self.vz, self.work = 0, approach


def approach():
    """Fly over it, and wait there until the drone stands still."""
    distance = go_over()
    if distance < OVER and math.hypot(*sim.getObjectVelocity(self.d)[0]) < SLOW:
        self.work = descend


def descend():
    """Sink, over the pad, until something holds the drone."""
    go_over()
    self.vz = -DESCENT
    self.still = self.still + self.dt if abs(sim.getObjectVelocity(self.d)[0][2]) < STANDS else 0.0
    if self.still > STANDS_FOR:
        self.work = rest


def rest():
    """Command nothing: the propellers stand."""
    self.vx = self.vy = self.vz = 0


def go_over():
    """Fly towards the pad, the slower the nearer; return how far it is (m)."""
    there = sim.getInvertedMatrix(sim.getObjectMatrix(self.trackBase, -1))
    ahead, left, _ = sim.multiplyVector(there, [*self.pad, 0])
    distance = math.hypot(ahead, left)
    speed = min(APPROACH, FASTEST / distance) if distance else 0
    self.vx, self.vy = speed * ahead, speed * left
    return distance


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
