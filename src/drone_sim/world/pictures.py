"""What can be seen of the world: PyBullet's visual shapes as neutral descriptions, and where they are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pybullet

from drone_sim.files.resources import identity_of
from drone_sim.mechanics.frames import Matrix, from_quaternion, multiply
from drone_sim.mechanics.state import Pose, compose
from drone_sim.shapes import REPORTED_SHAPES
from drone_sim.shapes.shape import DrawnShape
from drone_sim.shapes.visual import Visual
from drone_sim.world.bullet_files import BulletFiles

_TYPES = {getattr(pybullet, name): shape for name, shape in REPORTED_SHAPES.items()}


class _Placed(NamedTuple):
    visual: Visual
    link: int  # -1: the root link
    local: Matrix  # the link's frame from the visual


class Pictures:
    """The visual shapes of one client's bodies, read once for each body."""

    def __init__(self, client: int, origin: Callable[[str], str]):
        """Start with an empty world. `origin` returns the mesh file that one of PyBullet's was made from."""
        self._client = client
        self._origin = origin
        self._floor = -1
        self._textures: dict[int, str] = {}
        self._looks: dict[int, Mapping[int, Sequence[tuple[DrawnShape, str]]]] = {}
        self._hidden: set[tuple[int, int]] = set()
        self._parts: dict[int, list[_Placed]] = {}
        self._standing: dict[int, np.ndarray] = {}  # poses of what the dynamics does not move

    def set_floor(self, body: int, texture: str) -> None:
        """Say which body is the floor, which receives the shadows, and its texture; its second visual is the ground."""
        self._floor = body
        self.set_texture(body, texture)

    def set_looks(self, body: int, looks: Mapping[int, Sequence[tuple[DrawnShape, str]]]) -> None:
        """Say of which shapes a body's links (-1: the root) are, in their order, and what image covers each, or ''.

        PyBullet tells only of shapes that it has a word for.
        """
        self._looks[body] = looks

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
        self._standing.pop(body, None)

    def moved(self, body: int) -> None:
        """Look anew where a body stands: it has been put somewhere."""
        self._standing.pop(body, None)

    def all_moved(self) -> None:
        """Look anew where everything stands."""
        self._standing.clear()

    def remove(self, body: int) -> None:
        """Forget all about a body: it is gone, and PyBullet may give its number to another."""
        self.forget(body)
        self._looks.pop(body, None)
        self._hidden = {one for one in self._hidden if one[0] != body}
        self._textures.pop(body, None)
        if body == self._floor:
            self._floor = -1

    def place(self, body: int, places: Mapping[int, Matrix]) -> bool:
        """Move some of a body's visuals, by index, to places in their link's frame; return whether any moves."""
        parts = self._of(body)
        others = {index: place for index, place in places.items() if parts[index].local != place}
        if others:
            self.moved(body)
        for index, place in others.items():
            parts[index] = parts[index]._replace(local=place)
        return bool(others)

    def visuals(self, bodies: Iterable[int]) -> list[Visual]:
        """Return all that can be drawn of these bodies."""
        return [part.visual for body in bodies for part in self._of(body)]

    def places(self, bodies: Iterable[int]) -> list[tuple[int, int]]:
        """Return body and link (-1: the root) of each of their visuals."""
        return [(body, part.link) for body in bodies for part in self._of(body)]

    def poses(self, root_from_inertial: Mapping[int, Pose]) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4), of bodies given with the inverse of their inertial frame."""
        poses: list[np.ndarray] = [np.empty((0, 4, 4))]
        for body, inverse in root_from_inertial.items():
            if body in self._standing:
                poses.append(self._standing[body])
                continue
            centre = Pose(*pybullet.getBasePositionAndOrientation(body, self._client))
            root = compose(centre, inverse).matrix
            links = {-1: root}
            for part in self._of(body):
                if part.link not in links:
                    links[part.link] = from_quaternion(*pybullet.getLinkState(body, part.link, 0, 1, self._client)[4:6])
            local = np.tile(np.eye(4), (len(self._of(body)), 1, 1))
            local[:, :3] = np.reshape(
                [multiply(links[part.link], part.local) for part in self._of(body)] or np.empty(0), (-1, 3, 4)
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
        return [(_TYPES[row[2]].from_bullet(row[3], self._origin(row[4].decode())), texture) for row in rows]

    def _part(self, key: tuple[int, int], row: Sequence[Any], shape: DrawnShape, texture: str) -> _Placed:
        link, position, orientation, rgba = row[1], *row[5:8]
        floor, ground = key == (self._floor, 0), key == (self._floor, 1)
        texture = "" if ground else texture
        visual = Visual(
            key=key,
            shape=shape,
            rgba=tuple(rgba),
            texture=texture,
            edition=tuple(identity_of(one) for one in (*shape.files, texture) if one),
            floor=floor,
            ground=ground,
        )
        return _Placed(visual, link, from_quaternion(position, orientation))

    def tiny(
        self, camera: np.ndarray, size: tuple[int, int], vertical_fov: float, depths: tuple[float, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width) of PyBullet's software renderer.

        Slow, but always there. `camera` is the (4, 4) pose world from optical frame, `size` (width, height),
        the field of view in radians, `depths` the near and far plane; depth is in metres along the optical
        z, NaN where nothing is nearer than the far plane.
        """
        (width, height), (near, far) = size, depths
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
