"""How bodies move: what pushes them through each sub-step, and PyBullet's steps. Metres, newtons, world frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import pybullet

from drone_sim.mechanics.frames import Quaternion, Vector
from drone_sim.mechanics.state import Motion
from drone_sim.mechanics.wrench import Wrench
from drone_sim.world.gyroscopic_term import GyroscopicTerm, NoGyroscopicTerm
from drone_sim.world.impacts import Impacts
from drone_sim.world.queries import Queries
from drone_sim.world.shape_forces import ShapeForces

_Load = tuple[int, Vector, Vector, Sequence[tuple[float, ...]]]  # a body, and what Wrench has
_where, _pull, _turn = pybullet.getBasePositionAndOrientation, pybullet.applyExternalForce, pybullet.applyExternalTorque
_step, _IN_WORLD = pybullet.stepSimulation, pybullet.WORLD_FRAME


class Dynamics:
    """Steps one client's bodies under forces; it knows them by number, and reads each but once between two sub-steps.

    Whoever puts a body somewhere, or gives it a velocity, says so: `moved`, `all_moved`.
    """

    def __init__(self, client: int, sub_step: float, queries: Queries, *, gyroscopic: bool):
        """Take PyBullet's client, the sub-step (s), what tells contacts, and whether the gyroscopic term acts."""
        self._client, self._sub_step, self._queries = client, sub_step, queries
        self.shape_forces = ShapeForces(client)
        self._gyroscopic_term = term = GyroscopicTerm(client) if gyroscopic else NoGyroscopicTerm(client)
        self._end_sub_step = term.end_sub_step if isinstance(term, GyroscopicTerm) else None
        self._impacts = Impacts(client, sub_step)
        self._applied: list[tuple[int, Wrench]] = []  # through the next sub-step
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
        """Return where a root's inertial frame is (m, unit quaternion), and its velocities (m/s, rad/s)."""
        motion = self._known[body] = *_where(body, self._client), *pybullet.getBaseVelocity(body, self._client)
        return motion

    # ---- steps

    def apply(self, body: int, wrench: Wrench) -> None:
        """Let a wrench act on a body through the next sub-step, beside what `advance` applies."""
        self._applied.append((body, wrench))

    def advance(
        self, wrenches: Mapping[int, Wrench], sub_steps: int, between: Callable[[int], None] | None = None
    ) -> None:
        """Do what World.advance says."""
        loads = [(body, wrench.force, *wrench.terms) for body, wrench in wrenches.items()]
        any_fast = self._impacts.begin_step(sub_steps, self._known)
        if not any_fast:
            self._queries.begin_sub_step()
        self._gyroscopic_term.begin_step()
        if between is not None:
            between(0)
        for count in range(1, sub_steps + 1):
            if any_fast:
                self._step(loads, self._impacts.parts())
            else:
                self._step_once(loads, self._sub_step)
            if self._applied:
                self._applied.clear()
            if between is not None:
                between(count)
        self.all_moved()

    def _step(self, loads: Sequence[_Load], parts: int) -> None:
        """Do a sub-step, in equal parts."""
        self._gyroscopic_term.begin_step()  # the last one's parts may have been others
        if parts == 1:
            self._queries.begin_sub_step()
            self._step_once(loads, self._sub_step)
            return
        self._queries.begin_sub_step(body for body, *_ in loads)
        part = self._sub_step / parts
        with self._impacts.divided(part):
            for _ in range(parts):
                self._step_once(loads, part)
                self._queries.end_part(1 / parts)

    def _step_once(self, loads: Sequence[_Load], duration: float) -> None:
        # Positional arguments: this is most of a step.
        client, known = self._client, self._known
        attitudes: dict[int, Quaternion] = {}
        for applied in self._applied:
            self._act(*applied)
        for body, force, (torque_x, torque_y, torque_z), levers in loads:
            centre, orientation = known[body][:2] if body in known else _where(body, client)
            x, y, z, w = attitudes[body] = orientation
            _pull(body, -1, force, centre, _IN_WORLD, client)
            for lx, ly, lz, ax, ay, az in levers:  # Wrench.torque_under, without a call
                tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
                ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
                torque_x += uy * az - uz * ay
                torque_y += uz * ax - ux * az
                torque_z += ux * ay - uy * ax
            _turn(body, -1, (torque_x, torque_y, torque_z), _IN_WORLD, client)
        if self.shape_forces.sums:
            self.shape_forces.apply()
        self._gyroscopic_term.begin_sub_step(attitudes, duration)
        _step(client)
        if self._end_sub_step is not None:
            self._end_sub_step(duration)
        if known:
            known.clear()

    def _act(self, body: int, wrench: Wrench) -> None:
        centre, orientation = self._known[body][:2] if body in self._known else _where(body, self._client)
        _pull(body, -1, wrench.force, centre, _IN_WORLD, self._client)
        _turn(body, -1, wrench.torque_under(orientation), _IN_WORLD, self._client)
