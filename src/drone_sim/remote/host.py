"""The simulation, as the script API sees it where a client calls: all vehicles together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import Readable, ScriptParameters, Surroundings
from drone_sim.scripting.api.signals import Signals
from drone_sim.vehicles.vehicle import Vehicle


class ClientHost:
    """Names without a suffix mean the first vehicle's objects, as in its script."""

    def __init__(self, simulation: Simulation):
        """Take the simulation as it is in this era."""
        self._vehicles = list(simulation.vehicles.values())
        self._first = self._vehicles[0]

    @property
    def sensors(self) -> Mapping[str, Readable]:
        """The sensors of all vehicles."""
        return {name: sensor for one in self._vehicles for name, sensor in one.sensors.items()}

    @property
    def objects(self) -> ObjectTree:
        """The objects of the scene."""
        return self._first.objects

    @property
    def script_parameters(self) -> Mapping[str, ScriptParameters]:
        """The parameters of the scripts of all vehicles, those of the first before others."""
        return {name: values for one in self._vehicles for name, values in one.script_parameters.items()}

    @property
    def signals(self) -> Signals:
        """The signals of all scripts."""
        return self._first.signals

    @property
    def own_script(self) -> str:
        """Name of the object whose script `sim.handle_self` means: the first vehicle's."""
        return self._first.own_script

    @property
    def drawings(self) -> Drawings:
        """What is drawn, by all together."""
        return self._first.drawings

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m)."""
        self._of(shape).add_force(shape, force, torque, offset)

    def turn_joint(self, joint: str, angle: float | None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return the angle."""
        return self._of(joint).turn_joint(joint, angle)

    def pictures(self) -> dict[str, Callable[[], np.ndarray]]:
        """Return what takes a picture now, by the name of the camera's object."""
        return {
            one.parameters.cameras[name].object + one.suffix: partial(one.look, camera)
            for one in self._vehicles
            for name, camera in one.cameras.items()
        }

    def _of(self, name: str) -> Vehicle:
        """Return the vehicle whose objects end in the same suffix; the first for an object of the scene."""
        return next((one for one in self._vehicles if one.suffix and name.endswith(one.suffix)), self._first)


def surroundings(simulation: Simulation, host: ClientHost) -> Surroundings:
    """Return the clock and the cameras."""
    return Surroundings(lambda: simulation.time, simulation.parameters.time_step, host.pictures())
