"""The sum of the forces and torques on a body in one step. They keep their directions in the world."""

from __future__ import annotations

from drone_sim.mechanics.frames import Quaternion, Vector


class Wrench:
    """Sum of world-fixed forces at body-fixed points, which every sub-step of one step re-applies.

    V-REP turns each force into the world once per step and re-applies that world vector in every
    sub-step, at a point that moves with the body. For points p_i (inertial frame of the body) and
    forces F_i (world), the torque about the centre of mass under the rotation R is sum (R p_i) x F_i.
    Parallel forces F_i = f_i a share one lever, l = sum p_i f_i, and one torque (R l) x a. With the
    unit quaternion (q, w) of R it is l x a + (w t + q x t) x a, where t = 2 q x l.
    """

    def __init__(self) -> None:
        """Start with zero force and torque."""
        self.force: Vector = (0.0, 0.0, 0.0)
        self.torque: Vector = (0.0, 0.0, 0.0)  # the part that does not depend on R: the torques, and every l x a
        self.levers: list[tuple[float, ...]] = []  # 2 l and a of each axis, in one tuple

    def push(self, force: Vector) -> None:
        """Add a force (N, world) at the centre of mass."""
        (fx, fy, fz), (px, py, pz) = self.force, force
        self.force = fx + px, fy + py, fz + pz

    def add(self, force: Vector, torque: Vector, point: Vector) -> None:
        """Add a force (N, world) at a point (m, inertial frame of the body), and a torque (N m, world)."""
        self.add_parallel(force, torque, point, force)

    def add_parallel(self, force: Vector, torque: Vector, lever: Vector, axis: Vector) -> None:
        """Add forces along one axis (world) by their sum (N), and torques by their sum (N m).

        `lever` is sum p_i f_i (inertial frame of the body) over the points p_i where forces f_i times the axis act.
        """
        (fx, fy, fz), (tx, ty, tz), (lx, ly, lz), (ax, ay, az) = self.force, self.torque, lever, axis
        self.force = fx + force[0], fy + force[1], fz + force[2]
        self.torque = (
            tx + torque[0] + ly * az - lz * ay,
            ty + torque[1] + lz * ax - lx * az,
            tz + torque[2] + lx * ay - ly * ax,
        )
        self.levers.append((2.0 * lx, 2.0 * ly, 2.0 * lz, ax, ay, az))

    def torque_under(self, orientation: Quaternion) -> Vector:
        """Return the torque about the centre of mass (N m, world) for an orientation of the body."""
        # Vector operations are written out for speed; Dynamics has a copy of this code in its loop over sub-steps.
        if not self.levers:
            return self.torque
        x, y, z, w = orientation
        sum_x, sum_y, sum_z = self.torque
        for lx, ly, lz, ax, ay, az in self.levers:
            tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
            ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
            sum_x += uy * az - uz * ay
            sum_y += uz * ax - ux * az
            sum_z += ux * ay - uy * ax
        return sum_x, sum_y, sum_z
