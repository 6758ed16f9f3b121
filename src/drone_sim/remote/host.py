"""The simulation, as the script API sees it where a client calls: all vehicles together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from drone_sim.hosting.child_scripts import surroundings
from drone_sim.mechanics.frames import Vector
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.host import Readable, Surroundings
from drone_sim.scripting.api.registry import Attachment, Callee, Scripts
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles.quadricopter_objects import DRONE
from drone_sim.vehicles.vehicle import Vehicle


class ClientHost:
    """Names without a suffix mean the first vehicle's objects, as in its script."""

    def __init__(self, simulation: Simulation):
        """Take the simulation as it is in this era."""
        self.context = replace(simulation.context, scripts=_FromOutside(simulation.context.scripts))
        self._operations = simulation.operations
        self._vehicles = list(simulation.vehicles.values())

    def surroundings(self) -> Surroundings:
        """Return clock, cameras and the rest; no client's call is ended after a time."""
        return surroundings(self._vehicles, self.context, self._operations, TimeLimit(0.0), Turns())

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """The sensors of all vehicles."""
        return {name: sensor for one in self._vehicles for name, sensor in one.instruments.by_object.items()}

    @property
    def own_script(self) -> str:
        """Name of the object whose script `sim.handle_self` means: the first vehicle's."""
        return self._vehicles[0].object_name if self._vehicles else DRONE

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m)."""
        self._of(shape).propulsion.add_force(shape, force, torque, offset)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Forget the forces on a shape, or the torques, or both, that were added since the last step."""
        self._of(shape).propulsion.drop_forces(shape, forces, torques)

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return the angle."""
        return self._of(joint).propulsion.blades.turn(joint, angle)

    def _of(self, name: str) -> Vehicle:
        """Return the vehicle whose objects end in the same suffix; the first for an object of the scene.

        Raises ValueError where no vehicle flies.
        """
        if not self._vehicles:
            raise ValueError(f"'{name}' is not a part of a vehicle, and the scene has no vehicle")
        return next((one for one in self._vehicles if one.suffix and name.endswith(one.suffix)), self._vehicles[0])


class _FromOutside(Scripts):
    """The scripts of a simulation, called by a client that is not one of them."""

    are_own = False

    _NOBODY = Attachment(-1, "", {}, is_law=False)

    def __init__(self, scripts: Scripts):
        self.__dict__ = scripts.__dict__

    def is_own(self, _caller: Attachment, _callee: Attachment) -> bool:
        return False

    def call(self, _caller: Attachment, callee: Attachment, call: Callable[[Callee], Any]) -> Any:
        return super().call(self._NOBODY, callee, call)
