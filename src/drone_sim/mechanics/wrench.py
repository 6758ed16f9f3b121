"""What pushes a body for a step, summed: forces and torques that keep their direction in the world."""

from __future__ import annotations

from collections.abc import Sequence

from drone_sim.mechanics.frames import Quaternion, Vector


class Wrench:
    """World-fixed forces at body-fixed points, summed: what the sub-steps of one step re-apply.

    V-REP turns each force into the world once per step and re-applies that world vector in every
    sub-step, at a point that moves with the body. For points p_i (inertial frame of the body) and
    forces F_i (world), the torque about the centre of mass under the rotation R is sum (R p_i) x F_i.
    Parallel forces F_i = f_i a have one lever in common, l = sum p_i f_i, and one torque (R l) x a. With the
    unit quaternion (q, w) of R it is l x a + (w t + q x t) x a, where t = 2 q x l.
    """

    def __init__(self) -> None:
        """Start with no force at all."""
        self.force: Vector = (0.0, 0.0, 0.0)
        self._torque: Vector = (0.0, 0.0, 0.0)  # what does not depend on R: the torques, and every l x a
        self._levers: list[tuple[float, ...]] = []  # 2 l and a, in one

    def add(self, force: Vector, torque: Vector, point: Vector) -> None:
        """Add a force (N, world) at a point (m, inertial frame of the body), and a torque (N m, world)."""
        self.add_parallel(force, torque, point, force)

    def add_parallel(self, force: Vector, torque: Vector, lever: Vector, axis: Vector) -> None:
        """Add forces along one axis (world) by their sum (N), and torques by theirs (N m).

        `lever` is sum p_i f_i (inertial frame of the body) over the points p_i where forces f_i times the axis act.
        """
        (fx, fy, fz), (tx, ty, tz), (lx, ly, lz), (ax, ay, az) = self.force, self._torque, lever, axis
        self.force = fx + force[0], fy + force[1], fz + force[2]
        self._torque = (
            tx + torque[0] + ly * az - lz * ay,
            ty + torque[1] + lz * ax - lx * az,
            tz + torque[2] + lx * ay - ly * ax,
        )
        self._levers.append((2.0 * lx, 2.0 * ly, 2.0 * lz, ax, ay, az))

    @property
    def terms(self) -> tuple[Vector, Sequence[tuple[float, ...]]]:
        """What `torque_under` sums: the torque that does not depend on R, and of each axis 2 l and a, in one."""
        return self._torque, self._levers

    def torque_under(self, orientation: Quaternion) -> Vector:
        """Return the torque about the centre of mass (N m, world) while the body has this orientation."""
        # Written out, without a loop but the one over directions: Dynamics.advance does the same in every sub-step.
        x, y, z, w = orientation
        sum_x, sum_y, sum_z = self._torque
        for lx, ly, lz, ax, ay, az in self._levers:
            tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
            ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
            sum_x += uy * az - uz * ay
            sum_y += uz * ax - ux * az
            sum_z += ux * ay - uy * ax
        return sum_x, sum_y, sum_z
