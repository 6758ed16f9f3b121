"""The simulation: V-REP's phases in V-REP's order, without ROS.

    simulation = Simulation(parameters.load())
    simulation.step()
    print(simulation.drone.state.position)
    simulation.close()
"""

from __future__ import annotations

from typing import Dict

from drone_sim.camera.intrinsics import Intrinsics
from drone_sim.camera.vision import Camera, Vision
from drone_sim.drone import Drone
from drone_sim.parameters import CameraParameters, Parameters, SceneParameters
from drone_sim.world import World


class Simulation:
    """A world, the drone in it, its cameras, and the clock that counts steps.

    Not thread-safe: one thread owns it. `drone.bus` alone may be used from others.
    """

    def __init__(self, parameters: Parameters, *, script: str = "", gui: bool = False):
        """Build the scene and run the child script's init ('' is the tutorial's script).

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
        self._running = False
        self.drone.load_script(script, lambda: self.time)
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

    def close(self) -> None:
        """Run cleanup once, whatever happened before, and free the world; may be called twice."""
        try:
            if self._running:
                self._running = False
                self.drone.script.call("cleanup")
        finally:
            self.vision.close()
            self.world.close()


def _build(world: World, scene: SceneParameters) -> None:
    world.add_floor(scene.floor.size, scene.floor.texture)
    for box in scene.objects:
        world.add_box(box.size, box.position, box.rpy, box.color, box.mass)
