"""Context shared by the parts of one simulation. Each part that needs any of it gets it in its constructor."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from drone_sim.config.types import DatumParameters
from drone_sim.mechanics.frames import Vector
from drone_sim.scripting import load
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.host import ScriptContext
from drone_sim.scripting.api.vision import NO_OBJECT

if TYPE_CHECKING:  # slow imports, which programs that only check parameters do without
    from drone_sim.forces.weather import Weather
    from drone_sim.render.intrinsics import Lens
    from drone_sim.sensors.vision import TurningBlades, Vision
    from drone_sim.world import World

NOBODY = ("", "")


class FollowingBody(Protocol):
    """A kinematic body that follows an object."""

    def follow(self) -> None:
        """Set the pose of the body to that of the object that carries it."""


@dataclass
class CarriedBodies:
    """Massless bodies carried by other objects, by body number in the world."""

    bases: dict[int, FollowingBody] = field(default_factory=dict)  # of chains; moved before bodies on their links
    shapes: dict[int, FollowingBody] = field(default_factory=dict)

    def follow(self) -> None:
        """Set the pose of every carried body to that of its carrier."""
        for body in (*self.bases.values(), *self.shapes.values()):
            body.follow()


@dataclass(kw_only=True)
class SimulationContext(ScriptContext):
    """World, weather, renderer, names and limits, in addition to what scripts share. Each start creates a new one.

    `sub_step` in s; `script_time_limit` in s of real time; `magnetic_field` in T. `names` has for each body its display
    name and its name in scripts ('' for none); `link_names` has the names of single links in scripts.
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
    tunings: int = 0  # incremented when a tunable value changes

    def change_weather(self, changes: Mapping[str, Any]) -> None:
        """Change the weather for all vehicles; `changes` has keys of `weather`, as in YAML. Raises ParameterError."""
        self.weather.change(changes)
        self.tunings += 1

    def picture(self, kind: str, lens: Lens, pose: np.ndarray, only: Collection[str] | None = None) -> np.ndarray:
        """Return the picture from a camera pose (4, 4), world from optical frame: "color" or "depth" as Vision.picture.

        For "handles": (height, width) uint32, the handle of the object at each pixel; NO_OBJECT if it has no name in
        scripts. `only`: names of the objects to draw; None draws all. Raises ValueError if OpenGL is needed and not
        available.
        """
        if kind != "handles" and only is None:
            return self.vision.picture(kind, lens, pose)
        names = [self.name_of(*place) for place in self.world.pictures.places()]
        shown = None if only is None else np.array([name in only for name in names], dtype=bool)
        if kind != "handles":
            return self.vision.picture(kind, lens, pose, shown)
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names), 1)}
        handles = [NO_OBJECT, *(self.objects.handle(name) if name in self.objects else NO_OBJECT for name in numbers)]
        object_numbers = np.array([numbers[name] for name in names], dtype=np.uint16)
        return np.array(handles, dtype=np.uint32)[self.vision.numbers(lens, pose, object_numbers, shown)]

    def name_of(self, body: int, link: int = -1) -> str:
        """Return the script name of a body or link (-1: the body's root link); '' if it has none."""
        name = self.link_names.get((body, link))
        return self.names.get(body, NOBODY)[1] if name is None else name

    def person_name_of(self, place: tuple[int, int]) -> str:
        """Return the display name of a body's link; '' if it has none."""
        return self.link_names.get(place) or self.names.get(place[0], NOBODY)[0]

    def body_of(self, name: str) -> int:
        """Return the body with this script name. Raises LookupError."""
        return next(body for body, (_, script_name) in self.names.items() if script_name == name)
