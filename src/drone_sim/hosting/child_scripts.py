"""Child scripts, which fly vehicles, and scripts attached to other objects: loading, calls and API access."""

from __future__ import annotations

import copy
import logging
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

from drone_sim.context import SimulationContext
from drone_sim.hosting.kept_places import keep_places
from drone_sim.hosting.picture_filters import eye_of, filter_picture, filters_pictures
from drone_sim.hosting.tuning import Tuning
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.saved_state import Restore, in_turn
from drone_sim.scene.distances import Distances
from drone_sim.scene.scene_parameters import AttachedScriptParameters
from drone_sim.scripting import load
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.host import Operations, SceneServices
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros, make_sim_vision
from drone_sim.scripting.api.registry import CHILD, CUSTOMIZATION
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import log_failure
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.sensors.sensor import Instrument
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.propulsion import Propulsion, particles
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)  # for messages about scripts, not from scripts
_NO_NAMESPACE = ""  # namespace of the topics of scripts that belong to no vehicle
_Value = TypeVar("_Value")
_Parameters = dict[str, dict[str, Any]]  # by the object of the script


class HostedScript(ABC):
    """Script on an object, as the simulation calls it, and its access to the scene (scripting.api.host.Host)."""

    def __init__(self, own_script: str, bus: MessageBus, context: SimulationContext):
        """Create it without loading a script. `own_script`: name of the object; `bus` carries the script's messages."""
        self.own_script = own_script
        self.script_type = CHILD
        self.bus = bus
        bus.backend = context.backend
        self.context = context
        self.script: load.Script = load.no_script()
        self.path = ""  # of the loaded script
        self.flat_names: Collection[str] = ()  # functions that it calls by their V-REP 3.x names
        self.step_calls: Sequence[Callable[[], None]] = ()  # before each actuation
        self._filters_pictures = False  # whether the script filters each picture of its vision sensor

    @abstractmethod
    def seen(self) -> Sequence[Vehicle]:
        """Return the vehicles whose sensors, cameras and masses the script can access."""

    @abstractmethod
    def script_parameters(self) -> _Parameters:
        """Return the parameters of this script, then of the scripts that belong to it."""

    @abstractmethod
    def reached(self) -> Iterable[Vehicle]:
        """Return the vehicles on which it may exert forces, and whose blades it may turn."""

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Apply a force (N, world) at a point (m, frame of the shape) and a torque (N m, world) in the next step.

        Raises ValueError if the shape is no dynamic shape of a reachable vehicle.
        """
        self._propulsion(shape, lambda propulsion: shape in propulsion.shapes).add_force(shape, force, torque, offset)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Remove the forces on a shape, the torques, or both, that were added since the last step.

        Raises ValueError if the shape is no dynamic shape of a reachable vehicle.
        """
        self._propulsion(shape, lambda propulsion: shape in propulsion.shapes).drop_forces(shape, forces, torques)

    def turn_joint(self, joint: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError for other joints."""
        return self._propulsion(joint, lambda each: each.blades.has(joint)).blades.turn(joint, angle)

    def _propulsion(self, name: str, has: Callable[[Propulsion], bool]) -> Propulsion:
        """Return the propulsion of the vehicle with the object, or else the first one, whose methods then raise.

        Raises ValueError if there is no vehicle.
        """
        reached = [vehicle.propulsion for vehicle in self.reached()]
        if not reached:
            raise ValueError(f"'{name}' is not a part of a vehicle: the scene has no vehicle")
        return next(filter(has, reached), reached[0])

    @property
    def sensors(self) -> Mapping[str, Instrument]:
        """The sensors that the script can access, by object name."""
        return ChainMap(*(vehicle.instruments.by_object for vehicle in self.seen()))

    def _load(self, path: str, operations: Operations) -> None:
        """Load a script ('' for the pilot), with operations on objects. Raises ScriptError."""
        self.close()
        context = self.context
        limit, turns = TimeLimit(context.script_time_limit), Turns()
        around = services(self.seen(), context, operations, limit, turns)
        modules = {
            "sim": make_sim(self, around),
            "simROS": make_sim_ros(self.bus, context.clock),
            "simVision": make_sim_vision(self, around),
            **make_plugins(self, around),
        }
        customizes = self.script_type == CUSTOMIZATION
        script = context.load_script(path, modules, limit, turns, context.breakpoints, customizes)
        self.flat_names = script.flat_names
        self._filters_pictures = filters_pictures(context, self.own_script, script)
        self.script, self.path = script, load.script_path(path)
        context.scripts.attached_to(self.own_script, self.script_type).loaded(self.script, context.clock.time)

    def _call_init(self) -> None:
        """Call init. Raises ScriptError, also if a subscribed callback does not exist."""
        self.script.call("init")
        self.bus.check_callbacks(self.script)

    def actuation(self) -> None:
        """Clear readings and apply commands, if it flies a vehicle; deliver messages, then call its actuation."""
        for call in self.step_calls:
            call()
        self.bus.deliver(self.script)
        self.script.call("actuation")

    def sensing(self) -> None:
        """Filter the picture of a vision sensor, if the script does so, then call its sensing."""
        if self._filters_pictures:
            filter_picture(self.context, self.own_script, self.script)
        self.script.call("sensing")

    def close(self) -> None:
        """Unload the script, without calling cleanup, and end its subscriptions; may be called twice."""
        self._filters_pictures, self.path = False, ""
        self.script.close()
        self.script = load.no_script()
        self.bus.close()

    def leave(self) -> None:
        """Unload the script and remove it from the simulation."""
        self.close()
        for name in self.script_parameters():
            self.context.scripts.remove(name, self.script_type)

    def save_state(self) -> Restore:
        """Return a function that restores script, messages and parameters."""
        parts = [self.bus.save_state(), self.script.save_state()]
        kept = copy.deepcopy(self.script_parameters())

        def restore() -> None:
            values = self.script_parameters()
            for name, old in copy.deepcopy(kept).items():
                values[name].clear()
                values[name].update(old)
            for part in parts:
                part()

        return restore


class ChildScript(HostedScript):
    """The script that flies a vehicle. Its failure ends the flight."""

    def __init__(self, vehicle: Vehicle):
        """Create it for a vehicle; `begin` must be called before anything else."""
        super().__init__(vehicle.object_name, vehicle.bus, vehicle.context)
        self.vehicle = vehicle
        self.step_calls = vehicle.step_calls
        self.parameters: dict[str, Any] = {}
        self.tuning = Tuning(vehicle, self.parameters)

    def begin(self) -> None:
        """Unload the script, reset its parameters to their initial values, and register it in the simulation."""
        self.close()
        self.parameters.clear()
        self.parameters.update(_script_parameters(self.vehicle.parameters))
        for name, values in self.script_parameters().items():
            self.context.scripts.add(name, values, is_law=values is not self.parameters)

    def seen(self) -> Sequence[Vehicle]:
        """Return the vehicles that the script can see: only its own."""
        return [self.vehicle]

    reached = seen

    def script_parameters(self) -> _Parameters:
        """Return its own parameters, and those of the propellers, which their thrust model or script reads."""
        return {self.own_script: self.parameters, **self.vehicle.propulsion.script_parameters}

    def load_script(self, path: str, operations: Operations) -> None:
        """Load a script ('' for the pilot), with operations on objects, and call its init. Raises ScriptError."""
        self._load(path, operations)
        self.vehicle.flight_state.is_flown = True
        if self.script.idle and not self.bus.is_subscribed:  # it would never be called
            if not self.script.is_empty:
                raise ScriptError("load", load.script_path(path), 0, self.script.idle)
            _LOG.warning("%s: %s", path, self.script.idle)
        before = dict(self.parameters)
        self._call_init()
        self.tuning.begin(before)

    def close(self) -> None:
        if self.vehicle.flight_state.is_flown:
            self.tuning.keep_read()
        super().close()
        self.vehicle.flight_state.is_flown = False

    def save_state(self) -> Restore:
        """Return a function that restores script, messages, parameters, and tuned values."""
        return in_turn(super().save_state(), self.tuning.save_state())


class AttachedScript(HostedScript):
    """A script that a scene attaches to an object: a child script, not of a vehicle's body, or a customization script.

    A failure is logged, and the flight continues.
    """

    def __init__(
        self,
        parameters: AttachedScriptParameters,
        kind: int,
        handle: int,
        vehicles: Mapping[str, Vehicle],
        context: SimulationContext,
    ):
        """Attach it to the object with a handle, without loading it. `vehicles`: all vehicles of the simulation.

        `kind`: CHILD or CUSTOMIZATION.
        """
        self._vehicles = vehicles
        self.file = parameters.script if kind == CHILD else parameters.customization
        scene_object = context.objects[handle]
        self.vehicle = next((owner for owner in vehicles.values() if scene_object.is_part_of(owner.object)), None)
        bus = MessageBus(self.vehicle.name) if self.vehicle else MessageBus(_NO_NAMESPACE, {})
        super().__init__(scene_object.name, bus, context)
        self.script_type = kind
        self.goes_with = self.vehicle.name if self.vehicle and handle in self.vehicle.handles else ""
        self.failure: ScriptError | None = None  # raised by the script's top level
        self._is_removed = False
        self._first_bus = bus
        if self.vehicle:
            self.vehicle.commands.buses.append(bus)
            self.vehicle.flight_state.script_errors.append(self.error)
        # Parameters of V-REP's script there; a propeller's built-in thrust model is replaced by the script.
        is_child = kind == CHILD
        law = self.vehicle.propulsion.disable_thrust_model(self.own_script) if self.vehicle and is_child else None
        self.parameters: dict[str, Any] = {} if law is None else law
        self.parameters.update({} if law is None else {**_PROPELLER_SCRIPT, **law})
        self.parameters.update(copy.deepcopy(parameters.parameters))
        context.scripts.add(self.own_script, self.parameters, kind=kind).is_embedded = parameters.embedded

    def seen(self) -> Sequence[Vehicle]:
        """Return its vehicle, or all vehicles if it belongs to none."""
        return [self.vehicle] if self.vehicle else list(self._vehicles.values())

    def reached(self) -> Iterable[Vehicle]:
        """Return all vehicles of the simulation."""
        return self._vehicles.values()

    def script_parameters(self) -> _Parameters:
        return {self.own_script: self.parameters}

    def load_script(self, path: str, operations: Operations) -> None:
        """Load its script, with operations on objects, and call its init.

        A failure, now or later, is logged, and the other scripts continue.
        """
        if self._is_removed:  # the init of another script has removed its object
            return
        try:
            self._load(path, operations)
        except ScriptError as error:
            self.failure = error
            log_failure(error)
            return
        self.script.isolate()
        if self.script.idle:
            _LOG.warning("%s, on %s: %s", path, self.own_script, self.script.idle)
        self._call_init()

    def error(self) -> ScriptError | None:
        """Return the error after which the script is no longer called; None while it is called."""
        return self.failure or self.script.failure

    @property
    def is_loaded(self) -> bool:
        """Whether the script was loaded, even if it has failed."""
        return self.failure is not None or self.script is not load.no_script()

    @property
    def is_busy(self) -> bool:
        """Whether the script is being called, or has a thread that has not ended."""
        return self.script.is_busy

    def leave(self) -> None:
        super().leave()
        self._is_removed = True
        if self.vehicle and self._first_bus in self.vehicle.commands.buses:
            self.vehicle.commands.buses.remove(self._first_bus)
            self.vehicle.flight_state.script_errors.remove(self.error)

    def split_off(self) -> AttachedScript:
        """Return a copy with the running script and its messages, to be ended later; this one is then empty."""
        running = copy.copy(self)
        self.script, self.path, self.bus = load.no_script(), "", MessageBus(_NO_NAMESPACE, {})
        return running

    def close(self) -> None:
        super().close()
        self.failure = None


def services(
    seen: Sequence[Vehicle], context: SimulationContext, operations: Operations, limit: TimeLimit, turns: Turns
) -> SceneServices:
    """Return the scene services for a script with a time limit, which can access the vehicles `seen`."""
    cameras = [
        (camera.object + vehicle.suffix, camera, vehicle.cameras[name])
        for vehicle in seen
        for name, camera in vehicle.parameters.cameras.items()
    ]
    return SceneServices(
        pictures={name: eye_of(context, camera) for name, _, camera in cameras},
        planes={name: (camera.near, camera.far) for name, camera, _ in cameras},
        operations=operations,
        outside=limit.outside,
        inside=limit.inside,
        turns=turns,
        masses=lambda: _merged(vehicle.propulsion.masses() for vehicle in seen),
        inertias=lambda: _merged(vehicle.propulsion.inertias() for vehicle in seen),
        nearest=Distances(context).nearest,
        keep_places=partial(keep_places, context),
    )


def _merged(mappings: Iterable[Mapping[str, _Value]]) -> dict[str, _Value]:
    return {name: value for mapping in mappings for name, value in mapping.items()}


# ---- simulation parameters of scripts, as in V-REP

_SHOWN = {"particlesAreVisible": True, "simulateParticles": True}
_PROPELLER_SCRIPT = {  # read by V-REP's propeller script, in addition to those of the built-in thrust model
    **_SHOWN,
    "particleScatteringAngle": 30.0,
    "particleLifeTime": 0.5,
    "maxParticleCount": 50.0,
}


def _script_parameters(vehicle: VehicleParameters) -> dict[str, Any]:
    """Return the parameters of a vehicle's child script: V-REP's, the controller gains, and the user's."""
    law = vehicle.propellers
    base = {**vehicle.control.model_dump(), **_SHOWN, "fakeShadow": True, **particles(law), "propeller_law": law.law}
    base.update(start=vehicle.start, takeoff_height=vehicle.takeoff_height)
    meaning = vehicle.cmd_vel_meaning
    base.update(cmd_vel_means=meaning.means, cmd_vel_lifts_off=meaning.lifts_off)
    return {**base, **vehicle.script_parameters}
