"""To begin with: the tutorial's controller, hovering, and the picture of its front camera."""

import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup  # called as they are


def sysCall_init():
    """Begin as the tutorial's script does; find the camera."""
    tutorial.sysCall_init()
    self.camera = sim.getObjectHandle("FrontVision")
    self.steps = 0


def sysCall_sensing():
    """Look now and then, and say what to fly: vx and vy in m/s, ahead and to the left, rz in rad/s."""
    if self.steps % 2 == 0:
        picture = look()
        red = (picture[..., 0] > 120) & (picture[..., 1] < 60)  # rows x columns: where the red gate may be
        self.vx = self.vy = self.rz = 0 * red.sum()  # what should stand here?
    self.steps += 1
    tutorial.sysCall_sensing()


def look():
    """Return the picture, rows x columns x 3 (red, green, blue), the top row first."""
    data, width, height = sim.getVisionSensorCharImage(self.camera)
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1]  # V-REP's begin with the bottom row
