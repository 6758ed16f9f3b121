"""`sim`, as far as it is about the simulation as a whole, and as clients outside have it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from drone_sim.remote.arrangement import Arrangement
from drone_sim.remote.conversation import Call, ClientFunction, Refused, Task, Until
from drone_sim.remote.stepping import Stepping
from drone_sim.run.pacing import Stopwatch
from drone_sim.run.player import Player
from drone_sim.scripting.api.calls import Function, WrongValue, numbers
from drone_sim.scripting.api.types import Name, Number

STATES = {  # CoppeliaSim's values (simConst.h)
    "simulation_stopped": 0,
    "simulation_paused": 8,
    "simulation_advancing": 16,
    "simulation_advancing_firstafterstop": 16,
    "simulation_advancing_running": 17,
    "simulation_advancing_lastbeforepause": 18,
    "simulation_advancing_firstafterpause": 19,
    "simulation_advancing_abouttostop": 20,
    "simulation_advancing_lastbeforestop": 21,
}
_STOPPED, _PAUSED, _RUNNING = (STATES[f"simulation_{one}"] for one in ("stopped", "paused", "advancing_running"))
_MOST_CALLS = 10_000


class Control:
    """What a client does with the simulation as V-REP's toolbar does, and how it steps."""

    def __init__(
        self,
        player: Player,
        arrangement: Arrangement,
        stepping: Stepping,
        everybody: Callable[[], Iterable[Stepping]],
        clock: Callable[[], float],
    ):
        """Take what plays the simulation, where objects are put, the client's say in the steps, and all clients'.

        `clock` counts real seconds.
        """
        self._clock = clock
        self._player = player
        self._simulation = player.simulation
        self._arrangement = arrangement
        self._stepping = stepping
        self._everybody = everybody

    def functions(self) -> dict[str, Function]:
        """Return what a client may call, by name."""
        names = [name for name in dir(self) if not name.startswith("_") and name != "functions"]
        return {**{name: getattr(self, name) for name in names}, "yield": self.step, "switchThread": self.step}

    # ---- the toolbar

    def startSimulation(self) -> None:
        """Begin at time 0, or go on after a pause; what was moved while it was stopped begins where it was put."""
        if self._player.playing:
            return
        if self._simulation.running:
            self._player.pause(False)
            return
        moved = self._arrangement.moved()
        self._player.start()
        self._arrangement.put(moved)

    def pauseSimulation(self) -> None:
        """Pause, unless it is stopped."""
        if self._simulation.running:
            self._player.pause(True)

    def stopSimulation(self, _wait: bool = True) -> None:
        """Stop, and restore the initial scene. As in CoppeliaSim, stepping is off for all clients then."""
        for one in self._everybody():
            one.let_go()
        self._player.stop()

    def getSimulationState(self) -> int:
        """Return sim.simulation_stopped, _paused or _advancing_running."""
        return _RUNNING if self._player.playing else _PAUSED if self._simulation.running else _STOPPED

    # ---- steps

    def setStepping(self, enabled: bool = True) -> int:
        """Let the simulation step only when this client calls `step`, or freely; return the level from before."""
        return self._stepping.set(bool(enabled))

    def step(self, *_wait: Any) -> Task:
        """Let the simulation take a step, and return when it has. Raises Refused where a script fails in it."""
        simulation, player = self._simulation, self._player
        run, steps = simulation.run, simulation.steps
        if player.playing:
            yield self._stepping.wait(Until(lambda: (simulation.run, simulation.steps) != (run, steps)))
            self._raise_failure(run)

    def wait(self, seconds: Number, simulationTime: bool = True) -> Task:
        """Return after so many seconds: of simulated time, for which it is stepped, or else of real time."""
        (duration,) = numbers((seconds,), 1)
        simulation, run = self._simulation, self._simulation.run
        if not simulationTime:
            watch = Stopwatch(self._clock)
            yield self._stepping.wait(Until(lambda: watch.seconds() >= duration))
        elif self._player.playing:
            ahead = simulation.time + duration - 1e-9  # which a number of steps adds up to
            yield self._stepping.wait(Until(lambda: simulation.run != run or simulation.time >= ahead))
            self._raise_failure(run)
        return duration

    def waitForSignal(self, name: Name) -> Task:
        """Return the value of a signal of any kind, as soon as it is set; nothing where the simulation stops before."""
        simulation, run, signals = self._simulation, self._simulation.run, self._simulation.shared.signals
        kinds = (signals.getInt32Signal, signals.getFloatSignal, signals.getStringSignal)

        def value() -> Any:
            return next((one for one in (get(name) for get in kinds) if one is not None), None)

        if value() is None:
            yield self._stepping.wait(Until(lambda: simulation.run != run or value() is not None))
        return value()

    def getSystemTime(self) -> float:
        """Return the real time in seconds, from any beginning."""
        return self._clock()

    def acquireLock(self) -> None:
        """Let the simulation stand until releaseLock."""
        self._stepping.lock(1)

    def releaseLock(self) -> None:
        """Let the simulation go on that acquireLock had stand."""
        self._stepping.lock(-1)

    # ---- calls of the client's own functions

    def handleExtCalls(self) -> None:
        """Do nothing: messages that wait for the client are handed to it before whatever it asks for."""

    def testCB(self, first: Any, callback: Any, second: Any, iterations: int = 99) -> Task:
        """Call a function of the client's with two values, so many times and once more; return what it returned."""
        if not isinstance(callback, ClientFunction):
            raise WrongValue("a function of the client's is expected")
        if not 0 <= iterations <= _MOST_CALLS:
            raise ValueError(f"a function is called at most {_MOST_CALLS} times, not {iterations}")
        answer: Any = []
        for _ in range(int(iterations) + 1):
            answer = yield Call(callback.name, [first, second])
        return answer

    def _raise_failure(self, run: int) -> None:
        if self._simulation.run != run and self._player.failure:
            raise Refused(str(self._player.failure))
