"""To begin with: the tutorial's controller, which obeys what `on_twist` keeps; that is not much yet."""

from tutorial import sysCall_actuation, sysCall_cleanup, sysCall_init, sysCall_sensing  # called as they are


def on_twist(msg):
    """Keep the command that has come: `linear` in m/s, `angular` in rad/s, ahead, to the left and up."""
    self.vx = msg.linear.x  # the others are self.vy, self.vz and self.rz
