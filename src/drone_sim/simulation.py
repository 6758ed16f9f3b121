"""The simulation: V-REP's phases in V-REP's order, without ROS.

    simulation = Simulation(parameters.load())
    simulation.step()
    print(simulation.drone.state.position)
    simulation.close()
"""

from __future__ import annotations

from functools import partial
from typing import Dict, Optional, Tuple

import numpy as np

from drone_sim.camera.intrinsics import Intrinsics
from drone_sim.camera.vision import Camera, Vision
from drone_sim.drone import Drone
from drone_sim.parameters import CameraParameters, Parameters, SceneParameters
from drone_sim.scripting.messages import Backend
from drone_sim.world import Shape, World


class Simulation:
    """A world, the drone in it, its cameras, and the clock that counts steps.

    Not thread-safe: one thread owns it. `drone.bus` alone may be used from others.
    """

    def __init__(
        self, parameters: Parameters, *, script: str = "", gui: bool = False, backend: Optional[Backend] = None
    ):
        """Build the scene and run the child script's init ('' is the tutorial's script).

        `backend` carries what the script subscribes to and publishes; without it the messages stay in
        `drone.bus`.

        Raises UrdfError, ScriptError, and RuntimeError where `gui` finds no display.
        """
        self.parameters = parameters
        self.steps = 0
        self.world = World(parameters.sub_step, parameters.gravity, gui)
        _build(self.world, parameters.scene)
        self.drone = Drone(parameters, self.world)
        self.vision = Vision(self.world)
        self.cameras: Dict[str, Camera] = {
            name: self._camera(camera) for name, camera in parameters.cameras.items()
        }
        self._looked: Dict[str, Tuple[int, np.ndarray]] = {}  # by camera, step and picture of the script's last look
        self._pictures = {name: partial(self._picture, name) for name in self.cameras}
        self._running = False
        self.drone.bus.backend = backend
        try:
            self.drone.load_script(script, lambda: self.time, self._pictures)
        except BaseException:
            self.close()
            raise
        self._running = True

    def _camera(self, parameters: CameraParameters) -> Camera:
        size = (parameters.width, parameters.height)
        intrinsics = Intrinsics(*size, parameters.horizontal_fov, parameters.near, parameters.far)
        return Camera(parameters.kind, intrinsics, self.drone.mount(parameters), self.vision)

    @property
    def time(self) -> float:
        """Simulated time in seconds: counted, not summed, so that it does not drift."""
        return self.steps * self.parameters.time_step

    def step(self) -> None:
        """Run one simulation step: actuation, dynamics, vision, sensing. Raises ScriptError."""
        self.drone.actuation()
        self.world.advance(dict([self.drone.wrench()]), self.parameters.sub_steps)
        self.drone.refresh()
        self.steps += 1
        self._take_pictures()
        self.drone.script.call("sensing")

    def _take_pictures(self) -> None:
        every = {name: camera.every for name, camera in self.parameters.cameras.items()}
        watched = [
            camera for name, camera in self.cameras.items() if self.steps % every[name] == 0 and camera.watched()
        ]
        if watched:
            self.drone.show_blades()
        for camera in self.cameras.values():
            camera.image = camera.take() if camera in watched else None

    def _picture(self, name: str) -> np.ndarray:
        """Return what a camera sees, for the script: the step's picture if there is one, else a new one."""
        camera = self.cameras[name]
        if camera.image is not None:
            return camera.image
        if self._looked.get(name, (-1,))[0] != self.steps:
            self.drone.show_blades()
            self._looked[name] = (self.steps, camera.take())
        return self._looked[name][1]

    def close(self) -> None:
        """Run cleanup once, whatever happened before, and free the world; may be called twice."""
        try:
            if self._running:
                self._running = False
                self.drone.script.call("cleanup")
        finally:
            self.drone.close()
            self.vision.close()
            self.world.close()


def _build(world: World, scene: SceneParameters) -> None:
    world.add_floor(scene.floor.size, scene.floor.texture)
    for one in scene.objects:
        world.add_shape(
            Shape(one.shape, one.size, one.position, one.rpy, one.color, one.mass, getattr(one, "file", ""), one.texture)
        )
