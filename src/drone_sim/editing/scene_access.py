"""The scene that is edited, as operations reach it: its objects, and what its file says beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.run.parameters import Parameters
from drone_sim.run.rearrangement import put
from drone_sim.run.scene_document import SceneContent, SceneDocument
from drone_sim.run.scene_settings import PLACE, Settings
from drone_sim.run.simulation import Simulation
from drone_sim.scene.operations import SceneOperations
from drone_sim.scene.scene_parameters import WORLD_KEYS
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_FIXED = ("datum", "magnetic_field", "collections", *WORLD_KEYS)


class SceneAccess:
    """A simulation, as whoever edits its scene sees it."""

    def __init__(self, simulation: Simulation):
        """Take the simulation."""
        self.simulation = simulation

    @property
    def document(self) -> SceneDocument:
        """Its text, file and settings."""
        return self.simulation.document

    @property
    def settings(self) -> Settings:
        """What is said beside objects and scripts."""
        return self.document.settings

    @property
    def folder(self) -> Path:
        """The folder to which file names are relative."""
        return self.document.folder

    @property
    def operations(self) -> SceneOperations:
        """What is done to objects."""
        return self.simulation.operations

    @property
    def tree(self) -> ObjectTree:
        """The objects."""
        return self.simulation.context.objects

    def content(self) -> SceneContent:
        """Return what the scene is now."""
        return self.simulation.content()

    def handle(self, named: Any) -> int:
        """Return the handle of an object, given its handle or its name. Raises ValueError."""
        if isinstance(named, str):
            return self.tree.handle(named)
        self.tree[named]  # which there must be
        return int(named)

    def vehicle_of(self, handle: int) -> Vehicle | None:
        """Return the vehicle whose object it is."""
        return next((one for one in self.simulation.vehicles.values() if handle in one.handles), None)

    def is_root(self, handle: int) -> bool:
        """Tell whether an object is the root of a vehicle."""
        vehicle = self.vehicle_of(handle)
        return vehicle is not None and self.tree[handle] is vehicle.object

    def tops(self, handles: Sequence[int]) -> list[int]:
        """Return those of some objects that hang on none of the others."""
        tree = self.tree
        return [one for one in handles if not any(tree[one].hangs_on(tree[other]) for other in handles)]

    # ---- settings

    def checked(self, settings: Settings) -> Parameters:
        """Return the parameters of the same objects with other settings. Raises ParameterError."""
        simulation = self.simulation
        found = simulation.parameters.with_content({**settings, "objects": []}, self.folder)
        now = simulation.scene.parameters_now()
        scene = found.scene.model_copy(update={"objects": now.objects, "scripts": now.scripts})
        return found.varied(found.weather, scene, found.fleet)

    def arrange(self, settings: Settings) -> None:
        """Let the scene have other settings. Raises ParameterError and UrdfError, where all is as it was."""
        if settings == self.settings:
            return
        simulation = self.simulation
        if simulation.running:
            self._check_flight(settings)
        parameters = self.checked(settings)
        if simulation.running:
            simulation.rearrange(parameters)
        elif self._only_moves(settings, parameters):
            for one in parameters.fleet:
                put(simulation.vehicles[one.name], one.matrix)
            simulation.arrange(parameters, rebuild=False)
            simulation.scene.is_changed = True
        else:
            simulation.arrange(parameters)
        self.document.settings = settings

    def _check_flight(self, settings: Settings) -> None:
        """Refuse what no flight can go on with."""
        for key in _FIXED:
            if settings.get(key) != self.settings.get(key):
                raise ValueError(f"{key}: can only be changed while the simulation is stopped: stop it first")

    def _only_moves(self, settings: Settings, parameters: Parameters) -> bool:
        """Tell whether only the places of vehicles differ."""
        if _others(settings) != _others(self.settings):
            return False
        fleet = self.simulation.parameters.fleet
        return len(fleet) == len(parameters.fleet) and all(
            one.is_alone == two.is_alone and _placed_as(one, two) == two for one, two in zip(fleet, parameters.fleet)
        )


def _others(settings: Settings) -> Mapping[str, Any]:
    return {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}


def _placed_as(one: VehicleParameters, two: VehicleParameters) -> VehicleParameters:
    return one.model_copy(update={key: getattr(two, key) for key in PLACE})
