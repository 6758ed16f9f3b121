"""A child script on any object but a vehicle's own: its target, propellers, sensors, and what stands around."""

from __future__ import annotations

import copy
import logging
from collections import ChainMap
from collections.abc import Callable, Mapping

from drone_sim.mechanics.frames import Vector
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scripting import load
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.guarded import GuardedScript, tell_failure
from drone_sim.sensors.sensor import Instrument
from drone_sim.vehicles.child_script import call_init, check_callbacks, load_child_script
from drone_sim.vehicles.script_parameters import bring_back, propeller_script_parameters
from drone_sim.vehicles.shared import Shared
from drone_sim.vehicles.shared_view import SharedView
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)  # not the script's own words
_EVERYWHERE = ""  # namespace of the topics of what belongs to no vehicle


class AttachedScript(SharedView):
    """The script of an object, as the simulation calls it, and what the script finds (scripting.api.host.Host)."""

    def __init__(
        self, parameters: AttachedScriptParameters, handle: int, vehicles: Mapping[str, Vehicle], shared: Shared
    ):
        """Attach it to the object of a handle, without loading it. The vehicles are those of the simulation."""
        super().__init__(shared)
        self._vehicles = vehicles
        self.file = parameters.script
        here = shared.objects[handle]
        self.own_script = here.name
        self.vehicle = next((one for one in vehicles.values() if here.is_part_of(one.own_object)), None)
        self.goes_with = self.vehicle.name if self.vehicle and self.vehicle.owns(handle) else ""
        self.script: load.Script = load.NoScript()
        self.failure: ScriptError | None = None  # of its top level
        name = self.vehicle.name if self.vehicle else _EVERYWHERE
        self.bus = MessageBus(name, None if self.vehicle else {})
        self.bus.backend = shared.backend
        if self.vehicle:
            self.vehicle.commands.listening.append(self.bus)
        self.parameters = self._attach()
        self.parameters.update(copy.deepcopy(parameters.parameters))
        self.scripts.add(self.own_script, self.parameters)

    def _attach(self) -> dict[str, object]:
        """Return the parameters that V-REP's script has there; a propeller's built-in law gives way to it."""
        law = self.vehicle.propulsion.give_way(self.own_script) if self.vehicle else None
        if law is None:
            return {}
        law.update({**propeller_script_parameters(), **law})
        return law

    # ---- what scripts see

    @property
    def sensors(self) -> Mapping[str, Instrument]:
        """The sensors of its vehicle, or of all."""
        return ChainMap(*(dict(one.sensors) for one in self._seen()))

    def _seen(self) -> list[Vehicle]:
        return [self.vehicle] if self.vehicle else list(self._vehicles.values())

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Raises ValueError for what is no dynamic shape of any vehicle.
        """
        for one in self._vehicles.values():
            if one.has_shape(shape):
                return one.add_force(shape, force, torque, offset)
        raise ValueError(f"'{shape}' is not a dynamic shape of a vehicle")

    def turn_joint(self, joint: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError for what is none."""
        for one in self._vehicles.values():
            if one.propulsion.blades.has(joint):
                return one.turn_joint(joint, angle)
        raise ValueError(f"'{joint}' is not a joint")

    # ---- phases

    def load_script(self, path: str) -> None:
        """Load its script and call its init. Where it fails, now or later, that is told, and the others go on."""
        self.close()
        try:
            self.script = load_child_script(path, self, self.bus, self._seen(), self._shared, GuardedScript)
        except ScriptError as error:
            self.failure = error
            tell_failure(error)
            return
        if self.script.idle:
            _LOG.warning("%s, on %s: %s", path, self.own_script, self.script.idle)
        call_init(self.script, self.bus)

    @property
    def has_failed(self) -> bool:
        """Whether its script is not called any more."""
        return self.failure is not None or (isinstance(self.script, GuardedScript) and self.script.failure is not None)

    def actuation(self) -> None:
        """Hand waiting messages to the script, then let it act."""
        check_callbacks(self.script, self.bus)
        self.bus.deliver(self.script)
        self.script.call("actuation")

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        self.script.close()
        self.script, self.failure = load.NoScript(), None
        self.bus.close()

    def leave(self) -> None:
        """Be attached no longer."""
        self.close()
        self.scripts.remove(self.own_script)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back script, messages and parameters."""
        parts = [self.bus.remember(), self.script.remember()]
        parameters = {self.own_script: copy.deepcopy(self.parameters)}

        def recall() -> None:
            bring_back({self.own_script: self.parameters}, parameters)
            for one in parts:
                one()

        return recall
