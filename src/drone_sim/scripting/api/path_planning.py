"""`simOMPL`: path planning for objects and joints, with the library OMPL."""

from __future__ import annotations

import functools
import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.joint import Joint
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import Module
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.distances import DistanceFunctions
from drone_sim.scripting.api.drawings import DrawingFunctions
from drone_sim.scripting.api.host import Functions, Host, SceneServices
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.matrices import unit
from drone_sim.scripting.api.planning_problem import SIZES, SUBSTITUTES, WITH_THREADS, Component, Problem
from drone_sim.scripting.api.types import Callback, Handle, Name, Number, Numbers, ThreeNumbers, WrongValue, numbers
from drone_sim.scripting.script_log import say

simOMPL = Module("simOMPL")
_ALGORITHM, _KIND = "ompl_algorithm_", "ompl_statespacetype_"
_MOST = 1000  # tasks and state spaces of a script
_FLAT = "simExtOMPL_"


def _names(prefix: str) -> dict[str, int]:
    """Return the constants of an enumeration."""
    return {name.removeprefix(prefix): number for name, number in CONSTANTS.items() if name.startswith(prefix)}


_ALGORITHMS, _KINDS = ({number: name for name, number in _names(it).items()} for it in (_ALGORITHM, _KIND))
ENUMERATIONS = {"Algorithm": SimpleNamespace(**_names(_ALGORITHM)), "StateSpaceType": SimpleNamespace(**_names(_KIND))}


@dataclass
class _Task:
    name: str
    components: list[Component] = field(default_factory=list)
    pairs: list[tuple[int, int]] = field(default_factory=list)  # of entities that must not collide
    start: tuple[float, ...] = ()
    goals: list[tuple[float, ...]] = field(default_factory=list)
    callback: Callback = ""  # decides whether a state is valid
    resolution: float = 0.01  # of the checks of motions: a share of the space's extent
    algorithm: str = "KPIECE1"
    problem: Problem | None = None  # None until `setup`, and after a change

    @property
    def size(self) -> int:
        return sum(SIZES[component.kind][0] for component in self.components)


class PathPlanning(Functions):
    """Paths for objects and joints that avoid collisions.

    The library OMPL searches them: `./dev.sh setup --all` or `pip install ompl` installs it. While it searches, the
    objects of the state spaces move; then everything is as before. The random numbers are the same in every run.
    RRTstar and PRMstar use all of their time, so their paths depend on the computer's speed.
    """

    def __init__(self, host: Host, services: SceneServices, ignored: Ignored):
        """Create it without tasks; the arguments are those of Functions."""
        super().__init__(host, services, ignored)
        self._collisions = DistanceFunctions(self._objects, self._context.collections, services.nearest)
        self._drawings = DrawingFunctions(self._context.drawings, self._objects, ignored)
        self._handles, self._seeds = itertools.count(1), itertools.count(1)
        self._tasks: dict[int, _Task] = {}
        self._spaces: dict[int, Component] = {}

    # ---- state spaces

    @simOMPL("345")
    def createStateSpace(
        self,
        name: Name,
        type: int,
        objectHandle: Handle,
        boundsLow: Numbers,
        boundsHigh: Numbers,
        useForProjection: int = 0,
        weight: Number = 1.0,
        refObjectHandle: Handle = -1,
    ) -> int:
        """Create a part of the state, of a simOMPL.StateSpaceType: an object's pose, or a joint's position.

        The bounds (m, rad) are those of the position. `weight` counts in distances between states. The pose is relative
        to `refObjectHandle`.
        """
        if type not in _KINDS:
            raise WrongValue("expected a simOMPL.StateSpaceType")
        kind = _KINDS[type]
        bounded = SIZES[kind][1]
        low, high = (numbers(values[:bounded], bounded) for values in (boundsLow, boundsHigh))
        if not all(lower < upper for lower, upper in zip(low, high)):
            raise ValueError(f"state space '{name}': each lower bound must be less than the upper bound")
        moved = self._objects[objectHandle]
        if kind.endswith("joint_position") != isinstance(moved, Joint):
            raise ValueError(f"'{moved.name}' cannot be moved by a state space of type {kind}")
        if not weight > 0:
            raise ValueError("weight must be > 0")
        if refObjectHandle != -1:
            self._objects[refObjectHandle]
        component = Component(kind, objectHandle, low, high, bool(useForProjection), weight, refObjectHandle)
        return self._store(self._spaces, component)

    @simOMPL("45")
    def createStateSpaceForJoint(
        self, name: Name, jointHandle: Handle, useForProjection: int = 0, weight: Number = 1.0
    ) -> int:
        """Create the state space of a joint, with the joint's limits as bounds."""
        limits = self._found(jointHandle, Joint, "a joint").limits
        kind = "joint_position" if limits else "cyclic_joint_position"
        low, high = ([limits[0]], [limits[1]]) if limits else ([], [])
        number = CONSTANTS[_KIND + kind]
        return self.createStateSpace(name, number, jointHandle, low, high, useForProjection, weight)

    @simOMPL("345")
    def destroyStateSpace(self, stateSpace: Handle) -> None:
        """Remove a state space; tasks that use it keep it."""
        self._space(stateSpace)
        del self._spaces[stateSpace]

    @simOMPL("345")
    def setDubinsParams(self, stateSpace: Handle, turningRadius: Number, isSymmetric: bool) -> None:
        """Set the turning radius (m) of a state space of type dubins, and whether it also drives backwards."""
        if not turningRadius > 0:
            raise ValueError("turningRadius must be > 0")
        before = self._space(stateSpace)
        after = before._replace(turning_radius=turningRadius, is_symmetric=bool(isSymmetric))
        self._spaces[stateSpace] = after
        for task in self._tasks.values():
            task.components = [after if part is before else part for part in task.components]
            task.problem = None

    def _space(self, handle: int) -> Component:
        if handle not in self._spaces:
            raise ValueError(f"there is no state space with the handle {handle}")
        return self._spaces[handle]

    # ---- tasks

    @simOMPL("345")
    def createTask(self, name: Name) -> int:
        """Create a planning task; return its handle."""
        return self._store(self._tasks, _Task(name))

    @simOMPL("345")
    def destroyTask(self, task: Handle) -> None:
        """Remove a task."""
        self._changed(task)
        del self._tasks[task]

    @simOMPL("345")
    def printTaskInfo(self, task: Handle) -> None:
        """Write a task to the log."""
        it = self._task(task)
        kinds = ", ".join(part.kind for part in it.components)
        say(f"{it.name}: {it.algorithm} in {kinds}, from {it.start} to {it.goals}, collision pairs {it.pairs}")

    @simOMPL("345")
    def setVerboseLevel(self, task: Handle, level: int) -> None:
        """Accept a level, which has no effect."""
        self._task(task)

    @simOMPL("345")
    def setStateValidityCheckingResolution(self, task: Handle, resolution: Number) -> None:
        """Set how far apart checked states are, as a share of the space's extent (0.01)."""
        if not 1e-6 <= resolution <= 1:
            raise ValueError("resolution must be from 0.000001 to 1")
        self._changed(task).resolution = resolution

    @simOMPL("345")
    def setStateSpace(self, task: Handle, stateSpaces: Sequence[Handle]) -> None:
        """Set the state spaces of a task, which together are a state."""
        found = [self._space(handle) for handle in stateSpaces]
        changed = self._changed(task)
        changed.components, changed.start, changed.goals = found, (), []

    @simOMPL("45")
    def setStateSpaceForJoints(
        self,
        task: Handle,
        jointHandles: Sequence[Handle],
        useForProjection: Sequence[int] = (),
        weights: Sequence[Number] = (),
    ) -> None:
        """Set the positions of joints, within their limits, as the state of a task."""
        rows = itertools.zip_longest(jointHandles, useForProjection, weights)
        spaces = [
            self.createStateSpaceForJoint("", joint, projected or 0, weight or 1.0) for joint, projected, weight in rows
        ]
        self.setStateSpace(task, spaces)

    @simOMPL("345")
    def getStateSpaceDimension(self, task: Handle) -> int:
        """Return how many numbers a state of a task has."""
        return self._task(task).size

    @simOMPL("345")
    def setAlgorithm(self, task: Handle, algorithm: int) -> None:
        """Set the planner, a simOMPL.Algorithm (KPIECE1)."""
        if algorithm not in _ALGORITHMS:
            raise WrongValue("expected a simOMPL.Algorithm")
        wanted = _ALGORITHMS[algorithm]
        used = SUBSTITUTES.get(wanted, wanted)
        if used != wanted:
            why = f"the package ompl has no {wanted}, {used} plans instead"
            self._ignored.log("setAlgorithm", why, "simOMPL", logging.WARNING)
        self._changed(task).algorithm = used

    @simOMPL("345")
    def setCollisionPairs(self, task: Handle, collisionPairs: Sequence[Handle]) -> None:
        """Set pairs of objects or collections that must not collide; the second of a pair may be sim.handle_all."""
        pairs = list(zip(collisionPairs[::2], collisionPairs[1::2]))
        self._changed(task).pairs = [(first, second) for first, second in pairs if first >= 0]

    @simOMPL("345")
    def setStartState(self, task: Handle, state: Numbers) -> None:
        """Set the state at which the path begins."""
        self._changed(task).start = self._state(task, state)

    @simOMPL("345")
    def setGoalState(self, task: Handle, state: Numbers) -> None:
        """Set the state at which the path ends."""
        self.setGoalStates(task, [state])

    @simOMPL("345")
    def addGoalState(self, task: Handle, state: Numbers) -> None:
        """Add a state at which the path may end."""
        self.setGoalStates(task, [*self._task(task).goals, state])

    @simOMPL("5")
    def setGoalStates(self, task: Handle, states: Sequence[Numbers]) -> None:
        """Set the states at which the path may end."""
        goals = [self._state(task, state) for state in states]
        self._changed(task).goals = goals

    @simOMPL("345")
    def setStateValidationCallback(self, task: Handle, callback: Callback | None = "") -> None:
        """Let the script's function `callback(state)` return whether a state is valid, instead of the collision pairs.

        The search is then within the script's time limit.
        """
        self._changed(task).callback = callback or ""

    def _store(self, to: dict[int, Any], item: Any) -> int:
        if len(to) >= _MOST:
            raise ValueError(f"a script may have at most {_MOST} tasks, and {_MOST} state spaces")
        handle = next(self._handles)
        to[handle] = item
        return handle

    def _task(self, handle: int) -> _Task:
        if handle not in self._tasks:
            raise ValueError(f"there is no task with the handle {handle}")
        return self._tasks[handle]

    def _changed(self, handle: int) -> _Task:
        """Return a task that is about to change."""
        task = self._task(handle)
        task.problem = None
        return task

    def _state(self, handle: int, state: Numbers) -> tuple[float, ...]:
        task = self._task(handle)
        if not task.components:
            raise ValueError(f"task '{task.name}' has no state space")
        return numbers(state, task.size)

    # ---- planning

    @simOMPL("345")
    def setup(self, task: Handle) -> None:
        """Prepare the planner; the other functions do this themselves after a change."""
        self._set_up(self._task(task))

    @simOMPL("345")
    def solve(self, task: Handle, maxTime: Number) -> Any:
        """Search for a path for at most `maxTime` (s); return whether one was found, possibly an approximate one."""
        return self._answer(self._plan(task, lambda problem: problem.solve(*numbers([maxTime], 1))))

    @simOMPL("345")
    def simplifyPath(self, task: Handle, maxSimplificationTime: Number = -1.0) -> None:
        """Shorten the path, for at most a time (s; negative: as long as it takes)."""
        self._plan(task, lambda problem: problem.simplify(maxSimplificationTime))

    @simOMPL("345")
    def interpolatePath(self, task: Handle, stateCnt: int = 0) -> None:
        """Add states to the path, up to `stateCnt`."""
        self._plan(task, lambda problem: problem.interpolate(int(stateCnt)))

    @simOMPL("345")
    def getPath(self, task: Handle) -> list[float]:
        """Return the states of the path, one after the other."""
        return self._problem(task).path()

    @simOMPL("345")
    def compute(
        self, task: Handle, maxTime: Number, maxSimplificationTime: Number = -1.0, stateCnt: int = 0
    ) -> tuple[Any, list[float]]:
        """Search for a path, shorten it and add states; return whether one was found, and its states.

        A second call begins a new search.
        """
        if self._problem(task).is_used:
            self._set_up(self._task(task))

        def plan(problem: Problem) -> list[float]:
            if not problem.solve(*numbers([maxTime], 1)):
                return []
            problem.simplify(maxSimplificationTime)
            problem.interpolate(int(stateCnt))
            return problem.path()

        path = self._plan(task, plan)
        return self._answer(bool(path)), path

    @simOMPL("45")
    def hasExactSolution(self, task: Handle) -> bool:
        """Return whether a path to the goal was found."""
        return bool(self._problem(task).definition.hasExactSolution())

    @simOMPL("45")
    def hasApproximateSolution(self, task: Handle) -> bool:
        """Return whether the path that was found does not reach the goal."""
        return bool(self._problem(task).definition.hasApproximateSolution())

    def _answer(self, value: bool) -> bool | int:
        """Return a truth value as a number for a script of V-REP 3.x."""
        return int(value) if any(name.startswith(_FLAT) for name in getattr(self._host, "flat_names", ())) else value

    def _problem(self, handle: int) -> Problem:
        task = self._task(handle)
        return task.problem or self._set_up(task)

    def _set_up(self, task: _Task) -> Problem:
        if not task.start or not task.goals:
            raise ValueError(f"task '{task.name}' needs a state space, a start state and a goal state")
        if task.callback and task.algorithm in WITH_THREADS:
            raise ValueError(f"{task.algorithm} cannot call a function of the script: choose RRTConnect, for example")
        is_valid = functools.partial(self._is_accepted if task.callback else self._is_free, task)
        how = task.resolution, task.algorithm, task.start, task.goals
        task.problem = Problem(task.components, is_valid, *how, next(self._seeds))
        return task.problem

    def _plan(self, handle: int, action: Callable[[Problem], Any]) -> Any:
        """Return the result of a search; afterwards everything is where it was."""
        task, problem = self._task(handle), self._problem(handle)
        moved = None if task.callback else [part.handle for part in task.components]

        def plan() -> Any:
            restore, turns = self._services.keep_places(moved), self._services.turns
            leave, turns.leave = turns.leave, lambda: False  # a thread cannot be switched inside OMPL
            try:
                return action(problem)
            finally:
                turns.leave = leave
                restore()

        result = plan() if task.callback else self._services.outside(plan)
        if problem.failure is not None:
            task.problem = None
            raise ValueError(str(problem.failure)) from None
        return result

    # ---- states

    @simOMPL("345")
    def readState(self, task: Handle) -> list[float]:
        """Return the present state: where the objects and joints of a task are."""
        return [number for part in self._task(task).components for number in self._read(part)]

    @simOMPL("345")
    def writeState(self, task: Handle, state: Numbers) -> None:
        """Move the objects and joints of a task to a state."""
        self._write(self._task(task), self._state(task, state))

    @simOMPL("345")
    def isStateValid(self, task: Handle, state: Numbers) -> Any:
        """Return whether a state is valid: free of collisions, or as the script's function says."""
        values = self._state(task, state)
        return self._answer(self._plan(task, lambda problem: problem.is_state_valid(values)))

    @simOMPL("45")
    def isStateWithinBounds(self, task: Handle, state: Numbers) -> bool:
        """Return whether a state is within the bounds of the state spaces."""
        return self._problem(task).is_within_bounds(self._state(task, state))

    @simOMPL("45")
    def getPathStateCount(self, task: Handle, path: Numbers) -> int:
        """Return the number of states of a path."""
        return len(path) // max(1, self._task(task).size)

    @simOMPL("45")
    def getPathState(self, task: Handle, path: Numbers, index: int) -> list[float]:
        """Return a state of a path by its index, from 1; -1 is the last one."""
        count, size = self.getPathStateCount(task, path), self._task(task).size
        place = int(index) - 1 if index > 0 else count + int(index)
        if not 0 <= place < count:
            raise ValueError(f"a path of {count} states has no state {index}")
        return list(path[place * size : (place + 1) * size])

    @simOMPL("5")
    def drawPath(
        self,
        task: Handle,
        path: Numbers,
        lineSize: Number = 2,
        color: ThreeNumbers = (1, 0, 0),
        extraAttributes: int = 0,
    ) -> list[int]:
        """Draw the positions of a path in space as a line; return the handles of the drawing objects."""
        parts = self._task(task).components
        first = next((index for index, part in enumerate(parts) if SIZES[part.kind][1] == 3), None)
        if first is None:
            raise ValueError("the states of the task have no position in space")
        start = sum(SIZES[part.kind][0] for part in parts[:first])
        count, kind = self.getPathStateCount(task, path), CONSTANTS["drawing_linestrip"] + int(extraAttributes)
        drawing = self._drawings.addDrawingObject(kind, lineSize, 0.0, WORLD, max(1, count), color)
        for index in range(count):
            self._drawings.addDrawingObjectItem(drawing, self.getPathState(task, path, index + 1)[start : start + 3])
        return [drawing]

    @simOMPL("5")
    def removeDrawingObjects(self, task: Handle, dwos: Sequence[Handle]) -> None:
        """Remove drawing objects."""
        self._task(task)
        for drawing in dwos:
            self._drawings.removeDrawingObject(drawing)

    def _read(self, part: Component) -> Sequence[float]:
        if part.kind.endswith("joint_position"):
            return [self._found(part.handle, Joint, "a joint").value]
        matrix = self._objects.matrix(part.handle, part.reference)
        place = frames.position(matrix)[: SIZES[part.kind][1]]
        if part.kind == "pose3d":
            return [*place, *frames.to_quaternion(matrix)]
        return place if part.kind.startswith("position") else [*place, frames.to_euler(matrix)[2]]

    def _write(self, task: _Task, state: Sequence[float]) -> None:
        values = iter(state)
        for part in task.components:
            size, bounded = SIZES[part.kind]
            own = list(itertools.islice(values, size))
            if part.kind.endswith("joint_position"):
                self._found(part.handle, Joint, "a joint").place(own[0])
                continue
            before = self._objects.matrix(part.handle, part.reference)
            place = [*own[:bounded], before[11]][:3]
            if part.kind.startswith("position"):
                self._objects.set_position(part.handle, part.reference, place)
                continue
            if part.kind == "pose3d":
                matrix = frames.from_quaternion(place, unit(own[3:]))
            else:
                matrix = frames.from_euler(place, [*frames.to_euler(before)[:2], own[2]])
            self._objects.set_matrix(part.handle, part.reference, matrix)

    def _is_free(self, task: _Task, state: list[float]) -> bool:
        """Return whether no pair collides in a state."""
        self._write(task, state)
        return not any(self._collisions.checkCollision(*pair)[0] for pair in task.pairs)

    def _is_accepted(self, task: _Task, state: list[float]) -> Any:
        """Return whether the script's function says that a state is valid."""
        scripts = self._context.scripts
        script = scripts.attached_to(self._host.own_script, self._host.script_type).script
        if not scripts.are_own or script is None:
            raise ValueError("a remote client has no functions that simOMPL can call")
        return script.call_own(task.callback, [state])
