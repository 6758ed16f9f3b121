"""What the vehicles of one simulation share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.backend import Backend
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.signals import Signals
from drone_sim.sensors.camera import Vision
from drone_sim.world import World


@dataclass
class Shared:
    """World, objects, signals, drawings, messages, eyes and clock.

    `time` returns the simulated time in s; `time_step` is the step in s; `script_time_limit` in s of real time.
    """

    world: World
    vision: Vision
    time: Callable[[], float]
    time_step: float
    script_time_limit: float
    drawings: Drawings
    backend: Backend | None = None
    objects: ObjectTree = field(default_factory=ObjectTree)
    signals: Signals = field(default_factory=Signals)
    before_pictures: Callable[[], None] = lambda: None  # turns every vehicle's blades to where they are
