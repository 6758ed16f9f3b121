"""Construction of a scene and its vehicles in a new world."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from typing import Any

from drone_sim.config.types import ParameterError
from drone_sim.context import SimulationContext
from drone_sim.files.resources import resolve
from drone_sim.forces.weather import Weather
from drone_sim.hosting.child_scripts import ChildScript
from drone_sim.hosting.script_scheduler import AnyScript, ScriptScheduler, raise_first
from drone_sim.importing.cache import imported_scene
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_names import first_free, suffixed, suffixes
from drone_sim.mechanics.object_tree import NO_HANDLES, Handles, ObjectTree
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.run.parameters import Parameters
from drone_sim.scene.operations import SceneOperations
from drone_sim.scene.scene import Scene
from drone_sim.scripting.api.registry import CUSTOMIZATION
from drone_sim.scripting.api.remote_ports import RemotePorts
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import NO_SCRIPT
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.world import World

# Pairs of moving bodies at the start: whose bounds overlap, and which are deep inside each other. With more, a step
# takes seconds.
MAX_OVERLAPS, MAX_DEEP_OVERLAPS = 500, 50


class SimulationSetup:
    """Scene, vehicles, and the tree of their objects. If they cannot be built, the world is closed."""

    def __init__(
        self,
        parameters: Parameters,
        world: World,
        handles: Handles = NO_HANDLES,
        *,
        clock: Clock,
        **lasting: Any,
    ):
        """Fill an empty world. Objects whose names are in `handles` get these handles.

        `lasting` has fields of the context that persist across starts, as the clock does.
        Raises ParameterError and UrdfError.
        """
        self.parameters, self._world = parameters, world
        objects = ObjectTree(handles)
        self.context = context = SimulationContext(
            world=world,
            clock=clock,
            sub_step=parameters.sub_step,
            gravity=parameters.gravity,
            datum=parameters.scene.datum,
            magnetic_field=parameters.scene.magnetic_field,
            script_time_limit=parameters.script_time_limit,
            objects=objects,
            velocities=VelocityMeter(objects, clock),
            weather=Weather(parameters.weather, clock),
            remote_ports=RemotePorts(parameters.remote_api.serve),
            **lasting,
        )
        self.vehicles: dict[str, Vehicle] = {}
        try:
            self._clear_tree()
            self.scene = Scene(parameters.scene, context)
            for vehicle in parameters.fleet:
                self._create_vehicle(vehicle)
            self._name_objects()
            self.scripts = ScriptScheduler(self.scene, parameters.scene_place, self.vehicles, context)
            self.scripts.begin_anew()
            folder = resolve(parameters.scene_file).parent if parameters.scene_file else None
            self.operations = SceneOperations(self.scene, folder, self.scripts, imported_scene)
            self._check()
        except BaseException:
            self._world.close()
            raise
        self._world.keep_initial_poses()

    def begin_anew(self) -> None:
        """Reset everything to its start pose, at rest, with no script loaded."""
        self._world.saved_states.begin_anew()
        self.context.weather.reset()
        self._clear_tree()
        for vehicle in self.vehicles.values():
            vehicle.reset()
        self._name_objects()
        self.scripts.begin_anew()

    def save_state(self) -> Restore:
        """Return a function that restores all state except the world's own."""
        context, scripts = self.context, self.scripts
        script_data = (
            context.signals,
            context.graphs,
            context.data,
            context.tubes,
            context.collections,
            context.broadcasts,
            context.drawings,
            context.windows,
        )
        hosted_scripts = (*scripts.child_scripts.values(), *scripts.attached)
        carried = (*self.vehicles.values(), self.scene, context.weather)
        parts: list[Any] = [context.objects, context.velocities, *script_data, *hosted_scripts, *carried]
        return in_turn(saved(context.clock, "steps"), *(part.save_state() for part in parts))

    def tune_as(self, before: SimulationSetup) -> None:
        """Take over the tuned values of vehicles with the same name in another setup."""
        for name, script in self.scripts.child_scripts.items():
            if name in before.vehicles:
                script.tuning.take_over(before.scripts.child_scripts[name].tuning)

    def end_scripts(self, clean_up: bool) -> None:
        """Close every script; if `clean_up`, first end its thread and call its cleanup, even if another script fails.

        Raises the first ScriptError.
        """
        scripts = [*self.scripts.leaving, *self.scripts.all()]
        errors = self.scripts.clean_up(scripts, is_over=True) if clean_up else []
        for script in scripts:
            script.close()
        raise_first(errors)

    def load_scripts(self, scripts: Sequence[AnyScript], script: str) -> None:
        """Load scripts and run their init; `script` is for vehicles without one of their own. Raises ScriptError.

        Customization scripts come first, with what V-REP calls in them before the simulation starts.
        """
        customizing = [hosted for hosted in scripts if hosted.script_type == CUSTOMIZATION]
        self.context.control.is_stopped = True
        self._load_all(customizing, script)
        for phase in ("nonSimulation", "beforeSimulation"):
            for hosted in customizing:
                hosted.script.call(phase)
        self.context.control.is_stopped = False
        self._load_all((hosted for hosted in scripts if hosted.script_type != CUSTOMIZATION), script)

    def _load_all(self, scripts: Iterable[AnyScript], script: str) -> None:
        for hosted in scripts:
            if isinstance(hosted, ChildScript):
                path = script_of(hosted.vehicle.parameters, self.parameters, script)
            else:
                path = hosted.file
            hosted.load_script(path, self.operations)

    def add(self, parameters: VehicleParameters, running: bool, script: str) -> None:
        """Add a vehicle to the world; if `running`, load its scripts, with `script` if it names none of its own.

        If a script fails in init, the vehicle is removed again. Raises ParameterError, UrdfError and ScriptError.
        """
        vehicle = self._create_vehicle(parameters)
        self.scripts.attach()
        self._world.saved_states.keep(vehicle.body.number)
        try:
            self.load_scripts(self.scripts.of(vehicle.name) if running else (), script)
        except BaseException:
            self.remove(vehicle.name, running=False)
            raise

    def remove(self, name: str, running: bool) -> None:
        """Remove a vehicle and its objects from the world; if `running`, call its scripts' cleanup first.

        Raises the first ScriptError of a cleanup.
        """
        errors = self.scripts.clean_up(self.scripts.of(name)) if running else []
        self.scripts.detach(name)
        self.vehicles.pop(name).leave()
        raise_first(errors)

    def add_all(self, vehicles: Sequence[VehicleParameters], running: bool, script: str) -> None:
        """Add vehicles as `add` does; if one cannot be added, remove the others again."""
        for index, vehicle in enumerate(vehicles):
            try:
                self.add(vehicle, running, script)
            except BaseException:
                for error in self.remove_all([added.name for added in vehicles[:index]], running):
                    LOG.error("%s", error)
                raise

    def remove_all(self, names: Iterable[str], running: bool) -> list[ScriptError]:
        """Remove vehicles as `remove` does; return the errors of the cleanups."""
        errors = []
        for name in names:
            try:
                self.remove(name, running)
            except ScriptError as error:
                errors.append(error)
        return errors

    def _create_vehicle(self, parameters: VehicleParameters) -> Vehicle:
        vehicle = Vehicle(parameters, self._suffix(parameters), self.context)
        self.vehicles[vehicle.name] = vehicle
        if vehicle.instruments:
            self._world.solve_contacts_for_instruments()
        return vehicle

    def _suffix(self, parameters: VehicleParameters) -> str:
        """Return the suffix of object names, as in V-REP's copies: '', then #0, #1, ..., or the configured one.

        Raises ParameterError if another vehicle has the configured suffix.
        """
        taken = {vehicle.suffix for vehicle in self.vehicles.values()}
        if parameters.suffix is not None:
            wanted = suffixed("", parameters.suffix)
            if wanted in taken:
                raise ParameterError(
                    f"vehicle {parameters.name}: suffix = {parameters.suffix}: another vehicle has the same suffix"
                )
            return wanted
        return first_free(suffixes(), taken)

    def _clear_tree(self) -> None:
        self.context.clear()
        self.context.objects.add("Floor", also=("ResizableFloor_5_25",), kind="shape")

    def _name_objects(self) -> None:
        try:
            self.scene.name_objects()
        except ParameterError as error:
            raise ParameterError(f"{self.parameters.scene_place(error.location)}: {error.problems[0].reason}") from None

    def _check(self) -> None:
        if not self._world.is_finite():
            raise ParameterError("the scene at the start: a position or a velocity is not finite")
        queries = self._world.queries
        pairs = queries.overlaps()
        count, kind, most = len(pairs), "touch or overlap", MAX_OVERLAPS
        if MAX_DEEP_OVERLAPS < count <= MAX_OVERLAPS:
            deep = [pair for pair in pairs.tolist() if queries.is_deep_inside(*pair)]
            count, kind, most = len(deep), "are deep inside each other", MAX_DEEP_OVERLAPS
        if count > most:
            problem = f"{count} pairs of moving objects or vehicles {kind}; at most {most} are allowed"
            raise ParameterError(f"the scene at the start: {problem}")


def script_of(vehicle: VehicleParameters, parameters: Parameters, script: str) -> str:
    """Return the script that flies a vehicle: its own if it names one, else `script`, else the parameters' script."""
    return own_script(vehicle, parameters) or script or parameters.script or vehicle.script


def own_script(vehicle: VehicleParameters, parameters: Parameters) -> str:
    """Return the script that the scene names for a vehicle; '' if it is flown by the script for all vehicles."""
    return "" if vehicle.script in (parameters.script, NO_SCRIPT) else vehicle.script


def give_back_memory() -> None:
    """Return freed heap memory to the system with glibc's malloc_trim, if the C library has it.

    glibc does not return free blocks between used ones by itself: 300 MB of a script would stay with the process.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
