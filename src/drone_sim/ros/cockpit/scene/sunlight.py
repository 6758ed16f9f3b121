"""The light of the scene: the sun of the simulation's cameras, and the shadows that it throws on the floor."""

from __future__ import annotations

from typing import Any

import numpy as np
from visualization_msgs.msg import Marker

from drone_sim.render.renderer import TO_SUN

_AWAY = 50.0  # m; only the direction counts
_BRIGHT = 2.2
_DARK = 0.45  # what a shadow takes away of the floor's brightness
_FLOOR = "floor"  # the namespace of the marker on which shadows fall


class Sunlight:
    """The sun of one scene; without a GPU its shadows make every picture take twice as long or more."""

    def __init__(self, scene: Any):
        """Shine, with shadows."""
        self._on = True
        self._floors: dict[str, Any] = {}
        scene.configure_default_lights(enabled=False)
        place = tuple(map(float, _AWAY * np.array(TO_SUN)))
        self._sun = scene.add_light_directional("/sun", intensity=_BRIGHT, cast_shadow=True, position=place)

    def shine_on(self, marker: Marker, handle: Any) -> None:
        """Let shadows fall on what has come into the scene, if it is a floor."""
        if marker.ns == _FLOOR:
            self._floors[handle.name] = handle
            handle.receive_shadow = self._darkness

    def cast(self, shadows: bool) -> None:
        """Let there be shadows, or not."""
        if shadows == self._on:
            return
        self._on = self._sun.cast_shadow = shadows
        for handle in self._floors.values():
            handle.receive_shadow = self._darkness

    def forget(self) -> None:
        """Have no floor."""
        self._floors.clear()

    @property
    def _darkness(self) -> float | bool:
        return _DARK if self._on else False
