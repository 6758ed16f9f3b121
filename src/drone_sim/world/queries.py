"""What is asked of PyBullet: what a ray meets, what is near, what touches a body. Metres, newtons, world frame."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import dist
from typing import Any, NamedTuple

import numpy as np
import pybullet

from drone_sim.mechanics.frames import Vector
from drone_sim.world.collision_filter import CollisionFilter

_contacts = pybullet.getContactPoints
_ANY_BODY, _ANY_LINK = -1, -2
_NOTHING = -1  # as the body of a ray that meets none
_PROBE = 1e-6  # m, radius of what is as good as a point


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


class Queries:
    """Asks one client's world; by body and link, -1 is the root."""

    def __init__(self, client: int, collision_filter: CollisionFilter):
        """Take the client, and what knows which links nothing meets."""
        self._client = client
        self._filter = collision_filter
        self._met_in_parts: dict[int, dict[int, Touch]] = {}  # by body, and by what it met
        self._probe: int | None = None  # a collision shape as good as a point

    def ray(self, start: Vector, end: Vector, ignoring: int = -1) -> RayHit | None:
        """Return the nearest body between two points (m), but for the one that is ignored; None where there is none."""
        hit = pybullet.rayTest(start, end, physicsClientId=self._client)[0]
        if hit[0] == _NOTHING:
            return None
        if hit[0] == ignoring:
            others = [one for one in self._all_hits(start, end) if one[0] != ignoring]
            if not others:
                return None
            hit = min(others, key=lambda one: one[2])  # PyBullet numbers them in no order
        return RayHit(hit[0], hit[2] * dist(start, end), _normal(start, end, hit))

    def rays(self, ends: Sequence[tuple[Vector, Vector]], counts: Callable[[int, int], bool]) -> list[Met]:
        """Return what each of several rays (from, to, m) meets first of the bodies and links that count."""
        starts, stops = zip(*ends)
        found = []
        for start, stop, hit in zip(starts, stops, pybullet.rayTestBatch(starts, stops, physicsClientId=self._client)):
            if hit[0] != _NOTHING and not counts(hit[0], hit[1]):
                others = [one for one in self._all_hits(start, stop) if counts(one[0], one[1])]
                hit = min(others, key=lambda one: one[2], default=(_NOTHING,))
            if hit[0] != _NOTHING:
                found.append(Met(hit[0], hit[1], hit[3], _normal(start, stop, hit)))
        return found

    def _all_hits(self, start: Vector, end: Vector) -> Iterator[Any]:
        number = 0
        while True:
            hit = pybullet.rayTestBatch([start], [end], reportHitNumber=number, physicsClientId=self._client)[0]
            if hit[0] == _NOTHING:
                return
            yield hit
            number += 1

    def nearest_points(
        self, point: Vector, reach: float, counts: Callable[[int, int], bool], *, measured: bool = False
    ) -> list[Met]:
        """Return the points within `reach` (m) that are nearest to a point (m), of all bodies and links that count.

        `measured`: also of bodies that contain the point, and of links that collide with nothing; a sensor sees
        neither.
        """
        if self._probe is None:
            self._probe = pybullet.createCollisionShape(
                pybullet.GEOM_SPHERE, radius=_PROBE, physicsClientId=self._client
            )
        low, high = [one - reach for one in point], [one + reach for one in point]
        around = pybullet.getOverlappingObjects(low, high, physicsClientId=self._client) or ()
        found = []
        for body, link in sorted(set(around)):
            if (measured or not self._filter.is_permeable(body, link)) and counts(body, link):
                rows = pybullet.getClosestPoints(
                    bodyA=-1,
                    bodyB=body,
                    linkIndexB=link,
                    distance=reach,
                    collisionShapeA=self._probe,
                    collisionShapePositionA=point,
                    physicsClientId=self._client,
                )
                found += [Met(body, link, row[6], row[7]) for row in rows if measured or row[8] > 0]
        return found

    def gaps(self, body: int, link: int, reach: float, counts: Callable[[int, int], bool]) -> list[Gap]:
        """Return the gaps between a body's link and those others within `reach` (m) that count.

        Between two meshes that are not convex, PyBullet finds none.
        """
        low, high = pybullet.getAABB(body, link, self._client)
        around = pybullet.getOverlappingObjects(
            [one - reach for one in low], [one + reach for one in high], physicsClientId=self._client
        )
        found = []
        for other in sorted(set(around or ())):
            if other != (body, link) and counts(*other):
                rows = pybullet.getClosestPoints(body, other[0], reach, link, other[1], physicsClientId=self._client)
                found += [Gap(other[0], other[1], row[8], row[5], row[6]) for row in rows]
        return found

    def contacts(self, body: int) -> list[Touch]:
        """Return where a body was pushed by others in the last sub-step; once for each body, if that went in parts."""
        if body in self._met_in_parts:
            return list(self._met_in_parts[body].values())
        # By position: in every sub-step.
        rows = _contacts(body, _ANY_BODY, _ANY_LINK, _ANY_LINK, self._client)
        return self._touches(body, rows) if rows else []

    def begin_sub_step(self, bodies: Iterable[int] = ()) -> None:
        """Forget the last sub-step; of these bodies the contacts of its parts will be told, by `end_part`."""
        self._met_in_parts = {body: {} for body in bodies}

    def end_part(self, share: float) -> None:
        """Add up what pushed those bodies through a part that is such a share of its sub-step."""
        for body, met in self._met_in_parts.items():
            for one in self._touches(body, _contacts(body, _ANY_BODY, _ANY_LINK, _ANY_LINK, self._client)):
                x, y, z = met[one.body].force if one.body in met else (0.0, 0.0, 0.0)
                force = x + one.force[0] * share, y + one.force[1] * share, z + one.force[2] * share
                met[one.body] = one._replace(force=force)

    def _touches(self, body: int, rows: Sequence[Any]) -> list[Touch]:
        """Return what pushes a body, of PyBullet's contacts of it."""
        # Asked for a body, PyBullet turns the contacts round in which it is the second one: names, places and normal,
        # but not the friction. Those come once more where it is asked for as the second.
        turned = {row[1] for row in _contacts(_ANY_BODY, body, _ANY_LINK, _ANY_LINK, self._client)}
        return [_touch(row, -1.0 if row[2] in turned else 1.0) for row in rows if row[9] > 0.0]

    def lowest(self, body: int) -> float:
        """Return the height (m) of the lowest point that may touch something, of a body without joints."""
        return float(pybullet.getAABB(body, -1, self._client)[0][2])

    def overlaps(self) -> int:
        """Return how many pairs of moving bodies have bounds that overlap."""
        bounds = []
        for index in range(pybullet.getNumBodies(self._client)):
            body = pybullet.getBodyUniqueId(index, self._client)
            joints = pybullet.getNumJoints(body, self._client)
            if joints or pybullet.getDynamicsInfo(body, -1, self._client)[0]:
                boxes = [pybullet.getAABB(body, link, self._client) for link in range(-1, joints)]
                bounds.append((np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)))
        if len(bounds) < 2:  # most often
            return 0
        low, high = np.array(bounds)[:, 0], np.array(bounds)[:, 1]
        meet = (low[:, None] <= high[None]).all(axis=2)
        return int(np.triu(meet & meet.T, k=1).sum())


def _normal(start: Vector, end: Vector, hit: Any) -> Vector:
    """Return the unit normal where a ray met something; against the ray if it begins inside: Bullet knows none then."""
    if hit[2] > 0.0:
        return hit[4]  # type: ignore[no-any-return] # PyBullet has no types
    length = dist(start, end)
    x, y, z = ((a - b) / length for a, b in zip(start, end))
    return x, y, z


def _touch(row: Any, sense: float) -> Touch:
    other, point, normal = row[2], row[5], row[7]
    push, first, along, second, across = row[9], row[10] * sense, row[11], row[12] * sense, row[13]
    x, y, z = (n * push + a * first + b * second for n, a, b in zip(normal, along, across))
    return Touch(other, point, normal, (x, y, z))
