"""The visual shapes of PyBullet's bodies as neutral descriptions, and their poses."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pybullet

from drone_sim.files.resources import identity_of
from drone_sim.mechanics.frames import IDENTITY, Matrix, from_quaternion, multiply
from drone_sim.mechanics.state import Pose, compose
from drone_sim.shapes import REPORTED_SHAPES
from drone_sim.shapes.shape import DrawnShape
from drone_sim.shapes.visual import Visual
from drone_sim.world.bullet_files import BulletFiles

_TYPES = {getattr(pybullet, name): shape for name, shape in REPORTED_SHAPES.items()}
_changes = itertools.count()  # shared by all worlds, so that no two worlds have the same number


class Place(NamedTuple):
    """Pose of a visual in its link's frame; it rotates about the z axis of the frame `axis`, at `speed` (rad/s)."""

    local: Matrix  # link from visual
    axis: Matrix = IDENTITY  # link from the frame of rotation
    speed: float = 0.0

    def velocity(self, pose: np.ndarray) -> np.ndarray:
        """Return the velocity (6,) that the rotation adds to the link's, in the world; `pose` (4, 4): of the visual."""
        local, axis = (np.reshape((*m, 0, 0, 0, 1), (4, 4)) for m in (self.local, self.axis))
        frame = pose @ np.linalg.inv(local) @ axis  # world from the frame of rotation
        angular = self.speed * frame[:3, 2]
        return np.array([*np.cross(angular, pose[:3, 3] - frame[:3, 3]), *angular])


class _Part(NamedTuple):
    visual: Visual
    link: int  # -1: the root link
    place: Place


class Pictures:
    """The visual shapes of one client's bodies, read once per body; cameras (sensors.camera) draw them."""

    changes: int  # a new number whenever a picture may have changed

    def __init__(self, client: int, files: BulletFiles, *, window: bool):
        """Start with an empty world. `files` are those that PyBullet reads; `window`: PyBullet has a window."""
        self._client = client
        self._files, self._window = files, window
        self._floor = -1
        self._inertial_from_root: dict[int, Pose] = {}
        self._textures: dict[int, str] = {}
        self._bullet_textures = Textures(client, files)
        self._shapes: dict[int, Mapping[int, Sequence[tuple[DrawnShape, str]]]] = {}
        self._hidden: set[tuple[int, int]] = set()
        self._parts: dict[int, list[_Part]] = {}
        self._static_poses: dict[int, np.ndarray] = {}  # of bodies that the dynamics does not move
        self._poses: tuple[int, np.ndarray] | None = None  # of all visuals, cached for that value of `changes`
        self.look_anew()

    def add(self, body: int, inertial_from_root: Pose) -> None:
        """Add a body; PyBullet returns only the pose of its inertial frame."""
        self._inertial_from_root[body] = inertial_from_root
        self.look_anew()

    def look_anew(self) -> None:
        """Mark all pictures as outdated."""
        self.changes = next(_changes)

    def set_floor(self, body: int, looks: Sequence[tuple[DrawnShape, str]]) -> None:
        """Set the body of the floor, on which shadows fall, and its `looks`; the second, if any, is the ground."""
        self._floor = body
        self.set_looks(body, {-1: looks})

    def set_looks(self, body: int, looks: Mapping[int, Sequence[tuple[DrawnShape, str]]]) -> None:
        """Set shapes and textures ('': none) of the visuals of a body's links (-1: the root), in their order.

        PyBullet can only report shapes that it has a type for.
        """
        self._shapes[body] = looks

    def cover(self, body: int, texture: str, visual: int = -1) -> None:
        """Set the texture ('': none) of a visual of a body's root link (-1: of all) in PyBullet's own pictures."""
        self._bullet_textures.cover(body, texture, visual)
        if self._window:
            self._bullet_textures.show()

    def hide(self, body: int, link: int) -> None:
        """Omit a link (-1: the root) from all pictures."""
        self._hidden.add((body, link))
        self.forget(body)

    def set_texture(self, body: int, texture: str) -> None:
        """Set the texture of a body, which PyBullet does not report."""
        self._textures[body] = texture

    def forget(self, body: int) -> None:
        """Forget the visuals of a body, which have changed, so that they are read again."""
        self._parts.pop(body, None)
        self.moved(body)

    def moved(self, body: int) -> None:
        """Forget the pose of a body that was placed elsewhere."""
        self._static_poses.pop(body, None)
        self.look_anew()

    def all_moved(self) -> None:
        self._static_poses.clear()
        self.look_anew()

    def remove(self, body: int) -> None:
        """Forget everything about a removed body, whose number PyBullet may reuse."""
        self.forget(body)
        del self._inertial_from_root[body]
        self._bullet_textures.forget(body)
        self._shapes.pop(body, None)
        self._hidden = {key for key in self._hidden if key[0] != body}
        self._textures.pop(body, None)
        if body == self._floor:
            self._floor = -1

    def place(self, body: int, places: Mapping[int, Place]) -> None:
        """Move visuals of a body, by index, to other places in their links."""
        parts = self._parts_of(body)
        changed = {index: place for index, place in places.items() if parts[index].place != place}
        if changed:
            self.moved(body)
        for index, place in changed.items():
            parts[index] = parts[index]._replace(place=place)

    def visuals(self, bodies: Iterable[int] | None = None) -> list[Visual]:
        """Return the visuals of some bodies, or of all, in the order of `visual_poses`."""
        return [part.visual for body in self._bodies_or_all(bodies) for part in self._parts_of(body)]

    def places(self, bodies: Iterable[int] | None = None) -> list[tuple[int, int]]:
        """Return body and link (-1: the root) of each visual of some bodies, or of all, in the order of `visuals`."""
        return [(body, part.link) for body in self._bodies_or_all(bodies) for part in self._parts_of(body)]

    def visual_poses(self, bodies: Iterable[int] | None = None) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4), of the visuals of some bodies, or of all."""
        if bodies is not None:
            return self._poses_of(bodies)
        if self._poses is None or self._poses[0] != self.changes:  # once for all cameras of a step
            self._poses = self.changes, self._poses_of(self._inertial_from_root)
        return self._poses[1]

    def visual_velocities(self) -> np.ndarray:
        """Return linear velocity of the origin, and angular velocity, of all visuals, (N, 6), m/s, rad/s, world."""
        poses = self.visual_poses()
        velocities = np.zeros((len(poses), 6))
        parts = ((body, part) for body in self._inertial_from_root for part in self._parts_of(body))
        for number, ((body, part), pose) in enumerate(zip(parts, poses)):
            if body not in self._static_poses:
                centre, linear, angular = self._motion(body, part.link)
                velocities[number] = *(linear + np.cross(angular, pose[:3, 3] - centre)), *angular
            if part.place.speed:
                velocities[number] += part.place.velocity(pose)
        return velocities

    def _motion(self, body: int, link: int) -> np.ndarray:
        """Return a link's centre of mass and its velocities in the world, (3, 3)."""
        if link < 0:
            centre, _ = pybullet.getBasePositionAndOrientation(body, self._client)
            return np.array([centre, *pybullet.getBaseVelocity(body, self._client)])
        state = pybullet.getLinkState(body, link, 1, 1, self._client)
        return np.array([state[0], *state[6:8]])

    def _bodies_or_all(self, bodies: Iterable[int] | None) -> Iterable[int]:
        return self._inertial_from_root if bodies is None else bodies

    def _poses_of(self, bodies: Iterable[int]) -> np.ndarray:
        poses: list[np.ndarray] = [np.empty((0, 4, 4))]
        for body in bodies:
            if body in self._static_poses:
                poses.append(self._static_poses[body])
                continue
            centre = Pose(*pybullet.getBasePositionAndOrientation(body, self._client))
            root = compose(centre, self._inertial_from_root[body]).matrix
            links = {-1: root}
            for part in self._parts_of(body):
                if part.link not in links:
                    links[part.link] = from_quaternion(*pybullet.getLinkState(body, part.link, 0, 1, self._client)[4:6])
            local = np.tile(np.eye(4), (len(self._parts_of(body)), 1, 1))
            local[:, :3] = np.reshape(
                [multiply(links[part.link], part.place.local) for part in self._parts_of(body)] or np.empty(0),
                (-1, 3, 4),
            )
            poses.append(local)
            mass = pybullet.getDynamicsInfo(body, -1, self._client)[0]
            if mass == 0 and pybullet.getNumJoints(body, self._client) == 0:
                self._static_poses[body] = local
        return np.concatenate(poses)

    def _parts_of(self, body: int) -> list[_Part]:
        if body not in self._parts:
            rows = pybullet.getVisualShapeData(body, physicsClientId=self._client)
            if self._hidden:
                rows = [row for row in rows if (body, row[1]) not in self._hidden]
            looks = self._shapes_of(body, rows)
            self._parts[body] = [self._part((body, n), row, *look) for n, (row, look) in enumerate(zip(rows, looks))]
        return self._parts[body]

    def _shapes_of(self, body: int, rows: Sequence[Sequence[Any]]) -> list[tuple[DrawnShape, str]]:
        if body in self._shapes:  # PyBullet reports the visuals of a link in the order in which it was given them
            remaining = {link: list(looks) for link, looks in self._shapes[body].items()}
            return [remaining[row[1]].pop(0) for row in rows]
        texture = self._textures.get(body, "")
        origin = self._files.origin
        return [(_TYPES[row[2]].from_bullet(row[3], origin(row[4].decode())), texture) for row in rows]

    def _part(self, key: tuple[int, int], row: Sequence[Any], shape: DrawnShape, texture: str) -> _Part:
        link, position, orientation, rgba = row[1], *row[5:8]
        floor, ground = key == (self._floor, 0), key == (self._floor, 1)
        visual = Visual(
            key=key,
            shape=shape,
            rgba=tuple(rgba),
            texture=texture,
            edition=tuple(identity_of(file) for file in (*shape.files, texture) if file),
            floor=floor,
            ground=ground,
        )
        return _Part(visual, link, Place(from_quaternion(position, orientation)))

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width) from PyBullet's software renderer.

        Slow, but always available. `camera` is the pose (4, 4) world from optical frame, the field of view in radians,
        `near` and `far` in metres; depth is in metres along the optical z, NaN where nothing is nearer than `far`.
        """
        self._bullet_textures.show()
        gl_from_optical = np.diag([1.0, -1.0, -1.0, 1.0])
        view = gl_from_optical @ np.linalg.inv(camera)
        projection = pybullet.computeProjectionMatrixFOV(
            np.degrees(vertical_fov), width / height, near, far, self._client
        )
        picture = pybullet.getCameraImage(
            width,
            height,
            view.T.ravel().tolist(),
            projection,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=self._client,
        )
        color = np.ascontiguousarray(np.reshape(picture[2], (height, width, 4))[:, :, :3], dtype=np.uint8)
        buffer = np.reshape(picture[3], (height, width))
        depth = np.where(buffer < 1, far * near / (far - (far - near) * buffer), np.nan)
        return color, depth.astype(np.float32)

    def look_from_behind(self, position: Sequence[float], yaw: float) -> None:
        """Place the camera of PyBullet's window behind and above a position (m), looking along a yaw (rad)."""
        pybullet.resetDebugVisualizerCamera(1.2, np.degrees(yaw) - 90, -20, position, self._client)


class Textures:
    """Textures of PyBullet's visuals. They are loaded late, because only PyBullet's own pictures show them."""

    def __init__(self, client: int, files: BulletFiles):
        self._client = client
        self._files = files
        self._waiting: dict[int, tuple[str, int]] = {}

    def cover(self, body: int, texture: str, visual: int = -1) -> None:
        """Set the texture ('': none) of a visual of a body's root link (-1: of all)."""
        if texture:
            self._waiting[body] = (texture, visual)

    def show(self) -> None:
        """Load all textures that PyBullet does not have yet."""
        while self._waiting:
            body, (texture, visual) = self._waiting.popitem()
            image = pybullet.loadTexture(self._files.texture(texture), physicsClientId=self._client)
            pybullet.changeVisualShape(body, -1, visual, textureUniqueId=image, physicsClientId=self._client)

    def forget(self, body: int) -> None:
        self._waiting.pop(body, None)
