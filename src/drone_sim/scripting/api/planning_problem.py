"""A planning problem of the library OMPL, with states as lists of numbers."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple

IS_INSTALLED = find_spec("ompl") is not None

# Numbers of a state, and those that have bounds.
SIZES = {
    "position2d": (2, 2),
    "pose2d": (3, 2),
    "position3d": (3, 3),
    "pose3d": (7, 3),
    "joint_position": (1, 1),
    "dubins": (3, 2),
    "cyclic_joint_position": (1, 0),
}
# Planners of CoppeliaSim that the package does not have, and those that plan instead.
SUBSTITUTES = {
    "BiTRRT": "RRTConnect",
    **dict.fromkeys(("LazyRRT", "TRRT"), "RRT"),
    **dict.fromkeys(("CForest", "LBTRRT"), "RRTstar"),
    **dict.fromkeys(("EST", "PDST", "STRIDE"), "KPIECE1"),
    "SBL": "BKPIECE1",
    **dict.fromkeys(("LazyPRM", "SPARS", "SPARStwo"), "PRM"),
    "LazyPRMstar": "PRMstar",
}
WITH_THREADS = ("PRM", "PRMstar")  # an exception that passes through them would end the process
_MOST_STATES = 100_000
_LONGEST = 600.0  # s of a search, during which the simulation stands still


class Component(NamedTuple):
    """A part of the state: the pose of an object in the frame `reference`, or the position of a joint."""

    kind: str  # in SIZES
    handle: int
    low: Sequence[float]
    high: Sequence[float]
    is_projected: bool
    weight: float
    reference: int
    turning_radius: float = 0.05  # m, for `dubins`
    is_symmetric: bool = False


class Problem:
    """A planning problem, with its planner."""

    def __init__(
        self,
        components: Sequence[Component],
        is_valid: Callable[[list[float]], Any],
        resolution: float,
        algorithm: str,
        start: Sequence[float],
        goals: Sequence[Sequence[float]],
        seed: int,
    ):
        """Search with the planner `algorithm` a path from `start` to one of the `goals`.

        `resolution` of the checks of motions: a share of the space's extent. `seed`: of the random numbers.
        """
        from ompl import base, geometric, util  # optional

        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(seed)
        self._base, self._geometric = base, geometric
        self._check = is_valid
        self._condition: Any = None
        self.failure: Exception | None = None  # raised by a check; it ends the search
        self.is_used = False
        spaces = [_space(base, component) for component in components]
        self._space = spaces[0]
        if len(spaces) > 1:
            self._space = base.CompoundStateSpace()
            for space, component in zip(spaces, components):
                self._space.addSubspace(space, component.weight)
            projected = next((index for index, part in enumerate(components) if part.is_projected), 0)
            self._space.registerDefaultProjection(base.SubspaceProjectionEvaluator(self._space, projected))
        self._size = sum(SIZES[component.kind][0] for component in components)
        self._info = base.SpaceInformation(self._space)
        # OMPL would keep this problem in memory forever if the function referred to it.
        check = weakref.WeakMethod(self._is_valid)
        self._info.setStateValidityChecker(lambda state: check()(state))  # type: ignore[misc]
        self._info.setStateValidityCheckingResolution(resolution)
        self._info.setup()
        goal = base.GoalStates(self._info)
        for state in goals:
            goal.addState(self._state(state))
        self.definition = base.ProblemDefinition(self._info)
        self.definition.addStartState(self._state(start))
        self.definition.setGoal(goal)
        self._planner = getattr(geometric, algorithm)(self._info)
        self._planner.setProblemDefinition(self.definition)
        self._planner.setup()

    def _is_valid(self, state: Any) -> bool:
        if self.failure is None:
            try:
                return bool(self._check(self._numbers(state)))
            except Exception as error:
                self.failure = error
                if self._condition is not None:
                    self._condition.terminate()
        return False

    # ---- states

    def _state(self, numbers: Sequence[float]) -> Any:
        """Return OMPL's state with these numbers."""
        state = self._info.allocState()
        self._space.copyFromReals(state, list(numbers))
        return state

    def _numbers(self, state: Any) -> list[float]:
        """Return the numbers of OMPL's state."""
        return [self._space.getValueAddressAtIndex(state, index) for index in range(self._size)]

    def is_state_valid(self, numbers: Sequence[float]) -> bool:
        """Return whether a state is valid, also beyond the bounds."""
        return bool(self._info.isValid(self._state(numbers)))

    def is_within_bounds(self, numbers: Sequence[float]) -> bool:
        return bool(self._info.satisfiesBounds(self._state(numbers)))

    # ---- paths

    def solve(self, seconds: float) -> bool:
        """Search for a path for at most `seconds`; return whether one was found, possibly an approximate one."""
        if not 0 < seconds <= _LONGEST:
            raise ValueError(f"a search for {seconds:g} s: must take more than 0 and at most {_LONGEST:g} s")
        self.is_used = True
        self._condition = self._base.timedPlannerTerminationCondition(seconds)
        return bool(self._planner.solve(self._condition))

    def simplify(self, seconds: float) -> None:
        """Shorten the path; a negative time does not limit it."""
        simplifier = self._geometric.PathSimplifier(self._info, self.definition.getGoal())
        if seconds < 0:
            simplifier.simplifyMax(self._path())
        else:
            simplifier.simplify(self._path(), seconds)

    def interpolate(self, count: int) -> None:
        """Add states to the path, up to `count`; 0: as the resolution of the checks demands."""
        if not 0 <= count <= _MOST_STATES:
            raise ValueError(f"a path has at most {_MOST_STATES} states")
        self._path().interpolate(*[count] if count else [])

    def path(self) -> list[float]:
        """Return the numbers of all states of the path."""
        return [number for state in self._path().getStates() for number in self._numbers(state)]

    def _path(self) -> Any:
        path = self.definition.getSolutionPath()
        if path is None:
            raise ValueError("there is no path yet: solve found none")
        return path


def _space(base: Any, part: Component) -> Any:
    """Return OMPL's state space of a component."""
    size, bounded = SIZES[part.kind]
    makers: dict[str, Callable[[], Any]] = {
        "pose2d": base.SE2StateSpace,
        "pose3d": base.SE3StateSpace,
        "dubins": lambda: base.DubinsStateSpace(part.turning_radius, part.is_symmetric),
        "cyclic_joint_position": base.SO2StateSpace,
    }
    space = makers.get(part.kind, lambda: base.RealVectorStateSpace(size))()
    if bounded:
        bounds = base.RealVectorBounds(bounded)
        for index, (low, high) in enumerate(zip(part.low, part.high)):
            bounds.setLow(index, low)
            bounds.setHigh(index, high)
        space.setBounds(bounds)
    return space
