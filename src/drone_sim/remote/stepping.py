"""Who lets the simulation step: it does when every client that wants to be asked has said so."""

from __future__ import annotations

from drone_sim.remote.conversation import Until


class Stepping:
    """One client's say. Levels and locks count, as CoppeliaSim's do: what was switched on twice is off after twice."""

    def __init__(self) -> None:
        """Let the simulation run."""
        self.level = 0
        self.locks = 0
        self._waits: list[Until] = []

    def set(self, enabled: bool) -> int:
        """Be asked before every step, or no more; return the level from before."""
        before = self.level
        self.level = before + 1 if enabled else max(0, before - 1)
        return before

    def lock(self, more: int) -> None:
        """Let the simulation stand as long as there are locks."""
        self.locks = max(0, self.locks + more)

    def wait(self, until: Until) -> Until:
        """Let the simulation go on until then; return what to wait for."""
        self._waits = [one for one in self._waits if not one.over()]
        self._waits.append(until)
        return until

    def let_go(self) -> None:
        """Let the simulation run, whatever was said before."""
        self.level = self.locks = 0

    @property
    def holds(self) -> bool:
        """Whether the next step has to wait for this client."""
        return bool(self.locks or (self.level and all(one.over() for one in self._waits)))
