"""No child script: what it is attached to falls, unless somebody else flies it."""


def sysCall_init():
    """Do nothing."""
