"""Stage 8 of docs/tutorial.md: find the red gate in the front camera's picture, and fly through it."""

import json

import numpy as np
import tutorial
from tutorial import on_twist, sysCall_actuation  # called as they are

FIND = "color"  # or "mask", or "box"
EVERY = 2  # steps from one picture to the next
TURN, RISE = 1.0, 0.05  # rad/s, m: for half a picture off its middle
AHEAD, SEARCH = 0.5, 0.3  # m/s, rad/s
NEAR, LAST = 0.7, 6.0  # of the picture's width that the gate has; s that the drone flies on without looking


def sysCall_init():
    """Begin as the tutorial's script does; find the camera and, for the mask, the gate; subscribe to the boxes."""
    tutorial.sysCall_init()
    self.frontImage = sim.getObjectHandle("FrontVision")
    self.gate = sim.getObjectHandle("Red")
    self.boxes = []
    if FIND == "box":
        self.boxes_subscriber = simROS.subscribe("/drone/front/truth/boxes", "std_msgs/String", "on_boxes", 1)
    self.steps = 0
    self.until = None  # s, when it is through


def on_boxes(msg):
    """Keep the boxes of the last picture."""
    self.boxes = json.loads(msg.data)["objects"]


def by_color():
    """Return where there is red: rows x columns."""
    data, w, h = sim.getVisionSensorCharImage(self.frontImage)
    red, green, blue = np.moveaxis(np.frombuffer(data, np.uint8).reshape(h, w, 3)[::-1].astype(int), 2, 0)
    return (red > 2 * green) & (red > 2 * blue)


def by_mask():
    """Return where the gate is, by what the simulator knows: rows x columns."""
    w, h = sim.getVisionSensorRes(self.frontImage)
    depths = sim.checkVisionSensorEx(self.frontImage, self.gate, False)  # 1 where it is not
    return np.reshape(depths, (h, w))[::-1] < 1


def box_around(mask):
    """Return left, top, right and bottom of what is true in a mask, as shares from -1 to 1; None of nothing."""
    rows, columns = np.nonzero(mask)
    if len(rows) < 50:
        return None
    h, w = mask.shape
    return 2 * columns.min() / w - 1, 2 * rows.min() / h - 1, 2 * columns.max() / w - 1, 2 * rows.max() / h - 1


def by_box():
    """Return the same of the box that the camera publishes (`truth: true`)."""
    w, h = sim.getVisionSensorRes(self.frontImage)
    for one in self.boxes:
        if one["name"] == "Red":
            left, top, right, bottom = one["visible"]
            return 2 * left / w - 1, 2 * top / h - 1, 2 * right / w - 1, 2 * bottom / h - 1
    return None


FINDERS = {"color": lambda: box_around(by_color()), "mask": lambda: box_around(by_mask()), "box": by_box}


def sysCall_sensing():
    """Look now and then, and fly to what is seen; the tutorial's law does the rest."""
    now = sim.getSimulationTime()
    if self.until is not None:
        self.vx = AHEAD if now < self.until else 0
    elif self.steps % EVERY == 0:
        fly_to(FINDERS[FIND](), now)
    self.steps += 1
    tutorial.sysCall_sensing()


def fly_to(box, now):
    """Turn and rise to the middle of a box, and fly ahead; look round where there is none."""
    if box is None:
        self.vx, self.rz = 0, SEARCH
        return
    left, top, right, bottom = box
    self.vx, self.rz = AHEAD, -TURN * (left + right) / 2
    self.zref -= RISE * (top + bottom) / 2
    if right - left > 2 * NEAR:  # soon it is wider than the picture
        self.until, self.rz = now + LAST, 0


def sysCall_cleanup():
    """End what init began."""
    if FIND == "box":
        simROS.shutdownSubscriber(self.boxes_subscriber)
    tutorial.sysCall_cleanup()
