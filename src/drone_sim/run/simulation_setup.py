"""A scene and the vehicles in it, in a world of their own."""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Iterable
from typing import Any

from drone_sim.config.types import ParameterError
from drone_sim.context import SimulationContext
from drone_sim.files.resources import resolve
from drone_sim.forces.weather import Weather
from drone_sim.hosting.child_scripts import ChildScript
from drone_sim.hosting.script_scheduler import AnyScript, ScriptScheduler, raise_first
from drone_sim.importing.cache import imported_scene
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_names import suffixed
from drone_sim.mechanics.object_tree import NO_HANDLES, Handles, ObjectTree
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.run.parameters import Parameters
from drone_sim.scene import object_collections
from drone_sim.scene.operations import SceneOperations
from drone_sim.scene.scene import Scene
from drone_sim.scripting.api.remote_ports import RemotePorts
from drone_sim.scripting.load import NO_SCRIPT
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.world import World

MAX_OVERLAPS = 500  # pairs of moving bodies, at the start: with more a step takes seconds


class SimulationSetup:
    """Scene, vehicles, and the tree of their objects. Where it cannot be built, its world is closed again."""

    def __init__(
        self,
        parameters: Parameters,
        world: World,
        handles: Handles = NO_HANDLES,
        *,
        clock: Clock,
        **lasting: Any,
    ):
        """Fill an empty world; objects whose names are among the `handles` get those.

        `lasting` has those fields of the context that outlast a start, as the clock does.
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
            self._empty_tree()
            self.scene = Scene(parameters.scene, context)
            for one in parameters.fleet:
                self._put(one)
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
        """Put everything where it began, at rest, without scripts."""
        self._world.saved_states.begin_anew()
        self.context.weather.reset()
        self._empty_tree()
        for vehicle in self.vehicles.values():
            vehicle.reset()
        self._name_objects()
        self.scripts.begin_anew()

    def save_state(self) -> Restore:
        """Return a function that brings back all but what the world itself does."""
        own, scripts = self.context, self.scripts
        left = (
            own.signals,
            own.graphs,
            own.data,
            own.tubes,
            own.collections,
            own.broadcasts,
            own.drawings,
            own.windows,
        )
        hosted = (*scripts.child_scripts.values(), *scripts.attached)
        carried = (*self.vehicles.values(), self.scene, own.weather)
        parts: list[Any] = [own.objects, own.velocities, *left, *hosted, *carried]
        return in_turn(saved(own.clock, "steps"), *(one.save_state() for one in parts))

    def tune_as(self, before: SimulationSetup) -> None:
        """Take over the values that were tuned for the vehicles of another setup."""
        for name, script in self.scripts.child_scripts.items():
            if name in before.vehicles:
                script.tuning.take_over(before.scripts.child_scripts[name].tuning)

    def end_scripts(self, clean_up: bool) -> None:
        """Let go of every script; `clean_up`: end its thread and call its cleanup before, even if another's fails.

        Raises the first ScriptError.
        """
        scripts = [*self.scripts.leaving, *self.scripts.all()]
        errors = self.scripts.clean_up(scripts) if clean_up else []
        for one in scripts:
            one.close()
        raise_first(errors)

    def load_scripts(self, scripts: Iterable[AnyScript], script: str) -> None:
        """Load some of the scripts, and run their init: `script` for vehicles without their own. Raises ScriptError."""
        for one in scripts:
            if isinstance(one, ChildScript):
                path = script_of(one.vehicle.parameters, self.parameters, script)
            else:
                path = one.file
            one.load_script(path, self.operations)

    def add(self, parameters: VehicleParameters, running: bool, script: str) -> None:
        """Put one more vehicle into the world; `running`: load its scripts, `script` where it names none of its own.

        Where a script fails in init, the vehicle is removed again. Raises ParameterError, UrdfError and ScriptError.
        """
        vehicle = self._put(parameters)
        self.scripts.attach()
        self._world.saved_states.keep(vehicle.body.number)
        try:
            self.load_scripts(self.scripts.of(vehicle.name) if running else (), script)
        except BaseException:
            self.remove(vehicle.name, running=False)
            raise

    def remove(self, name: str, running: bool) -> None:
        """Take a vehicle, and its objects, out of the world; `running`: call its scripts' cleanup before.

        Raises the first ScriptError of these.
        """
        errors = self.scripts.clean_up(self.scripts.of(name)) if running else []
        self.scripts.detach(name)
        self.vehicles.pop(name).leave()
        raise_first(errors)

    def _put(self, parameters: VehicleParameters) -> Vehicle:
        vehicle = Vehicle(parameters, self._suffix(parameters), self.context)
        self.vehicles[vehicle.name] = vehicle
        if vehicle.instruments:
            self._world.solve_contacts_for_instruments()
        return vehicle

    def _suffix(self, parameters: VehicleParameters) -> str:
        """Return what the names of V-REP's copies end in: nothing for the first, then #0, #1, ..., or as it is given.

        Raises ParameterError for one that another vehicle has.
        """
        taken = {vehicle.suffix for vehicle in self.vehicles.values()}
        if parameters.suffix is not None:
            wanted = suffixed("", parameters.suffix)
            if wanted in taken:
                raise ParameterError(
                    f"vehicle {parameters.name}: suffix = {parameters.suffix}: another vehicle has the same suffix"
                )
            return wanted
        return next(one for one in itertools.chain([""], map("#{}".format, itertools.count())) if one not in taken)

    def _empty_tree(self) -> None:
        self.context.clear()
        self.context.objects.add("Floor", also=("ResizableFloor_5_25",), kind="shape")

    def _name_objects(self) -> None:
        try:
            self.scene.name_objects()
        except ParameterError as error:
            raise ParameterError(f"{self.parameters.scene_place(error.location)}: {error.problems[0].reason}") from None
        object_collections.begin(self.parameters.scene.collections, self.context)

    def _check(self) -> None:
        if not self._world.is_finite():
            raise ParameterError("the scene as it begins: a position or a velocity is not finite")
        overlaps = self._world.queries.overlaps()
        if overlaps > MAX_OVERLAPS:
            said = (
                f"{overlaps} pairs of moving objects touch or overlap at the start; at most {MAX_OVERLAPS} are allowed"
            )
            raise ParameterError(f"scene/objects: {said}")


def script_of(vehicle: VehicleParameters, parameters: Parameters, script: str) -> str:
    """Return the script that flies a vehicle: its own, where it names one, else `script`, or the parameters' one."""
    if vehicle.script not in (parameters.script, NO_SCRIPT):
        return vehicle.script
    return script or parameters.script or vehicle.script


def give_back_memory() -> None:
    """Return what was freed in between what is still used, where the C library can (glibc): it never does by itself.

    After a script that held 300 MB the process would keep them.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
