"""What is wrong with a vehicle: weak propellers, sensors that fail, a bad radio link."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from drone_sim.config.changing import changed
from drone_sim.forces.propellers import Propellers
from drone_sim.mechanics.state import Twist
from drone_sim.sensors.camera import Camera
from drone_sim.vehicles.fault_parameters import FaultParameters
from drone_sim.vehicles.instruments import Instruments
from drone_sim.vehicles.link import Link

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
        time: Callable[[], float],
    ):
        """Take the vehicle's name and what may fail; `begin` comes before anything else. `time` returns s."""
        self._vehicle = vehicle
        self._parameters = parameters
        self._instruments, self._cameras = instruments, cameras
        self._time = time
        self.commands: Link[Twist] | None = None  # over which they come; None for at once
        self._images: dict[str, Link[np.ndarray]] = {}

    def begin(self, propellers: Propellers) -> None:
        """Be as at the start of a run, which has propellers of its own."""
        self._propellers = propellers
        self.commands, self._images = None, {}
        self._be(self._parameters)

    def change(self, changes: Mapping[str, Any]) -> None:
        """Lay other values over some of the present ones, as in YAML. Raises ParameterError."""
        new = changed(self.now, changes)
        new.check([*self._instruments.by_name, *self._cameras])
        self._be(new)

    def _be(self, now: FaultParameters) -> None:
        self.now = now
        self._propellers.weaken(now.propellers)
        self._instruments.fail(now.sensors)
        for name, camera in self._cameras.items():
            camera.failure = now.sensors.get(name, "ok")
        self._link()

    def _link(self) -> None:
        """Put links where there are none yet; one that has become perfect stays, for what is under way."""
        now = self.now
        if self.commands is None and not now.commands.is_perfect:
            self.commands = Link(now.commands, self._seed("commands"), _COMMANDS)
        if not self._images and not now.images.is_perfect:
            self._images = {name: Link(now.images, self._seed(name), _PICTURES) for name in self._cameras}
        if self.commands is not None:
            self.commands.parameters = now.commands
        for link in self._images.values():
            link.parameters = now.images
        for name, camera in self._cameras.items():
            camera.over = partial(self._over, self._images[name]) if self._images else None

    def _seed(self, stream: str) -> tuple[int, ...]:
        return (self.now.seed, *f"{self._vehicle}/{stream}".encode())

    def _over(self, link: Link[np.ndarray], image: np.ndarray | None) -> tuple[float, np.ndarray | None]:
        """Send a picture, if there is one; return the age (s) of the one that has come, and that."""
        now = self._time()
        if image is not None:
            link.send(now, image)
        came = link.receive(now)
        return came if came is not None and came[0] < _STALE else (0.0, None)

    def remember(self) -> Callable[[], None]:
        """Return a function that brings back what is wrong now; propellers and sensors come back before."""
        now, commands, images = self.now, self.commands, self._images
        links = [link.remember() for link in (*([commands] if commands else ()), *images.values())]

        def recall() -> None:
            self.commands, self._images = commands, images
            self._be(now)
            for one in links:
                one()

        return recall
