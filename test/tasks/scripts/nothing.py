"""Does nothing: the propellers stand."""


def sysCall_init():
    """Find nothing to do."""
