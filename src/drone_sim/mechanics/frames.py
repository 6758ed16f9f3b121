"""Transforms in V-REP's conventions: 12-number matrices, X-Y-Z Euler angles, xyzw quaternions.

A `Matrix` is the first three rows of a 4x4 homogeneous transform, row by row, as simGetObjectMatrix
returns it: (r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z). It is a plain tuple of floats: a step
handles a dozen of them, and one numpy call costs more than all the arithmetic of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, copysign, cos, hypot, sin, sqrt

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[float, ...]

IDENTITY: Matrix = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def from_quaternion(position: Sequence[float], quaternion: Sequence[float]) -> Matrix:
    """Return the transform of a unit quaternion (x, y, z, w) and a position in metres."""
    x, y, z, w = quaternion
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w), position[0],
        2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w), position[1],
        2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y), position[2],
    )  # fmt: skip


def from_euler(position: Sequence[float], angles: Sequence[float]) -> Matrix:
    """Return the transform of V-REP's Euler angles, R = Rx(alpha) Ry(beta) Rz(gamma), in radians."""
    alpha, beta, gamma = angles
    sa, ca, sb, cb, sc, cc = sin(alpha), cos(alpha), sin(beta), cos(beta), sin(gamma), cos(gamma)
    return (
        cb * cc, -cb * sc, sb, position[0],
        ca * sc + sa * sb * cc, ca * cc - sa * sb * sc, -sa * cb, position[1],
        sa * sc - ca * sb * cc, sa * cc + ca * sb * sc, ca * cb, position[2],
    )  # fmt: skip


def from_rpy(position: Sequence[float], rpy: Sequence[float]) -> Matrix:
    """Return the transform of ROS's roll, pitch, yaw, R = Rz(yaw) Ry(pitch) Rx(roll), in radians."""
    roll, pitch, yaw = rpy
    sr, cr, sp, cp, sy, cy = sin(roll), cos(roll), sin(pitch), cos(pitch), sin(yaw), cos(yaw)
    return (
        cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, position[0],
        sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, position[1],
        -sp, cp * sr, cp * cr, position[2],
    )  # fmt: skip


def to_euler(m: Sequence[float]) -> Vector:
    """Return V-REP's Euler angles (alpha, beta, gamma) of a transform, in radians.

    At beta = +-pi/2 only a combination of alpha and gamma is defined: gamma is then 0.
    """
    if abs(m[2]) > 1 - 1e-12:
        return atan2(m[9], m[5]), asin(max(-1.0, min(1.0, m[2]))), 0.0
    return atan2(-m[6], m[10]), asin(m[2]), atan2(-m[1], m[0])


def to_rpy(m: Sequence[float]) -> Vector:
    """Return ROS's roll, pitch and yaw of a transform, in radians; at pitch = +-pi/2 roll is 0."""
    if abs(m[8]) > 1 - 1e-12:
        return 0.0, asin(max(-1.0, min(1.0, -m[8]))), atan2(-m[1], m[5])
    return atan2(m[9], m[10]), asin(-m[8]), atan2(m[4], m[0])


def to_quaternion(m: Sequence[float]) -> Quaternion:
    """Return the unit quaternion (x, y, z, w), w >= 0, of a transform (Shepperd's method)."""
    xx, yy, zz = m[0], m[5], m[10]
    ww = 1 + xx + yy + zz
    if ww > 2:  # the largest square: a rotation of less than 90°, as most are
        scale = 0.5 / sqrt(ww)
        return (m[9] - m[6]) * scale, (m[2] - m[8]) * scale, (m[4] - m[1]) * scale, ww * scale
    # Four squares that sum to 4; dividing by the largest loses no digits.
    squares = (1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, ww)
    largest = squares.index(max(squares))
    rows = (
        (squares[0], m[1] + m[4], m[2] + m[8], m[9] - m[6]),
        (m[1] + m[4], squares[1], m[6] + m[9], m[2] - m[8]),
        (m[2] + m[8], m[6] + m[9], squares[2], m[4] - m[1]),
        (m[9] - m[6], m[2] - m[8], m[4] - m[1], squares[3]),
    )
    scale = copysign(0.5 / sqrt(squares[largest]), rows[largest][3])
    x, y, z, w = rows[largest]
    return x * scale, y * scale, z * scale, w * scale


def multiply_quaternions(a: Sequence[float], b: Sequence[float]) -> Quaternion:
    """Return the product a·b of two quaternions (x, y, z, w): rotate by b first, then by a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def position(m: Sequence[float]) -> Vector:
    """Return the translation of a transform."""
    return m[3], m[7], m[11]


def multiply(a: Sequence[float], b: Sequence[float]) -> Matrix:
    """Return the transform a·b."""
    a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11 = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11 = b
    return (
        a0 * b0 + a1 * b4 + a2 * b8, a0 * b1 + a1 * b5 + a2 * b9,
        a0 * b2 + a1 * b6 + a2 * b10, a0 * b3 + a1 * b7 + a2 * b11 + a3,
        a4 * b0 + a5 * b4 + a6 * b8, a4 * b1 + a5 * b5 + a6 * b9,
        a4 * b2 + a5 * b6 + a6 * b10, a4 * b3 + a5 * b7 + a6 * b11 + a7,
        a8 * b0 + a9 * b4 + a10 * b8, a8 * b1 + a9 * b5 + a10 * b9,
        a8 * b2 + a9 * b6 + a10 * b10, a8 * b3 + a9 * b7 + a10 * b11 + a11,
    )  # fmt: skip


def invert(m: Sequence[float]) -> Matrix:
    """Return the inverse of a rigid transform: its rotation transposed, its translation rotated back."""
    r0, r1, r2, x, r4, r5, r6, y, r8, r9, r10, z = m
    return (
        r0, r4, r8, -(r0 * x + r4 * y + r8 * z),
        r1, r5, r9, -(r1 * x + r5 * y + r9 * z),
        r2, r6, r10, -(r2 * x + r6 * y + r10 * z),
    )  # fmt: skip


def relative(a: Sequence[float], b: Sequence[float]) -> Matrix:
    """Return transform b relative to transform a, where both have the same frame of reference: inverse(a)·b."""
    a0, a1, a2, x, a4, a5, a6, y, a8, a9, a10, z = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11 = b
    b3, b7, b11 = b3 - x, b7 - y, b11 - z
    return (
        a0 * b0 + a4 * b4 + a8 * b8, a0 * b1 + a4 * b5 + a8 * b9,
        a0 * b2 + a4 * b6 + a8 * b10, a0 * b3 + a4 * b7 + a8 * b11,
        a1 * b0 + a5 * b4 + a9 * b8, a1 * b1 + a5 * b5 + a9 * b9,
        a1 * b2 + a5 * b6 + a9 * b10, a1 * b3 + a5 * b7 + a9 * b11,
        a2 * b0 + a6 * b4 + a10 * b8, a2 * b1 + a6 * b5 + a10 * b9,
        a2 * b2 + a6 * b6 + a10 * b10, a2 * b3 + a6 * b7 + a10 * b11,
    )  # fmt: skip


def relative_turn(a: Sequence[float], b: Sequence[float]) -> Matrix:
    """Return `relative` with a translation of 0: cheaper if only the orientation is needed."""
    a0, a1, a2, _, a4, a5, a6, _, a8, a9, a10, _ = a
    b0, b1, b2, _, b4, b5, b6, _, b8, b9, b10, _ = b
    return (
        a0 * b0 + a4 * b4 + a8 * b8, a0 * b1 + a4 * b5 + a8 * b9, a0 * b2 + a4 * b6 + a8 * b10, 0.0,
        a1 * b0 + a5 * b4 + a9 * b8, a1 * b1 + a5 * b5 + a9 * b9, a1 * b2 + a5 * b6 + a9 * b10, 0.0,
        a2 * b0 + a6 * b4 + a10 * b8, a2 * b1 + a6 * b5 + a10 * b9, a2 * b2 + a6 * b6 + a10 * b10, 0.0,
    )  # fmt: skip


def transform(m: Sequence[float], point: Sequence[float]) -> Vector:
    """Return the point m·p (simMultiplyVector)."""
    x, y, z = point
    return (
        m[0] * x + m[1] * y + m[2] * z + m[3],
        m[4] * x + m[5] * y + m[6] * z + m[7],
        m[8] * x + m[9] * y + m[10] * z + m[11],
    )


def rotate(m: Sequence[float], vector: Sequence[float]) -> Vector:
    """Return a vector rotated by m, without its translation."""
    x, y, z = vector
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[4] * x + m[5] * y + m[6] * z,
        m[8] * x + m[9] * y + m[10] * z,
    )


def rotate_back(m: Sequence[float], vector: Sequence[float]) -> Vector:
    """Return a vector rotated by the inverse of m: from the world to the axes of m."""
    x, y, z = vector
    return (
        m[0] * x + m[4] * y + m[8] * z,
        m[1] * x + m[5] * y + m[9] * z,
        m[2] * x + m[6] * y + m[10] * z,
    )


def rotation_vector(m: Sequence[float]) -> Vector:
    """Return the rotation of a transform as its axis times its angle (rad, 0 to pi)."""
    x, y, z, w = to_quaternion(m)
    sine = hypot(x, y, z)
    scale = 2.0 * atan2(sine, w) / sine if sine else 2.0
    return x * scale, y * scale, z * scale


def rotation_between(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the rotation from the axes of transform a to those of b, as its axis times its angle (rad, 0 to pi).

    Its components are the same along the axes of a and of b. It is rotation_vector(relative_turn(a, b)) in one
    function, because an IMU calls it in every sub-step.
    """
    a0, a1, a2, _, a4, a5, a6, _, a8, a9, a10, _ = a
    b0, b1, b2, _, b4, b5, b6, _, b8, b9, b10, _ = b
    ww = 1 + (a0 * b0 + a4 * b4 + a8 * b8) + (a1 * b1 + a5 * b5 + a9 * b9) + (a2 * b2 + a6 * b6 + a10 * b10)
    if not ww > 2:  # a rotation of 90° or more
        return rotation_vector(relative_turn(a, b))
    scale = 0.5 / sqrt(ww)
    x = (a2 * b1 + a6 * b5 + a10 * b9 - (a1 * b2 + a5 * b6 + a9 * b10)) * scale
    y = (a0 * b2 + a4 * b6 + a8 * b10 - (a2 * b0 + a6 * b4 + a10 * b8)) * scale
    z = (a1 * b0 + a5 * b4 + a9 * b8 - (a0 * b1 + a4 * b5 + a8 * b9)) * scale
    sine = hypot(x, y, z)
    scale = 2.0 * atan2(sine, ww * scale) / sine if sine else 2.0
    return x * scale, y * scale, z * scale


def turned(quaternion: Sequence[float], vector: Sequence[float]) -> Vector:
    """Return a vector rotated by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v)."""
    x, y, z, w = quaternion
    vx, vy, vz = vector
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
