"""Change floor, weather and vehicles during a flight."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import split, suffixed
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_document import PLACE, Settings, are_same
from drone_sim.run.simulation_setup import SimulationSetup, script_of
from drone_sim.scene.scene_parameters import WORLD_KEYS
from drone_sim.scripting import load
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_CHANGEABLE = (*PLACE, "suffix")  # keys whose change does not need a new vehicle
_FIXED_IN_FLIGHT = ("datum", "magnetic_field", "collections", *WORLD_KEYS)


def check_changeable(before: Settings, after: Settings) -> None:
    """Raise ValueError if settings differ in a key that cannot be changed in flight."""
    for key in _FIXED_IN_FLIGHT:
        if before.get(key) != after.get(key):
            raise ValueError(f"{key}: can only be changed while the simulation is stopped: stop it first")


def apply_in_flight(setup: SimulationSetup, before: Parameters, after: Parameters, script: str) -> bool:
    """Apply the floor, weather and vehicles of `after`; return whether a vehicle was added, replaced or removed.

    A vehicle with a new start pose is put there, at rest; one with other changes is built again where it is. `script`
    flies vehicles without a script of their own. Raises ParameterError, UrdfError and ScriptError, without a change.
    """
    added = _replace_vehicles(setup, before, after, script)
    if after.scene.floor != before.scene.floor:
        setup.scene.set_floor(after.scene.floor)
    if after.weather != before.weather:
        setup.context.change_weather(after.weather.model_dump())
    before_by_name = {vehicle.name: vehicle for vehicle in before.fleet}
    for vehicle in after.fleet:
        if vehicle.name not in added and not are_same(vehicle.matrix, before_by_name[vehicle.name].matrix):
            put(setup.vehicles[vehicle.name], vehicle.matrix)
    return bool(added) or len(before.fleet) != len(after.fleet)


def put(vehicle: Vehicle, matrix: Matrix) -> None:
    """Put a vehicle at a pose in the world, at rest, unless it is there already."""
    if not are_same(vehicle.body.matrix, matrix):
        tree = vehicle.context.objects
        tree.set_matrix(tree.handle_of(vehicle.object), WORLD, matrix)


def _replace_vehicles(setup: SimulationSetup, before: Parameters, after: Parameters, script: str) -> Collection[str]:
    """Add, remove and replace vehicles; return the names of the new ones."""
    old, wanted = ({vehicle.name: vehicle for vehicle in parameters.fleet} for parameters in (before, after))
    new = {
        key: entry
        for key, entry in wanted.items()
        if key not in old or not _can_stay(setup.vehicles[key], old[key], entry)
    }
    removed = [vehicle for name, vehicle in setup.vehicles.items() if name in new or name not in wanted]
    if not new and not removed:
        return ()
    for vehicle in new.values():
        load.script_path(script_of(vehicle, after, script))
    added = [_as_successor(vehicle, _predecessor(vehicle, old, wanted), setup.vehicles) for vehicle in new.values()]
    tree, operations = setup.context.objects, setup.operations
    attached = [  # scene objects on removed vehicles: handle, name of the parent, pose in the parent
        (child, tree[parent].name, tree.matrix(child, PARENT))
        for vehicle in removed
        for parent in vehicle.handles
        for child, _ in tree.children(tree[parent])
        if child not in vehicle.handles
    ]
    _exchange(setup, removed, added, script)
    for handle, parent_name, local in attached:
        if parent_name in tree:
            operations.set_parent(handle, tree.handle(parent_name), keep_in_place=True)
            operations.put(handle, local)
    for name in wanted:  # in the order of the parameters
        setup.vehicles[name] = setup.vehicles.pop(name)
    return new


def _can_stay(vehicle: Vehicle, old: VehicleParameters, new: VehicleParameters) -> bool:
    """Return whether the vehicle for `old` can also be the one for `new`, perhaps at another pose."""
    keys = [key for key in VehicleParameters.model_fields if key not in _CHANGEABLE]
    has_same_suffix = new.suffix is None or suffixed("", new.suffix) == vehicle.suffix
    return has_same_suffix and all(getattr(old, key) == getattr(new, key) for key in keys)


def _predecessor(
    new: VehicleParameters, old: Mapping[str, VehicleParameters], wanted: Collection[str]
) -> VehicleParameters | None:
    """Return the vehicle that `new` replaces: the one with its name, or a removed one with the same start pose."""
    removed = [vehicle for name, vehicle in old.items() if name not in wanted and are_same(vehicle.matrix, new.matrix)]
    return old.get(new.name) or next(iter(removed), None)


def _as_successor(
    new: VehicleParameters, old: VehicleParameters | None, vehicles: Mapping[str, Vehicle]
) -> VehicleParameters:
    """Return `new` with the suffix of the vehicle it replaces, and with its present pose unless the start differs."""
    if old is None:
        return new
    vehicle = vehicles[old.name]
    suffix = split(f"_{vehicle.suffix}")[1] if new.suffix is None else new.suffix
    successor = new.model_copy(update={"suffix": suffix})
    if not are_same(new.matrix, old.matrix):
        return successor
    (x, y, z), (_, _, yaw) = frames.position(vehicle.body.matrix), frames.to_rpy(vehicle.body.matrix)
    return successor.model_copy(update={"position": (x, y, max(z, 0.0)), "yaw": yaw, "tilt": (0.0, 0.0)})


def _exchange(setup: SimulationSetup, removed: list[Vehicle], added: list[VehicleParameters], script: str) -> None:
    """Remove vehicles and add others; if one cannot be added, restore the removed ones and raise."""
    handles: Mapping[str, int] = {
        name: handle for each in removed for handle in each.handles for name in each.context.objects[handle].names
    }
    for error in setup.remove_all([vehicle.name for vehicle in removed], running=True):
        LOG.error("%s", error)
    setup.context.objects.reserve(handles)
    try:
        setup.add_all(added, True, script)
    except BaseException:
        for vehicle in removed:
            restored = vehicle.parameters.model_copy(update={"suffix": split(f"_{vehicle.suffix}")[1]})
            setup.add(_as_successor(restored, vehicle.parameters, {vehicle.name: vehicle}), True, script)
        raise
