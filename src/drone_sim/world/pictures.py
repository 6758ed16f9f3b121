"""What can be seen of the world: PyBullet's visual shapes as neutral descriptions, and where they are."""

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
_changes = itertools.count()  # of any world: what was seen in one is not mistaken for what is in another


class Place(NamedTuple):
    """Where a visual is in its link's frame; it turns about the z axis of a frame there, at a speed in rad/s."""

    local: Matrix  # the link's frame from the visual
    axis: Matrix = IDENTITY  # the link's frame from that which it turns in
    speed: float = 0.0

    def velocity(self, pose: np.ndarray) -> np.ndarray:
        """Return what is added to the link's velocities (6,), in the world, where the visual is at `pose` (4, 4)."""
        local, axis = (np.reshape((*one, 0, 0, 0, 1), (4, 4)) for one in (self.local, self.axis))
        around = pose @ np.linalg.inv(local) @ axis  # the frame that it turns in, in the world
        turn = self.speed * around[:3, 2]
        return np.array([*np.cross(turn, pose[:3, 3] - around[:3, 3]), *turn])


class _Placed(NamedTuple):
    visual: Visual
    link: int  # -1: the root link
    place: Place


class Pictures:
    """The visual shapes of one client's bodies, read once for each body: a subject for cameras (sensors.camera)."""

    changes: int  # another number than before whenever a picture may look different

    def __init__(self, client: int, files: BulletFiles, *, window: bool):
        """Start with an empty world. `files` are those that PyBullet reads; `window`: PyBullet shows it in one."""
        self._client = client
        self._files, self._window = files, window
        self._floor = -1
        self._inertial_from_root: dict[int, Pose] = {}
        self._textures: dict[int, str] = {}
        self._bullet_textures = Textures(client, files)
        self._looks: dict[int, Mapping[int, Sequence[tuple[DrawnShape, str]]]] = {}
        self._hidden: set[tuple[int, int]] = set()
        self._parts: dict[int, list[_Placed]] = {}
        self._standing: dict[int, np.ndarray] = {}  # poses of what the dynamics does not move
        self._poses: tuple[int, np.ndarray] | None = None  # of all visuals, and the changes that they are of
        self.look_anew()

    def add(self, body: int, inertial_from_root: Pose) -> None:
        """Know a body, where PyBullet says where its inertial frame is."""
        self._inertial_from_root[body] = inertial_from_root
        self.look_anew()

    def look_anew(self) -> None:
        """Take new pictures from now on: something may be elsewhere, or look different."""
        self.changes = next(_changes)

    def set_floor(self, body: int, looks: Sequence[tuple[DrawnShape, str]]) -> None:
        """Say which body is the floor, which receives the shadows, and its looks, of which the second is the ground."""
        self._floor = body
        self.set_looks(body, {-1: looks})

    def set_looks(self, body: int, looks: Mapping[int, Sequence[tuple[DrawnShape, str]]]) -> None:
        """Say of which shapes a body's links (-1: the root) are, in their order, and what image covers each, or ''.

        PyBullet tells only of shapes that it has a word for.
        """
        self._looks[body] = looks

    def cover(self, body: int, texture: str, visual: int = -1) -> None:
        """Cover a visual shape of a body (-1: all of its root link's) with an image, '' for none, as PyBullet draws."""
        self._bullet_textures.cover(body, texture, visual)
        if self._window:
            self._bullet_textures.show()

    def hide(self, body: int, link: int) -> None:
        """Leave a link (-1: the root) out of all pictures."""
        self._hidden.add((body, link))
        self.forget(body)

    def set_texture(self, body: int, texture: str) -> None:
        """Say which image covers a body: PyBullet does not tell."""
        self._textures[body] = texture

    def forget(self, body: int) -> None:
        """Read a body anew: it has changed."""
        self._parts.pop(body, None)
        self.moved(body)

    def moved(self, body: int) -> None:
        """Look anew where a body stands: it has been put somewhere."""
        self._standing.pop(body, None)
        self.look_anew()

    def all_moved(self) -> None:
        """Look anew where everything stands."""
        self._standing.clear()
        self.look_anew()

    def remove(self, body: int) -> None:
        """Forget all about a body: it is gone, and PyBullet may give its number to another."""
        self.forget(body)
        del self._inertial_from_root[body]
        self._bullet_textures.forget(body)
        self._looks.pop(body, None)
        self._hidden = {one for one in self._hidden if one[0] != body}
        self._textures.pop(body, None)
        if body == self._floor:
            self._floor = -1

    def place(self, body: int, places: Mapping[int, Place]) -> None:
        """Move some of a body's visuals, by index, to other places."""
        parts = self._of(body)
        others = {index: place for index, place in places.items() if parts[index].place != place}
        if others:
            self.moved(body)
        for index, place in others.items():
            parts[index] = parts[index]._replace(place=place)

    def visuals(self, bodies: Iterable[int] | None = None) -> list[Visual]:
        """Return what can be drawn of these bodies, or of all, in the order of `visual_poses`."""
        return [part.visual for body in self._chosen(bodies) for part in self._of(body)]

    def places(self, bodies: Iterable[int] | None = None) -> list[tuple[int, int]]:
        """Return body and link (-1: the root) of each of their visuals, or of all, in the order of `visuals`."""
        return [(body, part.link) for body in self._chosen(bodies) for part in self._of(body)]

    def visual_poses(self, bodies: Iterable[int] | None = None) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4), of these bodies, or of all."""
        if bodies is not None:
            return self._poses_of(bodies)
        if self._poses is None or self._poses[0] != self.changes:  # once for all cameras of a step
            self._poses = self.changes, self._poses_of(self._inertial_from_root)
        return self._poses[1]

    def visual_velocities(self) -> np.ndarray:
        """Return the velocities of the visuals' origins and of their turns, (N, 6), m/s and rad/s in the world."""
        poses = self.visual_poses()
        velocities = np.zeros((len(poses), 6))
        parts = ((body, part) for body in self._inertial_from_root for part in self._of(body))
        for number, ((body, part), pose) in enumerate(zip(parts, poses)):
            if body not in self._standing:
                centre, linear, angular = self._motion(body, part.link)
                velocities[number] = *(linear + np.cross(angular, pose[:3, 3] - centre)), *angular
            if part.place.speed:
                velocities[number] += part.place.velocity(pose)
        return velocities

    def _motion(self, body: int, link: int) -> np.ndarray:
        """Return where a link's centre of mass is, and its velocities, in the world, (3, 3)."""
        if link < 0:
            centre, _ = pybullet.getBasePositionAndOrientation(body, self._client)
            return np.array([centre, *pybullet.getBaseVelocity(body, self._client)])
        state = pybullet.getLinkState(body, link, 1, 1, self._client)
        return np.array([state[0], *state[6:8]])

    def _chosen(self, bodies: Iterable[int] | None) -> Iterable[int]:
        return self._inertial_from_root if bodies is None else bodies

    def _poses_of(self, bodies: Iterable[int]) -> np.ndarray:
        poses: list[np.ndarray] = [np.empty((0, 4, 4))]
        for body in bodies:
            if body in self._standing:
                poses.append(self._standing[body])
                continue
            centre = Pose(*pybullet.getBasePositionAndOrientation(body, self._client))
            root = compose(centre, self._inertial_from_root[body]).matrix
            links = {-1: root}
            for part in self._of(body):
                if part.link not in links:
                    links[part.link] = from_quaternion(*pybullet.getLinkState(body, part.link, 0, 1, self._client)[4:6])
            local = np.tile(np.eye(4), (len(self._of(body)), 1, 1))
            local[:, :3] = np.reshape(
                [multiply(links[part.link], part.place.local) for part in self._of(body)] or np.empty(0), (-1, 3, 4)
            )
            poses.append(local)
            mass = pybullet.getDynamicsInfo(body, -1, self._client)[0]
            if mass == 0 and pybullet.getNumJoints(body, self._client) == 0:
                self._standing[body] = local
        return np.concatenate(poses)

    def _of(self, body: int) -> list[_Placed]:
        if body not in self._parts:
            rows = pybullet.getVisualShapeData(body, physicsClientId=self._client)
            if self._hidden:
                rows = [row for row in rows if (body, row[1]) not in self._hidden]
            looks = self._looks_of(body, rows)
            self._parts[body] = [self._part((body, n), row, *look) for n, (row, look) in enumerate(zip(rows, looks))]
        return self._parts[body]

    def _looks_of(self, body: int, rows: Sequence[Sequence[Any]]) -> list[tuple[DrawnShape, str]]:
        """Return shape and texture of each visual."""
        if body in self._looks:  # a link without any has none but what PyBullet makes up
            left = {link: list(looks) for link, looks in self._looks[body].items()}
            return [left[row[1]].pop(0) for row in rows]
        texture = self._textures.get(body, "")
        origin = self._files.origin
        return [(_TYPES[row[2]].from_bullet(row[3], origin(row[4].decode())), texture) for row in rows]

    def _part(self, key: tuple[int, int], row: Sequence[Any], shape: DrawnShape, texture: str) -> _Placed:
        link, position, orientation, rgba = row[1], *row[5:8]
        floor, ground = key == (self._floor, 0), key == (self._floor, 1)
        visual = Visual(
            key=key,
            shape=shape,
            rgba=tuple(rgba),
            texture=texture,
            edition=tuple(identity_of(one) for one in (*shape.files, texture) if one),
            floor=floor,
            ground=ground,
        )
        return _Placed(visual, link, Place(from_quaternion(position, orientation)))

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width) of PyBullet's software renderer.

        Slow, but always there. `camera` is the (4, 4) pose world from optical frame, the field of view in radians,
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
        """Put the camera of PyBullet's window behind and above a place (m), looking along a yaw (rad)."""
        pybullet.resetDebugVisualizerCamera(1.2, np.degrees(yaw) - 90, -20, position, self._client)


class Textures:
    """Which image covers which body; PyBullet, whose window alone shows them, gets them when somebody looks."""

    def __init__(self, client: int, files: BulletFiles):
        """Begin with none."""
        self._client = client
        self._files = files
        self._waiting: dict[int, tuple[str, int]] = {}

    def cover(self, body: int, texture: str, visual: int = -1) -> None:
        """Cover a visual shape of a body (-1: all of its root link's) with an image, '' for none."""
        if texture:
            self._waiting[body] = (texture, visual)

    def show(self) -> None:
        """Give PyBullet those that it has not got yet."""
        while self._waiting:
            body, (texture, visual) = self._waiting.popitem()
            image = pybullet.loadTexture(self._files.texture(texture), physicsClientId=self._client)
            pybullet.changeVisualShape(body, -1, visual, textureUniqueId=image, physicsClientId=self._client)

    def forget(self, body: int) -> None:
        """Forget a body that is gone."""
        self._waiting.pop(body, None)
