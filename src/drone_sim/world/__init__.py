"""The world: bodies, dynamics, and what can be seen of them. The only package that imports pybullet."""

import os


def _load_pybullet_quietly() -> None:
    """Import pybullet for the first time, without the line on stderr that says when it was compiled."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


_load_pybullet_quietly()

from drone_sim.world.world import World, connect_ahead  # noqa: E402

__all__ = ["World", "connect_ahead"]
