"""Start, stop, pause and step, as V-REP's toolbar does, and the reaction to a failing script."""

from __future__ import annotations

import contextlib
import logging
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field

from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.run.stepping import Diverged
from drone_sim.scripting.api.control import STOP
from drone_sim.scripting.errors import ScriptError

_LOG = logging.getLogger(__name__)
_LOG.setLevel(logging.INFO)
_MAX_ORDERS = 1000  # calls of `step` that wait at the same time


@dataclass
class _Order:
    """Steps that are to be run while the simulation is paused."""

    count: int
    left: int
    answer: Future[str] = field(default_factory=Future)  # the simulated time after the last step, in words


class Player:
    """Start, stop, pause and step of a simulation; only the thread that owns the simulation may call it.

    `tell` is called immediately with each new state: `flying`, `paused` or `stopped`.
    """

    def __init__(
        self,
        simulation: Simulation,
        tell: Callable[[str], None],
        simulated_time: bool,
        prepare: Callable[[Parameters], None] = lambda _parameters: None,
    ):
        """With `simulated_time`, other nodes wait while the clock stands still.

        `prepare` is called at each start as `Simulation.start` says.
        """
        self.simulation = simulation
        self._prepare = prepare
        self.paused = False
        self.begun = False  # whether it has started since this was last set to False
        self.failure: ScriptError | Diverged | None = None  # the error that ended the last run, if one did
        self._orders: deque[_Order] = deque()  # executed one after the other
        self._simulated_time = simulated_time
        self._tell = tell
        self._last_state = ""
        self._publish_state()

    @property
    def state(self) -> str:
        """The state: `flying`, `paused` or `stopped`."""
        return "flying" if self.playing else "paused" if self.simulation.running else "stopped"

    @property
    def why_stopped(self) -> str:
        """One line about the error that stopped it since the last start; '' if none did."""
        if self.failure is None:
            return ""
        return f"script error: {self.failure}" if isinstance(self.failure, ScriptError) else str(self.failure)

    def _publish_state(self) -> None:
        state = self.state
        if state != self._last_state:
            self._last_state = state
            self._tell(state)

    @property
    def playing(self) -> bool:
        """Whether it is running and not paused, so that steps are due."""
        return self.simulation.running and not self.paused

    @property
    def is_step_due(self) -> bool:
        """Whether a step is to be run: it is playing, or paused with ordered steps left."""
        return self.playing or bool(self._orders)

    def start(self, scene_file: str | None = None) -> str:
        """Read scene and scripts from disk and begin at time 0. Raises as Simulation.start, and is then stopped."""
        self.interrupt_steps("interrupted")
        self.paused, self.failure = False, None
        with self._attempt():
            self.simulation.start(scene_file, self._prepare)
        self.simulation.look()  # reads meshes and textures now, which would delay the first step
        self.begun = True
        self._pause_at_breakpoint()
        scene = self.simulation.parameters.scene_file
        _LOG.info(f"started{f' in {scene}' if scene else ''}")
        return "started"

    def stop(self) -> str:
        """Run the scripts' cleanup, and restore the initial scene. Raises ScriptError."""
        if not self.simulation.running:
            return "already stopped"
        self.interrupt_steps("interrupted")
        try:
            self.simulation.stop()
        finally:
            self._publish_state()
        self._log_that_clock_stands("stopped")
        return "stopped"

    def restart(self) -> str:
        """Stop and start. Raises as `start`; errors in the scripts' cleanup are only logged."""
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
        self.interrupt_steps("interrupted")
        self.paused = on
        self._publish_state()
        if on:
            self._log_that_clock_stands("paused")
        else:
            _LOG.info("resumed")
        return f"{'paused' if on else 'resumed'} at t = {self.simulation.time:.2f} s"

    def order_steps(self, count: int) -> Future[str]:
        """Have `step` run `count` steps while paused; return their answer, which may be a ScriptError or Diverged.

        Orders are executed one after the other; a breakpoint ends all of them. Raises ValueError if it is not paused.
        """
        if not self.simulation.running or not self.paused:
            raise ValueError("the simulation is not paused: call `pause` before `step`")
        if len(self._orders) >= _MAX_ORDERS:
            raise ValueError(f"{_MAX_ORDERS} calls of `step` are waiting already")
        order = _Order(count, count)
        self._orders.append(order)
        return order.answer

    def interrupt_steps(self, reason: str) -> None:
        """Cancel all ordered steps; their answer is a ValueError with `reason`."""
        while self._orders:
            order = self._orders.popleft()
            order.answer.set_exception(ValueError(f"{reason}: {order.left} of {order.count} steps have not been run"))

    def _count_ordered_step(self) -> None:
        if not self._orders:
            return
        order, reached = self._orders[0], self.simulation.breakpoints.reached
        order.left -= 1
        if order.left == 0:
            self._orders.popleft()
            order.answer.set_result(f"t = {self.simulation.time:.2f} s")
        if reached is not None:
            self.interrupt_steps(f"breakpoint at {reached.file}:{reached.line}, t = {reached.time:.2f} s")

    def step(self) -> bool:
        """Run one step. If a script fails or the dynamics diverges, log it once, stop, and return False."""
        with self.stepping():
            self.simulation.step()
        return self.end_step()

    @contextlib.contextmanager
    def stepping(self) -> Iterator[None]:
        """Context of one step and its messages; call `end_step` after it.

        If a script fails or the dynamics diverges, log it once, and stop; the error ends here.
        """
        try:
            with self._attempt():
                yield
        except (ScriptError, Diverged) as error:
            while self._orders:
                self._orders.popleft().answer.set_exception(error)

    def end_step(self) -> bool:
        """Count an ordered step, pause at a breakpoint, and execute a script's request to stop or pause.

        Return whether the simulation still runs; False if the step failed.
        """
        if self.failure is not None:
            return False
        self._count_ordered_step()
        self._pause_at_breakpoint()
        request = self.simulation.context.control.take()
        return not request or self._execute_request(request)

    def _pause_at_breakpoint(self) -> None:
        reached = self.simulation.breakpoints.reached
        if reached is not None and self.playing:
            _LOG.info(f"breakpoint at {reached.file}:{reached.line}, t = {reached.time:.2f} s")
            self.pause(True)

    def _execute_request(self, request: str) -> bool:
        """Stop or pause, as a script requested; return whether the simulation still runs."""
        _LOG.info(f"a script has requested to {request} the simulation")
        try:
            self.stop() if request == STOP else self.pause(True)
        except ScriptError as error:
            _LOG.error(f"script error: {error}")
        return self.simulation.running

    @contextlib.contextmanager
    def _attempt(self) -> Iterator[None]:
        """Context of a start or a step. If it fails, log one line, run the scripts' cleanup, and raise again."""
        self.simulation.breakpoints.reached = None
        try:
            yield
        except (ScriptError, Diverged) as error:
            self.failure = error
            _LOG.error(self.why_stopped)
            try:
                self.simulation.stop()
            except ScriptError as second:  # mostly a consequence of the first, which is the one to show
                _LOG.warning(f"then a second script error, in cleanup: {second}")
            if isinstance(error, ScriptError):  # the vehicles' states show it until the next start
                failed = error
                for vehicle in self.simulation.vehicles.values():
                    vehicle.flight_state.script_errors.append(lambda: failed)
            self._log_that_clock_stands("stopped; `start` runs the edited file")
            raise
        finally:
            self._publish_state()

    def _log_that_clock_stands(self, state: str) -> None:
        if self._simulated_time:
            state += ": /clock stands still, and nodes that use simulated time wait"
        _LOG.info(state)
