"""Faults of a vehicle: weak propellers, failing sensors, a bad radio link."""

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

_MAX_COMMANDS, _MAX_IMAGES = 1000, 50  # maximum number of messages on a link
_MAX_IMAGE_AGE = 5.0  # s; an older image was sent before the camera lost its last subscriber


class Faults:
    """The present faults of one vehicle."""

    def __init__(
        self,
        vehicle: str,
        parameters: FaultParameters,
        instruments: Instruments,
        cameras: Mapping[str, Camera],
        clock: Clock,
    ):
        """Create them from the vehicle's name and the parts that may fail; call `begin` first."""
        self._vehicle = vehicle
        self._parameters = parameters
        self._instruments, self._cameras = instruments, cameras
        self._clock = clock
        self.commands: RadioLink[Twist] | None = None  # that delays commands; None: no delay
        self._images: dict[str, RadioLink[np.ndarray]] = {}

    def begin(self, propellers: Propellers) -> None:
        """Apply the initial faults at the start of a run, to that run's propellers."""
        self._propellers = propellers
        self.commands, self._images = None, {}
        self._apply(self._parameters)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Override some of the present values, with keys as in YAML. Raises ParameterError."""
        new = changed(self.now, changes)
        new.check([*self._instruments.by_name, *self._cameras], len(self._propellers.air))
        self._apply(new)

    def _apply(self, now: FaultParameters) -> None:
        self._propellers.weaken(now.propellers)
        self.now = now = now.model_copy(update={"propellers": self._propellers.effectiveness})
        self._instruments.fail(now.sensors)
        for name, camera in self._cameras.items():
            camera.failure = now.sensors.get(name, "ok")
        # A link that has become perfect is kept, since it may still hold messages.
        if self.commands is None and not now.commands.is_perfect:
            self.commands = RadioLink(now.commands, self._seed("commands"), _MAX_COMMANDS)
        if not self._images and not now.images.is_perfect:
            self._images = {name: RadioLink(now.images, self._seed(name), _MAX_IMAGES) for name in self._cameras}
        if self.commands is not None:
            self.commands.parameters = now.commands
        for link in self._images.values():
            link.parameters = now.images
        for camera in self._cameras.values():
            camera.is_linked = bool(self._images)

    def _seed(self, stream: str) -> tuple[int, ...]:
        return (self.now.seed, *f"{self._vehicle}/{stream}".encode())

    def transmit(self, camera: str, image: np.ndarray | None) -> tuple[np.ndarray | None, float]:
        """Send the image, if any, over the camera's link; return the image that arrived, or None, and its age (s)."""
        link, now = self._images.get(camera), self._clock.time
        if link is None:
            return image, 0.0
        if image is not None:
            link.send(now, image)
        arrived = link.receive(now)
        return (arrived[1], arrived[0]) if arrived is not None and arrived[0] < _MAX_IMAGE_AGE else (None, 0.0)

    def save_state(self) -> Restore:
        """Return a function that restores the faults; restore propellers and sensors before."""
        now, restore_links = self.now, saved(self, "commands", "_images")
        links = [*([self.commands] if self.commands else ()), *self._images.values()]
        return in_turn(restore_links, lambda: self._apply(now), *(link.save_state() for link in links))
