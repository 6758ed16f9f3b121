"""`sim`: trajectories that a script follows itself (Reflexxes, 3.x; Ruckig, 4.3), and motions in threads (4.x).

Both have limited velocity, acceleration and jerk. In every step of a motion, the script's callback is called with its
state; without a callback, the joints or the object are moved. A motion ends in the step in which it reaches its exact
end, or as soon as the callback returns true.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.joint import KINEMATIC, SPHERICAL, Joint
from drone_sim.mechanics.saved_state import Restore
from drone_sim.mechanics.trajectory import NONE, PHASE, TIME, Limits, State, Trajectory
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.control import Action, Call, Steps, Wait
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.matrices import axis_and_angle, between, from_pose, to_pose
from drone_sim.scripting.api.types import Handle, Number, Numbers, WrongValue, numbers
from drone_sim.scripting.api.unknown import PLUGINS

ABORTED = 2  # result of a step if the script's callback has returned true
_MOST_MOTIONS = 1000  # of one script
_MOST_TRAJECTORIES = 1000  # of one script
_SYNCHRONIZATION = (PHASE, TIME, PHASE, NONE)  # by the two lowest bits of the flags
_LEAST_VELOCITY, _LEAST_ACCELERATION = CONSTANTS["ruckig_minvel"], CONSTANTS["ruckig_minaccel"]
_AT_ONCE = {"maxVel": 9999.0, "maxAccel": 99999.0, "maxJerk": 9999999.0}  # with a step of 10 s, as in CoppeliaSim
# Arguments before 4.6.
_CONFIG = (
    *("flags", "pos", "vel", "accel", "maxVel", "maxAccel", "maxJerk", "targetPos", "targetVel"),
    *("callback", "auxData", "cyclicJoints", "timeStep"),
)
_POSE = (
    *("flags", "pose", "maxVel", "maxAccel", "maxJerk", "targetPose"),
    *("callback", "auxData", "metric", "timeStep"),
)
Parameters = dict[str, Any]


def _synchronization(flags: int, default: str) -> str:
    """Return how degrees of freedom are synchronized; `default` if the flags are -1."""
    return default if flags < 0 else _SYNCHRONIZATION[int(flags) & 3]


class TrajectoryFunctions:
    """Trajectories with limited velocity, acceleration and jerk, which a script follows itself."""

    def __init__(self) -> None:
        self._trajectories: dict[int, Trajectory] = {}
        self._handles = itertools.count(1)

    @sim("5", rmlPos="45", RMLPos="3")
    def ruckigPos(
        self,
        dofs: int,
        _smallestTimeStep: Number,
        flags: int,
        currentPosVelAccel: Numbers,
        maxVelAccelJerk: Numbers,
        selection: Sequence[bool],
        targetPosVel: Numbers,
    ) -> int:
        """Start a trajectory of `dofs` degrees of freedom to positions and velocities; return its handle.

        Each list has `dofs` numbers of the first quantity, then of the next. `flags`: sim.ruckig_phasesync, _timesync
        (-1) or _nosync, and _minvel, _minaccel if minima follow in maxVelAccelJerk.
        """
        least = [bool(flags >= 0 and int(flags) & bit) for bit in (_LEAST_VELOCITY, _LEAST_ACCELERATION)]
        count = _count(dofs)
        largest = _quantities("maxVelAccelJerk", maxVelAccelJerk, count, 3 + sum(least))
        minima = iter(largest[3:])
        limits = Limits(*largest[:3], *(next(minima) if is_given else None for is_given in least))
        position, velocity = _quantities("targetPosVel", targetPosVel, count, 2)
        start = State(*_quantities("currentPosVelAccel", currentPosVelAccel, count, 3))
        sync = _synchronization(flags, TIME)
        return self._add(Trajectory(start, position, velocity, limits, sync, _selected(selection, count)))

    @sim("5", rmlVel="45", RMLVel="3")
    def ruckigVel(
        self,
        dofs: int,
        _smallestTimeStep: Number,
        flags: int,
        currentPosVelAccel: Numbers,
        maxAccelJerk: Numbers,
        selection: Sequence[bool],
        targetVel: Numbers,
    ) -> int:
        """Start a trajectory of `dofs` degrees of freedom to velocities, like ruckigPos; return its handle."""
        least = bool(flags >= 0 and int(flags) & _LEAST_ACCELERATION)
        count = _count(dofs)
        acceleration, jerk, *minima = _quantities("maxAccelJerk", maxAccelJerk, count, 2 + least)
        (velocity,) = _quantities("targetVel", targetVel, count, 1)
        limits = Limits([float("inf")] * count, acceleration, jerk, None, *minima)
        start = State(*_quantities("currentPosVelAccel", currentPosVelAccel, count, 3))
        sync = _synchronization(flags, TIME)
        return self._add(Trajectory(start, None, velocity, limits, sync, _selected(selection, count)))

    @sim("5", rmlStep="45", RMLStep="3")
    def ruckigStep(self, handle: Handle, timeStep: Number) -> tuple[int, list[float], float]:
        """Advance a trajectory by a time in s; return 0, or 1 at its end, the state, and the time left in s.

        The state is positions, velocities and accelerations, in one list.
        """
        trajectory, (seconds,) = self._trajectory(handle), numbers((timeStep,), 1)
        if seconds <= 0:
            raise WrongValue("the time step must be greater than 0")
        state = trajectory.advance(seconds)
        return (
            int(trajectory.is_over),
            [value for quantity in state for value in quantity],
            trajectory.duration - trajectory.elapsed,
        )

    @sim("5", rmlRemove="45", RMLRemove="3")
    def ruckigRemove(self, handle: Handle) -> None:
        """Remove a trajectory."""
        self._trajectory(handle)
        del self._trajectories[handle]

    def save_state(self) -> Restore:
        """Return a function that restores the present trajectories and their elapsed times."""
        kept = {handle: (trajectory, trajectory.elapsed) for handle, trajectory in self._trajectories.items()}

        def restore() -> None:
            self._trajectories = {handle: trajectory for handle, (trajectory, _) in kept.items()}
            for trajectory, elapsed in kept.values():
                trajectory.elapsed = elapsed

        return restore

    def _add(self, trajectory: Trajectory) -> int:
        if len(self._trajectories) >= _MOST_TRAJECTORIES:
            raise ValueError(f"a script may have at most {_MOST_TRAJECTORIES} trajectories: remove some")
        handle = next(self._handles)
        self._trajectories[handle] = trajectory
        return handle

    def _trajectory(self, handle: int) -> Trajectory:
        if handle not in self._trajectories:
            raise ValueError(f"there is no trajectory with the handle {handle}")
        return self._trajectories[handle]


def _count(dofs: int) -> int:
    if not isinstance(dofs, (int, float)) or not 0 < dofs <= 100:
        raise WrongValue("expected 1 to 100 degrees of freedom")
    return int(dofs)


def _quantities(name: str, values: Any, count: int, quantities: int) -> list[list[float]]:
    """Return a list of `count` numbers for each quantity; surplus numbers are ignored, as in V-REP."""
    total = count * quantities
    if not isinstance(values, Sequence) or len(values) < total:
        raise WrongValue(f"{name} must have {total} numbers")
    found = numbers(values[:total], total)
    return [list(found[first : first + count]) for first in range(0, total, count)]


def _selected(selection: Any, count: int) -> list[bool]:
    if not isinstance(selection, Sequence) or len(selection) < count:
        raise WrongValue(f"selection must have {count} values")
    return [bool(value) for value in selection[:count]]


# ---- motions


class Motion:
    """A motion along a trajectory."""

    def __init__(
        self,
        trajectory: Trajectory,
        time_step: float,
        describe: Callable[[State], Parameters],
        move: Callable[[Parameters], None] = lambda _data: None,
        data: Parameters | None = None,
    ):
        """`describe` returns parameters for a state; `move` moves the joints or the object according to them.

        `data` are the script's own parameters, with its `callback`, if any; those of `describe` are added.
        """
        self._trajectory, self._time_step, self._describe, self._move = trajectory, time_step, describe, move
        self.data: Parameters = {**(data or {}), "timeLeft": 0.0}
        self._callback = self.data.pop("callback", None)
        self._legacy: tuple[str, ...] = self.data.pop("legacy", ())

    def step(self) -> Generator[Call | None, Any, int]:
        """Advance by a step; return 0, 1 at the end, or ABORTED."""
        self.data.update(self._describe(self._trajectory.advance(self._time_step)))
        self.data["timeLeft"] = max(0.0, self._trajectory.elapsed - self._trajectory.duration)
        if self._callback is None:
            self._move(self.data)
        else:
            legacy = [self.data.get(name) for name in (*self._legacy, "auxData")]
            if (yield Call(self._callback, legacy if self._legacy else [dict(self.data)])):
                return ABORTED
        return int(self._trajectory.is_over)


class MotionFunctions(Functions):
    """Motions with limited velocity, acceleration and jerk, in threads (4.x)."""

    def __init__(self, *arguments: Any):
        """Create it without motions; `arguments` are those of Functions."""
        super().__init__(*arguments)
        self._motions: dict[int, Motion] = {}
        self._handles = itertools.count(1)

    # ---- joints, or any other numbers

    @sim("5")
    def moveToConfig(self, params: Any, *arguments: Any) -> Wait:
        """Move joints to positions; at the end, return the parameters with `pos`, `vel` and `accel`.

        `params`: `joints` or `pos`, `targetPos`, and `maxVel`, `maxAccel`, `maxJerk` (without these three: at once);
        `vel`, `accel`, `targetVel`, `minVel`, `minAccel`, `flags`, `cyclicJoints`, `callback`, `auxData`, `timeStep`.
        Before 4.6, the arguments are flags, pos, vel, accel, maxVel, maxAccel, maxJerk, targetPos, targetVel, callback,
        auxData, cyclicJoints, timeStep. Then pos, vel, accel and the time left are returned, and passed to the
        callback.
        """
        parameters = _parse_parameters(_CONFIG, params, arguments, ("pos", "vel", "accel"))
        return self.run(self._config(parameters), _result_of(parameters, "pos", "vel", "accel", "timeLeft"))

    @sim("5")
    def moveToConfig_init(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Start a motion like moveToConfig's, for moveToConfig_step; return the parameters and `ruckigObj`."""
        return self._begin(self._config(_parse_parameters(_CONFIG, params, ())))

    @sim("5", moveToPose_step="5")
    def moveToConfig_step(self, data: Mapping[str, Any]) -> Wait:
        """Advance a motion by a step; return 0, 1 at the end or 2 if the callback returned true, and its parameters."""
        motion, result = self._motion(data), [0]

        def step() -> Steps:
            result[0] = yield from motion.step()

        return Action(step(), lambda: (result[0], {**motion.data, "ruckigObj": data["ruckigObj"]}))

    @sim("5", moveToPose_cleanup="5")
    def moveToConfig_cleanup(self, data: Mapping[str, Any]) -> None:
        """Remove a motion that was started with _init."""
        self._motion(data)
        del self._motions[data["ruckigObj"]]

    def _config(self, parameters: Parameters) -> Motion:
        joints = [self._movable(handle) for handle in parameters.get("joints") or ()]
        if "pos" not in parameters:
            parameters["pos"] = [joint.value for joint in joints]
        start = _numbers(parameters, "pos", len(joints) or None)
        target = _numbers(parameters, "targetPos", len(start))
        for index, is_cyclic in zip(range(len(start)), _cyclic(parameters, start)):
            if is_cyclic:  # the equivalent position in the shorter direction
                target[index] = start[index] + math.remainder(target[index] - start[index], math.tau)
        return Motion(
            self._trajectory(parameters, start, target),
            self._time_step(parameters),
            lambda state: dict(zip(("pos", "vel", "accel"), state)),
            lambda data: move_joints(joints, data["pos"]),
            parameters,
        )

    def _movable(self, handle: int) -> Joint:
        joint = self._found(handle, Joint, "a joint of the scene")
        if joint.motion == SPHERICAL:
            raise WrongValue(f"'{joint.name}' is spherical: it has no position")
        return joint

    # ---- poses

    @sim("5")
    def moveToPose(self, params: Any, *arguments: Any) -> Wait:
        """Move an object to a pose; at the end, return the parameters with `pose`, `matrix`, `vel` and `accel`.

        `params`: `object` (and `relObject`) or `pose`, `targetPose`, and `maxVel`, `maxAccel`, `maxJerk`. These limits
        apply to x, y, z and the angle; with `metric`, four weights, they apply to the weighted distance. The other
        parameters are those of moveToConfig. Before 4.6: flags, pose, maxVel, maxAccel, maxJerk, targetPose, callback,
        auxData, metric, timeStep.
        """
        parameters = _parse_parameters(_POSE, params, arguments, ("pose", "vel", "accel"))
        place = "pose" if len(parameters.get("pose") or ()) != 12 else "matrix"
        if "legacy" in parameters:
            parameters["legacy"] = (place, "vel", "accel")
        return self.run(self._pose(parameters), _result_of(parameters, place, "timeLeft"))

    @sim("5")
    def moveToPose_init(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Start a motion like moveToPose's, for moveToPose_step; return the parameters and `ruckigObj`."""
        return self._begin(self._pose(_parse_parameters(_POSE, params, ())))

    def _pose(self, parameters: Parameters) -> Motion:
        if parameters.get("ik") is not None:
            raise ValueError(f"ik: {PLUGINS['simIK']}; `callback` is called in every step")
        moved, relative = parameters.get("object"), parameters.get("relObject", -1)
        if "pose" not in parameters:
            if moved is None:
                raise ValueError("`object` or `pose` must be given")
            parameters["pose"] = to_pose(self._objects.matrix(moved, relative))
        start, goal = (_matrix_of(parameters, name) for name in ("pose", "targetPose"))
        way = [b - a for a, b in zip(frames.position(start), frames.position(goal))]
        turn = axis_and_angle(frames.to_quaternion(frames.multiply(frames.invert(start), goal)))[1]
        goals = [*way, turn]
        if "metric" in parameters:  # one number for all four
            goals = [math.hypot(*(one * much for one, much in zip(goals, numbers(parameters["metric"], 4))))]

        def seen(state: State) -> Parameters:
            m = list(goal)
            if state.position != goals:
                m = list(between(start, goal, state.position[-1] / goals[-1] if goals[-1] else 0.0))
                if len(goals) > 1:
                    m[3], m[7], m[11] = (a + b for a, b in zip(frames.position(start), state.position))
            return {"pose": to_pose(m), "matrix": m, "vel": state.velocity, "accel": state.acceleration}

        return Motion(
            self._trajectory(parameters, [0.0] * len(goals), goals),
            self._time_step(parameters),
            seen,
            lambda data: None if moved is None else self._objects.set_matrix(moved, relative, data["matrix"]),
            parameters,
        )

    # ---- both

    def move(self, parameters: Parameters, value: Callable[[Parameters], Any]) -> Wait:
        """Move like moveToConfig if `parameters` have `joints`, otherwise like moveToPose; surplus numbers are ignored.

        `value` returns the API function's result for the motion's data.
        """
        parameters = {name: one for name, one in parameters.items() if one is not None}
        return self.run(
            (self._config if "joints" in parameters else self._pose)({**parameters, "legacy": ("vel",)}), value
        )

    def run(self, motion: Motion, value: Callable[[Parameters], Any]) -> Wait:
        """Return the wait for the end of a motion; `value` returns the API function's result for the motion's data."""

        def steps() -> Steps:
            over = 0
            while not over and not self._context.control.is_exit_requested:
                over = yield from motion.step()
                yield None

        return Action(steps(), lambda: value(motion.data))

    def _begin(self, motion: Motion) -> dict[str, Any]:
        if len(self._motions) >= _MOST_MOTIONS:
            raise ValueError(f"a script may have at most {_MOST_MOTIONS} motions: clean some up")
        handle = next(self._handles)
        self._motions[handle] = motion
        return {**motion.data, "ruckigObj": handle}

    def _motion(self, data: Any) -> Motion:
        handle = data.get("ruckigObj") if isinstance(data, Mapping) else None
        if handle not in self._motions:
            raise WrongValue("expected the value that moveToConfig_init or moveToPose_init returned")
        return self._motions[handle]

    def _trajectory(self, parameters: Parameters, start: Sequence[float], goal: Sequence[float]) -> Trajectory:
        count, flags = len(start), int(parameters.get("flags", -1))
        bits = max(flags, 0)
        if not any(parameters.get(name) for name in _AT_ONCE):
            parameters.update({name: [most] * count for name, most in _AT_ONCE.items()}, timeStep=10.0)
        still = [0.0] * count
        state = State(
            list(start), _numbers(parameters, "vel", count, still), _numbers(parameters, "accel", count, still)
        )
        velocity, acceleration, jerk = (_numbers(parameters, name, count) for name in _AT_ONCE)
        limits = Limits(
            velocity,
            acceleration,
            jerk,
            _least(parameters, "minVel", "maxVel", count, bits & _LEAST_VELOCITY),
            _least(parameters, "minAccel", "maxAccel", count, bits & _LEAST_ACCELERATION),
        )
        target = _numbers(parameters, "targetVel", count, still)
        return Trajectory(state, goal, target, limits, _synchronization(flags, PHASE))

    def _time_step(self, parameters: Parameters) -> float:
        (seconds,) = numbers((parameters.get("timeStep") or self._context.clock.time_step,), 1)
        if seconds <= 0:
            raise WrongValue(f"timeStep = {seconds:g}: must be greater than 0")
        return seconds


def move_joints(joints: Sequence[Joint], positions: Sequence[float]) -> None:
    """Set target positions of joints that the dynamics moves, and positions of the others."""
    for joint, position in zip(joints, positions):
        if joint.drive is not None and joint.control.mode != KINEMATIC:
            joint.change(position=position)
        else:
            joint.place(position)


def _parse_parameters(
    names: Sequence[str], params: Any, arguments: Sequence[Any], legacy: tuple[str, ...] = ()
) -> Parameters:
    """Return parameters by name, without None. `legacy`: names of the callback's arguments before 4.6."""
    if isinstance(params, Mapping):
        found = dict(params)
    elif legacy and isinstance(params, (int, float)) and len(arguments) < len(names):
        found = {**dict(zip(names, (params, *arguments))), "legacy": legacy}
    else:
        raise WrongValue("expected a table of parameters")
    return {name: value for name, value in found.items() if value is not None}


def _result_of(parameters: Parameters, *names: str) -> Callable[[Parameters], Any]:
    """Return a function that selects the result from a motion's data: all data, or before 4.6 these names."""
    if "legacy" not in parameters:
        return lambda data: data
    return lambda data: tuple(data[name] for name in names)


def _numbers(parameters: Parameters, name: str, count: int | None, otherwise: list[float] | None = None) -> list[float]:
    """Return `count` numbers (None: all). Before 4.6, there may be more, which are ignored."""
    values = parameters.get(name, otherwise)
    if not isinstance(values, Sequence) or isinstance(values, (str, bytes)) or not values:
        raise WrongValue(f"`{name}`: a list of {f'{count} ' if count else ''}numbers must be given")
    if count and "legacy" in parameters:
        values = values[:count]
    try:
        return list(numbers(values, count or len(values)))
    except WrongValue as error:
        raise WrongValue(f"`{name}`: {error}") from None


def _least(parameters: Parameters, name: str, most: str, count: int, is_behind: int) -> list[float] | None:
    """Return the lower limits for the upper limits `most`; before 4.6, they may follow in the same list."""
    if "legacy" in parameters and is_behind:
        return list(numbers(parameters[most][count : 2 * count], count))
    return _numbers(parameters, name, count) if name in parameters else None


def _cyclic(parameters: Parameters, start: Sequence[float]) -> Sequence[bool]:
    found = parameters.get("cyclicJoints") or [False] * len(start)
    if not isinstance(found, Sequence) or len(found) < len(start):
        raise WrongValue(f"`cyclicJoints`: {len(start)} values must be given")
    return found


def _matrix_of(parameters: Parameters, name: str) -> frames.Matrix:
    values = _numbers(parameters, name, None)
    if len(values) not in (7, 12):
        raise WrongValue(f"`{name}`: expected a pose of 7 numbers or a matrix of 12, not {len(values)} numbers")
    return from_pose(values) if len(values) == 7 else numbers(values, 12)
