"""`sim`: how 3.x moves joints and objects in threads, on the motions of 4.x."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.frames import Matrix
from drone_sim.mechanics.joint import PRISMATIC, REVOLUTE, Joint
from drone_sim.mechanics.path import Path
from drone_sim.mechanics.trajectory import NONE, PHASE, Limits, State, Trajectory
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.control import Wait
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.matrices import axis_and_angle, between, built
from drone_sim.scripting.api.motions import Motion, MotionFunctions, move_joints
from drone_sim.scripting.api.types import Handle, Number, Numbers, WrongValue, numbers

_POSITION, _ORIENTATION = 1, 2  # what of an object is moved, added up
_LIMITS = ("flags", "vel", "accel", "maxVel", "maxAccel", "maxJerk")
_JOINTS = (*_LIMITS, "targetPos", "targetVel", "direction")
_PLACES = (*_LIMITS, "position", "quaternion")
_M_PER_RAD = 0.1 / math.radians(90)  # what V-REP counts a turn for, where nothing else is said
_NEAR_M, _NEAR_RAD = 5e-5, math.radians(0.01)  # below which V-REP takes a way for none
_WAYS: tuple[Callable[[float, float], float], ...] = (  # by sim.distcalcmethod_..., of m and of rad in m
    lambda way, turn: way,
    lambda way, turn: turn,
    max,
    lambda way, turn: way + turn,
    math.hypot,
    lambda way, turn: way if way > _NEAR_M else turn,
    lambda way, turn: turn if turn > _NEAR_RAD * _M_PER_RAD else way,
)


class OlderMotions(Functions):
    """Motions in threads (3.x)."""

    def __init__(self, motions: MotionFunctions, *seen: Any):
        """`motions` are those of 4.x."""
        super().__init__(*seen)
        self._motions = motions

    # ---- with Reflexxes' limits: velocity, acceleration and jerk

    @sim("45", RMLMoveToJointPositions="3")
    def rmlMoveToJointPositions(self, jointHandles: Sequence[Handle], *arguments: Any) -> Wait:
        """Move joints to positions; return 1 when they are there, positions, velocities, accelerations, and time left.

        The others are flags, currentVel, currentAccel, maxVel, maxAccel, maxJerk, targetPos, targetVel, direction: -1
        or 1 for a joint without end that turns only that way, -2 or 2 one turn more.
        """
        given = dict(zip(_JOINTS, arguments))
        joints = [self._found(handle, Joint, "a joint of the scene") for handle in jointHandles]
        endless = [joint.motion == REVOLUTE and joint.limits is None for joint in joints]
        directions = list(given.pop("direction", None) or [0] * len(joints))
        target = list(numbers(given["targetPos"], len(given["targetPos"]))) if given.get("targetPos") else []
        for index, (joint, turns) in enumerate(zip(joints, directions)):
            if turns and endless[index] and index < len(target):
                target[index], endless[index] = _turned(joint.value, target[index], int(turns)), False
        params = {**given, "joints": list(jointHandles), "targetPos": target, "cyclicJoints": endless}
        return self._motions.move(params, lambda data: (1, data["pos"], data["vel"], data["accel"], data["timeLeft"]))

    @sim("45", RMLMoveToPosition="3")
    def rmlMoveToPosition(self, handle: Handle, relativeTo: Handle, *arguments: Any) -> Wait:
        """Move an object to a position and a quaternion, one of which may be left out; return 1 when it is there.

        And position, quaternion, velocities, accelerations, and time left. The others are flags, currentVel,
        currentAccel, maxVel, maxAccel, maxJerk (of x, y, z and the angle), targetPosition, targetQuaternion.
        """
        given = {name: one for name, one in zip(_PLACES, arguments) if one is not None}
        now = self._objects.matrix(handle, relativeTo)
        place = given.pop("position", frames.position(now))
        goal = built(place, given.pop("quaternion", frames.to_quaternion(now)))
        params = {**given, "object": handle, "relObject": relativeTo, "targetPose": list(goal)}

        def value(data: dict[str, Any]) -> Any:
            pose, still = data["pose"], [0.0] * 4
            return 1, pose[:3], pose[3:], still, still, data["timeLeft"]

        return self._motions.move(params, value)

    # ---- with a velocity and an acceleration

    @sim("345")
    def moveToPosition(
        self,
        handle: Handle,
        relativeTo: Handle,
        position: Numbers | None = None,
        orientation: Numbers | None = None,
        velocity: Number = 0.0,
        accel: Number | None = None,
        distance: Numbers = (5, _M_PER_RAD),
    ) -> Wait:
        """Move an object to a position and Euler angles, one of which may be left out; return the time left in s.

        `velocity`: the most, m/s; `accel`: m/s², chosen to fit if it is left out. `distance`: sim.distcalcmethod_...
        and how many m a rad counts for.
        """
        start = self._objects.matrix(handle, relativeTo)
        if position is None and orientation is None:
            raise WrongValue("a position or an orientation must be given")
        goal = built(position or frames.position(start), orientation or frames.to_quaternion(start))
        part = (_POSITION if position else 0) + (_ORIENTATION if orientation else 0)
        way, turn = _apart(start, goal)
        method, much = numbers(distance, 2)
        if not 0 <= method < len(_WAYS):
            raise WrongValue("the distance needs one of sim.distcalcmethod_... and a number")
        whole = _WAYS[int(method)](way, turn * much)
        return self._along(
            whole, velocity, accel, self._mover(handle, relativeTo, part, lambda share: between(start, goal, share))
        )

    @sim("345")
    def moveToObject(
        self,
        handle: Handle,
        target: Handle,
        positionAndOrOrientation: int | None = None,
        relativeDistance: Number | None = None,
        velocity: Number = 1.0,
        accel: Number | None = None,
    ) -> Wait:
        """Move an object to where another is by then, or to a share of a path; return the time left in s.

        `positionAndOrOrientation`: 1, 2, or 3 both. Velocity and acceleration are shares of the way, in 1/s and 1/s².
        """
        start, path = self._objects.matrix(handle), self._objects[target]

        def place(share: float) -> Matrix:
            goal = path.matrix()
            if relativeDistance is not None and isinstance(path, Path):
                goal = frames.multiply(goal, path.at(numbers((relativeDistance,), 1)[0] * path.length))
            return between(start, goal, share)

        return self._along(1.0, velocity, accel, self._mover(handle, -1, positionAndOrOrientation or 3, place))

    @sim("345")
    def followPath(
        self,
        handle: Handle,
        path: Handle,
        positionAndOrOrientation: int | None = None,
        relativeDistance: Number = 0.0,
        velocity: Number = 0.0,
        accel: Number | None = None,
    ) -> Wait:
        """Move an object along a path (m/s, m/s²) from a share of it to its end; return the time left in s.

        With a velocity below 0 it moves to its beginning. `positionAndOrOrientation`: 1, 2, or 3 both.
        """
        line, (share, speed) = self._found(path, Path, "a path"), numbers((relativeDistance, velocity), 2)
        begin = min(max(share, 0.0), 1.0) * line.length
        whole = line.length - begin if speed >= 0 else -begin

        def place(share: float) -> Matrix:
            along = begin + share * whole
            return frames.multiply(line.matrix(), line.at(min(along, math.nextafter(line.length, 0.0))))

        return self._along(abs(whole), speed, accel, self._mover(handle, -1, positionAndOrOrientation or 3, place))

    @sim("345")
    def moveToJointPositions(
        self,
        jointHandles: Sequence[Handle],
        positions: Numbers,
        velocity: Number | Numbers,
        accel: Number | Numbers | None = None,
        angleToLinearCoeff: Number = 1.0,
    ) -> Wait:
        """Move joints to positions; return the time left in s.

        With one velocity (rad/s or m/s) and acceleration, all arrive together; with lists, each moves by itself. With
        one velocity for all, that of revolute joints is divided by `angleToLinearCoeff`.
        """
        joints = [self._found(handle, Joint, "a joint of the scene") for handle in jointHandles]
        alone = isinstance(velocity, Sequence)
        (much,) = numbers((angleToLinearCoeff,), 1)
        if much <= 0:
            raise WrongValue("angleToLinearCoeff must be greater than 0")
        scale = [1.0 if alone or joint.motion == PRISMATIC else 1.0 / much for joint in joints]
        most, fastest = (_each(one, scale) for one in (velocity, math.inf if accel is None else accel))
        start = [joint.value for joint in joints]
        goal = [_allowed(*one) for one in zip(joints, numbers(positions, len(joints)))]
        limits = Limits(most, fastest, [math.inf] * len(joints))
        still = [0.0] * len(joints)
        trajectory = Trajectory(State(start, still, still), goal, still, limits, NONE if alone else PHASE)
        return self._run(trajectory, lambda state: move_joints(joints, state.position))

    def _along(self, way: float, velocity: Any, accel: Any, move: Callable[[float], None]) -> Wait:
        """Move something over a way, in m; `move` is told the share of it."""
        (most,), (fastest,) = numbers((velocity,), 1), (math.inf,) if not accel else numbers((accel,), 1)
        if way < _NEAR_M / 10:
            way, most, fastest = 1.0, 1e6, math.inf
        limits = Limits([abs(most)], [abs(fastest)], [math.inf])
        trajectory = Trajectory(State([0.0], [0.0], [0.0]), [way], [0.0], limits)
        return self._run(trajectory, lambda state: move(state.position[0] / way))

    def _run(self, trajectory: Trajectory, put: Callable[[State], None]) -> Wait:
        motion = Motion(
            trajectory, self._context.clock.time_step, lambda state: {"state": state}, lambda data: put(data["state"])
        )
        return self._motions.run(motion, lambda data: data["timeLeft"])

    def _mover(
        self, handle: int, relative: int, parts: int, place: Callable[[float], Matrix]
    ) -> Callable[[float], None]:
        """Return a function of the share of the way that puts an object at `place(share)`, or only its `parts`."""
        if parts not in (_POSITION, _ORIENTATION, _POSITION + _ORIENTATION):
            raise WrongValue("expected 1 (move the position), 2 (the orientation) or 3 (both)")
        self._objects[handle]

        def move(share: float) -> None:
            goal, now = place(share), self._objects.matrix(handle, relative)
            position = frames.position(goal if parts & _POSITION else now)
            turn = frames.to_quaternion(goal if parts & _ORIENTATION else now)
            self._objects.set_matrix(handle, relative, frames.from_quaternion(position, turn))

        return move


def _apart(start: Matrix, goal: Matrix) -> tuple[float, float]:
    """Return how far two places are apart, in m and in rad."""
    turn = frames.multiply(frames.invert(start), goal)
    return math.dist(frames.position(start), frames.position(goal)), axis_and_angle(frames.to_quaternion(turn))[1]


def _turned(start: float, target: float, turns: int) -> float:
    """Return a target of a joint without limits, in the direction of the sign of `turns`; 2 or -2: one turn more."""
    ahead = (target - start) % math.tau if turns > 0 else -((start - target) % math.tau)
    return start + ahead + math.tau * (turns - 1 if turns > 0 else turns + 1)


def _each(values: Any, scale: Sequence[float]) -> list[float]:
    """Return one number for each joint, of a list or of one for all."""
    found = numbers(values, len(scale)) if isinstance(values, Sequence) else [values] * len(scale)
    return [abs(one) * factor for one, factor in zip(found, scale)]


def _allowed(joint: Joint, position: float) -> float:
    """Return the position nearest to a target that a joint may have: the shorter way round where it has no end."""
    if joint.limits is None:
        return joint.value + math.remainder(position - joint.value, math.tau) if joint.motion == REVOLUTE else position
    return min(max(position, joint.limits[0]), joint.limits[1])
