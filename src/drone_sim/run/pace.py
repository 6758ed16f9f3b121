"""How fast the simulation goes, which may be changed while it runs: its real-time factor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from drone_sim.config.comments import comments
from drone_sim.config.leaves import Leaf, leaves
from drone_sim.config.types import ParameterError
from drone_sim.run.pacing import Pacer
from drone_sim.run.parameters import PaceParameters, Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.wording import near_names, shown

FACTOR = "real_time_factor"


def period(parameters: Parameters) -> float:
    """Return the real seconds from one step to the next, 0 where they come as fast as they can."""
    factor = parameters.real_time_factor
    return parameters.time_step / factor if factor else 0.0


class Pace:
    """The pace of one simulation. It holds from the step that is waited for, through every start."""

    def __init__(self, simulation: Simulation, pacer: Pacer):
        """Take the simulation, and what lets its steps pass."""
        self._simulation, self._pacer = simulation, pacer
        said = comments()[FACTOR]
        self.known: dict[str, Leaf] = {one.name: one._replace(said=said) for one in leaves(PaceParameters)}

    def values(self) -> dict[str, Any]:
        """Return what holds now, by name."""
        return {FACTOR: self._simulation.parameters.real_time_factor}

    def change(self, changes: Mapping[str, Any]) -> None:
        """Let another factor hold. Raises ParameterError."""
        for name in changes.keys() - self.known.keys():
            near = near_names(name[:80], self.known)
            raise ParameterError(f"parameter {shown(name)}: cannot be changed while the simulation runs; {near}")
        if changes:
            self._simulation.set_pace(changes[FACTOR])
            self._pacer.change(period(self._simulation.parameters))
