"""The interface of forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol

from drone_sim.mechanics.frames import Matrix, Vector
from drone_sim.mechanics.state import State
from drone_sim.mechanics.wrench import Wrench


class PushedBody(Protocol):
    """The body that a force acts on."""

    @property
    def mass(self) -> float:
        """The body's mass (kg)."""

    @property
    def state(self) -> State:
        """Pose and velocity of the body's root link."""

    @property
    def matrix(self) -> Matrix:
        """Transform world from the root link."""

    @property
    def wind(self) -> Vector:
        """Velocity of the air at the body (m/s, world)."""


class Force:
    """A force on a body, called once a step, as V-REP's scripts apply forces, or before every sub-step.

    Wrenches that are added once a step keep their direction in the world and their point on the body through all
    sub-steps. In a sub-step the body's state is the present one.
    """

    every_sub_step: ClassVar[bool] = False
    feels_wind: ClassVar[bool] = False  # if any force of a vehicle does, weather adds no default drag

    def add_to(self, wrench: Wrench, body: PushedBody) -> None:
        """Add the present wrench: N and N m, both in the world; points in the body's inertial frame."""
        raise NotImplementedError

    def save_state(self) -> Callable[[], None]:
        """Return a function that restores the present state, for a snapshot."""
        return lambda: None
