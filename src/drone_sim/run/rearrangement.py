"""Change floor, weather and vehicles during a flight."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.object_names import split, suffixed
from drone_sim.mechanics.object_tree import PARENT, WORLD
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_settings import PLACE, are_same
from drone_sim.run.simulation_setup import SimulationSetup, script_of
from drone_sim.scripting import load
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.vehicle import Vehicle

_NOT_ITS_OWN = (*PLACE, "suffix")  # keys of which no other value makes another vehicle


class Hanging(NamedTuple):
    """An object of the scene that hangs on an object of a vehicle: its handle, that object's name, its place there."""

    handle: int
    parent: str
    local: Matrix


def rearrange(setup: SimulationSetup, before: Parameters, after: Parameters, script: str) -> bool:
    """Change floor, weather and vehicles to what other parameters say; return whether a vehicle has come or gone.

    A vehicle that is only moved flies on from its new place; one that differs in more is built anew where it is.
    `script` flies the vehicles that name none of their own. Raises ParameterError, UrdfError and ScriptError, where all
    is as it was.
    """
    came = _exchange(setup, before, after, script)
    if after.scene.floor != before.scene.floor:
        setup.scene.lay_floor(after.scene.floor)
    if after.weather != before.weather:
        setup.context.change_weather(after.weather.model_dump())
    old = {one.name: one for one in before.fleet}
    for one in after.fleet:
        if one.name not in came and not are_same(one.matrix, old[one.name].matrix):
            put(setup.vehicles[one.name], one.matrix)
    return bool(came) or len(before.fleet) != len(after.fleet)


def put(vehicle: Vehicle, matrix: Matrix) -> None:
    """Put a vehicle somewhere in the world, at rest, unless it is there."""
    if not are_same(vehicle.body.matrix, matrix):
        tree = vehicle.context.objects
        tree.set_matrix(tree.handle_of(vehicle.object), WORLD, matrix)


def _exchange(setup: SimulationSetup, before: Parameters, after: Parameters, script: str) -> Collection[str]:
    """Let vehicles come, go, and take the place of others; return the names of the new ones."""
    old, wanted = ({one.name: one for one in several.fleet} for several in (before, after))
    new = {
        name: one for name, one in wanted.items() if name not in old or not _is_as(setup.vehicles[name], old[name], one)
    }
    going = [one for name, one in setup.vehicles.items() if name in new or name not in wanted]
    if not new and not going:
        return ()
    for one in new.values():
        load.script_path(script_of(one, after, script))
    coming = [_in_place_of(one, _predecessor(one, old, wanted), setup.vehicles) for one in new.values()]
    hanging = [child for one in going for child in _hanging(one)]
    _replace(setup, going, coming, script)
    for child in hanging:
        tree = setup.context.objects
        if child.parent in tree:
            setup.operations.set_parent(child.handle, tree.handle(child.parent), keep_in_place=True)
            setup.operations.put(child.handle, child.local)
    for name in wanted:  # in their order
        setup.vehicles[name] = setup.vehicles.pop(name)
    return new


def _is_as(vehicle: Vehicle, old: VehicleParameters, new: VehicleParameters) -> bool:
    """Tell whether a vehicle can stay, perhaps at another place."""
    others = [key for key in VehicleParameters.model_fields if key not in _NOT_ITS_OWN]
    has_its_names = new.suffix is None or suffixed("", new.suffix) == vehicle.suffix
    return has_its_names and all(getattr(old, key) == getattr(new, key) for key in others)


def _predecessor(
    new: VehicleParameters, old: Mapping[str, VehicleParameters], wanted: Collection[str]
) -> VehicleParameters | None:
    """Return the vehicle that a new one replaces: that of its name, else one that is gone and began at its place."""
    gone = [one for name, one in old.items() if name not in wanted and are_same(one.matrix, new.matrix)]
    return old.get(new.name) or next(iter(gone), None)


def _in_place_of(
    new: VehicleParameters, old: VehicleParameters | None, vehicles: Mapping[str, Vehicle]
) -> VehicleParameters:
    """Return a vehicle with the object names of the one it replaces, at its present place unless another is given."""
    if old is None:
        return new
    vehicle = vehicles[old.name]
    suffix = split(f"_{vehicle.suffix}")[1] if new.suffix is None else new.suffix
    kept = new.model_copy(update={"suffix": suffix})
    if not are_same(new.matrix, old.matrix):
        return kept
    (x, y, z), (_, _, yaw) = frames.position(vehicle.body.matrix), frames.to_rpy(vehicle.body.matrix)
    return kept.model_copy(update={"position": (x, y, max(z, 0.0)), "yaw": yaw, "tilt": (0.0, 0.0)})


def _hanging(vehicle: Vehicle) -> Iterable[Hanging]:
    tree = vehicle.context.objects
    for above in vehicle.handles:
        for child, _ in tree.children(tree[above]):
            if child not in vehicle.handles:
                yield Hanging(child, tree[above].name, tree.matrix(child, PARENT))


def _replace(setup: SimulationSetup, going: list[Vehicle], coming: list[VehicleParameters], script: str) -> None:
    """Remove some vehicles and add others; where one cannot be added, restore them all."""
    handles: Mapping[str, int] = {
        name: handle for one in going for handle in one.handles for name in one.context.objects[handle].names
    }
    for one in going:
        _take_out(setup, one.name)
    came: list[str] = []
    try:
        for new in coming:
            setup.context.objects.reserve(handles)
            setup.add(new, True, script)
            came.append(new.name)
    except BaseException:
        for name in came:
            _take_out(setup, name)
        for one in going:
            back = one.parameters.model_copy(update={"suffix": split(f"_{one.suffix}")[1]})
            setup.context.objects.reserve(handles)
            setup.add(_in_place_of(back, one.parameters, {one.name: one}), True, script)
        raise


def _take_out(setup: SimulationSetup, name: str) -> None:
    """Remove a vehicle, even where the cleanup of its scripts fails."""
    try:
        setup.remove(name, running=True)
    except ScriptError as error:
        LOG.error("%s", error)
