"""`sim`: V-REP 3.x functions that move joints and objects in threads, based on the motions of 4.x."""

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

_POSITION, _ORIENTATION = 1, 2  # bits: what of an object is moved
_LIMITS = ("flags", "vel", "accel", "maxVel", "maxAccel", "maxJerk")
_JOINTS = (*_LIMITS, "targetPos", "targetVel", "direction")
_PLACES = (*_LIMITS, "position", "quaternion")
_M_PER_RAD = 0.1 / math.radians(90)  # V-REP's default for the length that corresponds to an angle
_NEAR_M, _NEAR_RAD = 5e-5, math.radians(0.01)  # distances below which V-REP ignores a motion
# Distances by sim.distcalcmethod_..., from a length in m and an angle converted to m.
_DISTANCES: tuple[Callable[[float, float], float], ...] = (
    lambda length, angle: length,
    lambda length, angle: angle,
    max,
    lambda length, angle: length + angle,
    math.hypot,
    lambda length, angle: length if length > _NEAR_M else angle,
    lambda length, angle: angle if angle > _NEAR_RAD * _M_PER_RAD else length,
)


class OlderMotions(Functions):
    """Motions in threads (3.x)."""

    def __init__(self, motions: MotionFunctions, *arguments: Any):
        """`motions` are those of 4.x; the other arguments are those of Functions."""
        super().__init__(*arguments)
        self._motions = motions

    # ---- with limits of velocity, acceleration and jerk, as in Reflexxes

    @sim("45", RMLMoveToJointPositions="3")
    def rmlMoveToJointPositions(self, jointHandles: Sequence[Handle], *arguments: Any) -> Wait:
        """Move joints to positions; at the end, return 1, positions, velocities, accelerations and the time left.

        The other arguments are flags, currentVel, currentAccel, maxVel, maxAccel, maxJerk, targetPos, targetVel,
        direction. A direction is for a joint without limits: -1 or 1 is the direction of rotation, -2 or 2 adds one
        turn.
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
        """Move an object to a position and quaternion, one of which may be missing; at the end, return 1 and the state.

        The state is position, quaternion, velocities, accelerations and the time left. The other arguments are flags,
        currentVel, currentAccel, maxVel, maxAccel, maxJerk (of x, y, z and the angle), targetPosition,
        targetQuaternion.
        """
        given = {name: value for name, value in zip(_PLACES, arguments) if value is not None}
        now = self._objects.matrix(handle, relativeTo)
        place = given.pop("position", frames.position(now))
        goal = built(place, given.pop("quaternion", frames.to_quaternion(now)))
        params = {**given, "object": handle, "relObject": relativeTo, "targetPose": list(goal)}

        def value(data: dict[str, Any]) -> Any:
            pose, still = data["pose"], [0.0] * 4
            return 1, pose[:3], pose[3:], still, still, data["timeLeft"]

        return self._motions.move(params, value)

    # ---- with limits of velocity and acceleration

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
        """Move an object to a position and Euler angles, either of which may be missing; return the time left in s.

        `velocity`: the largest, in m/s; `accel`: in m/s², unlimited if it is missing. `distance`:
        sim.distcalcmethod_..., and the length (m) that corresponds to 1 rad.
        """
        start = self._objects.matrix(handle, relativeTo)
        if position is None and orientation is None:
            raise WrongValue("a position or an orientation must be given")
        goal = built(position or frames.position(start), orientation or frames.to_quaternion(start))
        part = (_POSITION if position else 0) + (_ORIENTATION if orientation else 0)
        way, turn = _apart(start, goal)
        method, much = numbers(distance, 2)
        if not 0 <= method < len(_DISTANCES):
            raise WrongValue("the distance needs one of sim.distcalcmethod_... and a number")
        whole = _DISTANCES[int(method)](way, turn * much)
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
        """Move an object to the current pose of another object, or to a fraction of a path; return the time left in s.

        `positionAndOrOrientation`: 1 position, 2 orientation, 3 both. Velocity and acceleration are fractions of the
        motion, in 1/s and 1/s².
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
        """Move an object along a path (m/s, m/s²) from a fraction of it to its end; return the time left in s.

        With a negative velocity, it moves to the beginning. `positionAndOrOrientation`: 1 position, 2 orientation, 3
        both.
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

        With a single velocity (rad/s or m/s) and acceleration, all joints arrive at the same time, and the velocity of
        revolute joints is divided by `angleToLinearCoeff`. With lists, each joint moves independently.
        """
        joints = [self._found(handle, Joint, "a joint of the scene") for handle in jointHandles]
        alone = isinstance(velocity, Sequence)
        (much,) = numbers((angleToLinearCoeff,), 1)
        if much <= 0:
            raise WrongValue("angleToLinearCoeff must be greater than 0")
        scale = [1.0 if alone or joint.motion == PRISMATIC else 1.0 / much for joint in joints]
        most, fastest = (_each(limit, scale) for limit in (velocity, math.inf if accel is None else accel))
        start = [joint.value for joint in joints]
        goal = [_allowed(joint, position) for joint, position in zip(joints, numbers(positions, len(joints)))]
        limits = Limits(most, fastest, [math.inf] * len(joints))
        still = [0.0] * len(joints)
        trajectory = Trajectory(State(start, still, still), goal, still, limits, NONE if alone else PHASE)
        return self._run(trajectory, lambda state: move_joints(joints, state.position))

    def _along(self, way: float, velocity: Any, accel: Any, move: Callable[[float], None]) -> Wait:
        """Return the wait for a motion over a distance in m; `move` is called with the fraction of it."""
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
        """Return a function that moves an object, or only its `parts`, to `place(share)`, by the fraction `share`."""
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
    """Return the distance between two poses in m and in rad."""
    turn = frames.multiply(frames.invert(start), goal)
    return math.dist(frames.position(start), frames.position(goal)), axis_and_angle(frames.to_quaternion(turn))[1]


def _turned(start: float, target: float, turns: int) -> float:
    """Return the target of a joint without limits, in the direction of `turns`; 2 or -2 adds one turn."""
    ahead = (target - start) % math.tau if turns > 0 else -((start - target) % math.tau)
    return start + ahead + math.tau * (turns - 1 if turns > 0 else turns + 1)


def _each(values: Any, scale: Sequence[float]) -> list[float]:
    """Return one number for each joint, from a list or a single number."""
    found = numbers(values, len(scale)) if isinstance(values, Sequence) else [values] * len(scale)
    return [abs(value) * factor for value, factor in zip(found, scale)]


def _allowed(joint: Joint, position: float) -> float:
    """Return the allowed position of a joint nearest to a target; without limits, in the shorter direction."""
    if joint.limits is None:
        return joint.value + math.remainder(position - joint.value, math.tau) if joint.motion == REVOLUTE else position
    return min(max(position, joint.limits[0]), joint.limits[1])
