"""Empty child script: the vehicle falls, unless another script or a client flies it."""


def sysCall_init():
    """Do nothing."""
