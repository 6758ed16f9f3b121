"""The physics: bodies, dynamics, and their visual shapes. The only package that imports pybullet."""

import os


def _load_pybullet_quietly() -> None:
    """Import pybullet for the first time without the line about its build time on stderr."""
    stderr, devnull = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(devnull, 2)
    try:
        import pybullet  # noqa: F401
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)
        os.close(devnull)


_load_pybullet_quietly()

from drone_sim.world.world import World, connect_ahead  # noqa: E402

__all__ = ["World", "connect_ahead"]
