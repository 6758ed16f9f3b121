"""`sim`, as far as it is about the simulation as a whole, and as clients outside have it."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from drone_sim.files.resources import locate, resolve
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.joint import Joint, JointControl
from drone_sim.mechanics.scene_object import SceneObject
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


class Arrangement(NamedTuple):
    """Where an object is (in the world what the dynamics moves, else in its parent), and how a joint stands."""

    place: Matrix
    value: float = 0.0  # rad or m
    control: JointControl | None = None


Arrangements = dict[str, Arrangement]  # by the names of objects


class MovedObjects:
    """Changes of objects' places and of joints that are made while the simulation is stopped.

    V-REP starts with these changes; here `start` reads the scene again, so they are kept here.
    """

    def __init__(self, simulation: Simulation):
        """Take the simulation."""
        self._simulation = simulation
        self._era = -1
        self._initial: Arrangements = {}

    def watch(self) -> None:
        """Remember how an era begins; call it before anything is done to the simulation."""
        if self._era != self._simulation.era:
            self._era = self._simulation.era
            self._initial = {} if self._simulation.running else self._all()

    def changed(self) -> Arrangements:
        """Return what has changed since the simulation stopped; places are in the world.

        An object that was only carried along by a moved one has not changed.
        """
        objects = self._simulation.context.objects
        changed = {name: one for name, one in self._all().items() if self._initial.get(name, one) != one}
        return {name: one._replace(place=objects[objects.handle(name)].matrix()) for name, one in changed.items()}

    def arrange(self, arrangements: Arrangements) -> None:
        """Put objects and joints back into these arrangements, if objects of these names still exist."""
        objects = self._simulation.context.objects
        for name, (place, value, control) in arrangements.items():
            one = objects[objects.handle(name)] if name in objects else None
            if one is not None:
                one.put(place)
            if isinstance(one, Joint) and control is not None:
                one.place(value)
                one.command(control)

    def _all(self) -> Arrangements:
        """Return the arrangement of every object, except those that a joint holds: the joint gives their places."""
        objects = self._simulation.context.objects
        found = (objects[handle] for handle in objects)
        return {one.name: _arrangement(one) for one in found if not getattr(one, "is_held", False)}


def _arrangement(one: SceneObject) -> Arrangement:
    place = one.local if one.body is None else one.matrix()
    return Arrangement(place, one.value, one.control) if isinstance(one, Joint) else Arrangement(place)


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

        `stepping` is the client's control of the steps, `everybody` returns that of each client.
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
        """Begin at time 0, or go on after a pause; what was moved while it was stopped begins where it was put.

        Signals that were set then are set, unless a script's init has set them.
        """
        if self._player.playing:
            return
        if self._simulation.running:
            self._player.pause(False)
            return
        changed, signals = self._moved.changed(), copy.deepcopy(self._simulation.context.signals)
        self._player.start()
        self._moved.arrange(changed)
        self._simulation.context.signals.add_those_of(signals)

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
        """Let another scene file take the last one's place while the simulation is stopped; return 1.

        It may be one of V-REP's (.ttt), and lies in sim.stringparam_scenedefaultdir: beside the last one, or in
        `remote_api: {scenes: ...}`. '' is the scene that there is without a file.
        """
        if self._simulation.running:
            raise ValueError("a scene can only be loaded while the simulation is stopped: call stopSimulation first")
        self._simulation.load_scene(str(inside(self._folder(), filename, ".ttt")) if filename != "" else "")
        return 1

    @sim("345")
    def saveScene(self, filename: Name) -> int:
        """Write the scene as it stands into a file (.yaml) beside the scene file; return 1."""
        self._simulation.save_scene(inside(self._folder(), filename))
        return 1

    @sim("5", getStringParameter="345")
    def getStringParam(self, parameter: int) -> str:
        """Return sim.stringparam_scenedefaultdir, the folder of which loadScene takes files; '' for any other."""
        return str(self._folder() or "") if parameter == CONSTANTS["stringparam_scenedefaultdir"] else ""

    def _folder(self) -> Path | None:
        """Return the folder where scene files lie, None for none."""
        known = self._simulation.parameters
        if known.remote_api.scenes:
            return locate(known.remote_api.scenes)
        return resolve(known.scene_file).parent if known.scene_file else None

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
        """Let the simulation stand still until releaseLock."""
        self._stepping.lock(1)

    @sim("5")
    def releaseLock(self) -> None:
        """Let the simulation go on after acquireLock."""
        self._stepping.lock(-1)

    # ---- calls of the client's own functions

    @sim("")
    def handleExtCalls(self) -> None:
        """Do nothing: messages that wait for the client are handed to it before whatever it asks for."""

    @sim("")
    def testCB(self, first: Any, callback: Any, second: Any, iterations: int = 99) -> Task:
        """Call a function of the client's with two values, `iterations` + 1 times; return its last result."""
        if not isinstance(callback, ClientFunction):
            raise WrongValue("expected a function of the client")
        if not 0 <= iterations <= _MOST_CALLS:
            raise ValueError(f"iterations = {iterations}: must be at most {_MOST_CALLS}")
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
        """Carry out an action, at most until the simulation stops; a playing one goes on between the action's steps.

        Raises ValueError if the simulation is not playing and the action takes too many steps.
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
