"""A script that does nothing: the propellers stand still."""


def sysCall_init():
    """Do nothing."""
