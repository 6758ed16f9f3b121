"""The simulation: V-REP's phases in V-REP's order, without ROS.

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
from drone_sim.importing.folder import holes
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_tree import NO_HANDLES, Handles
from drone_sim.mechanics.saved_state import Restore
from drone_sim.run.parameters import Parameters
from drone_sim.run.rearrangement import rearrange
from drone_sim.run.scene_document import SceneContent, SceneDocument
from drone_sim.run.scene_settings import settings_now
from drone_sim.run.simulation_setup import SimulationSetup, give_back_memory, script_of
from drone_sim.run.stepping import Stepper
from drone_sim.scripting import load
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.breakpoints import Breakpoints, Scope
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.sensors.truth import VEHICLE, Identity, category_of
from drone_sim.sensors.vision import Vision
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.world import World


class Snapshot(NamedTuple):
    """The exact dynamic state at a moment; see Simulation.snapshot."""

    era: int
    scripts: int  # that had come or gone on objects
    world: int
    restore: Restore


class Simulation:
    """A world, what flies in it, and the clock that counts steps.

    Not thread-safe: one thread owns it. The `bus` of a vehicle alone may be used from others. World, scene and
    vehicles are new ones after every start.
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

        `script` flies the vehicles that name none of their own; '' is the parameters', or the pilot. `backend`
        carries what scripts subscribe to and publish; without it the messages go nowhere.
        `drawings` takes what scripts draw; without it that is ignored. `load_script` loads scripts, as load.load does.

        Raises ParameterError, UrdfError, ScriptError, and RuntimeError where `gui` finds no display.
        """
        self.script, self.running = script, False
        self._gui = gui
        self._drawings = drawings if drawings is not None else Drawings(shown=False)
        self.windows = Windows()
        self.clock = Clock(parameters.time_step)
        self.vision = Vision(parameters.samples)
        self.breakpoints = Breakpoints(lambda: self.clock.time)
        self._set_up = partial(
            SimulationSetup,
            clock=self.clock,
            vision=self.vision,
            drawings=self._drawings,
            windows=self.windows,
            breakpoints=self.breakpoints,
            backend=backend,
            load_script=load_script,
        )
        self.scenes_read = 0  # how often a scene file, or none, has taken the last one's place
        self._handles = NO_HANDLES  # of the objects as the scene began
        self._is_arranged = False  # whether that is what was made of it, not what the scene file says
        self._before: Parameters | None = None  # what stop brings back, once it was rearranged in flight
        self.run = 0  # number of the run: another one after every start and every stop
        self.era = 0  # another number after every start, every stop, and whenever a vehicle has come or gone
        flown = [script_of(one, parameters, script) for one in parameters.fleet]
        for path in (*flown, *(one.script for one in parameters.scene.scripts)):  # one that is not there needs no world
            load.script_path(path)
        self._take(self._set_up(parameters, _world(parameters, gui)))
        self.holes: list[str] = []  # what will not work in an imported scene
        self._find_holes()
        self.document = SceneDocument(parameters, self.object_handles)
        try:
            if started:
                self.load_scripts()
        except BaseException:
            try:
                self.close()
            except ScriptError as second:  # in cleanup; the first one is what the caller is told
                LOG.error("%s", second)
            raise

    def _rebuild(self, parameters: Parameters, handles: Handles) -> None:
        """Put scene and vehicles without scripts into a new world, which then takes the last one's place."""
        built = self._set_up(parameters, _world(parameters), handles)
        if self._gui:  # a process has one window: what can be built is built there once more
            built.context.world.close()
            self.world.clear()
            built = self._set_up(parameters, self.world, handles)
        else:
            self.world.close()
        built.tune_as(self._setup)
        self._take(built)

    def _take(self, built: SimulationSetup) -> None:
        """Use the new setup from now on, and begin a run in it."""
        self._setup = built
        self.parameters = built.parameters
        self.context = built.context  # what all that flies, and every script, has in common
        self.world, self.scene, self.operations = built.context.world, built.scene, built.operations
        self.vehicles: dict[str, Vehicle] = built.vehicles  # by name
        self.child_scripts: dict[str, ChildScript] = built.scripts.child_scripts  # that fly them, by vehicle
        self.vision.look_at(self.world.pictures, self.context.blades, self._identify)
        self._begin()

    def _identify(self) -> list[Identity]:
        """Return for each of the world's visuals the object that it belongs to."""
        categories = self.scene.categories()
        return [
            Identity(name, categories.get(name) or (VEHICLE if name in self.vehicles else category_of(name)))
            for name in map(self.context.person_name_of, self.world.pictures.places())
        ]

    def _begin(self) -> None:
        """Be at time 0 of a new run, in the initial scene."""
        self._stepper = Stepper(self._setup)
        self.run += 1
        self.era += 1
        self._drawings.clear()
        self.windows.clear()

    # ---- what flies

    @property
    def drone(self) -> Vehicle:
        """The first vehicle, most often the only one. Raises LookupError where nobody flies."""
        for first in self.vehicles.values():
            return first
        raise LookupError("the scene has no vehicle")

    def set_vehicles(self, entries: Any) -> tuple[list[str], list[str]]:
        """Let the vehicles in `entries`, as in the parameter `vehicles`, fly; return which came and which went.

        Vehicles that stay fly on unchanged, to the last bit. A new one whose script fails in init is removed again.
        Snapshots are forgotten. Raises ParameterError, UrdfError and ScriptError.
        """
        parameters = self.parameters.with_vehicles(entries)
        if self._is_arranged or self._before:
            parameters = parameters.varied(self.parameters.weather, self.parameters.scene, parameters.fleet)
        wanted = {one.name: one for one in parameters.fleet}
        came = [name for name in wanted if name not in self.vehicles]
        went = [name for name in self.vehicles if name not in wanted]
        for name in came:
            load.script_path(script_of(wanted[name], parameters, self.script))
        try:
            for name in came:
                self._setup.add(wanted[name], self.running, self.script)
            for name in went:
                self._setup.remove(name, self.running)
        finally:
            if came or went:
                self.era += 1
                self._stepper.list_vehicles()
        self.parameters = parameters
        if self._before:
            self._before = parameters.varied(self._before.weather, self._before.scene, parameters.fleet)
        return came, went

    def set_pace(self, factor: Any) -> None:
        """Have whoever plays it play at another real-time factor, through every start. Raises ParameterError."""
        self.parameters = self.parameters.at_pace(factor)

    # ---- start and stop

    def start(self, scene_file: str | None = None) -> None:
        """Read scene and scripts from disk, run the scripts' init; another scene file may take the last one's place.

        A scene whose objects have been changed while it was stopped begins as it stands. Where scene or vehicles cannot
        be read, the last ones stay, stopped. Raises ParameterError, UrdfError, ScriptError.
        """
        self.stop()
        if scene_file is None and self._is_arranged:
            self._rebuild(self.parameters, self._handles)
        else:
            self._read(self.parameters.scene_file if scene_file is None else scene_file)
        give_back_memory()
        self.load_scripts()

    def load_scene(self, scene_file: str) -> None:
        """Stop, and let another scene file take the last one's place. Raises ParameterError, UrdfError, ScriptError."""
        self.stop()
        self._read(scene_file)

    def _read(self, scene_file: str) -> None:
        self._rebuild(self.parameters.in_scene(scene_file), NO_HANDLES)
        self._find_holes()
        self.document = SceneDocument(self.parameters, self.object_handles)
        self._is_arranged = False
        self.scenes_read += 1

    def _find_holes(self) -> None:
        """Warn of what will not work in a scene that was imported from V-REP, unless it was said before."""
        file, before = self.parameters.scene_file, self.holes
        self.holes = holes(file) if file else []
        for one in self.holes:
            if one not in before:
                LOG.warning("%s: %s", file, one)

    def arrange(self, parameters: Parameters, rebuild: bool = True) -> None:
        """While it is stopped: begin as these parameters say from now on, with the handles that objects have, or had.

        Without `rebuild`, what stands there stays until then. Raises ParameterError and UrdfError, where all is as it
        was.
        """
        if rebuild:
            self._handles = self.context.objects.handles().with_those_of(self._handles)
            self._rebuild(parameters, self._handles)
        self.parameters = parameters
        self._is_arranged = True

    def rearrange(self, parameters: Parameters) -> None:
        """In flight: let floor, weather and vehicles be as these parameters say, until stop.

        Raises ParameterError, UrdfError and ScriptError, where all is as it was.
        """
        self._before = self._before or self.parameters
        self.scene.is_changed = True
        if rearrange(self._setup, self.parameters, parameters, self.script):
            self.era += 1
            self._stepper.list_vehicles()
        self._stepper.lay_floor(parameters.scene.floor)
        self.parameters = parameters

    def load_scripts(self) -> None:
        """Load the scripts and run their init, of a simulation that was built without. Raises ScriptError."""
        self._handles = self.context.objects.handles()
        self._document_began = self.document.save_state()
        self.running = True
        self._setup.load_scripts(self._setup.scripts.all(), self.script)
        self._stepper.list_scripts()

    def stop(self) -> None:
        """Run the scripts' cleanup, and restore the initial scene, at time 0. Raises ScriptError.

        What has been done to its objects in flight is undone; what was done while it was stopped is how it begins.
        """
        if self.scene.is_changed and not self.running:
            self._handles, self._is_arranged = self.context.objects.handles(), True
            before, scene = self.parameters, self.scene.parameters_now()
            self.parameters = before.varied(before.weather, scene, before.fleet)
        if self.running:
            self._document_began()
        self.parameters, self._before = self._before or self.parameters, None
        try:
            self._clean_up()
        finally:
            # False even if the scene cannot be rebuilt: the next start must not take the flown scene as its beginning.
            is_changed, self.scene.is_changed = self.scene.is_changed, False
            if not is_changed or not self._undo_changes():
                self._setup.begin_anew()
                self._begin()

    def _undo_changes(self) -> bool:
        """Rebuild the scene as it began; return whether that was possible: its files may be missing by now."""
        self.clock.steps = 0  # whatever is made begins there
        try:
            self._rebuild(self.parameters, self._handles)
        except ValueError as error:
            LOG.error("the scene could not be restored and stays as it was flown; `start` tries again: %s", error)
            return False
        return True

    def close(self) -> None:
        """Run cleanup if it is due, and free the world; may be called twice. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self.vision.close()
            self.world.close()

    def _clean_up(self) -> None:
        was_running, self.running = self.running, False
        self._setup.end_scripts(clean_up=was_running)

    def read_at_start(self) -> None:
        """Have the next start read the scene file, whatever was made of the scene while it was stopped."""
        self._is_arranged = self.scene.is_changed = False

    # ---- stepping

    @property
    def failed_scripts(self) -> dict[str, ScriptError]:
        """Errors of attached scripts that have failed and are not called any more, by their objects' names."""
        errors = ((one.own_script, one.error()) for one in self._setup.scripts.attached)
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

        `watch` is called like `between` of World.advance, to look and no more.
        """
        self._stepper.step(watch)

    def look(self) -> None:
        """Let cameras that are watched show what is there now, between two steps."""
        for vehicle in self.vehicles.values():
            vehicle.take_pictures(self.steps, now=True)

    # ---- what scripts hold

    def set_breakpoints(self, lines: Mapping[str, frozenset[int]]) -> None:
        """Have breakpoints at these lines of scripts, from 1, by the paths of their files, and at no others."""
        if self.breakpoints.set(lines):
            for one in self._setup.scripts.all():
                one.script.follow_breakpoints()

    def variables(self) -> Iterator[tuple[str, str, list[Scope]]]:
        """Yield the object and the file of every script that is loaded, and its variables as a person reads them."""
        for one in self._setup.scripts.all():
            if one.path:
                yield one.own_script, one.path, one.script.variables()

    # ---- snapshots and files

    def snapshot(self) -> Snapshot:
        """Remember the exact dynamic state, the scripts' variables included, until the next start or stop."""
        number = self.world.saved_states.snapshot()
        return Snapshot(self.era, self._setup.scripts.changes, number, self._setup.save_state())

    def restore(self, snapshot: Snapshot) -> None:
        """Bring a snapshot back: the flight goes on as it did from there, to the last bit. May be repeated.

        Raises ValueError for a snapshot from before a start, a stop, or a change of vehicles, shapes or their scripts.
        """
        is_same = snapshot.era == self.era and snapshot.scripts == self._setup.scripts.changes
        if not is_same or not self.world.saved_states.has_snapshot(snapshot.world):
            said = "it is dropped at start and stop, and when a vehicle, a shape or a script of one is added or removed"
            raise ValueError(f"the snapshot is from an earlier run: {said}")
        self.scene.drag.let_go_of_all()
        for vehicle in self.vehicles.values():
            vehicle.body.let_go()
        self.world.saved_states.restore(snapshot.world)
        snapshot.restore()
        self._stepper.feel_weather()

    def forget(self, snapshot: Snapshot) -> None:
        """Free a snapshot; start and stop forget all of theirs."""
        if snapshot.era == self.era:
            self.world.saved_states.forget_snapshot(snapshot.world)

    @property
    def object_handles(self) -> Mapping[str, int]:
        """Handles of all objects, by name."""
        return self.context.objects.handles().by_name

    def content(self) -> SceneContent:
        """Return what the scene is now; vehicles and weather as they begin."""
        scene = self.scene
        entries = {scene.tree.handle(one.name): scene.entry_now(index) for index, one in scene.entries.items()}
        return SceneContent(entries, dict(scene.scripts), self.document.settings)

    def save_scene(self, path: Path) -> str:
        """Write floor, objects, vehicles and weather as they are now: a scene file; return its text.

        Comments and order of the file that it was read from stay. Raises ParameterError and OSError, as
        SceneDocument.write does.
        """
        now = settings_now(self.document.settings, self.parameters, self.vehicles, self.context.weather.now)
        return self.document.write(path, self.content()._replace(settings=now), self.parameters)


def _world(parameters: Parameters, gui: bool = False) -> World:
    return World(parameters.sub_step, parameters.gravity, gui, gyroscopic=parameters.physics.gyroscopic)
