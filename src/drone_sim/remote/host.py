"""The simulation as the script API sees it when a remote client calls: all vehicles together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from drone_sim.hosting.child_scripts import services
from drone_sim.mechanics.frames import Vector
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.host import Readable, SceneServices
from drone_sim.scripting.api.registry import Attachment, Scripts
from drone_sim.scripting.api.script import Script
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.vehicles.quadricopter_objects import DRONE
from drone_sim.vehicles.vehicle import Vehicle


class ClientHost:
    """Host of remote clients. Names without a suffix mean the first vehicle's objects, as in its script."""

    def __init__(self, simulation: Simulation):
        """Use the simulation's current context; to be created again with every topology version."""
        self.context = replace(simulation.context, scripts=_ScriptsForClients(simulation.context.scripts))
        self._operations = simulation.operations
        self._vehicles = list(simulation.vehicles.values())

    def services(self) -> SceneServices:
        """Return the services of the scene, without a time limit for calls."""
        return services(self._vehicles, self.context, self._operations, TimeLimit(0.0), Turns())

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """The sensors of all vehicles."""
        return {name: sensor for vehicle in self._vehicles for name, sensor in vehicle.instruments.by_object.items()}

    @property
    def own_script(self) -> str:
        """Name of the object with the script that `sim.handle_self` means: the first vehicle's."""
        return self._vehicles[0].object_name if self._vehicles else DRONE

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Apply a force (N, world) at a point (m, shape's frame) and a torque (N m) in the next step."""
        self._of(shape).propulsion.add_force(shape, force, torque, offset)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Remove the forces or torques, or both, added to a shape since the last step."""
        self._of(shape).propulsion.drop_forces(shape, forces, torques)

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Set the angle (rad) of a propeller's blades, unless None; return it."""
        return self._of(joint).propulsion.blades.turn(joint, angle)

    def _of(self, name: str) -> Vehicle:
        """Return the vehicle that an object belongs to, by its suffix; the first one for an object of the scene.

        Raises ValueError if there is no vehicle.
        """
        if not self._vehicles:
            raise ValueError(f"'{name}' is not a part of a vehicle, and the scene has no vehicle")
        return next((item for item in self._vehicles if item.suffix and name.endswith(item.suffix)), self._vehicles[0])


class _ScriptsForClients(Scripts):
    """The scripts of a simulation, called by a client instead of a script."""

    are_own = False

    _NO_CALLER = Attachment(-1, "", {}, is_law=False)

    def __init__(self, scripts: Scripts):
        self.__dict__ = scripts.__dict__

    def is_own(self, _caller: Attachment, _callee: Attachment) -> bool:
        return False

    def call(self, _caller: Attachment, callee: Attachment, call: Callable[[Script], Any]) -> Any:
        return super().call(self._NO_CALLER, callee, call)
