"""Whether the simulation goes on: what scripts are told of it, and what they ask for."""

from __future__ import annotations

from drone_sim.scripting.api.constants import CONSTANTS

STOP, PAUSE = "stop", "pause"


class Control:
    """What the scripts of a simulation share of it; whoever plays the simulation looks at `asked` after each step."""

    def __init__(self) -> None:
        """Begin with nothing asked for."""
        self.asked = ""  # STOP, PAUSE or nothing
        self.is_stopping = False  # while threads have their last turns
        self.is_ending = False  # while cleanup is called

    def state(self, time: float) -> int:
        """Return CoppeliaSim's state of the simulation at a simulated time in s."""
        if self.is_ending:
            return CONSTANTS["simulation_advancing_lastbeforestop"]
        if self.asked == STOP or self.is_stopping:
            return CONSTANTS["simulation_advancing_abouttostop"]
        return CONSTANTS["simulation_advancing_running" if time > 0 else "simulation_advancing_firstafterstop"]

    def take(self) -> str:
        """Return what was asked for, and forget it."""
        asked, self.asked = self.asked, ""
        return asked
