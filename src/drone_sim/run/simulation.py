"""The simulation, with V-REP's phases in V-REP's order, without ROS.

For example:

    simulation = Simulation(parameters.load())
    simulation.step()
    print(simulation.drone.body.state.position)
    simulation.close()
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.hosting.child_scripts import ChildScript
from drone_sim.hosting.script_scheduler import raise_first
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_tree import NO_HANDLES, Handles
from drone_sim.mechanics.saved_state import Restore
from drone_sim.run.flight_changes import apply_in_flight, check_changeable, put
from drone_sim.run.parameters import Parameters
from drone_sim.run.scene_document import (
    SceneContent,
    SceneDocument,
    Settings,
    have_only_moved,
    settings_now,
    without_vehicles,
)
from drone_sim.run.simulation_setup import SimulationSetup, give_back_memory, script_of
from drone_sim.run.stepping import Stepper
from drone_sim.scripting import load
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.sensors.truth import VEHICLE, ObjectLabel, category_of
from drone_sim.sensors.vision import Vision
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.world import World


class Snapshot(NamedTuple):
    """Exact dynamic state at one time; see Simulation.snapshot."""

    topology_version: int
    scripts: int  # ScriptScheduler.changes at that time
    world: int
    restore: Restore


class InitialScene(NamedTuple):
    """What stop restores: parameters, object handles, and the scene file's text and settings."""

    parameters: Parameters
    handles: Handles = NO_HANDLES
    restore_document: Restore = lambda: None
    is_edited: bool = False  # whether it was edited while stopped: the next start does not read the scene file


class Simulation:
    """A world, the vehicles in it, and the clock that counts steps.

    Not thread-safe: one thread owns it, and other threads may only use the `bus` of a vehicle. Every start replaces
    world, scene and vehicles by new objects.
    """

    def __init__(
        self,
        parameters: Parameters,
        *,
        script: str = "",
        gui: bool = False,
        backend: Backend | None = None,
        drawings: Drawings | None = None,
        started: bool = True,
        load_script: load.Loader = load.load,
    ):
        """Build the scene and, if `started`, run the init of the child scripts.

        `script` flies the vehicles without a script of their own; '' is the parameters' script, or the pilot.
        `backend` transports the scripts' ROS subscriptions and publications; without it messages are dropped.
        `drawings` receives what scripts draw; without it drawings are ignored. `load_script` replaces load.load.

        Raises ParameterError, UrdfError, ScriptError, and RuntimeError if `gui` is set without a display.
        """
        self.script, self.running = script, False
        self._gui = gui
        self._drawings = drawings if drawings is not None else Drawings(shown=False)
        self.windows = Windows()
        self.clock = Clock(parameters.time_step)
        self.vision = Vision(parameters.samples)
        self.breakpoints = Breakpoints(lambda: self.clock.time)
        self._new_setup = partial(
            SimulationSetup,
            clock=self.clock,
            vision=self.vision,
            drawings=self._drawings,
            windows=self.windows,
            breakpoints=self.breakpoints,
            backend=backend,
            load_script=load_script,
        )
        self.scenes_read = 0  # number of times that a scene was loaded from a file or the parameters
        # Document and content of the edited scene that the last one loaded replaced; None if it was not edited.
        self.replaced: tuple[SceneDocument, SceneContent] | None = None
        self._initial = InitialScene(parameters)
        self.run = 0  # run number, incremented by every start and stop
        self.topology_version = 0  # incremented by every start and stop, and when vehicles are added or removed
        flying_scripts = [script_of(vehicle, parameters, script) for vehicle in parameters.fleet]
        # Missing files are reported before a world is built.
        of_scene = (path for entry in parameters.scene.scripts for path in (entry.script, entry.customization) if path)
        for path in (*flying_scripts, *of_scene):
            load.script_path(path)
        self._use(self._new_setup(parameters, _world(parameters, gui)))
        self.document = SceneDocument(parameters, self.object_handles)
        try:
            if started:
                self.load_scripts()
        except BaseException:
            try:
                self.close()
            except ScriptError as second:  # in cleanup; the caller gets the first error
                LOG.error("%s", second)
            raise

    def _rebuild(self, parameters: Parameters, handles: Handles) -> None:
        """Build scene and vehicles, without scripts, in a new world that then replaces the present one."""
        built = self._new_setup(parameters, _world(parameters), handles)
        if self._gui:  # a process can have one window, so the setup is tested first, then built in it
            built.context.world.close()
            self.world.clear()
            built = self._new_setup(parameters, self.world, handles)
        else:
            self.world.close()
        built.tune_as(self._setup)
        self._use(built)

    def _use(self, built: SimulationSetup) -> None:
        """Replace the present setup by `built`, and begin a run in it."""
        self._setup = built
        self.parameters = built.parameters
        self.context = built.context  # shared by all vehicles and scripts
        self.world, self.scene, self.operations = built.context.world, built.scene, built.operations
        self.tree = built.context.objects
        self.vehicles: dict[str, Vehicle] = built.vehicles  # by name
        self.child_scripts: dict[str, ChildScript] = built.scripts.child_scripts  # by vehicle
        self.vision.look_at(self.world.pictures, self.context.blades, self._identify)
        self._begin_run()

    def _identify(self) -> list[ObjectLabel]:
        """Return the name and category of the object of each of the world's visuals."""
        categories = self.scene.categories()
        return [
            ObjectLabel(name, categories.get(name) or (VEHICLE if name in self.vehicles else category_of(name)))
            for name in map(self.context.person_name_of, self.world.pictures.places())
        ]

    def _begin_run(self) -> None:
        self._stepper = Stepper(self._setup)
        self.run += 1
        self.topology_version += 1
        self._drawings.clear()
        self.windows.clear()

    # ---- vehicles

    @property
    def drone(self) -> Vehicle:
        """The first vehicle, usually the only one. Raises LookupError if there is none."""
        for first in self.vehicles.values():
            return first
        raise LookupError("the scene has no vehicle")

    def vehicle_of(self, handle: int) -> Vehicle | None:
        """Return the vehicle that an object belongs to, or None."""
        return next((vehicle for vehicle in self.vehicles.values() if handle in vehicle.handles), None)

    def is_vehicle(self, handle: int) -> bool:
        """Return whether an object is the root of a vehicle."""
        return any(self.tree[handle] is vehicle.object for vehicle in self.vehicles.values())

    def set_vehicles(self, entries: Any) -> tuple[list[str], list[str]]:
        """Add and remove vehicles to match `entries` (as the parameter `vehicles`); return the added and removed names.

        Other vehicles fly on unchanged, to the last bit. Snapshots become invalid. Raises ParameterError, UrdfError and
        ScriptError without a change if a vehicle cannot be added or its script fails in init; ScriptError after the
        change if the cleanup of a removed one fails.
        """
        parameters = self.parameters.with_vehicles(entries)
        parameters = parameters.varied(self.parameters.weather, self.parameters.scene, parameters.fleet)
        wanted = {vehicle.name: vehicle for vehicle in parameters.fleet}
        added = [name for name in wanted if name not in self.vehicles]
        removed = [name for name in self.vehicles if name not in wanted]
        for name in added:
            load.script_path(script_of(wanted[name], parameters, self.script))
        errors: list[ScriptError] = []
        try:
            self._setup.add_all([wanted[name] for name in added], self.running, self.script)
            errors = self._setup.remove_all(removed, self.running)
        finally:
            if added or removed:
                self.topology_version += 1
                self._stepper.refresh_vehicles()
        self.parameters = parameters
        initial = self._initial.parameters
        initial = parameters.varied(initial.weather, initial.scene, parameters.fleet)
        self._initial = self._initial._replace(parameters=initial)
        raise_first(errors)
        return added, removed

    def set_pace(self, factor: Any) -> None:
        """Set the real-time factor, which persists across starts. Raises ParameterError."""
        self.parameters = self.parameters.at_pace(factor)
        self._initial = self._initial._replace(parameters=self._initial.parameters.at_pace(factor))

    # ---- start and stop

    def start(
        self, scene_file: str | None = None, prepare: Callable[[Parameters], None] = lambda _parameters: None
    ) -> None:
        """Read scene and scripts from disk, and run the scripts' init; `scene_file` replaces the present scene file.

        A scene that was edited while stopped is not read again. `prepare` is called with the parameters of the run
        before the scene is built. If it raises an exception, or scene or vehicles cannot be read, the present ones
        stay, stopped. Raises ParameterError, UrdfError, ScriptError.
        """
        self.stop()
        if scene_file is None and self._initial.is_edited:
            prepare(self.parameters)
            self._rebuild(self.parameters, self._initial.handles)
        else:
            self._load_scene(self.parameters.scene_file if scene_file is None else scene_file, prepare)
        give_back_memory()
        self.load_scripts()

    def load_scene(self, scene_file: str) -> None:
        """Stop, and load another scene file. Raises ParameterError, UrdfError, ScriptError."""
        self.stop()
        self._load_scene(scene_file)

    def _load_scene(self, scene_file: str, prepare: Callable[[Parameters], None] = lambda _parameters: None) -> None:
        parameters = self.parameters.in_scene(scene_file)
        prepare(parameters)
        replaced = (self.document, self.content()) if self._initial.is_edited else None
        self._rebuild(parameters, NO_HANDLES)
        self.replaced = replaced
        self.document = SceneDocument(self.parameters, self.object_handles)
        self._initial = self._initial._replace(is_edited=False)
        self.scenes_read += 1

    def replace_scene(self, parameters: Parameters, rebuild: bool = True) -> None:
        """While stopped, replace the initial scene by that of `parameters`; objects keep present or former handles.

        Without `rebuild`, the world changes at the next start. Raises ParameterError and UrdfError, without a change.
        """
        if rebuild:
            handles = self.tree.handles().with_those_of(self._initial.handles)
            self._rebuild(parameters, handles)
            self._initial = self._initial._replace(handles=handles)
        self.parameters = parameters
        self._initial = self._initial._replace(is_edited=True)

    def apply_settings(self, settings: Settings) -> None:
        """Change all but objects and scripts to `settings`, which are as in a scene file.

        While running, floor, weather and vehicles may change; stop reverts them. Raises ParameterError, UrdfError and
        ScriptError, without a change.
        """
        before = self.document.settings
        if settings == before:
            return
        if self.running:
            check_changeable(before, settings)
        parameters = self.with_settings(settings)
        if self.running:
            self.scene.is_changed = True
            if apply_in_flight(self._setup, self.parameters, parameters, self.script):
                self.topology_version += 1
                self._stepper.refresh_vehicles()
            self._stepper.set_floor(parameters.scene.floor)
            self.parameters = parameters
        elif without_vehicles(settings) == without_vehicles(before) and have_only_moved(
            self.parameters.fleet, parameters.fleet
        ):
            for vehicle in parameters.fleet:
                put(self.vehicles[vehicle.name], vehicle.matrix)
            self.replace_scene(parameters, rebuild=False)
            self.scene.is_changed = True
        else:
            self.replace_scene(parameters)
        self.document.settings = settings

    def with_settings(self, settings: Settings) -> Parameters:
        """Return the parameters of the present objects with other settings. Raises ParameterError."""
        result = self.parameters.with_content({**settings, "objects": []}, self.document.folder)
        present = self.scene.parameters_now()
        scene = result.scene.model_copy(update={"objects": present.objects, "scripts": present.scripts})
        return result.varied(result.weather, scene, result.fleet)

    def load_scripts(self) -> None:
        """Load the scripts of a simulation that has none loaded, and run their init. Raises ScriptError."""
        handles, restore_document = self.tree.handles(), self.document.save_state()
        self._initial = InitialScene(self.parameters, handles, restore_document, self._initial.is_edited)
        self.running = True
        self._setup.load_scripts(self._setup.scripts.all(), self.script)
        self._stepper.list_scripts()

    def stop(self) -> None:
        """Run the scripts' cleanup, and restore the initial scene, at time 0. Raises ScriptError.

        Changes of objects in flight are undone; changes made while stopped become the initial scene.
        """
        if self.running:
            self.parameters = self._initial.parameters
            self._initial.restore_document()
        elif self.scene.is_changed:
            self.scene.sync()  # should the rebuild fail, the changes stay
            before, scene = self.parameters, self.scene.parameters_now()
            self.parameters = before.varied(before.weather, scene, before.fleet)
            self._initial = self._initial._replace(handles=self.tree.handles(), is_edited=True)
        try:
            self._clean_up()
        finally:
            # False even if the scene cannot be rebuilt: the next start must not take the flown scene as its beginning.
            is_changed, self.scene.is_changed = self.scene.is_changed, False
            if not is_changed or not self._undo_changes():
                self._setup.begin_anew()
                self._begin_run()

    def _undo_changes(self) -> bool:
        """Rebuild the initial scene; return whether that was possible, as its files may be missing now."""
        self.clock.steps = 0  # the new setup must begin at time 0
        try:
            self._rebuild(self.parameters, self._initial.handles)
        except ValueError as error:
            LOG.error("the scene could not be restored and stays as the flight left it; `start` tries again: %s", error)
            return False
        return True

    def close(self) -> None:
        """Run the scripts' cleanup if they are running, and free the world; may be called twice. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self.vision.close()
            self.world.close()

    def _clean_up(self) -> None:
        was_running, self.running = self.running, False
        self._setup.end_scripts(clean_up=was_running)

    def read_at_start(self) -> None:
        """Discard edits made while stopped: the next start reads the scene file again."""
        self._initial = self._initial._replace(is_edited=False)
        self.scene.is_changed = False

    # ---- stepping

    @property
    def failed_scripts(self) -> dict[str, ScriptError]:
        """Errors of attached scripts that have failed and are no longer called, by object name."""
        errors = ((script.own_script, script.error()) for script in self._setup.scripts.attached)
        return {name: error for name, error in errors if error is not None}

    @property
    def steps(self) -> int:
        """Steps since the start of the run."""
        return self.clock.steps

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self.clock.time

    def step(self, watch: Callable[[int], None] | None = None) -> None:
        """Run one simulation step: threads, actuation, dynamics, vision, sensing. Raises ScriptError and Diverged.

        `watch` is called like `between` of World.advance, and must not change anything.
        """
        self._stepper.step(watch)

    def look(self) -> None:
        """Render a picture for every subscribed camera now, between two steps."""
        for vehicle in self.vehicles.values():
            vehicle.take_pictures(self.steps, now=True)

    # ---- debugging of scripts

    def set_breakpoints(self, lines: Mapping[str, frozenset[int]]) -> None:
        """Replace all breakpoints of scripts by `lines` (from 1), by file path."""
        if self.breakpoints.set(lines):
            for hosted in self._setup.scripts.all():
                hosted.script.follow_breakpoints()

    def variables(self) -> Iterator[tuple[str, str, list[Scope]]]:
        """Yield the object, file and variables (as text for people) of every loaded script."""
        for hosted in self._setup.scripts.all():
            if hosted.path:
                yield hosted.own_script, hosted.path, hosted.script.variables()

    # ---- snapshots and files

    def snapshot(self) -> Snapshot:
        """Save the exact dynamic state, including the scripts' variables; it is valid until the next start or stop."""
        number = self.world.saved_states.snapshot()
        return Snapshot(self.topology_version, self._setup.scripts.changes, number, self._setup.save_state())

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot: the flight then continues as before, to the last bit. May be repeated.

        Raises ValueError for a snapshot from before a start, a stop, or a change of vehicles, shapes or their scripts.
        """
        is_valid = (
            snapshot.topology_version == self.topology_version and snapshot.scripts == self._setup.scripts.changes
        )
        if not is_valid or not self.world.saved_states.has_snapshot(snapshot.world):
            reason = "start, stop, and adding or removing a vehicle, a shape or a script of one make a snapshot invalid"
            raise ValueError(f"the snapshot is from an earlier run: {reason}")
        self.scene.drag.let_go_of_all()
        for vehicle in self.vehicles.values():
            vehicle.body.let_go()
        self.world.saved_states.restore(snapshot.world)
        snapshot.restore()
        self._stepper.update_wind_forces()

    def forget(self, snapshot: Snapshot) -> None:
        """Free a snapshot. Start and stop free all snapshots themselves."""
        if snapshot.topology_version == self.topology_version:
            self.world.saved_states.forget_snapshot(snapshot.world)

    @property
    def object_handles(self) -> Mapping[str, int]:
        return self.tree.handles().by_name

    def content(self) -> SceneContent:
        """Return the present content of the scene; vehicles and weather are those at the start."""
        scene = self.scene
        entries = {self.tree.handle(record.entry.name): record.present for record in scene.records.values()}
        return SceneContent(entries, dict(scene.scripts), self.document.settings)

    def save_scene(self, path: Path) -> str:
        """Write a scene file with the present floor, objects, vehicles and weather; return its text.

        Comments and order of the file that the scene was read from are kept. Raises ParameterError and OSError, as
        SceneDocument.write does.
        """
        now = settings_now(self.document.settings, self.parameters, self.vehicles, self.context.weather.now)
        return self.document.write(path, self.content()._replace(settings=now), self.parameters)


def _world(parameters: Parameters, gui: bool = False) -> World:
    return World(parameters.sub_step, parameters.gravity, gui, gyroscopic=parameters.physics.gyroscopic)
