"""`sim`: motions within limits of velocity, acceleration and jerk, in threads (4.x).

In every step the script's own function is called with what the motion has come to; without one, the joints or the
object are put there. A motion ends in the step that reaches its end, exactly there, or as soon as the function returns
true.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.joint import KINEMATIC, SPHERICAL, Joint
from drone_sim.mechanics.trajectory import PHASE, Limits, State, Trajectory
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.control import Action, Call, Steps, Wait
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.matrices import axis_and_angle, between, from_pose, to_pose
from drone_sim.scripting.api.trajectories import LEAST_ACCELERATION, LEAST_VELOCITY, synchronization
from drone_sim.scripting.api.types import WrongValue, numbers
from drone_sim.scripting.api.unknown import PLUGINS

ABORTED = 2  # what a step returns after the script's function has returned true
_MOST = 1000  # of one script
_AT_ONCE = {"maxVel": 9999.0, "maxAccel": 99999.0, "maxJerk": 9999999.0}  # and a step of 10 s, as CoppeliaSim has them
_CONFIG = (
    "flags",
    "pos",
    "vel",
    "accel",
    "maxVel",
    "maxAccel",
    "maxJerk",
    "targetPos",
    "targetVel",
    "callback",
    "auxData",
    "cyclicJoints",
    "timeStep",
)
_POSE = (
    "flags",
    "pose",
    "maxVel",
    "maxAccel",
    "maxJerk",
    "targetPose",
    "callback",
    "auxData",
    "metric",
    "timeStep",
)
Parameters = dict[str, Any]


class Motion:
    """A motion along a trajectory: `seen` makes parameters of its state, `put` puts the joints or the object there."""

    def __init__(
        self,
        trajectory: Trajectory,
        time_step: float,
        seen: Callable[[State], Parameters],
        put: Callable[[Parameters], None] = lambda _data: None,
        data: Parameters | None = None,
    ):
        """`data` are the script's own parameters, among them its `callback`, if any; `seen` adds to them."""
        self._trajectory, self._time_step, self._seen, self._put = trajectory, time_step, seen, put
        self.data: Parameters = {**(data or {}), "timeLeft": 0.0}
        self._callback = self.data.pop("callback", None)
        self._legacy: tuple[str, ...] = self.data.pop("legacy", ())

    def step(self) -> Generator[Call | None, Any, int]:
        """Move once; return 0, 1 at the end, or ABORTED."""
        self.data.update(self._seen(self._trajectory.advance(self._time_step)))
        self.data["timeLeft"] = max(0.0, self._trajectory.elapsed - self._trajectory.duration)
        if self._callback is None:
            self._put(self.data)
        elif (yield Call(self._callback, self._told())):
            return ABORTED
        return int(self._trajectory.is_over)

    def _told(self) -> list[Any]:
        return [self.data.get(name) for name in (*self._legacy, "auxData")] if self._legacy else [dict(self.data)]


class MotionFunctions(Functions):
    """Motions within limits of velocity, acceleration and jerk, in threads (4.x)."""

    def __init__(self, *seen: Any):
        """Take what all functions take."""
        super().__init__(*seen)
        self._motions: dict[int, Motion] = {}
        self._handles = itertools.count(1)

    # ---- joints, or any other numbers

    @sim("5")
    def moveToConfig(self, params: Any, *arguments: Any) -> Wait:
        """Move joints to positions, and return when they are there: what was given, with `pos`, `vel`, `accel`.

        `params`: `joints` or `pos`, `targetPos`, and `maxVel`, `maxAccel`, `maxJerk` (without these three: at once);
        `vel`, `accel`, `targetVel`, `minVel`, `minAccel`, `flags`, `cyclicJoints`, `callback`, `auxData`, `timeStep`.
        Before 4.6 they come one after the other: flags, pos, vel, accel, maxVel, maxAccel, maxJerk, targetPos,
        targetVel, callback, auxData, cyclicJoints, timeStep; then the four are returned, and the callback gets them.
        """
        given = _given(_CONFIG, params, arguments, ("pos", "vel", "accel"))
        return self.run(self._config(given), _returned(given, "pos", "vel", "accel", "timeLeft"))

    @sim("5")
    def moveToConfig_init(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Begin a motion as moveToConfig's, which moveToConfig_step moves on; return what was given and `ruckigObj`."""
        return self._begin(self._config(_given(_CONFIG, params, ())))

    @sim("5", moveToPose_step="5")
    def moveToConfig_step(self, data: Mapping[str, Any]) -> Wait:
        """Move once; return 0, 1 at the end or 2 where the script's function returned true, and how things are."""
        motion, result = self._motion(data), [0]

        def step() -> Steps:
            result[0] = yield from motion.step()

        return Action(step(), lambda: (result[0], {**motion.data, "ruckigObj": data["ruckigObj"]}))

    @sim("5", moveToPose_cleanup="5")
    def moveToConfig_cleanup(self, data: Mapping[str, Any]) -> None:
        """Forget a motion that was begun with _init."""
        self._motion(data)
        del self._motions[data["ruckigObj"]]

    def _config(self, given: Parameters) -> Motion:
        joints = [self._movable(handle) for handle in given.get("joints") or ()]
        if "pos" not in given:
            given["pos"] = [joint.value for joint in joints]
        start = _numbers(given, "pos", len(joints) or None)
        target = [_near(*one) for one in zip(_numbers(given, "targetPos", len(start)), start, _cyclic(given, start))]
        return Motion(
            self._trajectory(given, start, target),
            self._time_step(given),
            lambda state: dict(zip(("pos", "vel", "accel"), state)),
            lambda data: move_joints(joints, data["pos"]),
            given,
        )

    def _movable(self, handle: int) -> Joint:
        joint = self._found(handle, Joint, "a joint of the scene")
        if joint.motion == SPHERICAL:
            raise WrongValue(f"'{joint.name}' is spherical: it has no position")
        return joint

    # ---- poses

    @sim("5")
    def moveToPose(self, params: Any, *arguments: Any) -> Wait:
        """Move an object to a pose, and return when it is there: what was given, with `pose`, `matrix`, `vel`, `accel`.

        `params`: `object` (and `relObject`) or `pose`, `targetPose`, and `maxVel`, `maxAccel`, `maxJerk`. These limits
        are for x, y, z and the angle; with `metric`, four weights of these, they are for the weighted distance. The
        rest is as for moveToConfig. Before 4.6: flags, pose, maxVel, maxAccel, maxJerk, targetPose, callback, auxData,
        metric, timeStep.
        """
        given = _given(_POSE, params, arguments, ("pose", "vel", "accel"))
        place = "pose" if len(given.get("pose") or ()) != 12 else "matrix"
        if "legacy" in given:
            given["legacy"] = (place, "vel", "accel")
        return self.run(self._pose(given), _returned(given, place, "timeLeft"))

    @sim("5")
    def moveToPose_init(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Begin a motion as moveToPose's, which moveToPose_step moves on; return what was given, and `ruckigObj`."""
        return self._begin(self._pose(_given(_POSE, params, ())))

    def _pose(self, given: Parameters) -> Motion:
        if given.get("ik") is not None:
            raise ValueError(f"ik: {PLUGINS['simIK']}; `callback` is called in every step")
        moved, relative = given.get("object"), given.get("relObject", -1)
        if "pose" not in given:
            if moved is None:
                raise ValueError("`object` or `pose` must be given")
            given["pose"] = to_pose(self._objects.matrix(moved, relative))
        start, goal = (_place(given, name) for name in ("pose", "targetPose"))
        way = [b - a for a, b in zip(frames.position(start), frames.position(goal))]
        turn = axis_and_angle(frames.to_quaternion(frames.multiply(frames.invert(start), goal)))[1]
        goals = [*way, turn]
        if "metric" in given:  # one number for all four
            goals = [math.hypot(*(one * much for one, much in zip(goals, numbers(given["metric"], 4))))]

        def seen(state: State) -> Parameters:
            m = list(goal)
            if state.position != goals:
                m = list(between(start, goal, state.position[-1] / goals[-1] if goals[-1] else 0.0))
                if len(goals) > 1:
                    m[3], m[7], m[11] = (a + b for a, b in zip(frames.position(start), state.position))
            return {"pose": to_pose(m), "matrix": m, "vel": state.velocity, "accel": state.acceleration}

        return Motion(
            self._trajectory(given, [0.0] * len(goals), goals),
            self._time_step(given),
            seen,
            lambda data: None if moved is None else self._objects.set_matrix(moved, relative, data["matrix"]),
            given,
        )

    # ---- both

    def move(self, given: Parameters, value: Callable[[Parameters], Any]) -> Wait:
        """Move like moveToConfig if there are `joints`, otherwise like moveToPose; surplus numbers are ignored.

        `value` makes the function's return value from the motion's data.
        """
        given = {name: one for name, one in given.items() if one is not None}
        return self.run((self._config if "joints" in given else self._pose)({**given, "legacy": ("vel",)}), value)

    def run(self, motion: Motion, value: Callable[[Parameters], Any]) -> Wait:
        """Return the wait for the end of a motion; `value` makes the function's return value from the motion's data."""

        def steps() -> Steps:
            over = 0
            while not over and not self._context.control.is_exit_requested:
                over = yield from motion.step()
                yield None

        return Action(steps(), lambda: value(motion.data))

    def _begin(self, motion: Motion) -> dict[str, Any]:
        if len(self._motions) >= _MOST:
            raise ValueError(f"a script may have at most {_MOST} motions: clean some up")
        handle = next(self._handles)
        self._motions[handle] = motion
        return {**motion.data, "ruckigObj": handle}

    def _motion(self, data: Any) -> Motion:
        handle = data.get("ruckigObj") if isinstance(data, Mapping) else None
        if handle not in self._motions:
            raise WrongValue("expected the value that moveToConfig_init or moveToPose_init returned")
        return self._motions[handle]

    def _trajectory(self, given: Parameters, start: Sequence[float], goal: Sequence[float]) -> Trajectory:
        count, flags = len(start), int(given.get("flags", -1))
        bits = max(flags, 0)
        if not any(given.get(name) for name in _AT_ONCE):
            given.update({name: [most] * count for name, most in _AT_ONCE.items()}, timeStep=10.0)
        still = [0.0] * count
        state = State(list(start), _numbers(given, "vel", count, still), _numbers(given, "accel", count, still))
        velocity, acceleration, jerk = (_numbers(given, name, count) for name in _AT_ONCE)
        limits = Limits(
            velocity,
            acceleration,
            jerk,
            _least(given, "minVel", "maxVel", count, bits & LEAST_VELOCITY),
            _least(given, "minAccel", "maxAccel", count, bits & LEAST_ACCELERATION),
        )
        target = _numbers(given, "targetVel", count, still)
        return Trajectory(state, goal, target, limits, synchronization(flags, PHASE))

    def _time_step(self, given: Parameters) -> float:
        (seconds,) = numbers((given.get("timeStep") or self._context.clock.time_step,), 1)
        if seconds <= 0:
            raise WrongValue(f"timeStep = {seconds:g}: must be greater than 0")
        return seconds


def move_joints(joints: Sequence[Joint], positions: Sequence[float]) -> None:
    """Let joints that the dynamics moves go to positions, and put the others there."""
    for joint, position in zip(joints, positions):
        if joint.drive is not None and joint.control.mode != KINEMATIC:
            joint.change(position=position)
        else:
            joint.place(position)


def _given(names: Sequence[str], params: Any, arguments: Sequence[Any], told: tuple[str, ...] = ()) -> Parameters:
    """Return parameters by name, without those that are None; `told`: the names that a callback before 4.6 gets."""
    if isinstance(params, Mapping):
        found = dict(params)
    elif told and isinstance(params, (int, float)) and len(arguments) < len(names):
        found = {**dict(zip(names, (params, *arguments))), "legacy": told}
    else:
        raise WrongValue("expected a table of parameters")
    return {name: one for name, one in found.items() if one is not None}


def _returned(given: Parameters, *names: str) -> Callable[[Parameters], Any]:
    """Return a function from a motion's data to the return value: all data, or before 4.6 those with these names."""
    if "legacy" not in given:
        return lambda data: data
    return lambda data: tuple(data[name] for name in names)


def _numbers(given: Parameters, name: str, count: int | None, otherwise: list[float] | None = None) -> list[float]:
    """Return `count` numbers, or as many as there are. Before 4.6 there may be more, which are ignored."""
    values = given.get(name, otherwise)
    if not isinstance(values, Sequence) or isinstance(values, (str, bytes)) or not values:
        raise WrongValue(f"`{name}`: a list of {f'{count} ' if count else ''}numbers must be given")
    if count and "legacy" in given:
        values = values[:count]
    try:
        return list(numbers(values, count or len(values)))
    except WrongValue as error:
        raise WrongValue(f"`{name}`: {error}") from None


def _least(given: Parameters, name: str, most: str, count: int, is_behind: int) -> list[float] | None:
    """Return the lower limits that belong to the upper limits `most`; before 4.6 they may follow in the same list."""
    if "legacy" in given and is_behind:
        return list(numbers(given[most][count : 2 * count], count))
    return _numbers(given, name, count) if name in given else None


def _cyclic(given: Parameters, start: Sequence[float]) -> Sequence[bool]:
    found = given.get("cyclicJoints") or [False] * len(start)
    if not isinstance(found, Sequence) or len(found) < len(start):
        raise WrongValue(f"`cyclicJoints`: {len(start)} values must be given")
    return found


def _near(target: float, start: float, is_cyclic: bool) -> float:
    """Return a joint's target, the shorter way round where it has no end."""
    return start + math.remainder(target - start, math.tau) if is_cyclic else target


def _place(given: Parameters, name: str) -> frames.Matrix:
    values = _numbers(given, name, None)
    if len(values) not in (7, 12):
        raise WrongValue(f"`{name}`: expected a pose of 7 numbers or a matrix of 12, not {len(values)} numbers")
    return from_pose(values) if len(values) == 7 else numbers(values, 12)
