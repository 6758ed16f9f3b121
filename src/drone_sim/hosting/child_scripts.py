"""Child scripts: that of a vehicle, which flies it, and those of other objects; how they are loaded, what they find."""

from __future__ import annotations

import copy
import logging
from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from drone_sim.context import SimulationContext
from drone_sim.hosting.picture_filters import eye_of, filter_picture, filters_pictures
from drone_sim.hosting.tuning import Tuning
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.saved_state import Restore, in_turn
from drone_sim.scene.attached_scripts import AttachedScriptParameters
from drone_sim.scene.distances import Distances
from drone_sim.scripting import load
from drone_sim.scripting.api.control import Turns
from drone_sim.scripting.api.host import Operations, Surroundings
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_plugins, make_sim, make_sim_ros, make_sim_vision
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.guarded import GuardedScript, tell_failure
from drone_sim.scripting.time_limit import TimeLimit
from drone_sim.sensors.sensor import Instrument
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.propulsion import Propulsion, particles
from drone_sim.vehicles.vehicle import Vehicle

_LOG = logging.getLogger(__name__)  # not the script's own words
_EVERYWHERE = ""  # namespace of the topics of what belongs to no vehicle
_Value = TypeVar("_Value")
_Parameters = dict[str, dict[str, Any]]  # by the object of the script that has them


class HostedScript(ABC):
    """A script on an object, as the simulation calls it, and what it finds there (scripting.api.host.Host)."""

    def __init__(self, own_script: str, bus: MessageBus, context: SimulationContext):
        """Take the name of the object, what carries its messages, and what the simulation shares; load nothing."""
        self.own_script = own_script
        self.bus = bus
        bus.backend = context.backend
        self.context = context
        self.script: load.Script = load.no_script()
        self.path = ""  # of the script that is loaded
        self.flat_names: Collection[str] = ()  # functions that it calls by their names of 3.x
        self._filters = False  # whether its script is to see every picture of the vision sensor that it is on

    @abstractmethod
    def seen(self) -> Sequence[Vehicle]:
        """Return the vehicles whose sensors, cameras and masses it finds."""

    @abstractmethod
    def script_parameters(self) -> _Parameters:
        """Return the parameters of scripts that go with it, its own first."""

    @abstractmethod
    def reached(self) -> Iterable[Vehicle]:
        """Return the vehicles that it may push, and whose blades it may turn."""

    def add_force(self, shape: str, force: Vector, torque: Vector, offset: Vector) -> None:
        """Let a force (N, world) act in the next step at a point (m) in a shape's frame, and a torque (N m, world).

        Raises ValueError for what is no dynamic shape of a vehicle that it may push.
        """
        self._owner(shape, lambda one: shape in one.shapes).add_force(shape, force, torque, offset)

    def drop_forces(self, shape: str, forces: bool, torques: bool) -> None:
        """Forget the forces on a shape, or the torques, or both, that were added since the last step.

        Raises ValueError for what is no dynamic shape of a vehicle that it may push.
        """
        self._owner(shape, lambda one: shape in one.shapes).drop_forces(shape, forces, torques)

    def turn_joint(self, joint: str, angle: float | None = None) -> float:
        """Turn a propeller's blades to an angle (rad), unless None; return it. Raises ValueError for what is none."""
        return self._owner(joint, lambda one: one.blades.has(joint)).blades.turn(joint, angle)

    def _owner(self, name: str, has: Callable[[Propulsion], bool]) -> Propulsion:
        """Return the propulsion of the vehicle that has an object; if none has it, the first, which raises an error.

        Raises ValueError if no vehicle flies.
        """
        reached = [one.propulsion for one in self.reached()]
        if not reached:
            raise ValueError(f"'{name}' is not a part of a vehicle: the scene has no vehicle")
        return next(filter(has, reached), reached[0])

    @property
    def sensors(self) -> Mapping[str, Instrument]:
        """The sensors that it finds, by the name of their object."""
        return ChainMap(*(one.instruments.by_object for one in self.seen()))

    def _load(
        self, path: str, operations: Operations, guarded: Callable[[load.Script], load.Script] = lambda script: script
    ) -> None:
        """Load a script ('' for the pilot), with what it may do to objects; `guarded` wraps it. Raises ScriptError."""
        self.close()
        context = self.context
        limit, turns = TimeLimit(context.script_time_limit), Turns()
        around = surroundings(self.seen(), context, operations, limit, turns)
        modules = {
            "sim": make_sim(self, around),
            "simROS": make_sim_ros(self.bus, context.clock),
            "simVision": make_sim_vision(self, around),
            **make_plugins(self),
        }
        script = context.load_script(path, modules, limit, turns, context.breakpoints)
        self.flat_names = script.flat_names
        self._filters = filters_pictures(context, self.own_script, script)
        self.script, self.path = guarded(script), load.script_path(path)
        context.scripts.attached_to(self.own_script).loaded(self.script, context.clock.time)

    def _call_init(self) -> None:
        """Call init. Raises ScriptError, also if it lacks one of its callbacks."""
        self.script.call("init")
        self._check_callbacks()

    def _check_callbacks(self) -> None:
        """Raise ScriptError if it has subscribed with a function that it does not have."""
        for callback in self.bus.new_callbacks():
            self.script.check(callback)

    def actuation(self) -> None:
        """Hand waiting messages to the script, then let it act."""
        self._check_callbacks()
        self.bus.deliver(self.script)
        self.script.call("actuation")

    def sensing(self) -> None:
        """Let the script sense; one of a vision sensor filters its picture first."""
        if self._filters:
            filter_picture(self.context, self.own_script, self.script)
        self.script.call("sensing")

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        self._filters, self.path = False, ""
        self.script.close()
        self.script = load.no_script()
        self.bus.close()

    def leave(self) -> None:
        """Be attached no longer."""
        self.close()
        for name in self.script_parameters():
            self.context.scripts.remove(name)

    def save_state(self) -> Restore:
        """Return a function that brings back script, messages and parameters."""
        parts = [self.bus.save_state(), self.script.save_state()]
        kept = copy.deepcopy(self.script_parameters())

        def restore() -> None:
            values = self.script_parameters()
            for name, one in copy.deepcopy(kept).items():
                values[name].clear()
                values[name].update(one)
            for part in parts:
                part()

        return restore


class ChildScript(HostedScript):
    """The script that flies a vehicle: where it fails, the flight ends."""

    def __init__(self, vehicle: Vehicle):
        """Take the vehicle; `begin` comes before anything else."""
        super().__init__(vehicle.object_name, vehicle.bus, vehicle.context)
        self.vehicle = vehicle
        self.parameters: dict[str, Any] = {}
        self.tuning = Tuning(vehicle, self.parameters)

    def begin(self) -> None:
        """Unload the script, reset its parameters to those of a start, and register it in the simulation."""
        self.close()
        self.parameters.clear()
        self.parameters.update(_script_parameters(self.vehicle.parameters))
        for name, values in self.script_parameters().items():
            self.context.scripts.add(name, values, is_law=values is not self.parameters)

    def seen(self) -> Sequence[Vehicle]:
        """Return the vehicle."""
        return [self.vehicle]

    reached = seen

    def script_parameters(self) -> _Parameters:
        """Return its own, and those of its propellers, which a law or a script of theirs reads."""
        return {self.own_script: self.parameters, **self.vehicle.propulsion.script_parameters}

    def load_script(self, path: str, operations: Operations) -> None:
        """Load a script ('' for the pilot), with what it may do to objects, and call its init. Raises ScriptError."""
        self._load(path, operations)
        self.vehicle.flight_state.is_flown = True
        if self.script.idle and not self.bus.is_subscribed:  # nothing would ever call it
            if not self.script.is_empty:
                raise ScriptError("load", load.script_path(path), 0, self.script.idle)
            _LOG.warning("%s: %s", path, self.script.idle)
        before = dict(self.parameters)
        self._call_init()
        self.tuning.begin(before)

    def actuation(self) -> None:
        """Let the vehicle take its commands, hand waiting messages to the script, and let it command propellers."""
        self.vehicle.begin_step()
        super().actuation()

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        if self.vehicle.flight_state.is_flown:
            self.tuning.keep_read()
        super().close()
        self.vehicle.flight_state.is_flown = False

    def save_state(self) -> Restore:
        """Return a function that brings back script, messages, parameters, and what was tuned."""
        return in_turn(super().save_state(), self.tuning.save_state())


class AttachedScript(HostedScript):
    """The script of any object but a vehicle itself: its target, propellers, sensors, and what stands around."""

    def __init__(
        self,
        parameters: AttachedScriptParameters,
        handle: int,
        vehicles: Mapping[str, Vehicle],
        context: SimulationContext,
    ):
        """Attach it to the object of a handle, without loading it. The vehicles are those of the simulation."""
        self._vehicles = vehicles
        self.file = parameters.script
        here = context.objects[handle]
        self.vehicle = next((one for one in vehicles.values() if here.is_part_of(one.object)), None)
        bus = MessageBus(self.vehicle.name) if self.vehicle else MessageBus(_EVERYWHERE, {})
        super().__init__(here.name, bus, context)
        self.goes_with = self.vehicle.name if self.vehicle and handle in self.vehicle.handles else ""
        self.failure: ScriptError | None = None  # of its top level
        self._has_left = False
        self._heard = bus
        if self.vehicle:
            self.vehicle.commands.listening.append(bus)
            self.vehicle.flight_state.script_errors.append(self.error)
        # The parameters that V-REP's script has there; a propeller's built-in law gives way to it.
        law = self.vehicle.propulsion.give_way(self.own_script) if self.vehicle else None
        self.parameters: dict[str, Any] = {} if law is None else law
        self.parameters.update({} if law is None else {**_PROPELLER_SCRIPT, **law})
        self.parameters.update(copy.deepcopy(parameters.parameters))
        context.scripts.add(self.own_script, self.parameters).is_embedded = parameters.embedded

    def seen(self) -> Sequence[Vehicle]:
        """Return its vehicle, or all."""
        return [self.vehicle] if self.vehicle else list(self._vehicles.values())

    def reached(self) -> Iterable[Vehicle]:
        """Return all vehicles."""
        return self._vehicles.values()

    def script_parameters(self) -> _Parameters:
        """Return its own."""
        return {self.own_script: self.parameters}

    def load_script(self, path: str, operations: Operations) -> None:
        """Load its script, with what it may do to objects, and call its init.

        Where it fails, now or later, that is told, and the others go on.
        """
        if self._has_left:  # another one's init has removed its object
            return
        try:
            self._load(path, operations, GuardedScript)
        except ScriptError as error:
            self.failure = error
            tell_failure(error)
            return
        if self.script.idle:
            _LOG.warning("%s, on %s: %s", path, self.own_script, self.script.idle)
        self._call_init()

    def error(self) -> ScriptError | None:
        """Return the error after which its script is not called any more; None while it is called."""
        return self.failure or (self.script.failure if isinstance(self.script, GuardedScript) else None)

    @property
    def is_loaded(self) -> bool:
        """Whether it has begun, even if it has failed."""
        return self.failure is not None or isinstance(self.script, GuardedScript)

    @property
    def is_busy(self) -> bool:
        """Whether it is being called now, or has a thread that has not ended."""
        return isinstance(self.script, GuardedScript) and self.script.is_busy

    def leave(self) -> None:
        """Be attached no longer."""
        super().leave()
        self._has_left = True
        if self.vehicle and self._heard in self.vehicle.commands.listening:
            self.vehicle.commands.listening.remove(self._heard)
            self.vehicle.flight_state.script_errors.remove(self.error)

    def split_off(self) -> AttachedScript:
        """Return what still runs of it, with its messages, to be ended later; this one calls nothing any more."""
        running = copy.copy(self)
        self.script, self.path, self.bus = load.no_script(), "", MessageBus(_EVERYWHERE, {})
        return running

    def close(self) -> None:
        """Let go of the script (cleanup is not called) and of its subscriptions; may be called twice."""
        super().close()
        self.failure = None


def surroundings(
    seen: Sequence[Vehicle], context: SimulationContext, operations: Operations, limit: TimeLimit, turns: Turns
) -> Surroundings:
    """Return what the API finds around a script that is called within a limit, and sees some vehicles."""
    cameras = [
        (one.object + vehicle.suffix, one, vehicle.cameras[name])
        for vehicle in seen
        for name, one in vehicle.parameters.cameras.items()
    ]
    return Surroundings(
        pictures={name: eye_of(context, camera) for name, _, camera in cameras},
        planes={name: (own.near, own.far) for name, own, _ in cameras},
        operations=operations,
        outside=limit.outside,
        inside=limit.inside,
        turns=turns,
        masses=lambda: _merged(one.propulsion.masses() for one in seen),
        inertias=lambda: _merged(one.propulsion.inertias() for one in seen),
        nearest=Distances(context).nearest,
    )


def _merged(mappings: Iterable[Mapping[str, _Value]]) -> dict[str, _Value]:
    return {name: value for one in mappings for name, value in one.items()}


# ---- the simulation parameters of scripts, as V-REP's have them

_SEEN = {"particlesAreVisible": True, "simulateParticles": True}
_PROPELLER_SCRIPT = {  # what V-REP's own script of a propeller reads besides what the built-in law does
    **_SEEN,
    "particleScatteringAngle": 30.0,
    "particleLifeTime": 0.5,
    "maxParticleCount": 50.0,
}


def _script_parameters(vehicle: VehicleParameters) -> dict[str, Any]:
    """Return those of a vehicle's child script: V-REP's, the gains of control, and the user's own."""
    law = vehicle.propellers
    own = {**vehicle.control.model_dump(), **_SEEN, "fakeShadow": True, **particles(law), "propeller_law": law.law}
    own.update(start=vehicle.start, takeoff_height=vehicle.takeoff_height)
    return {**own, **vehicle.script_parameters}
