"""A scene and the vehicles in it, in a world of their own."""

from __future__ import annotations

import itertools

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import suffixed
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.render.orthographic import Lens
from drone_sim.run.cast import Cast, tell
from drone_sim.run.parameters import Parameters
from drone_sim.scene.scene import Scene
from drone_sim.scripting.api.control import Control
from drone_sim.scripting.api.custom_values import CustomData
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.tubes import Tubes
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.shared import Shared
from drone_sim.vehicles.vehicle import Vehicle

MAX_OVERLAPS = 500  # pairs of moving bodies, at the start: with more a step takes seconds


class Setting:
    """Scene, vehicles, and the tree of their objects. Where it cannot be built, its world is closed again."""

    def __init__(self, parameters: Parameters, shared: Shared):
        """Fill the empty world of `shared`. Raises ParameterError and UrdfError."""
        self.parameters = parameters
        self.shared = shared
        self.world = shared.world
        self.vehicles: dict[str, Vehicle] = {}
        shared.before_pictures = self._show_blades
        self._blades_shown = -1  # the world's changes, when they were
        try:
            self._empty_tree()
            self.scene = Scene(parameters.scene, self.world, self._look, shared.names)
            shared.nearest = self.scene.nearest
            for one in parameters.fleet:
                self._put(one)
            self._name_objects()
            self.cast = Cast(parameters, self.vehicles, shared)
            self.cast.begin_anew()
            self._check()
        except BaseException:
            self.world.close()
            raise
        self.world.keep_beginning()

    def begin_anew(self) -> None:
        """Put everything where it began, at rest, without scripts."""
        self.world.begin_anew()
        self.shared.weather.reset()
        self._empty_tree()
        for vehicle in self.vehicles.values():
            vehicle.reset()
        self._name_objects()
        self.cast.begin_anew()

    def tune_as(self, before: Setting) -> None:
        """Let what was tuned of the vehicles in another setting be so here, too."""
        for name, vehicle in self.vehicles.items():
            if name in before.vehicles:
                vehicle.tuning.take_over(before.vehicles[name].tuning)

    def end_scripts(self, clean_up: bool) -> None:
        """Let go of every script; `clean_up`: let its thread end and call its cleanup before, whatever the others' do.

        Raises the first ScriptError.
        """
        actors = self.cast.all()
        errors = self.cast.clean_up(actors) if clean_up else []
        for one in actors:
            one.close()
        tell(errors)

    def add(self, parameters: VehicleParameters) -> Vehicle:
        """Put one more vehicle into the world, without a script. Raises ParameterError and UrdfError."""
        vehicle = self._put(parameters)
        self.cast.attach()
        self.world.keep_beginning_of(vehicle.body.number)
        return vehicle

    def remove(self, name: str) -> None:
        """Take a vehicle out of the world, and its objects out of the tree."""
        self.cast.detach(name)
        self.vehicles.pop(name).leave()

    def _put(self, parameters: VehicleParameters) -> Vehicle:
        vehicle = Vehicle(parameters, self._suffix(parameters), self.shared)
        self.vehicles[vehicle.name] = vehicle
        if vehicle.instruments:
            self.world.solve_contacts_for_instruments()
        return vehicle

    def _suffix(self, parameters: VehicleParameters) -> str:
        """Return what the names of V-REP's copies end in: nothing for the first, then #0, #1, ..., or as it is given.

        Raises ParameterError for one that another vehicle has.
        """
        taken = {vehicle.suffix for vehicle in self.vehicles.values()}
        if parameters.suffix is not None:
            wanted = suffixed("", parameters.suffix)
            if wanted in taken:
                raise ParameterError(f"vehicle {parameters.name}: suffix = {parameters.suffix}: another vehicle has it")
            return wanted
        return next(one for one in itertools.chain([""], map("#{}".format, itertools.count())) if one not in taken)

    def _empty_tree(self) -> None:
        self.shared.objects, self.shared.signals, self.shared.scripts = ObjectTree(), Signals(), Scripts()
        self.shared.control, self.shared.data, self.shared.tubes = Control(), CustomData(), Tubes()
        self.shared.objects.add("Floor", also=("ResizableFloor_5_25",), kind="shape")

    def _name_objects(self) -> None:
        try:
            self.scene.name_objects(self.shared.objects)
        except ParameterError as error:
            raise ParameterError(f"{self.parameters.scene_place(error.location)}: {error}") from None

    def _check(self) -> None:
        if not self.world.is_finite():
            raise ParameterError("the scene as it begins: a position or a velocity is not finite")
        overlaps = self.world.overlaps()
        if overlaps > MAX_OVERLAPS:
            said = f"{overlaps} pairs of moving ones touch or overlap, at most {MAX_OVERLAPS} may"
            raise ParameterError(f"scene/objects: {said}")

    def _look(self, kind: str, camera: Lens, pose: Matrix) -> np.ndarray:
        """Take a picture for a vision sensor of the scene; see scene.kinds.kind.Look."""
        self._show_blades()
        return self.shared.vision.picture(kind, camera, np.reshape((*pose, 0, 0, 0, 1), (4, 4)))

    def _show_blades(self) -> None:
        """Turn the blades of all vehicles in the world's pictures to where they are, once for all cameras."""
        blades = [vehicle.propulsion.blades for vehicle in self.vehicles.values()]
        if self._blades_shown == self.world.changes and not any(one.turned for one in blades):
            return
        for one in blades:
            one.show()
        self._blades_shown = self.world.changes
