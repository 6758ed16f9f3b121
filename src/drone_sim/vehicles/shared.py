"""What the vehicles of one simulation share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from drone_sim.config.place import DatumParameters
from drone_sim.forces.weather import Weather
from drone_sim.mechanics.frames import Vector
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.control import Control
from drone_sim.scripting.api.custom_values import CustomData
from drone_sim.scripting.api.distances import MeasureWay, no_way
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.tubes import Tubes
from drone_sim.scripting.api.windows import Windows
from drone_sim.sensors.camera import Vision
from drone_sim.world import World


@dataclass
class Shared:
    """World, weather, objects, signals, scripts, custom data, tubes, drawings, windows, messages, eyes and clock.

    `time` returns the simulated time in s; `time_step` and `sub_step` in s; `script_time_limit` in s of real time;
    `gravity` in m/s² along z; `magnetic_field` in T. `names` has for each body in the world what a person calls it,
    and its name among the objects of scripts, or ''.
    """

    world: World
    vision: Vision
    time: Callable[[], float]
    time_step: float
    sub_step: float
    gravity: float
    datum: DatumParameters
    magnetic_field: Vector
    script_time_limit: float
    drawings: Drawings
    windows: Windows
    weather: Weather
    backend: Backend | None = None
    objects: ObjectTree = field(default_factory=ObjectTree)
    signals: Signals = field(default_factory=Signals)
    scripts: Scripts = field(default_factory=Scripts)
    control: Control = field(default_factory=Control)
    data: CustomData = field(default_factory=CustomData)
    tubes: Tubes = field(default_factory=Tubes)
    names: dict[int, tuple[str, str]] = field(default_factory=dict)
    tunings: int = 0  # grows whenever something is other than it was that may be tuned
    nearest: MeasureWay = no_way  # measures between objects
    before_pictures: Callable[[], None] = lambda: None  # turns every vehicle's blades to where they are
