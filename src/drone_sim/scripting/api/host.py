"""What the script API needs: the object that a script is attached to, its vehicle, and the scene."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.object_collections import Collections, members
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.saved_state import Restore
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.control import Control, Turns
from drone_sim.scripting.api.custom_data import CustomData
from drone_sim.scripting.api.distances import MeasureDistance
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.graphs import Graphs
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.remote_ports import RemotePorts
from drone_sim.scripting.api.signals import Broadcasts, Signals, Tubes
from drone_sim.scripting.api.types import WrongValue
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.breakpoints import Breakpoints

_Kind = TypeVar("_Kind")
_Value = TypeVar("_Value")
_MOST_NAMES = 20  # in a message
_EVERYTHING = CONSTANTS["handle_all"]
Caller = Callable[[Callable[[], Any]], Any]


class Readable(Protocol):
    """A sensor of a vehicle."""

    def read(self) -> dict[str, Any] | None:
        """Return the fields of its last reading; None before the first one."""


@dataclass(kw_only=True)
class ScriptContext:
    """What the scripts of a simulation share: clock, gravity (m/s² along z), objects, and the data of scripts."""

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
    breakpoints: Breakpoints = field(default_factory=Breakpoints)  # not cleared between runs
    remote_ports: RemotePorts = field(default_factory=RemotePorts)

    def clear(self) -> None:
        """Clear all parts, as before a run; they stay the same Python objects, so references to them remain valid."""
        parts = self.objects, self.velocities, self.scripts, self.signals, self.control, self.data, self.tubes
        for part in (*parts, self.graphs, self.collections, self.broadcasts, self.remote_ports):
            part.clear()


class Host(Protocol):
    """The object that a script is attached to, or a remote client."""

    @property
    def context(self) -> ScriptContext:
        """The data that all scripts share."""

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """Its sensors except cameras, by the names of their objects."""

    @property
    def own_script(self) -> str:
        """Name of the object that this script is attached to, with its suffix: 'Drone', 'Drone#0'."""

    @property
    def script_type(self) -> int:
        """CHILD or CUSTOMIZATION, of the registry."""

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Apply a force (N, world) at a point (m, frame of the shape) and a torque (N m, world) in the next step.

        Raises ValueError for a shape that is not part of a vehicle.
        """

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Remove the forces on a shape, the torques, or both, that were added since the last step.

        Raises ValueError for a shape that is not part of a vehicle.
        """

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Turn a propeller's joint to an angle (rad), unless None; return it. Raises ValueError for other joints."""


class Operations(Protocol):
    """Operations on the objects of the scene, with handles, and with the keys and values of scene files.

    A Protocol because the implementation, `scene.operations`, is in a package above this one; it documents them. An
    operation that is not possible raises ValueError and changes nothing.
    """

    def add(self, items: Sequence[Mapping[str, Any]]) -> list[int]: ...
    def add_mesh(self, name: str, vertices: Sequence[float], indices: Sequence[int]) -> int: ...
    def remove(self, handles: Sequence[int]) -> None: ...
    def copy(self, handles: Sequence[int]) -> list[int]: ...
    def model(self, handle: int) -> list[int]: ...
    def free_name(self, wanted: str) -> str: ...
    def rename(self, handle: int, name: str) -> None: ...
    def set_alias(self, handle: int, alias: str) -> None: ...
    def set_parent(self, handle: int, parent: int, keep_in_place: bool) -> None: ...
    def link(self, handle: int, other: int) -> None: ...
    def linked(self, handle: int) -> int: ...
    def change(self, handle: int, **values: Any) -> None: ...
    def paint(self, handle: int, rgba: Sequence[float | None]) -> None: ...
    def color(self, handle: int) -> tuple[float, ...]: ...
    def scale(self, handles: Sequence[int], factors: Sequence[float], positions: bool = False) -> None: ...
    def factors(self, handle: int) -> tuple[float, float, float]: ...
    def box(self, handle: int) -> tuple[Vector, Vector]: ...
    def forms(self, handle: int) -> list[tuple[str, tuple[float, ...]]]: ...
    def group(self, handles: Sequence[int]) -> int: ...
    def ungroup(self, handle: int) -> list[int]: ...
    def load_model(self, name: str) -> int: ...
    def save_model(self, handle: int, name: str) -> None: ...


@dataclass(frozen=True)
class SceneServices:
    """Services of the simulation for the API of one script; mappings have object names as keys."""

    pictures: Mapping[str, Callable[..., np.ndarray]] = field(default_factory=dict)  # by kind; default: its own
    outside: Caller = lambda function: function()  # calls a function in the thread of OpenGL, without a time limit
    inside: Caller = lambda function: function()  # the same, within this script's time limit
    operations: Operations | None = None  # None without a scene
    turns: Turns = field(default_factory=Turns)  # of the script's thread
    planes: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # near and far plane of each camera, m
    masses: Callable[[], Mapping[str, float]] = dict  # kg, of a vehicle's shapes
    inertias: Callable[[], Mapping[str, Inertia]] = dict  # of a vehicle's shapes, in their frames
    nearest: MeasureDistance = lambda *_: None
    # Returns a function that undoes the movements of these objects, or of any (None).
    keep_places: Callable[[Collection[int] | None], Restore] = lambda _: lambda: None


class Functions:
    """Base class for API functions that need the host; docs/api.md has a section for each class."""

    def __init__(self, host: Host, services: SceneServices, ignored: Ignored):
        """`host` is the drone or object that the script belongs to; `services` give access to the rest of the scene.

        `ignored` logs what is ignored.
        """
        self._host, self._services, self._ignored = host, services, ignored
        self._context, self._objects = host.context, host.context.objects

    def _do(self, action: Callable[[Operations], _Value]) -> _Value:
        """Return the result of an action on the scene, outside the script's time limit. Raises ValueError."""
        operations = self._services.operations
        if operations is None:
            raise ValueError("there is no scene")
        result: _Value = self._services.outside(lambda: action(operations))
        return result

    def _add(self, name: str, **keys: Any) -> int:
        """Add an entry of a scene file with a free name and an alias; return the object's handle."""
        return self._do(lambda scene: scene.add([{"name": scene.free_name(name), "alias": name, **keys}])[0])

    def _found(self, handle: int, kind: type[_Kind], called: str) -> _Kind:
        """Return the object with a handle, if it has a type.

        Raises WrongValue, which lists the objects of this type.
        """
        item = self._objects[handle]
        if isinstance(item, kind):
            return item
        known = [other.name for other in self._all(kind)]
        raise WrongValue(f"'{item.name}' is not {called}; there are: {', '.join(known[:_MOST_NAMES]) or 'none'}")

    def _all(self, kind: Any) -> list[Any]:
        """Return all objects of a type."""
        return [item for item in map(self._objects.__getitem__, self._objects) if isinstance(item, kind)]

    def _names_of(self, entity: int) -> set[str] | None:
        """Return all names of an object, or of those in a collection; None for sim.handle_all. Raises ValueError."""
        if entity == _EVERYTHING:
            return None
        handles = members(entity, self._objects, self._context.collections)
        return {name for handle in handles for name in self._objects[handle].names}
