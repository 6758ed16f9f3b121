"""The world: bodies, dynamics, and what can be seen of them. The only package that imports pybullet."""

from drone_sim.world.shapes import Shape
from drone_sim.world.world import World

__all__ = ["Shape", "World"]
