"""The simulation: V-REP's phases in V-REP's order, without ROS.

For example:

    simulation = Simulation(parameters.load())
    simulation.step()
    print(simulation.drone.state.position)
    simulation.close()
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.forces.weather import Weather
from drone_sim.run import memory, saving
from drone_sim.run.cast import Actor, tell
from drone_sim.run.parameters import Parameters
from drone_sim.run.setting import Setting
from drone_sim.run.whereabouts import Whereabouts
from drone_sim.scene.scene import Scene
from drone_sim.scripting import load
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.script_log import LOG
from drone_sim.sensors.camera import Vision
from drone_sim.vehicles.parameters import VehicleParameters
from drone_sim.vehicles.shared import Shared
from drone_sim.vehicles.vehicle import Vehicle
from drone_sim.world import World


class Snapshot(NamedTuple):
    """The exact dynamic state at a moment; see Simulation.snapshot."""

    steps: int
    world: int
    recall: tuple[Callable[[], None], ...]
    era: int


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
    ):
        """Build the scene and, if `started`, run the init of the child scripts.

        `script` flies the vehicles that name none of their own; '' is the parameters', or the pilot. `backend`
        carries what scripts subscribe to and publish; without it the messages go nowhere.
        `drawings` takes what scripts draw; without it that is ignored.

        Raises ParameterError, UrdfError, ScriptError, and RuntimeError where `gui` finds no display.
        """
        self.parameters = parameters
        self.script = script
        self.running = False
        self._backend, self._gui = backend, gui
        self._drawings = drawings if drawings is not None else Drawings(shown=False)
        self.windows = Windows()
        self.watch: Callable[[int], None] | None = None  # called like `between` of World.advance, to look and no more
        self._runs = 0
        self._era = 0  # another one whenever what is in the world has become something else
        for one in parameters.fleet:  # a script that is not there needs no world
            load.script_path(self._script_of(one))
        for attached in parameters.scene.scripts:
            load.script_path(attached.script)
        world = World(parameters.sub_step, parameters.gravity, gui)
        self.vision = Vision(world, parameters.samples)
        self._take(self._built(parameters, world))
        try:
            if started:
                self.load_scripts()
        except BaseException:
            try:
                self.close()
            except ScriptError as second:  # in cleanup; the first one is what the caller is told
                LOG.error("%s", second)
            raise

    def _built(self, parameters: Parameters, world: World) -> Setting:
        """Return scene and vehicles in an empty world. Raises ParameterError and UrdfError."""
        shared = Shared(
            world=world,
            vision=self.vision,
            time=lambda: self.time,
            time_step=parameters.time_step,
            sub_step=parameters.sub_step,
            gravity=parameters.gravity,
            datum=parameters.scene.datum,
            magnetic_field=parameters.scene.magnetic_field,
            script_time_limit=parameters.script_time_limit,
            backend=self._backend,
            drawings=self._drawings,
            windows=self.windows,
            weather=Weather(parameters.weather, lambda: self.time),
        )
        return Setting(parameters, shared)

    def _rebuild(self, parameters: Parameters) -> None:
        """Put scene and vehicles without scripts into a new world, which then takes the last one's place."""
        built = self._built(parameters, World(parameters.sub_step, parameters.gravity))
        if self._gui:  # a process has one window: what can be built is built there once more
            built.world.close()
            self.world.clear()
            built = self._built(parameters, self.world)
        else:
            self.world.close()
        built.tune_as(self._setting)
        self._take(built)
        self.vision.look_at(self.world)

    def _take(self, built: Setting) -> None:
        """Begin in what has been built."""
        self._setting = built
        self.parameters = built.parameters
        self._sub_steps = built.parameters.sub_steps
        self.world: World = built.world
        self.scene: Scene = built.scene
        self._begin()
        built.shared.weather.changed = self._feel_weather

    def _begin(self) -> None:
        """Be at time 0 of a new run, in the initial scene."""
        self._whereabouts = Whereabouts(self.parameters.scene.floor, lambda: self.time)
        self.steps = 0
        self._runs += 1
        self._changed_vehicles()
        self._drawings.clear()
        self.windows.clear()

    def _changed_vehicles(self) -> None:
        self._era += 1
        self._flying = tuple(self.vehicles.values())
        self._bodies = tuple(vehicle.body.number for vehicle in self._flying)
        self._feel_weather()

    def _feel_weather(self) -> None:
        for vehicle in self._flying:
            vehicle.feel_weather()
        self._setting.shared.tunings += 1
        self._any_between = any(vehicle.sub_step_forces or vehicle.instruments for vehicle in self._flying)
        self._changed_scripts()

    def _changed_scripts(self) -> None:
        self._alone = not self._setting.cast.attached  # no scripts but the vehicles'
        self._threaded = tuple(one for one in self._setting.cast.all() if one.script.threaded)

    # ---- what flies

    @property
    def vehicles(self) -> dict[str, Vehicle]:
        """The vehicles, by name."""
        return self._setting.vehicles

    @property
    def drone(self) -> Vehicle:
        """The first vehicle, most often the only one. Raises LookupError where nobody flies."""
        if not self._flying:
            raise LookupError("no vehicle flies in the scene")
        return self._flying[0]

    @property
    def shared(self) -> Shared:
        """What all that flies, and every script, has in common."""
        return self._setting.shared

    @property
    def era(self) -> int:
        """Another number after every start, every stop, and whenever a vehicle has come or gone."""
        return self._era

    def set_vehicles(self, entries: Any) -> tuple[list[str], list[str]]:
        """Let those fly that `entries` say, as the parameter `vehicles` does; return who came and who went.

        Who was there and still is flies on, as it would have, to the last bit. A new one whose script fails in init
        goes again. Snapshots are forgotten. Raises ParameterError, UrdfError and ScriptError.
        """
        parameters = self.parameters.with_vehicles(entries)
        wanted = {one.name: one for one in parameters.fleet}
        came = [name for name in wanted if name not in self.vehicles]
        went = [name for name in self.vehicles if name not in wanted]
        for name in came:
            load.script_path(self._script_of(wanted[name]))
        for name in came:
            self._add(wanted[name])
        for name in went:
            self._remove(name)
        self.parameters = parameters
        return came, went

    def _add(self, parameters: VehicleParameters) -> None:
        vehicle = self._setting.add(parameters)
        try:
            if self.running:
                self._load(self._setting.cast.in_order([vehicle, *self._setting.cast.of(parameters.name)]))
        except BaseException:
            self._setting.remove(parameters.name)
            raise
        finally:
            self._changed_vehicles()

    def _remove(self, name: str) -> None:
        cast = self._setting.cast
        errors = cast.clean_up(cast.in_order([self.vehicles[name], *cast.of(name)])) if self.running else []
        self._setting.remove(name)
        self._changed_vehicles()
        tell(errors)

    def set_pace(self, factor: Any) -> None:
        """Have whoever plays it play at another real-time factor, through every start. Raises ParameterError."""
        self.parameters = self.parameters.at_pace(factor)

    # ---- start and stop

    def start(self, scene_file: str | None = None) -> None:
        """Read scene and scripts from disk, run the scripts' init; another scene file may take the last one's place.

        Where scene or vehicles cannot be read, the last ones stay, stopped. Raises ParameterError, UrdfError,
        ScriptError.
        """
        self.stop()
        self._rebuild(self.parameters.in_scene(self.parameters.scene_file if scene_file is None else scene_file))
        memory.give_back()
        self.load_scripts()

    def load_scripts(self) -> None:
        """Load the scripts and run their init, of a simulation that was built without. Raises ScriptError."""
        self.running = True
        self._load(self._setting.cast.all())
        self._changed_scripts()

    def _load(self, actors: Iterable[Actor]) -> None:
        for one in actors:
            one.load_script(self._script_of(one.parameters) if isinstance(one, Vehicle) else one.file)

    def _script_of(self, vehicle: VehicleParameters) -> str:
        has_own = vehicle.script != self.parameters.script
        return vehicle.script if has_own or not self.script else self.script

    def stop(self) -> None:
        """Run the scripts' cleanup, and restore the initial scene, at time 0. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self._setting.begin_anew()
            self._begin()

    def close(self) -> None:
        """Run cleanup if it is due, and free the world; may be called twice. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self.vision.close()
            self.world.close()

    def _clean_up(self) -> None:
        was_running, self.running = self.running, False
        self._setting.end_scripts(clean_up=was_running)

    # ---- stepping

    @property
    def failed_scripts(self) -> list[str]:
        """Names of the objects whose attached scripts have failed and are not called any more."""
        return [one.own_script for one in self._setting.cast.attached if one.has_failed]

    @property
    def asked(self) -> str:
        """What a script asked for since it was last taken: 'stop', 'pause' or nothing. Whoever plays this obeys."""
        return self._setting.shared.control.asked

    def take_asked(self) -> str:
        """Return what a script asked for, and forget it."""
        return self._setting.shared.control.take()

    @property
    def run(self) -> int:
        """Number of the run: another one after every start and every stop."""
        return self._runs

    @property
    def time(self) -> float:
        """Simulated time in seconds: counted, not summed, so that it does not drift."""
        return self.steps * self.parameters.time_step

    def step(self) -> None:
        """Run one simulation step: threads, actuation, dynamics, vision, sensing. Raises ScriptError and Diverged."""
        vehicles = self._flying
        if self._threaded:
            self._take_turns()
        for actor in vehicles if self._alone else self._setting.cast.all():
            actor.actuation()
        wrenches = dict(zip(self._bodies, map(Vehicle.wrench, vehicles)))
        if self.scene.carries:
            self.scene.follow()
        self.world.advance(wrenches, self._sub_steps, self._between if self._any_between else self.watch)
        for vehicle in vehicles:
            vehicle.body.refresh()
        if self.scene.carries:
            self.scene.follow()
        self.steps += 1
        self._whereabouts.check(vehicles)
        for vehicle in vehicles:
            vehicle.take_pictures(self.steps)
        for actor in vehicles if self._alone else self._setting.cast.all():
            actor.script.call("sensing")

    def _take_turns(self) -> None:
        """Let each thread of a script run for its turn."""
        for thread in self._threaded:
            if thread.script.threaded:
                thread.script.take_turn()

    def _between(self, count: int) -> None:
        """Do what is due after so many sub-steps of the step: instruments look, and forces follow."""
        if self.watch is not None:
            self.watch(count)
        if count:
            for vehicle in self._flying:
                vehicle.after_sub_step(self.steps * self._sub_steps + count)
        if count < self._sub_steps:
            for vehicle in self._flying:
                vehicle.before_sub_step()

    def look(self) -> None:
        """Let cameras that are watched show what is there now, between two steps."""
        for vehicle in self._flying:
            vehicle.take_pictures(self.steps, now=True)

    # ---- snapshots and files

    def snapshot(self) -> Snapshot:
        """Remember the exact dynamic state, the scripts' variables included, until the next start or stop."""
        shared = self._setting.shared
        kept = (shared.objects, shared.signals, shared.data, shared.tubes, self._drawings, self.windows)
        parts: list[Any] = [*kept, *self._flying, *self._setting.cast.attached, self.scene, shared.weather]
        return Snapshot(self.steps, self.world.snapshot(), tuple(one.remember() for one in parts), self._era)

    def restore(self, snapshot: Snapshot) -> None:
        """Bring a snapshot back: the flight goes on as it did from there, to the last bit. May be repeated.

        Raises ValueError for a snapshot of another era.
        """
        if snapshot.era != self._era:
            raise ValueError(
                "the snapshot is of an earlier run: start, stop, and a vehicle that comes or goes, forget it"
            )
        self.scene.grip.let_go_of_all()
        self.world.restore(snapshot.world)
        self.steps = snapshot.steps
        for recall in snapshot.recall:
            recall()

    def forget(self, snapshot: Snapshot) -> None:
        """Free a snapshot; start and stop forget all of theirs."""
        if snapshot.era == self._era:
            self.world.forget(snapshot.world)

    def save_scene(self, path: Path) -> None:
        """Write floor, objects, vehicles and weather as they are now: a scene file. Raises ParameterError, OSError."""
        saving.save(path, self.parameters, self.scene, self._flying, self.shared.weather.now)
