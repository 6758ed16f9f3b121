"""What a force is."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol

from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import State
from drone_sim.mechanics.wrench import Wrench


class PushedBody(Protocol):
    """The body that forces act on."""

    @property
    def mass(self) -> float:
        """Its mass (kg)."""

    @property
    def state(self) -> State:
        """Pose and velocity of its root link."""

    @property
    def matrix(self) -> Matrix:
        """World from its root link."""

    @property
    def wind(self) -> Vector:
        """Velocity of the air where it is (m/s, world)."""


class Force:
    """Acts on a body: asked once a step, as V-REP's scripts push, or before every sub-step.

    What it adds to the wrench of a step keeps its direction in the world through the sub-steps, and its point on the
    body. In a sub-step the body's state is that of this moment.
    """

    every_sub_step: ClassVar[bool] = False
    feels_wind: ClassVar[bool] = False  # of a vehicle that has such a force, weather needs no other

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        """Add what acts now. Forces in N, torques in N m, both in the world; points in the body's inertial frame."""
        raise NotImplementedError

    def save_state(self) -> Callable[[], None]:
        """Return a function that brings back what it is now, for a snapshot."""
        return lambda: None
