"""The video of a flight without ROS: what one camera of a vehicle sees, as its topic would show it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from drone_sim.offline import video
from drone_sim.offline.hud import Flight
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.camera_parameters import CameraParameters
from drone_sim.vehicles.flight_state import UNKNOWN
from drone_sim.vehicles.parameters import EquipmentParameters
from drone_sim.wording import near_names, shown


def camera_of(vehicle: EquipmentParameters, name: str | None) -> str:
    """Return the name of a vehicle's camera, by default of its first one. Raises ValueError."""
    cameras = vehicle.cameras
    if not cameras:
        raise ValueError("--video: the vehicle has no camera")
    if name is not None and name not in cameras:
        raise ValueError(f"--camera {shown(name)}: no such camera; {near_names(name, cameras)}")
    return next(iter(cameras)) if name is None else name


def rate_of(camera: CameraParameters, time_step: float) -> float:
    """Return how many pictures it takes in a second of simulated time. Raises ValueError for too many."""
    rate = 1 / (time_step * camera.every)
    if rate > video.MAX_RATE:
        raise ValueError(f"--video: {rate:g} pictures a second; at most {video.MAX_RATE:g} can be shown")
    return rate


class Film:
    """Adds a picture to a video whenever the camera has taken one."""

    def __init__(self, made: video.Video, simulation: Simulation, vehicle: str, camera: str):
        """Let the camera take pictures."""
        self._video = made
        self._vehicle = simulation.vehicles[vehicle]
        self._camera = self._vehicle.cameras[camera]
        self._camera.watched = lambda: True

    def add(self, simulation: Simulation) -> None:
        """Take what the camera has seen in the last step, if it was its turn. Raises OSError."""
        if self._camera.image is not None:
            row = (simulation.time, *(number for part in self._vehicle.state for number in part))
            state = self._state(simulation)
            self._video.add(video.to_color(self._camera.image), Flight.of(row, state))

    def _state(self, simulation: Simulation) -> str:
        said = str(self._vehicle.flight_state)
        return "stopped" if not simulation.running else "flying" if said.startswith(UNKNOWN) else said

    def __str__(self) -> str:
        """Return what it has become, in words."""
        return str(self._video)


@contextlib.contextmanager
def filming(path: str, simulation: Simulation, vehicle: str, camera: str) -> Iterator[list[Film]]:
    """Give one film, of a flight, which takes the place of `path` at the end. Raises OSError."""
    parameters = next(one for one in simulation.parameters.fleet if one.name == vehicle).cameras[camera]
    with video.writing_to(path, rate_of(parameters, simulation.parameters.time_step)) as made:
        yield [Film(made, simulation, vehicle, camera)]
