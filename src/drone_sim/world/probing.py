"""What sensors ask of PyBullet: what a ray meets, and what touches a body. Metres, newtons, world frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import dist
from typing import Any, NamedTuple

import pybullet

from drone_sim.mechanics.frames import Vector

_NOTHING = -1  # as the body of a ray that meets none


class RayHit(NamedTuple):
    """What a ray met: the body, how far from its start (m), the unit normal of the surface.

    Where the ray begins in the body, or 1 mm from it, the distance is 0, and the normal is against the ray.
    """

    body: int
    distance: float
    normal: Vector


class Met(NamedTuple):
    """A point of a body's link (-1: the root): where it is (m), and the unit normal of the surface there."""

    body: int
    link: int
    point: Vector
    normal: Vector


class Gap(NamedTuple):
    """What lies nearest to a link: body and link, how far (m, below 0 inside), the point of either, world frame."""

    body: int
    link: int
    distance: float
    own_point: Vector
    point: Vector


class Touch(NamedTuple):
    """One contact of the last sub-step: the other body, where (m), its unit normal, the force (N) that it exerts."""

    body: int
    point: Vector
    normal: Vector
    force: Vector  # on the body that was asked about, friction included


def ray(client: int, start: Vector, end: Vector, ignoring: int) -> RayHit | None:
    """Return the nearest body but one (-1 ignores none) between two points; None where there is none."""
    hit = pybullet.rayTest(start, end, physicsClientId=client)[0]
    if hit[0] == _NOTHING:
        return None
    if hit[0] == ignoring:
        others = [one for one in _all_hits(client, start, end) if one[0] != ignoring]
        if not others:
            return None
        hit = min(others, key=lambda one: one[2])  # PyBullet numbers them in no order
    return RayHit(hit[0], hit[2] * dist(start, end), _normal(start, end, hit))


def _normal(start: Vector, end: Vector, hit: Any) -> Vector:
    """Return the unit normal of what a ray met; of what it begins in Bullet knows none, and returns anything."""
    if hit[2] > 0.0:
        return hit[4]  # type: ignore[no-any-return] # PyBullet has no types
    length = dist(start, end)
    x, y, z = ((a - b) / length for a, b in zip(start, end))
    return x, y, z


def _all_hits(client: int, start: Vector, end: Vector) -> Iterator[Any]:
    number = 0
    while True:
        hit = pybullet.rayTestBatch([start], [end], reportHitNumber=number, physicsClientId=client)[0]
        if hit[0] == _NOTHING:
            return
        yield hit
        number += 1


def rays(client: int, ends: Sequence[tuple[Vector, Vector]], counts: Callable[[int, int], bool]) -> list[Met]:
    """Return what each of several rays meets first of the bodies and links that count, but for those that meet none."""
    starts, stops = zip(*ends)
    found = []
    for start, stop, hit in zip(starts, stops, pybullet.rayTestBatch(starts, stops, physicsClientId=client)):
        if hit[0] != _NOTHING and not counts(hit[0], hit[1]):
            others = [one for one in _all_hits(client, start, stop) if counts(one[0], one[1])]
            hit = min(others, key=lambda one: one[2], default=(_NOTHING,))
        if hit[0] != _NOTHING:
            found.append(Met(hit[0], hit[1], hit[3], _normal(start, stop, hit)))
    return found


def nearest_points(
    client: int,
    probe: int,
    point: Vector,
    reach: float,
    counts: Callable[[int, int], bool],
    inside: bool = False,
) -> list[Met]:
    """Return the points that are nearest to a point (m) and within `reach` (m), of every body and link that counts.

    `probe` is a collision shape as good as a point; `inside`: what it lies inside of counts, too.
    """
    low, high = [one - reach for one in point], [one + reach for one in point]
    around = pybullet.getOverlappingObjects(low, high, physicsClientId=client) or ()
    found = []
    for body, link in sorted(set(around)):
        if counts(body, link):
            rows = pybullet.getClosestPoints(
                bodyA=-1,
                bodyB=body,
                linkIndexB=link,
                distance=reach,
                collisionShapeA=probe,
                collisionShapePositionA=point,
                physicsClientId=client,
            )
            found += [Met(body, link, row[6], row[7]) for row in rows if inside or row[8] > 0]
    return found


def gaps(client: int, body: int, link: int, reach: float, counts: Callable[[int, int], bool]) -> list[Gap]:
    """Return the gap between a body's link and every other that counts and is within `reach` (m).

    Between two meshes that are not convex, PyBullet finds none.
    """
    low, high = pybullet.getAABB(body, link, client)
    around = pybullet.getOverlappingObjects(
        [one - reach for one in low], [one + reach for one in high], physicsClientId=client
    )
    found = []
    for other in sorted(set(around or ())):
        if other != (body, link) and counts(*other):
            rows = pybullet.getClosestPoints(body, other[0], reach, link, other[1], physicsClientId=client)
            found += [Gap(other[0], other[1], row[8], row[5], row[6]) for row in rows]
    return found


def contacts(client: int, body: int) -> list[Touch]:
    """Return where a body was pushed by others in the last sub-step."""
    found = pybullet.getContactPoints(bodyA=body, physicsClientId=client)
    if not found:
        return []
    # Asked for a body, PyBullet turns the contacts round in which it is the second one: names, places and normal, but
    # not the friction. Those come once more where it is asked for as the second.
    turned = {row[1] for row in pybullet.getContactPoints(bodyB=body, physicsClientId=client)}
    return [_touch(row, -1.0 if row[2] in turned else 1.0) for row in found if row[9] > 0.0]


def _touch(row: Any, sense: float) -> Touch:
    other, point, normal = row[2], row[5], row[7]
    push, first, along, second, across = row[9], row[10] * sense, row[11], row[12] * sense, row[13]
    x, y, z = (n * push + a * first + b * second for n, a, b in zip(normal, along, across))
    return Touch(other, point, normal, (x, y, z))
