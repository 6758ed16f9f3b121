"""Access of edit operations to the scene: its objects, and the settings of its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.run.flight_changes import put
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_document import SceneContent, SceneDocument
from drone_sim.run.scene_settings import PLACE, Settings
from drone_sim.run.simulation import Simulation
from drone_sim.scene.operations import SceneOperations
from drone_sim.scene.scene_parameters import WORLD_KEYS
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_FIXED_IN_FLIGHT = ("datum", "magnetic_field", "collections", *WORLD_KEYS)


class SceneAccess:
    """A simulation, as the edit operations see it."""

    def __init__(self, simulation: Simulation):
        """Give access to this simulation."""
        self.simulation = simulation

    @property
    def document(self) -> SceneDocument:
        """The scene's text, file and settings."""
        return self.simulation.document

    @property
    def settings(self) -> Settings:
        """The scene file's content except objects and scripts."""
        return self.document.settings

    @property
    def folder(self) -> Path:
        """The folder to which file names in the scene are relative."""
        return self.document.folder

    @property
    def operations(self) -> SceneOperations:
        """The operations on objects."""
        return self.simulation.operations

    @property
    def tree(self) -> ObjectTree:
        """The object tree."""
        return self.simulation.context.objects

    def content(self) -> SceneContent:
        """Return the present content of the scene."""
        return self.simulation.content()

    def handle(self, reference: Any) -> int:
        """Return the handle of an object, given its handle or its name. Raises ValueError."""
        if isinstance(reference, str):
            return self.tree.handle(reference)
        self.tree[reference]  # raises ValueError for an unknown handle
        return int(reference)

    def vehicle_of(self, handle: int) -> Vehicle | None:
        """Return the vehicle that an object belongs to, or None."""
        return next((vehicle for vehicle in self.simulation.vehicles.values() if handle in vehicle.handles), None)

    def is_root(self, handle: int) -> bool:
        """Return whether an object is the root of a vehicle."""
        vehicle = self.vehicle_of(handle)
        return vehicle is not None and self.tree[handle] is vehicle.object

    def tops(self, handles: Sequence[int]) -> list[int]:
        """Return the handles of the objects that are not descendants of any other."""
        tree = self.tree
        return [
            handle for handle in handles if not any(tree[handle].is_descendant_of(tree[other]) for other in handles)
        ]

    # ---- settings

    def checked(self, settings: Settings) -> Parameters:
        """Return the parameters of the present objects with other settings. Raises ParameterError."""
        simulation = self.simulation
        result = simulation.parameters.with_content({**settings, "objects": []}, self.folder)
        present = simulation.scene.parameters_now()
        scene = result.scene.model_copy(update={"objects": present.objects, "scripts": present.scripts})
        return result.varied(result.weather, scene, result.fleet)

    def apply_settings(self, settings: Settings) -> None:
        """Apply other settings to the scene. Raises ParameterError and UrdfError; then nothing has changed."""
        if settings == self.settings:
            return
        simulation = self.simulation
        if simulation.running:
            self._check_flight(settings)
        parameters = self.checked(settings)
        if simulation.running:
            simulation.apply_in_flight(parameters)
        elif self._only_moves(settings, parameters):
            for vehicle in parameters.fleet:
                put(simulation.vehicles[vehicle.name], vehicle.matrix)
            simulation.replace_scene(parameters, rebuild=False)
            simulation.scene.is_changed = True
        else:
            simulation.replace_scene(parameters)
        self.document.settings = settings

    def _check_flight(self, settings: Settings) -> None:
        for key in _FIXED_IN_FLIGHT:
            if settings.get(key) != self.settings.get(key):
                raise ValueError(f"{key}: can only be changed while the simulation is stopped: stop it first")

    def _only_moves(self, settings: Settings, parameters: Parameters) -> bool:
        """Return whether only the poses of vehicles differ."""
        if _without_vehicles(settings) != _without_vehicles(self.settings):
            return False
        fleet = self.simulation.parameters.fleet
        return len(fleet) == len(parameters.fleet) and all(
            old.is_alone == new.is_alone and _placed_as(old, new) == new for old, new in zip(fleet, parameters.fleet)
        )


def _without_vehicles(settings: Settings) -> Mapping[str, Any]:
    return {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}


def _placed_as(old: VehicleParameters, new: VehicleParameters) -> VehicleParameters:
    return old.model_copy(update={key: getattr(new, key) for key in PLACE})
