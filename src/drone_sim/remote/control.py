"""`sim`, as far as it is about the simulation as a whole, and as clients outside have it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from drone_sim.files.resources import resolve
from drone_sim.mechanics.frames import Matrix
from drone_sim.remote.conversation import Call, ClientFunction, RequestRefused, Stepping, Task, Until, name_of
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scene.models import inside
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.control import Action, Wait, has_passed
from drone_sim.scripting.api.types import Name, Number, WrongValue, numbers

_STOPPED, _PAUSED, _RUNNING = (CONSTANTS[f"simulation_{one}"] for one in ("stopped", "paused", "advancing_running"))
_MOST_CALLS = 10_000
Places = dict[str, Matrix]  # by the names of objects


class MovedObjects:
    """Where objects are put while the simulation is stopped: V-REP begins there; here `start` reads the scene anew."""

    def __init__(self, simulation: Simulation):
        """Take the simulation."""
        self._simulation = simulation
        self._era = -1
        self._initial: Places = {}

    def watch(self) -> None:
        """Remember how an era begins; call it before anything is done to the simulation."""
        if self._era != self._simulation.era:
            self._era = self._simulation.era
            self._initial = {} if self._simulation.running else self._all()

    def places(self) -> Places:
        """Return where in the world what is that has been put somewhere else since the simulation stopped.

        Carried by an object that was moved is not moved.
        """
        objects = self._simulation.context.objects
        changed = (name for name, place in self._all().items() if self._initial.get(name, place) != place)
        return {name: objects[objects.handle(name)].matrix() for name in changed}

    def put(self, places: Places) -> None:
        """Put objects there again, as far as there still are some of these names."""
        objects = self._simulation.context.objects
        for name, place in places.items():
            if name in objects:
                objects[objects.handle(name)].put(place)

    def _all(self) -> Places:
        """Return where every object is: in the world what the dynamics moves, else in its parent."""
        objects = self._simulation.context.objects
        found = (objects[handle] for handle in objects)
        return {one.name: one.local if one.body is None else one.matrix() for one in found}


class ClientControl:
    """What a client does with the simulation as V-REP's toolbar does, and how it steps."""

    def __init__(
        self,
        player: Player,
        moved: MovedObjects,
        stepping: Stepping,
        everybody: Callable[[], Iterable[Stepping]],
        clock: Callable[[], float],
    ):
        """`player` plays the simulation, `moved` watches where objects are put; `clock` counts real seconds.

        `stepping` is the client's say in the steps, `everybody` returns all clients'.
        """
        self._clock = clock
        self._player = player
        self._simulation = player.simulation
        self._moved = moved
        self._stepping = stepping
        self._everybody = everybody

    # ---- the toolbar

    @sim("345")
    def startSimulation(self) -> None:
        """Begin at time 0, or go on after a pause; what was moved while it was stopped begins where it was put."""
        if self._player.playing:
            return
        if self._simulation.running:
            self._player.pause(False)
            return
        moved = self._moved.places()
        self._player.start()
        self._moved.put(moved)

    @sim("345")
    def pauseSimulation(self) -> None:
        """Pause, unless it is stopped."""
        if self._simulation.running:
            self._player.pause(True)

    @sim("345")
    def stopSimulation(self, _wait: bool = True) -> None:
        """Stop, and restore the initial scene. As in CoppeliaSim, stepping is off for all clients then."""
        for one in self._everybody():
            one.let_go()
        self._player.stop()

    @sim("345")
    def getSimulationState(self) -> int:
        """Return sim.simulation_stopped, _paused or _advancing_running."""
        return _RUNNING if self._player.playing else _PAUSED if self._simulation.running else _STOPPED

    # ---- scenes

    @sim("345")
    def loadScene(self, filename: Name) -> int:
        """Let another scene file, beside the last one, take its place while the simulation is stopped; return 1."""
        if self._simulation.running:
            raise ValueError("a scene is loaded while the simulation is stopped: call stopSimulation first")
        self._simulation.load_scene(str(self._beside(filename)))
        return 1

    @sim("345")
    def saveScene(self, filename: Name) -> int:
        """Write the scene as it stands into a file (.yaml) beside the scene file; return 1."""
        self._simulation.save_scene(self._beside(filename))
        return 1

    def _beside(self, filename: str) -> Path:
        file = self._simulation.parameters.scene_file
        return inside(resolve(file).parent if file else None, filename)

    # ---- steps

    @sim("5")
    def setStepping(self, enabled: bool = True) -> int:
        """Let the simulation step only when this client calls `step`, or freely; return the level from before."""
        return self._stepping.set(bool(enabled))

    @sim("345")
    def wait(self, seconds: Number, simulationTime: bool = True) -> Wait:
        """Return after so many seconds: of simulated time, for which it is stepped, or else of real time."""
        (duration,) = numbers((seconds,), 1)
        clock = (lambda: self._simulation.time) if simulationTime else self._clock
        return Wait(has_passed(clock, duration), lambda: duration, by_steps=bool(simulationTime))

    @sim("345")
    def getSystemTime(self) -> float:
        """Return the real time in seconds, from any beginning."""
        return self._clock()

    @sim("5")
    def acquireLock(self) -> None:
        """Let the simulation stand until releaseLock."""
        self._stepping.lock(1)

    @sim("5")
    def releaseLock(self) -> None:
        """Let the simulation go on that acquireLock had stand."""
        self._stepping.lock(-1)

    # ---- calls of the client's own functions

    @sim("")
    def handleExtCalls(self) -> None:
        """Do nothing: messages that wait for the client are handed to it before whatever it asks for."""

    @sim("")
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

    def wait_for(self, wait: Wait) -> Task:
        """Let the simulation go on until a wait is over; return what it brings.

        Where that takes steps, and the simulation is not playing, nothing is waited for. Raises RequestRefused where a
        script fails in such a step.
        """
        simulation, run = self._simulation, self._simulation.run
        if isinstance(wait, Action):
            yield from self._carry_out(wait)
            return wait.value()
        if wait.by_steps and not self._player.playing:
            return wait.value()
        if not wait.over():
            yield self._stepping.wait(Until(lambda: simulation.run != run or wait.over()))
        if wait.by_steps and simulation.run != run and self._player.failure:
            raise RequestRefused(str(self._player.failure))
        return wait.value()

    def _carry_out(self, action: Action) -> Task:
        """Let an action be done, and the simulation go on in between, if it is playing, until it is stopped.

        Raises ValueError for one that takes too many steps, where it is not.
        """
        simulation, run, answer = self._simulation, self._simulation.run, None
        steps, at_once = iter(action), 0
        while simulation.run == run:
            try:
                asked = steps.send(answer)
            except StopIteration:
                return
            answer, now = None, simulation.context.clock.steps
            if asked:
                answer = yield Call(name_of(asked.callback), asked.arguments)
            elif not self._player.playing:
                at_once += 1
                if at_once > _MOST_CALLS:
                    raise ValueError(f"more than {_MOST_CALLS} steps: start the simulation first")
            else:
                yield self._stepping.wait(Until(partial(self._has_left, run, now)))

    def _has_left(self, run: int, steps: int) -> bool:
        """Tell whether the simulation is in another step, or another run."""
        return self._simulation.run != run or self._simulation.context.clock.steps != steps
