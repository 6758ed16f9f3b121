"""The functions of `sim` that control the whole simulation, for remote clients."""

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

_STOPPED, _PAUSED, _RUNNING = (CONSTANTS[f"simulation_{state}"] for state in ("stopped", "paused", "advancing_running"))
_MAX_CALLS = 10_000


class Arrangement(NamedTuple):
    """The pose of an object (in the world if the dynamics moves it, else in its parent), and a joint's state."""

    place: Matrix
    value: float = 0.0  # rad or m
    control: JointControl | None = None


Arrangements = dict[str, Arrangement]  # by object name


class MovedObjects:
    """Records changes of poses and joints that are made while the simulation is stopped.

    V-REP starts with these changes; here `start` reads the scene again, so they are recorded to be applied after it.
    """

    def __init__(self, simulation: Simulation):
        self._simulation = simulation
        self._topology_version = -1
        self._initial: Arrangements = {}

    def watch(self) -> None:
        """Save the arrangement at the first change after a start, a stop or a change of the vehicles.

        To be called before any change.
        """
        if self._topology_version != self._simulation.topology_version:
            self._topology_version = self._simulation.topology_version
            self._initial = {} if self._simulation.running else self._all()

    def changed(self) -> Arrangements:
        """Return what has changed since the simulation stopped, with poses in the world frame.

        An object that only moved with its parent has not changed.
        """
        objects = self._simulation.context.objects
        changed = {name: new for name, new in self._all().items() if self._initial.get(name, new) != new}
        return {name: new._replace(place=objects[objects.handle(name)].matrix()) for name, new in changed.items()}

    def arrange(self, arrangements: Arrangements) -> None:
        """Restore these poses and joint states, for objects whose names still exist."""
        objects = self._simulation.context.objects
        for name, (place, value, control) in arrangements.items():
            item = objects[objects.handle(name)] if name in objects else None
            if item is not None:
                item.put(place)
            if isinstance(item, Joint) and control is not None:
                item.place(value)
                item.command(control)

    def _all(self) -> Arrangements:
        """Return the arrangement of every object, except those held by a joint, which determines their poses."""
        objects = self._simulation.context.objects
        items = (objects[handle] for handle in objects)
        return {item.name: _arrangement(item) for item in items if not getattr(item, "is_held", False)}


def _arrangement(item: SceneObject) -> Arrangement:
    place = item.local if item.body is None else item.matrix()
    return Arrangement(place, item.value, item.control) if isinstance(item, Joint) else Arrangement(place)


class ClientControl:
    """A client's control of the simulation, like V-REP's toolbar, and of its steps."""

    def __init__(
        self,
        player: Player,
        moved: MovedObjects,
        stepping: Stepping,
        everybody: Callable[[], Iterable[Stepping]],
        clock: Callable[[], float],
    ):
        """`player` runs the simulation, `moved` records moved objects; `clock` returns real seconds.

        `stepping` is this client's control of the steps, `everybody` returns that of each client.
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
        """Start at time 0, or resume a paused simulation. Objects moved while stopped start where they are.

        Signals that were set while stopped stay set, unless a script's init sets them.
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
        """Pause a running simulation."""
        if self._simulation.running:
            self._player.pause(True)

    @sim("345")
    def stopSimulation(self, _wait: bool = True) -> None:
        """Stop, and restore the initial scene. As in CoppeliaSim, this switches stepping off for all clients."""
        for stepping in self._everybody():
            stepping.let_go()
        self._player.stop()

    @sim("345")
    def getSimulationState(self) -> int:
        """Return sim.simulation_stopped, _paused or _advancing_running."""
        return _RUNNING if self._player.playing else _PAUSED if self._simulation.running else _STOPPED

    # ---- scenes

    @sim("345")
    def loadScene(self, filename: Name) -> int:
        """Replace the scene by that of a file (.yaml or .ttt) while the simulation is stopped; return 1.

        The file must be in sim.stringparam_scenedefaultdir: the folder of the last scene file, or
        `remote_api: {scenes: ...}`. '' loads the default scene, without a file.
        """
        if self._simulation.running:
            raise ValueError("a scene can only be loaded while the simulation is stopped: call stopSimulation first")
        self._simulation.load_scene(str(inside(self._folder(), filename, ".ttt")) if filename != "" else "")
        return 1

    @sim("345")
    def saveScene(self, filename: Name) -> int:
        """Save the current scene to a file (.yaml) in the folder of the scene file; return 1."""
        self._simulation.save_scene(inside(self._folder(), filename))
        return 1

    @sim("5", getStringParameter="345")
    def getStringParam(self, parameter: int) -> str:
        """Return sim.stringparam_scenedefaultdir, the folder of loadScene's files; '' for other parameters."""
        return str(self._folder() or "") if parameter == CONSTANTS["stringparam_scenedefaultdir"] else ""

    def _folder(self) -> Path | None:
        """Return the folder of scene files, None if there is none."""
        parameters = self._simulation.parameters
        if parameters.remote_api.scenes:
            return locate(parameters.remote_api.scenes)
        return resolve(parameters.scene_file).parent if parameters.scene_file else None

    # ---- steps

    @sim("5")
    def setStepping(self, enabled: bool = True) -> int:
        """Make each simulation step wait for this client's `step`, or not; return the previous level."""
        return self._stepping.set(bool(enabled))

    @sim("345")
    def wait(self, seconds: Number, simulationTime: bool = True) -> Wait:
        """Wait for a number of seconds: simulated time, with the steps that this takes, or real time."""
        (duration,) = numbers((seconds,), 1)
        clock = (lambda: self._simulation.time) if simulationTime else self._clock
        return Wait(has_passed(clock, duration), lambda: duration, by_steps=bool(simulationTime))

    @sim("345")
    def getSystemTime(self) -> float:
        """Return the real time in seconds; its zero is arbitrary."""
        return self._clock()

    @sim("5")
    def acquireLock(self) -> None:
        """Block the simulation until releaseLock is called."""
        self._stepping.lock(1)

    @sim("5")
    def releaseLock(self) -> None:
        """Resume the simulation after acquireLock."""
        self._stepping.lock(-1)

    # ---- calls of the client's own functions

    @sim("")
    def handleExtCalls(self) -> None:
        """Do nothing: pending messages are delivered to the client before each of its requests."""

    @sim("")
    def testCB(self, first: Any, callback: Any, second: Any, iterations: int = 99) -> Task:
        """Call a function of the client with two values, `iterations` + 1 times; return its last result."""
        if not isinstance(callback, ClientFunction):
            raise WrongValue("expected a function of the client")
        if not 0 <= iterations <= _MAX_CALLS:
            raise ValueError(f"iterations = {iterations}: must be at most {_MAX_CALLS}")
        answer: Any = []
        for _ in range(int(iterations) + 1):
            answer = yield Call(callback.name, [first, second])
        return answer

    def wait_for(self, wait: Wait) -> Task:
        """Run the simulation until a wait is over; return its value.

        If it needs simulation steps while the simulation is not playing, return at once. Raises RequestRefused if a
        script fails in one of these steps.
        """
        simulation, run = self._simulation, self._simulation.run
        if isinstance(wait, Action):
            yield from self._execute(wait)
            return wait.value()
        if wait.by_steps and not self._player.playing:
            return wait.value()
        if not wait.over():
            yield self._stepping.wait(Until(lambda: simulation.run != run or wait.over()))
        if wait.by_steps and simulation.run != run and self._player.failure:
            raise RequestRefused(str(self._player.failure))
        return wait.value()

    def _execute(self, action: Action) -> Task:
        """Execute an action, at most until the simulation stops; while playing, it steps between the action's steps."""
        simulation, run, answer = self._simulation, self._simulation.run, None
        steps, steps_in_place = iter(action), 0
        while simulation.run == run:
            try:
                call = steps.send(answer)
            except StopIteration:
                return
            answer, step = None, simulation.context.clock.steps
            if call:
                answer = yield Call(name_of(call.callback), call.arguments)
            elif not self._player.playing:
                steps_in_place += 1
                if steps_in_place > _MAX_CALLS:
                    raise ValueError(f"more than {_MAX_CALLS} steps: start the simulation first")
            else:
                yield self._stepping.wait(Until(partial(self._has_left, run, step)))

    def _has_left(self, run: int, steps: int) -> bool:
        """Return whether the simulation is in another step or another run than given."""
        return self._simulation.run != run or self._simulation.context.clock.steps != steps
