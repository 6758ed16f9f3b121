"""What the script API needs from the object that a script is attached to, and from the drone that has it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.object_collections import Collections
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.scripting.api.broadcasts import Broadcasts
from drone_sim.scripting.api.control import Control, Turns
from drone_sim.scripting.api.custom_data import CustomData
from drone_sim.scripting.api.distances import MeasureWay
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.graphs import Graphs
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.remote_ports import RemotePorts
from drone_sim.scripting.api.signals import Signals, Tubes
from drone_sim.scripting.api.types import WrongValue
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.breakpoints import Breakpoints

_Kind = TypeVar("_Kind")
_MOST_NAMES = 20  # in a message
Caller = Callable[[Callable[[], Any]], Any]


class Readable(Protocol):
    """A sensor, as the API sees it."""

    def read(self) -> dict[str, Any] | None:
        """Return its last reading, by field; None before there is one."""


@dataclass(kw_only=True)
class ScriptContext:
    """What the scripts of a simulation share: clock, gravity (m/s² along z), objects, and what they leave there."""

    clock: Clock
    gravity: float
    drawings: Drawings
    windows: Windows
    objects: ObjectTree
    velocities: VelocityMeter  # of the objects
    scripts: Scripts = field(default_factory=Scripts)
    signals: Signals = field(default_factory=Signals)
    graphs: Graphs = field(default_factory=Graphs)
    control: Control = field(default_factory=Control)
    data: CustomData = field(default_factory=CustomData)
    tubes: Tubes = field(default_factory=Tubes)
    collections: Collections = field(default_factory=Collections)
    broadcasts: Broadcasts = field(default_factory=Broadcasts)
    breakpoints: Breakpoints = field(default_factory=Breakpoints)  # which last longer than a run
    remote_ports: RemotePorts = field(default_factory=RemotePorts)

    def clear(self) -> None:
        """Clear all parts, as before a run; they stay the same Python objects, so references to them remain valid."""
        parts = self.objects, self.velocities, self.scripts, self.signals, self.control, self.data, self.tubes
        for one in (*parts, self.graphs, self.collections, self.broadcasts, self.remote_ports):
            one.clear()


class Host(Protocol):
    """The drone, or what else a script is attached to, as the API sees it."""

    @property
    def context(self) -> ScriptContext:
        """What all scripts share."""

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """Its sensors, cameras aside, by the name of their object."""

    @property
    def own_script(self) -> str:
        """Name of the object that this script is attached to, with its suffix: 'Drone', 'Drone#0'."""

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in the frame of a shape, and a torque (N m).

        Raises ValueError for a shape that is not a part of the drone.
        """

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Forget the forces on a shape, or the torques, or both, that were added since the last step.

        Raises ValueError for a shape that is not a part of the drone.
        """

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Turn a joint to an angle (rad), unless None; return the angle. Raises ValueError for what is none."""


class Operations(Protocol):
    """What can be done to the objects of the scene, by their handles, in the words of a scene file.

    An operation that is not possible raises ValueError, in one line, and changes nothing.
    """

    def add(self, said: Sequence[Mapping[str, Any]]) -> list[int]:
        """Add entries as in a scene file; return their handles."""

    def add_mesh(self, name: str, vertices: Sequence[float], indices: Sequence[int]) -> int:
        """Add a shape of triangles: their corners' coordinates (m), and the corners of each; return its handle."""

    def remove(self, handles: Sequence[int]) -> None:
        """Remove objects; what hangs on them stays where it is."""

    def copy(self, handles: Sequence[int]) -> list[int]:
        """Add copies of objects, one of which may hang on another; return their handles."""

    def model(self, handle: int) -> list[int]:
        """Return an object and all that hangs on it."""

    def free_name(self, wanted: str) -> str:
        """Return a name that nothing has: the wanted one, or that with a number."""

    def rename(self, handle: int, name: str) -> None:
        """Give an object another name, which nothing else has."""

    def set_alias(self, handle: int, alias: str) -> None:
        """Give an object another alias, which others may have, too."""

    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None:
        """Hang an object on another, -1 for none."""

    def change(self, handle: int, **values: Any) -> None:
        """Let a key of its entry have another value."""

    def paint(self, handle: int, rgba: Sequence[float | None]) -> None:
        """Set the color of a shape; a component that is None stays as it is."""

    def color(self, handle: int) -> tuple[float, ...]:
        """Return the color of a shape, of its first part."""

    def scale(self, handles: Sequence[int], factors: Sequence[float], positions: bool = False) -> None:
        """Scale objects by factors along x, y and z; `positions`: also their distances from their parents."""

    def factors(self, handle: int) -> tuple[float, float, float]:
        """Return how many times as large an object is as it was."""

    def box(self, handle: int) -> tuple[Vector, Vector]:
        """Return size and centre (m) of the box around a shape, along its own axes."""

    def forms(self, handle: int) -> list[tuple[str, tuple[float, ...]]]:
        """Return the forms of a shape, each with its size, as in a scene file; [] if it is no shape of the scene."""

    def group(self, handles: Sequence[int]) -> int:
        """Make one rigid shape of several; return its handle."""

    def ungroup(self, handle: int) -> list[int]:
        """Make a shape of each part of one; return their handles."""

    def load_model(self, name: str) -> int:
        """Add the objects of a file; return the first one's handle."""

    def save_model(self, handle: int, name: str) -> None:
        """Write an object and all that hangs on it into a file."""


@dataclass(frozen=True)
class SceneServices:
    """What the API needs besides the drone: how a script is run, and what it sees, by object name."""

    pictures: Mapping[str, Callable[..., np.ndarray]] = field(default_factory=dict)  # of a kind, or without one its own
    outside: Caller = lambda function: function()  # calls a function where OpenGL is, on nobody's time limit
    inside: Caller = lambda function: function()  # the same, on this script's time limit
    operations: Operations | None = None  # on the objects of the scene, where there is one
    turns: Turns = field(default_factory=Turns)  # of the script's thread
    planes: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # m: the near and far plane of each
    masses: Callable[[], Mapping[str, float]] = dict  # kg, of the shapes that the dynamics move, by object name
    inertias: Callable[[], Mapping[str, Inertia]] = dict  # how these lie in each, in its frame
    nearest: MeasureWay = lambda *_: None  # without a world


class Functions:
    """Functions of `sim` about what a script is attached to; docs/api.md has a section for each such class."""

    def __init__(self, host: Host, services: SceneServices, ignored: Ignored):
        """`host` is the drone or object that the script belongs to; `services` give access to the rest of the scene.

        `ignored` says that something is ignored.
        """
        self._host, self._surroundings, self._ignored = host, services, ignored
        self._context, self._objects = host.context, host.context.objects

    def _found(self, handle: int, kind: type[_Kind], called: str) -> _Kind:
        """Return the object with a handle, which is of a kind. Raises WrongValue that lists those that are."""
        found = self._objects[handle]
        if isinstance(found, kind):
            return found
        known = [self._objects[one].name for one in self._objects if isinstance(self._objects[one], kind)]
        raise WrongValue(f"'{found.name}' is not {called}; there are: {', '.join(known[:_MOST_NAMES]) or 'none'}")
