"""How bodies move: what pushes them through each sub-step, and PyBullet's steps. Metres, newtons, world frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pybullet

from drone_sim.mechanics.state import Motion
from drone_sim.mechanics.wrench import Wrench
from drone_sim.world.gyroscopic_term import SLOW, GyroscopicTerm, NoGyroscopicTerm, torque_of_turn
from drone_sim.world.impacts import Impacts
from drone_sim.world.queries import Queries
from drone_sim.world.shape_forces import ShapeForces

# What pushes a body through a step: the body, Wrench's force, torque and levers, its moments of inertia if the term
# ω x Iω is to be cancelled, and its attitude one PyBullet step ago (None: unknown).
_Load = list[Any]
_pose_of, _velocity_of = pybullet.getBasePositionAndOrientation, pybullet.getBaseVelocity
_apply_force, _apply_torque = pybullet.applyExternalForce, pybullet.applyExternalTorque
_step, _IN_WORLD, _ALONG_AXES = pybullet.stepSimulation, pybullet.WORLD_FRAME, pybullet.LINK_FRAME
_PAST = 5  # index in a load


class Dynamics:
    """Steps the bodies of one PyBullet client under forces. It reads each body at most once between two sub-steps.

    Code that sets the pose or velocity of a body must call `moved` or `all_moved` after it.
    """

    def __init__(self, client: int, sub_step: float, queries: Queries, *, gyroscopic: bool):
        """Step the bodies of PyBullet's `client` by `sub_step` (s).

        `gyroscopic`: bodies turn as Euler's equations say; otherwise as in V-REP, without the term ω × Iω.
        """
        self._client, self._sub_step, self._queries = client, sub_step, queries
        self.shape_forces = ShapeForces(client)
        self._gyroscopic_term = GyroscopicTerm(client) if gyroscopic else NoGyroscopicTerm(client)
        self._impacts = Impacts(client, sub_step)
        self._applied: list[tuple[int, Wrench]] = []  # through the next sub-step
        self._term_acts = False  # on a body that is not among the loads
        self._known: dict[int, Motion] = {}  # what has been read since PyBullet's last step

    # ---- bodies

    def add(self, body: int) -> None:
        """Know a body."""
        self._gyroscopic_term.add(body)
        self._impacts.add(body)

    def forget(self, body: int) -> None:
        """Know nothing of a body any more."""
        self.moved(body)
        self._gyroscopic_term.forget(body)
        self._impacts.forget(body)
        self.shape_forces.forget(body)

    def moved(self, body: int) -> None:
        """Read a body anew."""
        self._known.pop(body, None)

    def all_moved(self) -> None:
        """Read every body anew; the scripts' pushes are those of another time."""
        self._known.clear()
        self.shape_forces.sums.clear()

    def motion(self, body: int) -> Motion:
        """Return the pose of a root's inertial frame (m, unit quaternion) and its velocities (m/s, rad/s)."""
        motion = self._known.get(body)
        if motion is None:
            motion = self._known[body] = *_pose_of(body, self._client), *_velocity_of(body, self._client)
        return motion

    # ---- steps

    def apply(self, body: int, wrench: Wrench) -> None:
        """Let a wrench act on a body through the next sub-step, beside what `advance` applies."""
        self._applied.append((body, wrench))

    def advance(
        self, wrenches: Mapping[int, Wrench], sub_steps: int, between: Callable[[int], None] | None = None
    ) -> None:
        """Do what World.advance says."""
        moments = self._gyroscopic_term.moments_to_cancel
        self._term_acts = self._gyroscopic_term.begin_step(wrenches)
        loads = [[body, one.force, *one.terms, moments.get(body), None] for body, one in wrenches.items()]
        any_fast = self._impacts.begin_step(sub_steps, self._known)
        if not any_fast:
            self._queries.begin_sub_step()
        if between is None and not any_fast:
            self._step(loads, sub_steps, self._sub_step)
        else:
            if between is not None:
                between(0)
            for count in range(1, sub_steps + 1):
                if any_fast:
                    self._step_in_parts(loads, self._impacts.parts())
                else:
                    self._step(loads, 1, self._sub_step)
                if between is not None:
                    between(count)
        self.all_moved()

    def _step_in_parts(self, loads: Sequence[_Load], parts: int) -> None:
        """Advance by one sub-step, in equal parts."""
        for load in loads:
            load[_PAST] = None  # the parts of the last sub-step may have had another length
        if parts == 1:
            self._queries.begin_sub_step()
            self._step(loads, 1, self._sub_step)
            return
        self._queries.begin_sub_step(load[0] for load in loads)
        part = self._sub_step / parts
        applied = list(self._applied)
        with self._impacts.divided(part):
            for _ in range(parts):
                self._applied[:] = applied
                self._step(loads, 1, part)
                self._queries.end_part(1 / parts)

    def _step(self, loads: Sequence[_Load], steps: int, duration: float) -> None:
        """Let PyBullet take `steps` steps of `duration` (s), with everything that pushes in each of them."""
        # A step of the simulation spends most of its time here. So names are local, PyBullet's arguments positional,
        # Wrench.torque_under is written out, and a body that has hardly turned costs no call for its term w x Iw.
        client, known, applied, term = self._client, self._known, self._applied, self._gyroscopic_term
        sums, slow = self.shape_forces.sums, SLOW * duration * duration / 4
        for _ in range(steps):
            if applied:
                self._apply_once()
            for load in loads:
                body, force, (torque_x, torque_y, torque_z), levers, moments, past = load
                centre, attitude = known[body][:2] if known and body in known else _pose_of(body, client)
                x, y, z, w = load[_PAST] = attitude
                _apply_force(body, -1, force, centre, _IN_WORLD, client)
                for lx, ly, lz, ax, ay, az in levers:
                    tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
                    ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
                    torque_x += uy * az - uz * ay
                    torque_y += uz * ax - ux * az
                    torque_z += ux * ay - uy * ax
                _apply_torque(body, -1, (torque_x, torque_y, torque_z), _IN_WORLD, client)
                if moments is not None:
                    if past is not None:
                        px, py, pz, pw = past
                        px, py, pz, pw = px - x, py - y, pz - z, pw - w
                        if px * px + py * py + pz * pz + pw * pw < slow:  # it is at least sin² of half the angle
                            continue
                        torque = torque_of_turn(moments, past, attitude, duration)
                    else:
                        torque = term.torque_of_velocity(moments, body, attitude, duration)
                    if torque is not None:
                        _apply_torque(body, -1, torque, _ALONG_AXES, client)
            if sums:
                self.shape_forces.apply()
            if self._term_acts:
                term.begin_sub_step(duration)
            _step(client)
            if term.acts_after_steps:
                term.end_sub_step(duration)
            if known:
                known.clear()

    def _apply_once(self) -> None:
        """Apply what `apply` was given for the next step."""
        for body, wrench in self._applied:
            centre, attitude = self._known[body][:2] if body in self._known else _pose_of(body, self._client)
            _apply_force(body, -1, wrench.force, centre, _IN_WORLD, self._client)
            _apply_torque(body, -1, wrench.torque_under(attitude), _IN_WORLD, self._client)
        self._applied.clear()
