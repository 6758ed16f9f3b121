"""The simulation: V-REP's phases in V-REP's order, without ROS.

For example:

    simulation = Simulation(parameters.load())
    simulation.step()
    print(simulation.drone.state.position)
    simulation.close()
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from drone_sim.render.intrinsics import Intrinsics
from drone_sim.run import memory
from drone_sim.run.parameters import CameraParameters, ParameterError, Parameters
from drone_sim.scene.scene import Scene
from drone_sim.scripting import load
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.messages import Backend
from drone_sim.scripting.api.scripts import LOG
from drone_sim.scripting.errors import ScriptError
from drone_sim.sensors.camera import Camera, Vision
from drone_sim.vehicles.quadricopter import Drone
from drone_sim.world import World

MAX_OVERLAPS = 500  # pairs of moving bodies, at the start: with more a step takes seconds
_NOWHERE = 1e9  # m, m/s and rad/s, summed


class Diverged(RuntimeError):
    """The dynamics has ended in numbers that mean nothing; one line that says when."""


class Snapshot(NamedTuple):
    """The exact dynamic state at a moment; see Simulation.snapshot."""

    steps: int
    world: int
    recall: Callable[[], None]
    run: int


class Simulation:
    """A world, the drone in it, its cameras, and the clock that counts steps.

    Not thread-safe: one thread owns it. `drone.bus` alone may be used from others. `drone` and `scene` are
    new ones after every start.
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
        """Build the scene and, if `started`, run the init of the child script ('' is the tutorial's).

        `backend` carries what the script subscribes to and publishes; without it the messages stay in
        `drone.bus`. `drawings` takes what the script draws; without it that is ignored.

        Raises ParameterError, UrdfError, ScriptError, and RuntimeError where `gui` finds no display.
        """
        self.parameters = parameters
        self.script = script
        self.running = False
        self._backend = backend
        self._drawings = drawings
        self._runs = 0
        self._gui = gui
        load.script_path(script)  # one that is not there needs no world
        self._take(_Built(parameters, World(parameters.sub_step, parameters.gravity, gui)))
        try:
            self.vision = Vision(self.world, parameters.samples)
            self.cameras: dict[str, Camera] = {name: self._camera(one) for name, one in parameters.cameras.items()}
            if started:
                self._run()
        except BaseException:
            try:
                self.close()
            except ScriptError as second:  # in cleanup; the first one is what the caller is told
                LOG.error("%s", second)
            raise

    def _build(self, parameters: Parameters) -> None:
        """Put the scene and a drone without a script into a new world, which then takes the last one's place."""
        built = _Built(parameters, World(parameters.sub_step, parameters.gravity))
        if self._gui:  # a process has one window: what can be built is built there once more
            built.world.close()
            self.world.clear()
            built = _Built(parameters, self.world)
        else:
            self.world.close()
        self._take(built)
        self.vision.look_at(self.world)

    def _take(self, built: _Built) -> None:
        """Begin in what has been built."""
        self.parameters = built.parameters
        self._sub_steps = built.parameters.sub_steps
        self.world, self.scene, self.drone = built.world, built.scene, built.drone
        self.drone.bus.backend = self._backend
        self.drone.drawings = self._drawings
        self.world.keep_beginning()
        self._begin()

    def _begin(self) -> None:
        """Be at time 0 of a new run, in the initial scene."""
        floor = self.parameters.scene.floor
        self._edge = floor.size / 2 if floor.edge else None  # m, of what the drone can stand on
        self.steps = 0
        self._runs += 1
        if self._drawings is not None:
            self._drawings.clear()

    def _camera(self, parameters: CameraParameters) -> Camera:
        size = (parameters.width, parameters.height)
        intrinsics = Intrinsics(*size, parameters.horizontal_fov, parameters.near, parameters.far)
        camera = Camera(parameters.kind, intrinsics, lambda: self.drone.optical(parameters), self.vision)
        camera.every = parameters.every
        return camera

    # ---- start and stop

    def start(self, scene_file: str | None = None) -> None:
        """Read scene and script from disk, and run the script's init; another scene file may take the last one's place.

        Where scene or drone cannot be read, the last ones stay, stopped. Raises ParameterError, UrdfError,
        ScriptError.
        """
        self.stop()
        parameters = self.parameters.in_scene(self.parameters.scene_file if scene_file is None else scene_file)
        self._build(parameters)
        memory.give_back()
        self._run()

    def _run(self) -> None:
        """Load the script and run its init."""
        self.running = True
        pictures = {name: partial(self._look, camera) for name, camera in self.cameras.items()}
        self.drone.load_script(self.script, lambda: self.time, pictures)

    def stop(self) -> None:
        """Run the script's cleanup, and restore the initial scene, at time 0. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self.world.begin_anew()
            self.drone.reset()
            self.scene.name_objects(self.drone.objects)
            self._begin()

    def close(self) -> None:
        """Run cleanup if it is due, and free the world; may be called twice. Raises ScriptError."""
        try:
            self._clean_up()
        finally:
            self.vision.close()
            self.world.close()

    def _clean_up(self) -> None:
        if not hasattr(self, "drone"):
            return
        try:
            if self.running:
                self.running = False
                self.drone.script.call("cleanup")
        finally:
            self.drone.close()

    # ---- stepping

    @property
    def run(self) -> int:
        """Number of the run: another one after every start and every stop."""
        return self._runs

    @property
    def time(self) -> float:
        """Simulated time in seconds: counted, not summed, so that it does not drift."""
        return self.steps * self.parameters.time_step

    def step(self) -> None:
        """Run one simulation step: actuation, dynamics, vision, sensing. Raises ScriptError and Diverged."""
        drone = self.drone
        drone.actuation()
        self.world.advance(drone.wrenches(), self._sub_steps)
        drone.refresh()
        self.steps += 1
        self._check_state()
        for camera in self.cameras.values():
            camera.image = self._look(camera) if camera.watched() and self.steps % camera.every == 0 else None
        drone.script.call("sensing")

    def _check_state(self) -> None:
        """Raise Diverged where the drone is nowhere any more."""
        (x, y, z), _, (vx, vy, vz), (wx, wy, wz) = self.drone.state
        # Of a NaN no comparison is true. One sum, since this runs in every step.
        if not -_NOWHERE < x + y + z + vx + vy + vz + wx + wy + wz < _NOWHERE:
            where = f"position {x:g} {y:g} {z:g} m, velocity {vx:g} {vy:g} {vz:g} m/s"
            raise Diverged(f"the simulation has diverged at t = {self.time:.2f} s: {where}; `start` begins anew")
        if self._edge is not None and max(abs(x), abs(y)) > self._edge:
            LOG.warning("the drone is past the edge of the floor, at %.2f %.2f m: nothing carries it there", x, y)
            self._edge = None  # said once

    def snapshot(self) -> Snapshot:
        """Remember the exact dynamic state, the script's variables included, until the next start or stop."""
        return Snapshot(self.steps, self.world.snapshot(), self.drone.remember(), self._runs)

    def restore(self, snapshot: Snapshot) -> None:
        """Bring a snapshot back: the flight goes on as it did from there, to the last bit. May be repeated.

        Raises ValueError for a snapshot of an earlier run.
        """
        if snapshot.run != self._runs:
            raise ValueError("the snapshot is of an earlier run: start and stop forget it")
        self.world.restore(snapshot.world)
        self.steps = snapshot.steps
        snapshot.recall()

    def forget(self, snapshot: Snapshot) -> None:
        """Free a snapshot; start and stop forget all of theirs."""
        if snapshot.run == self._runs:
            self.world.forget(snapshot.world)

    # ---- pictures

    def look(self) -> None:
        """Let cameras that are watched show what is there now, between two steps."""
        for camera in self.cameras.values():
            camera.image = self._look(camera) if camera.watched() else None

    def _look(self, camera: Camera) -> np.ndarray:
        self.drone.show_blades()
        return camera.look()


class _Built:
    """A scene and a drone in a world; where they cannot be built, the world is closed again."""

    def __init__(self, parameters: Parameters, world: World):
        """Fill an empty world. Raises ParameterError and UrdfError."""
        self.parameters = parameters
        self.world = world
        try:
            self.scene = Scene(parameters, world)
            self.drone = Drone(parameters, world)
            self.scene.name_objects(self.drone.objects)
            if not world.is_finite():
                raise ParameterError("the scene as it begins: a position or a velocity is not finite")
            overlaps = world.overlaps()
            if overlaps > MAX_OVERLAPS:
                said = f"{overlaps} pairs of moving ones touch or overlap, at most {MAX_OVERLAPS} may"
                raise ParameterError(f"scene/objects: {said}")
        except BaseException:
            world.close()
            raise
