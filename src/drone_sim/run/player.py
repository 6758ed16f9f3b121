"""Start, stop, pause and step: what V-REP's toolbar does, and what happens when a script fails."""

from __future__ import annotations

import logging
from collections.abc import Callable

from drone_sim.run.simulation import Simulation
from drone_sim.run.stepping import Diverged
from drone_sim.scripting.api.control import STOP
from drone_sim.scripting.errors import ScriptError

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)


class Player:
    """Plays a simulation; the thread that owns the simulation calls all of this.

    `tell` is called at once with what it does from now on: `flying`, `paused` or `stopped`.
    """

    def __init__(
        self, simulation: Simulation, step: Callable[[], None], tell: Callable[[str], None], simulated_time: bool
    ):
        """Begin stopped. `step` runs one step and shows it.

        `simulated_time`: others go by the simulation's clock, and wait when it stands still.
        """
        self.simulation = simulation
        self._step = step
        self.paused = False
        self.begun = False  # since this was last set to False
        self.failure: ScriptError | Diverged | None = None  # what ended the last run, if it did not end well
        self._simulated_time = simulated_time
        self._tell = tell
        self._told = ""
        self._tell_state()

    @property
    def state(self) -> str:
        """What it does: `flying`, `paused` or `stopped`."""
        return "flying" if self.playing else "paused" if self.simulation.running else "stopped"

    @property
    def why_stopped(self) -> str:
        """Why it stopped by itself since the last start, in one line; '' where it did not."""
        if self.failure is None:
            return ""
        return f"script error: {self.failure}" if isinstance(self.failure, ScriptError) else str(self.failure)

    def _tell_state(self) -> None:
        state = self.state
        if state != self._told:
            self._told = state
            self._tell(state)

    @property
    def playing(self) -> bool:
        """Whether the next step is due when the clock says so."""
        return self.simulation.running and not self.paused

    def start(self, scene_file: str | None = None) -> str:
        """Read scene and script from disk and begin at time 0. Raises what Simulation.start does, after stopping."""
        self.paused, self.failure = False, None
        self.attempt(lambda: self.simulation.start(scene_file))
        self.simulation.look()  # meshes and textures are read now, which the first step would be late for
        self.begun = True
        self._pause_at_breakpoint()
        scene = self.simulation.parameters.scene_file
        _LOG.info(f"started{f' in {scene}' if scene else ''}")
        return "started"

    def stop(self) -> str:
        """Run the script's cleanup, and restore the initial scene. Raises ScriptError."""
        if not self.simulation.running:
            return "already stopped"
        try:
            self.simulation.stop()
        finally:
            self._tell_state()
        self._say_that_the_clock_stands("stopped")
        return "stopped"

    def restart(self) -> str:
        """Stop and start. Raises what `start` does; errors in the script's cleanup are said and do not hinder it."""
        if self.simulation.running:
            try:
                self.stop()
            except ScriptError as error:
                _LOG.error(f"script error: {error}")
        return self.start()

    def pause(self, on: bool) -> str:
        """Pause or resume. Raises ValueError when stopped."""
        if not self.simulation.running:
            raise ValueError("the simulation is stopped: start it first")
        self.paused = on
        self._tell_state()
        if on:
            self._say_that_the_clock_stands("paused")
        else:
            _LOG.info("resumed")
        return f"{'paused' if on else 'resumed'} at t = {self.simulation.time:.2f} s"

    def one_step(self) -> str:
        """Run one step while paused. Raises ValueError when it is not, ScriptError."""
        if not self.simulation.running or not self.paused:
            raise ValueError("the simulation is not paused: call `pause` before `step`")
        self.attempt(self._step)
        return f"t = {self.simulation.time:.2f} s"

    def step(self) -> bool:
        """Run one step; when the script fails or the dynamics diverges, say so once, stop, and return False."""
        try:
            self.attempt(self._step)
        except (ScriptError, Diverged):
            return False
        self._pause_at_breakpoint()
        asked = self.simulation.context.control.take()
        return not asked or self._obey(asked)

    def _pause_at_breakpoint(self) -> None:
        """Pause where a script has reached one in the step, or in its init."""
        reached = self.simulation.breakpoints.reached
        if reached is not None and self.playing:
            _LOG.info(f"breakpoint at {reached.file}:{reached.line}, t = {reached.time:.2f} s")
            self.pause(True)

    def _obey(self, asked: str) -> bool:
        """Stop or pause, as a script asked for; return whether the simulation still runs."""
        _LOG.info(f"a script has requested to {asked} the simulation")
        try:
            self.stop() if asked == STOP else self.pause(True)
        except ScriptError as error:
            _LOG.error(f"script error: {error}")
        return self.simulation.running

    def attempt(self, action: Callable[[], None]) -> None:
        """Start or step. When script or dynamics fails, log its one line, run cleanup, and raise it again."""
        self.simulation.breakpoints.reached = None
        try:
            action()
        except (ScriptError, Diverged) as error:
            self.failure = error
            _LOG.error(self.why_stopped)
            try:
                self.simulation.stop()
            except ScriptError as second:  # mostly because of the first: whoever shows an error shows that one
                _LOG.warning(f"then a second script error, in cleanup: {second}")
            if isinstance(error, ScriptError):  # shown until the next start
                failed = error
                for vehicle in self.simulation.vehicles.values():
                    vehicle.flight_state.script_errors.append(lambda: failed)
            self._say_that_the_clock_stands("stopped; `start` runs the edited file")
            raise
        finally:
            self._tell_state()

    def _say_that_the_clock_stands(self, state: str) -> None:
        if self._simulated_time:
            state += ": /clock stands still, and nodes that use simulated time wait"
        _LOG.info(state)
