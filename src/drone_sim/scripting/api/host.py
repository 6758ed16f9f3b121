"""What the script API needs from the object that a script is attached to, and from the drone that has it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.control import Control
from drone_sim.scripting.api.custom_values import CustomData
from drone_sim.scripting.api.distances import MeasureWay, no_way
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.tubes import Tubes
from drone_sim.scripting.api.turns import Turns
from drone_sim.scripting.api.windows import Windows


def _call(function: Callable[[], Any]) -> Any:
    return function()


class Readable(Protocol):
    """A sensor, as the API sees it."""

    def read(self) -> dict[str, Any] | None:
        """Return its last reading, by field; None before there is one."""


class Host(Protocol):
    """The drone, or what else a script is attached to, as the API sees it."""

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """Its sensors, cameras aside, by the name of their object."""

    @property
    def objects(self) -> ObjectTree:
        """The objects of the scene, which several drones share."""

    @property
    def scripts(self) -> Scripts:
        """The scripts of the simulation, this one among them."""

    @property
    def signals(self) -> Signals:
        """The signals that scripts leave, for those of other drones, too."""

    @property
    def own_script(self) -> str:
        """Name of the object that this script is attached to, with its suffix: 'Drone', 'Drone#0'."""

    @property
    def drawings(self) -> Drawings:
        """What is drawn, by all drones together."""

    @property
    def windows(self) -> Windows:
        """The views, dialogs and consoles that scripts have opened."""

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in the frame of a shape, and a torque (N m).

        Raises ValueError for what is none of the drone's.
        """

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Turn a joint to an angle (rad), unless None; return the angle. Raises ValueError for what is none."""


@dataclass(frozen=True)
class Surroundings:
    """What the API needs besides the drone: the simulation's clock, and the vision sensors by object name."""

    clock: Callable[[], float]
    time_step: float
    pictures: Mapping[str, Callable[[], np.ndarray]] = field(default_factory=dict)
    outside: Callable[[Callable[[], Any]], Any] = _call  # calls a function where OpenGL is, on nobody's time limit
    inside: Callable[[Callable[[], Any]], Any] = _call  # the same, on this script's time limit
    turns: Turns = field(default_factory=Turns)  # of the script's thread
    planes: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # m: the near and far plane of each
    gravity: float = -9.81  # m/s² along z
    masses: Callable[[], Mapping[str, float]] = dict  # kg, of the shapes that the dynamics move, by object name
    inertias: Callable[[], Mapping[str, Inertia]] = dict  # how these lie in each, in its frame
    control: Control = field(default_factory=Control)
    data: CustomData = field(default_factory=CustomData)
    tubes: Tubes = field(default_factory=Tubes)
    nearest: MeasureWay = no_way
