"""Queries of PyBullet: rays, nearest points, contacts, bounds. Metres, newtons, world frame."""

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
_NO_BODY = -1  # the body of a ray without a hit
_PROBE = 1e-6  # m, radius of a sphere that stands for a point


class RayHit(NamedTuple):
    """What a ray hit: the body, the distance from the ray's start (m), the unit normal of the surface.

    If the ray begins in the body, or 1 mm from it, the distance is 0, and the normal is opposite to the ray.
    """

    body: int
    distance: float
    normal: Vector


class SurfacePoint(NamedTuple):
    """A point on a body's link (-1: the root): its position (m), and the unit normal of the surface."""

    body: int
    link: int
    point: Vector
    normal: Vector


class Gap(NamedTuple):
    """The nearest points of two links: the other body and link, the distance (m, below 0: penetration), the points."""

    body: int
    link: int
    distance: float
    own_point: Vector
    point: Vector


class ContactPoint(NamedTuple):
    """A contact in the last sub-step: the other body, position (m), unit normal, and the force (N) that it exerts."""

    body: int
    point: Vector
    normal: Vector
    force: Vector  # on the body of the query, with friction


class Queries:
    """Queries of one PyBullet client, by body and link (-1: the root)."""

    def __init__(self, client: int, collision_filter: CollisionFilter):
        """Use a PyBullet client; `collision_filter` knows its permeable links."""
        self._client = client
        self._filter = collision_filter
        self._contacts_of_parts: dict[int, dict[int, ContactPoint]] = {}  # by body, and by the other body
        self._probe: int | None = None  # a collision shape that stands for a point

    def ray(self, start: Vector, end: Vector, ignoring: int = -1) -> RayHit | None:
        """Return the nearest hit between two points (m), except on the body `ignoring`; None if there is none."""
        hit = pybullet.rayTest(start, end, physicsClientId=self._client)[0]
        if hit[0] == _NO_BODY:
            return None
        if hit[0] == ignoring:
            others = [other for other in self._all_hits(start, end) if other[0] != ignoring]
            if not others:
                return None
            hit = min(others, key=lambda other: other[2])  # PyBullet does not sort them
        return RayHit(hit[0], hit[2] * dist(start, end), _normal(start, end, hit))

    def rays(self, ends: Sequence[tuple[Vector, Vector]], counts: Callable[[int, int], bool]) -> list[SurfacePoint]:
        """Return the first hit of each ray (from, to, m) on a body and link for which `counts` is true."""
        starts, stops = zip(*ends)
        hits = []
        for start, stop, hit in zip(starts, stops, pybullet.rayTestBatch(starts, stops, physicsClientId=self._client)):
            if hit[0] != _NO_BODY and not counts(hit[0], hit[1]):
                others = [other for other in self._all_hits(start, stop) if counts(other[0], other[1])]
                hit = min(others, key=lambda other: other[2], default=(_NO_BODY,))
            if hit[0] != _NO_BODY:
                hits.append(SurfacePoint(hit[0], hit[1], hit[3], _normal(start, stop, hit)))
        return hits

    def _all_hits(self, start: Vector, end: Vector) -> Iterator[Any]:
        number = 0
        while True:
            hit = pybullet.rayTestBatch([start], [end], reportHitNumber=number, physicsClientId=self._client)[0]
            if hit[0] == _NO_BODY:
                return
            yield hit
            number += 1

    def nearest_points(
        self, point: Vector, reach: float, counts: Callable[[int, int], bool], *, measured: bool = False
    ) -> list[SurfacePoint]:
        """Return the points nearest to a point, within `reach` (m), of all bodies and links for which `counts` is true.

        `measured`: include bodies that contain the point, and links that collide with nothing; sensors see neither.
        """
        if self._probe is None:
            self._probe = pybullet.createCollisionShape(
                pybullet.GEOM_SPHERE, radius=_PROBE, physicsClientId=self._client
            )
        low, high = [x - reach for x in point], [x + reach for x in point]
        around = pybullet.getOverlappingObjects(low, high, physicsClientId=self._client) or ()
        points = []
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
                points += [SurfacePoint(body, link, row[6], row[7]) for row in rows if measured or row[8] > 0]
        return points

    def gaps(self, body: int, link: int, reach: float, counts: Callable[[int, int], bool]) -> list[Gap]:
        """Return the gaps between a body's link and other links within `reach` (m) for which `counts` is true.

        PyBullet finds none between two meshes that are not convex.
        """
        low, high = pybullet.getAABB(body, link, self._client)
        around = pybullet.getOverlappingObjects(
            [x - reach for x in low], [x + reach for x in high], physicsClientId=self._client
        )
        gaps = []
        for other in sorted(set(around or ())):
            if other != (body, link) and counts(*other):
                rows = pybullet.getClosestPoints(body, other[0], reach, link, other[1], physicsClientId=self._client)
                gaps += [Gap(other[0], other[1], row[8], row[5], row[6]) for row in rows]
        return gaps

    def contacts(self, body: int) -> list[ContactPoint]:
        """Return the contacts of a body in the last sub-step; one per other body if the sub-step was divided."""
        if body in self._contacts_of_parts:
            return list(self._contacts_of_parts[body].values())
        # Positional arguments are faster, and this runs in every sub-step.
        rows = _contacts(body, _ANY_BODY, _ANY_LINK, _ANY_LINK, self._client)
        return self._touches(body, rows) if rows else []

    def begin_sub_step(self, bodies: Iterable[int] = ()) -> None:
        """Forget the last sub-step's contacts; `end_part` will sum up those of `bodies`."""
        self._contacts_of_parts.clear()
        for body in bodies:
            self._contacts_of_parts[body] = {}

    def end_part(self, share: float) -> None:
        """Add the forces on those bodies in a part of the sub-step; `share`: its share of the duration."""
        for body, by_other in self._contacts_of_parts.items():
            for touch in self._touches(body, _contacts(body, _ANY_BODY, _ANY_LINK, _ANY_LINK, self._client)):
                x, y, z = by_other[touch.body].force if touch.body in by_other else (0.0, 0.0, 0.0)
                force = x + touch.force[0] * share, y + touch.force[1] * share, z + touch.force[2] * share
                by_other[touch.body] = touch._replace(force=force)

    def _touches(self, body: int, rows: Sequence[Any]) -> list[ContactPoint]:
        """Return a body's contacts that push it, from PyBullet's rows about it."""
        # If the requested body is the second one of a contact, PyBullet swaps bodies, positions and normal, but not the
        # friction. A request for it as the second body returns exactly these contacts.
        swapped = {row[1] for row in _contacts(_ANY_BODY, body, _ANY_LINK, _ANY_LINK, self._client)}
        touches = []
        for row in rows:
            if row[9] > 0.0:
                sign = -1.0 if row[2] in swapped else 1.0
                push, first, along, second, across = row[9], row[10] * sign, row[11], row[12] * sign, row[13]
                x, y, z = (n * push + a * first + b * second for n, a, b in zip(row[7], along, across))
                touches.append(ContactPoint(row[2], row[5], row[7], (x, y, z)))
        return touches

    def lowest(self, body: int) -> float:
        """Return the height (m) of the lowest point that can collide, of a body without joints."""
        return float(pybullet.getAABB(body, -1, self._client)[0][2])

    def overlaps(self) -> np.ndarray:
        """Return the pairs (n, 2) of moving bodies whose bounds overlap; permeable bodies do not count."""
        bodies, bounds = [], []
        for index in range(pybullet.getNumBodies(self._client)):
            body = pybullet.getBodyUniqueId(index, self._client)
            joints = pybullet.getNumJoints(body, self._client)
            is_moving = joints or pybullet.getDynamicsInfo(body, -1, self._client)[0]
            if is_moving and not all(self._filter.is_permeable(body, link) for link in range(-1, joints)):
                bodies.append(body)
                bounds.append(self._bounds(body))
        if len(bodies) < 2:  # the usual case
            return np.empty((0, 2), int)
        low, high = np.array(bounds)[:, 0], np.array(bounds)[:, 1]
        meet = (low[:, None] <= high[None]).all(axis=2)
        return np.array(bodies)[np.argwhere(np.triu(meet & meet.T, k=1))]

    def is_deep_inside(self, first: int, second: int) -> bool:
        """Return whether two bodies are in each other by more than a quarter of the shortest side of their bounds.

        Also if their centers are closer than a quarter of the depth: the bounds of a tilted disc are larger than it.
        """
        extent = min(float((high - low).min()) for low, high in map(self._bounds, (first, second)))
        rows = pybullet.getClosestPoints(first, second, 0.0, physicsClientId=self._client)
        is_permeable = self._filter.is_permeable
        depths = [-row[8] for row in rows if not (is_permeable(first, row[3]) or is_permeable(second, row[4]))]
        depth = max(depths, default=0.0)
        centers = [pybullet.getBasePositionAndOrientation(body, self._client)[0] for body in (first, second)]
        return depth > 0.25 * extent or dist(*centers) < 0.25 * depth

    def _bounds(self, body: int) -> tuple[Any, Any]:
        """Return the lowest and the highest corner (m) of the box around a body, in the world."""
        links = range(-1, pybullet.getNumJoints(body, self._client))
        boxes = [pybullet.getAABB(body, link, self._client) for link in links]
        return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def _normal(start: Vector, end: Vector, hit: Any) -> Vector:
    """Return the unit normal at a hit; opposite to a ray that begins inside, where Bullet has none."""
    if hit[2] > 0.0:
        return hit[4]  # type: ignore[no-any-return] # PyBullet has no types
    length = dist(start, end)
    x, y, z = ((a - b) / length for a, b in zip(start, end))
    return x, y, z
