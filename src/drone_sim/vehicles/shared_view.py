"""What every script sees of what the vehicles share, whatever object it is on."""

from __future__ import annotations

from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.registry import Scripts
from drone_sim.scripting.api.signals import Signals
from drone_sim.scripting.api.windows import Windows
from drone_sim.vehicles.shared import Shared


class SharedView:
    """Objects, scripts, signals, drawings and windows of the simulation."""

    def __init__(self, shared: Shared):
        """Show these."""
        self._shared = shared

    @property
    def objects(self) -> ObjectTree:
        """The objects of the scene, those of every vehicle among them."""
        return self._shared.objects

    @property
    def scripts(self) -> Scripts:
        """The scripts of the simulation."""
        return self._shared.scripts

    @property
    def signals(self) -> Signals:
        """The signals that scripts leave for each other."""
        return self._shared.signals

    @property
    def drawings(self) -> Drawings:
        """What scripts draw."""
        return self._shared.drawings

    @property
    def windows(self) -> Windows:
        """What scripts open for a person to look at."""
        return self._shared.windows
