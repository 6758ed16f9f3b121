"""What is wrong with a vehicle: weak propellers, sensors that fail, a bad radio link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from drone_sim.config.errors import changed
from drone_sim.forces.propellers import Propellers
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.saved_state import Restore, in_turn, saved
from drone_sim.mechanics.state import Twist
from drone_sim.sensors.camera import Camera
from drone_sim.vehicles.instruments import Instruments
from drone_sim.vehicles.parameters import FaultParameters
from drone_sim.vehicles.radio_link import RadioLink

_COMMANDS, _PICTURES = 1000, 50  # that may be under way
_STALE = 5.0  # s; a picture so old was under way when nobody looked any more


class Faults:
    """What is wrong with one vehicle now."""

    def __init__(
        self,
        vehicle: str,
        parameters: FaultParameters,
        instruments: Instruments,
        cameras: Mapping[str, Camera],
        clock: Clock,
    ):
        """Take the vehicle's name and what may fail; by which clock; `begin` comes before anything else."""
        self._vehicle = vehicle
        self._parameters = parameters
        self._instruments, self._cameras = instruments, cameras
        self._clock = clock
        self.commands: RadioLink[Twist] | None = None  # over which they come; None for at once
        self._images: dict[str, RadioLink[np.ndarray]] = {}

    def begin(self, propellers: Propellers) -> None:
        """Be as at the start of a run, which has propellers of its own."""
        self._propellers = propellers
        self.commands, self._images = None, {}
        self._be(self._parameters)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Lay other values over some of the present ones, as in YAML. Raises ParameterError."""
        new = changed(self.now, changes)
        new.check([*self._instruments.by_name, *self._cameras], len(self._propellers.air))
        self._be(new)

    def _be(self, now: FaultParameters) -> None:
        self._propellers.weaken(now.propellers)
        self.now = now = now.model_copy(update={"propellers": self._propellers.effectiveness})
        self._instruments.fail(now.sensors)
        for name, camera in self._cameras.items():
            camera.failure = now.sensors.get(name, "ok")
        # Links are put where there are none yet; one that has become perfect stays, for what is under way.
        if self.commands is None and not now.commands.is_perfect:
            self.commands = RadioLink(now.commands, self._seed("commands"), _COMMANDS)
        if not self._images and not now.images.is_perfect:
            self._images = {name: RadioLink(now.images, self._seed(name), _PICTURES) for name in self._cameras}
        if self.commands is not None:
            self.commands.parameters = now.commands
        for link in self._images.values():
            link.parameters = now.images
        for camera in self._cameras.values():
            camera.is_linked = bool(self._images)

    def _seed(self, stream: str) -> tuple[int, ...]:
        return (self.now.seed, *f"{self._vehicle}/{stream}".encode())

    def transmit(self, camera: str, image: np.ndarray | None) -> tuple[np.ndarray | None, float]:
        """Send a picture, if there is one, over the camera's link; return the one that has come, and its age (s)."""
        link, now = self._images.get(camera), self._clock.time
        if link is None:
            return image, 0.0
        if image is not None:
            link.send(now, image)
        came = link.receive(now)
        return (came[1], came[0]) if came is not None and came[0] < _STALE else (None, 0.0)

    def save_state(self) -> Restore:
        """Return a function that brings back what is wrong now; propellers and sensors come back before."""
        now, own = self.now, saved(self, "commands", "_images")
        links = [*([self.commands] if self.commands else ()), *self._images.values()]
        return in_turn(own, lambda: self._be(now), *(link.save_state() for link in links))
