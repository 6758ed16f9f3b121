"""What the parts of one simulation share: each part that needs some of it gets all of it in its constructor."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from drone_sim.config.types import DatumParameters
from drone_sim.forces.weather import Weather
from drone_sim.mechanics.frames import Vector
from drone_sim.render.intrinsics import Lens
from drone_sim.scripting import load
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.host import ScriptContext
from drone_sim.scripting.api.vision import NO_OBJECT
from drone_sim.sensors.vision import TurningBlades, Vision
from drone_sim.world import World

NOBODY = ("", "")


class FollowingBody(Protocol):
    """A body that goes where something else goes."""

    def follow(self) -> None:
        """Put it where what carries it has gone."""


@dataclass
class CarriedBodies:
    """The bodies without mass that something carries, by their numbers in the world."""

    bases: dict[int, FollowingBody] = field(default_factory=dict)  # of chains, before what hangs on their links
    shapes: dict[int, FollowingBody] = field(default_factory=dict)

    def follow(self) -> None:
        """Put every one where what carries it has gone."""
        for one in (*self.bases.values(), *self.shapes.values()):
            one.follow()


@dataclass(kw_only=True)
class SimulationContext(ScriptContext):
    """World, weather, renderer, names and limits, beside what scripts share; it lasts from one start to the next.

    `sub_step` in s; `script_time_limit` in s of real time; `magnetic_field` in T. `names` has for each body the name
    that people read, and the name that scripts use ('' for none); `link_names` has the latter for single links.
    """

    world: World
    vision: Vision
    weather: Weather
    sub_step: float
    datum: DatumParameters
    magnetic_field: Vector
    script_time_limit: float
    backend: Backend | None = None
    load_script: load.Loader = load.load
    names: dict[int, tuple[str, str]] = field(default_factory=dict)
    link_names: dict[tuple[int, int], str] = field(default_factory=dict)
    carried: CarriedBodies = field(default_factory=CarriedBodies)
    blades: list[TurningBlades] = field(default_factory=list)  # of all vehicles
    tunings: int = 0  # grows whenever something is other than it was that may be tuned

    def change_weather(self, changes: Mapping[str, Any]) -> None:
        """Change the weather of all vehicles: keys of `weather`, as in YAML. Raises ParameterError."""
        self.weather.change(changes)
        self.tunings += 1

    def picture(self, kind: str, lens: Lens, pose: np.ndarray, only: Collection[str] | None = None) -> np.ndarray:
        """Return what is seen from a pose (4, 4), world from optical frame: "color" or "depth", as of Vision.picture.

        Or "handles": (height, width) uint32, the handle of the object that each pixel shows, NO_OBJECT for what scripts
        do not know. `only`: names of the objects to draw; None draws all. Raises ValueError where OpenGL is needed and
        not available.
        """
        if kind != "handles" and only is None:
            return self.vision.picture(kind, lens, pose)
        names = [self.name_of(*place) for place in self.world.pictures.places()]
        shown = None if only is None else np.array([name in only for name in names], dtype=bool)
        if kind != "handles":
            return self.vision.picture(kind, lens, pose, shown)
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names), 1)}
        handles = [NO_OBJECT, *(self.objects.handle(one) if one in self.objects else NO_OBJECT for one in numbers)]
        whose = np.array([numbers[name] for name in names], dtype=np.uint16)
        return np.array(handles, dtype=np.uint32)[self.vision.numbers(lens, pose, whose, shown)]

    def name_of(self, body: int, link: int = -1) -> str:
        """Return what scripts call a body's link (-1: its root), '' for what they do not know."""
        name = self.link_names.get((body, link))
        return self.names.get(body, NOBODY)[1] if name is None else name

    def person_name_of(self, place: tuple[int, int]) -> str:
        """Return what a person calls a body's link, '' for what has no name."""
        return self.link_names.get(place) or self.names.get(place[0], NOBODY)[0]

    def body_of(self, name: str) -> int:
        """Return the body with this script name. Raises LookupError."""
        return next(body for body, (_, one) in self.names.items() if one == name)
