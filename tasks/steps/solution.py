"""Follow velocity commands as the tutorial's script does, with half the lag in the inner loop."""

import tutorial
from tutorial import on_twist, sysCall_actuation, sysCall_cleanup, sysCall_sensing  # called as they are


def sysCall_init():
    """Begin as the tutorial's script does; then lean over faster."""
    tutorial.sysCall_init()
    self.Pangle = 0.6  # 1 per rad; the lag of the inner loop is Dangle / Pangle
