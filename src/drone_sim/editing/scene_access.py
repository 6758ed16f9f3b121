"""The scene that is edited, as operations reach it: its objects, and what its file says beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drone_sim.editing.changes import SceneContent, Settings, content_of
from drone_sim.editing.settings import PLACE, vehicles_in, with_vehicles
from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_tree import WORLD, ObjectTree
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scene.operations import SceneOperations
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_WHILE_STOPPED = "vehicles, floor and weather are changed while the simulation is stopped: stop it first"


class SceneAccess:
    """A simulation, and the settings of its scene, which the simulation does not know as they were written."""

    def __init__(self, simulation: Simulation):
        """Take the simulation; its scene has no file."""
        self.simulation = simulation
        self.settings: Settings = {}
        self.folder = Path()  # relative to which settings name files

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
        return content_of(self.simulation, self.settings)

    def handle(self, named: Any) -> int:
        """Return the handle of an object that is given by it, or by name. Raises ValueError."""
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

    def settings_in_flight(self) -> Settings:
        """Return the settings with vehicles where they are, and the weather that there is."""
        simulation = self.simulation
        said = vehicles_in(self.settings, simulation.parameters)
        for name, vehicle in simulation.vehicles.items():
            roll, pitch, yaw = (round(one, 9) + 0.0 for one in frames.to_rpy(vehicle.body.matrix))
            place = {"position": [round(one, 9) + 0.0 for one in frames.position(vehicle.body.matrix)], "yaw": yaw}
            tilt = {"tilt": [roll, pitch]} if any(vehicle.parameters.tilt) else {}
            said[name] = {**said.get(name, {}), **place, **tilt}
        settings = dict(with_vehicles(self.settings, said, simulation.parameters))
        weather = simulation.context.weather.now
        if weather != simulation.parameters.weather:
            settings["weather"] = weather.model_dump(mode="json")
        return settings

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
            raise ValueError(_WHILE_STOPPED)
        parameters = self.checked(settings)
        if self._only_moves(settings, parameters):
            for one in parameters.fleet:
                self.put_vehicle(simulation.vehicles[one.name], _matrix(one))
            simulation.arrange(parameters, rebuild=False)
            simulation.scene.is_changed = True
        else:
            simulation.arrange(parameters)
        self.settings = settings

    def _only_moves(self, settings: Settings, parameters: Parameters) -> bool:
        """Tell whether nothing is otherwise but where vehicles are."""
        if _others(settings) != _others(self.settings):
            return False
        fleet = self.simulation.parameters.fleet
        return len(fleet) == len(parameters.fleet) and all(
            one.is_alone == two.is_alone and _placed_as(one, two) == two for one, two in zip(fleet, parameters.fleet)
        )

    def put_vehicle(self, vehicle: Vehicle, matrix: Matrix) -> None:
        """Put a vehicle somewhere in the world, at rest, unless it is there."""
        if any(abs(one - two) > 1e-9 for one, two in zip(vehicle.body.matrix, matrix)):
            self.tree.set_matrix(self.tree.handle_of(vehicle.object), WORLD, matrix)


def _others(settings: Settings) -> Mapping[str, Any]:
    return {key: value for key, value in settings.items() if key not in ("drone", "vehicles")}


def _placed_as(one: VehicleParameters, two: VehicleParameters) -> VehicleParameters:
    return one.model_copy(update={key: getattr(two, key) for key in PLACE})


def _matrix(one: VehicleParameters) -> Matrix:
    return frames.from_rpy(one.position, (*one.tilt, one.yaw))
