"""Motion of the bodies: PyBullet's sub-steps, with the forces in each. Metres, newtons, world frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from math import dist
from typing import Any

import pybullet

from drone_sim.mechanics.frames import Vector, multiply_quaternions, turned
from drone_sim.mechanics.state import UNTURNED, Pose, State
from drone_sim.mechanics.wrench import Wrench
from drone_sim.world.gyroscopic_term import SLOW, GyroscopicTerm, NoGyroscopicTerm, torque_of_turn
from drone_sim.world.impacts import Impacts, Motion
from drone_sim.world.pictures import Pictures
from drone_sim.world.queries import Queries

# The load on a body in a step: the body, Wrench's force, torque and levers, its moments of inertia if the term ω x Iω
# is to be cancelled, and its attitude one PyBullet step ago (None: unknown).
_Load = list[Any]
_pose_of, _velocity_of = pybullet.getBasePositionAndOrientation, pybullet.getBaseVelocity
_apply_force, _apply_torque = pybullet.applyExternalForce, pybullet.applyExternalTorque
_step, _IN_WORLD, _ALONG_AXES = pybullet.stepSimulation, pybullet.WORLD_FRAME, pybullet.LINK_FRAME
_PAST_ATTITUDE = 5  # index in a load
_NONE: Vector = (0.0, 0.0, 0.0)


class ShapeForces:
    """Forces and torques that scripts apply to shapes: their sums for each link (-1: the root) of a body in a step.

    They keep their directions in the world through the step.
    """

    def __init__(self, client: int):
        self._client = client
        self.sums: dict[tuple[int, int], tuple[Vector, Vector]] = {}

    def add(self, body: int, link: int, force: Vector, torque: Vector) -> None:
        """Add a force (N) at the centre of mass and a torque (N m) for the next step, both in the world frame."""
        (fx, fy, fz), (tx, ty, tz) = self.sums.get((body, link), (_NONE, _NONE))
        force = fx + force[0], fy + force[1], fz + force[2]
        self.sums[body, link] = force, (tx + torque[0], ty + torque[1], tz + torque[2])

    def drop(self, body: int, link: int, forces: bool, torques: bool) -> None:
        """Remove the forces, or the torques, or both, that were added since the last step."""
        force, torque = self.sums.get((body, link), (_NONE, _NONE))
        self.sums[body, link] = _NONE if forces else force, _NONE if torques else torque

    def forget(self, body: int) -> None:
        self.sums = {key: total for key, total in self.sums.items() if key[0] != body}

    def apply(self) -> None:
        """Apply all sums in the next sub-step."""
        client, in_world = self._client, pybullet.WORLD_FRAME
        for (body, link), (force, torque) in self.sums.items():
            if link == -1:
                centre = pybullet.getBasePositionAndOrientation(body, client)[0]
            else:
                centre = pybullet.getLinkState(body, link, 0, 1, client)[0]
            pybullet.applyExternalForce(body, link, force, centre, in_world, client)
            pybullet.applyExternalTorque(body, link, torque, in_world, client)


class Dynamics:
    """Steps the bodies of one PyBullet client under forces. It reads each body at most once between two sub-steps.

    Code that sets the pose or velocity of a body must call `moved` or `all_moved` after it.
    """

    def __init__(
        self,
        client: int,
        sub_step: float,
        queries: Queries,
        pictures: Pictures,
        inertial_frames: Mapping[int, tuple[Pose, Pose]],
        *,
        gyroscopic: bool,
    ):
        """Step the bodies of PyBullet's `client` by `sub_step` (s).

        `inertial_frames` has, by body, the pose of the inertial frame in the root link's frame, and the inverse.
        `gyroscopic`: bodies rotate by Euler's equations; otherwise as in V-REP, without the term ω × Iω.
        """
        self._client, self._sub_step, self._queries, self._pictures = client, sub_step, queries, pictures
        self._inertial_frames = inertial_frames
        self.shape_forces = ShapeForces(client)
        self._gyroscopic_term = GyroscopicTerm(client) if gyroscopic else NoGyroscopicTerm(client)
        self._impacts = Impacts(client, sub_step)
        self._applied: dict[int, Wrench] = {}  # in the next sub-step, by body
        self._term_acts = False  # whether the gyroscopic term acts on a body without load
        self._cached: dict[int, Motion] = {}  # read since PyBullet's last step, by body

    # ---- bodies

    def add(self, body: int) -> None:
        self._gyroscopic_term.add(body)
        self._impacts.add(body)

    def forget(self, body: int) -> None:
        self.moved(body)
        self._gyroscopic_term.forget(body)
        self._impacts.forget(body)
        self.shape_forces.forget(body)

    def moved(self, body: int) -> None:
        """Forget the motion of a body that was placed elsewhere."""
        self._cached.pop(body, None)

    def all_moved(self) -> None:
        """Forget the motion of all bodies, and the forces that scripts have added for the next step."""
        self._cached.clear()
        self.shape_forces.sums.clear()

    def state(self, body: int) -> State:
        """Return pose and velocity of a body's root link; the same object as long as it does not move."""
        if body in self._cached:
            return self._cached[body][-1]
        centre, axes = _pose_of(body, self._client)
        linear, angular = _velocity_of(body, self._client)
        inertial, from_root = self._inertial_frames[body]
        orientation = axes if from_root.orientation is UNTURNED else multiply_quaternions(axes, from_root.orientation)
        ax, ay, az = turned(orientation, inertial.position)  # from the root link to the centre of mass
        (x, y, z), (vx, vy, vz), (wx, wy, wz) = centre, linear, angular
        velocity = vx - (wy * az - wz * ay), vy - (wz * ax - wx * az), vz - (wx * ay - wy * ax)
        state = State((x - ax, y - ay, z - az), orientation, velocity, angular)
        self._cached[body] = centre, axes, linear, angular, state
        return state

    # ---- steps

    def apply(self, body: int, wrench: Wrench) -> None:
        """Add a wrench to that of `advance` for a body, in the next sub-step; a second one replaces the first.

        `advance` must have a wrench for the body, even if it is zero.
        """
        self._applied[body] = wrench

    def advance(
        self, wrenches: Mapping[int, Wrench], sub_steps: int, between: Callable[[int], None] | None = None
    ) -> None:
        """Take `sub_steps` sub-steps and re-apply each body's wrench in every one, since PyBullet clears it.

        `between` is called with 0 before the first sub-step, and after each with the number of sub-steps so far.
        """
        moments = self._gyroscopic_term.moments_to_cancel
        self._term_acts = self._gyroscopic_term.begin_step(wrenches)
        loads = [[body, it.force, it.torque, it.levers, moments.get(body), None] for body, it in wrenches.items()]
        any_fast = self._impacts.begin_step(sub_steps, self._cached)
        if not any_fast:
            self._queries.begin_sub_step()
        if between is not None:
            between(0)
        if not any_fast:
            self._step(loads, sub_steps, self._sub_step, between)
        else:
            for count in range(1, sub_steps + 1):
                self._step_in_parts(loads, self._impacts.parts())
                if between is not None:
                    between(count)
        self.shape_forces.sums.clear()
        self._pictures.look_anew()

    def _step_in_parts(self, loads: Sequence[_Load], parts: int) -> None:
        """Advance by one sub-step, divided into equal parts."""
        for load in loads:
            load[_PAST_ATTITUDE] = None  # the parts of the last sub-step may have had another length
        if parts == 1:
            self._queries.begin_sub_step()
            self._step(loads, 1, self._sub_step)
            return
        self._queries.begin_sub_step(load[0] for load in loads)
        part = self._sub_step / parts
        applied = dict(self._applied)
        with self._impacts.divided(part):
            for _ in range(parts):
                self._applied.update(applied)
                self._step(loads, 1, part)
                self._queries.end_part(1 / parts)

    def _step(
        self, loads: Sequence[_Load], steps: int, duration: float, between: Callable[[int], None] | None = None
    ) -> None:
        """Take `steps` PyBullet steps of `duration` (s) and apply all forces in each; call `between` after each."""
        # The simulation spends most of its time here. So names are local, PyBullet's arguments positional,
        # Wrench.torque_under is written out, and a body that has hardly rotated costs no call for its term w x Iw.
        client, cached, applied, term = self._client, self._cached, self._applied, self._gyroscopic_term
        term_acts, acts_after_steps = self._term_acts, term.acts_after_steps
        sums, slow = self.shape_forces.sums, math.sqrt(SLOW) * duration / 2
        for count in range(1, steps + 1):
            for load in loads:
                body, force, (torque_x, torque_y, torque_z), levers, moments, past = load
                known = cached.get(body) if cached else None
                centre, attitude = known[:2] if known else _pose_of(body, client)
                x, y, z, w = load[_PAST_ATTITUDE] = attitude
                for lx, ly, lz, ax, ay, az in levers:
                    tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
                    ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
                    torque_x += uy * az - uz * ay
                    torque_y += uz * ax - ux * az
                    torque_z += ux * ay - uy * ax
                if applied and body in applied:
                    (fx, fy, fz), (tx, ty, tz) = applied[body].force, applied[body].torque_under(attitude)
                    force = force[0] + fx, force[1] + fy, force[2] + fz
                    torque_x, torque_y, torque_z = torque_x + tx, torque_y + ty, torque_z + tz
                _apply_force(body, -1, force, centre, _IN_WORLD, client)
                _apply_torque(body, -1, (torque_x, torque_y, torque_z), _IN_WORLD, client)
                if moments is not None:
                    if past is not None:
                        if dist(past, attitude) < slow:  # this distance is at least the sine of half the angle
                            continue
                        torque = torque_of_turn(moments, past, attitude, duration)
                    else:
                        velocity = known[3] if known else _velocity_of(body, client)[1]
                        torque = term.torque_of_velocity(moments, attitude, velocity, duration)
                    if torque is not None:
                        _apply_torque(body, -1, torque, _ALONG_AXES, client)
            if applied:
                applied.clear()
            if sums:
                self.shape_forces.apply()
            if term_acts:
                term.begin_sub_step(duration)
            _step(client)
            if acts_after_steps:
                term.end_sub_step(duration)
            if cached:
                cached.clear()
            if between is not None:
                between(count)
