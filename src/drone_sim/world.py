"""The PyBullet world: the only module that imports pybullet. Metres, kilograms, seconds, world frame ENU.

One thread owns it. Every call names its client, so several worlds can live in one process.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Dict, List, Mapping, Sequence, Tuple

import numpy as np
import pybullet

from drone_sim.frames import Matrix, cross, from_quaternion, from_rpy, to_quaternion
from drone_sim.propeller import Wrench
from drone_sim.state import Pose, State, compose, inverse
from drone_sim.urdf import RigidBody
from drone_sim.visual import Visual

_FLOOR_TILE = 2.0  # m covered by one floor texture
_FLOOR_THICKNESS = 0.1  # m, below z = 0


class World:
    """A floor, objects and rigid bodies under gravity."""

    def __init__(self, sub_step: float, gravity: float, gui: bool = False):
        """Make an empty world that steps by `sub_step` (s); `gui` opens PyBullet's window.

        Raises RuntimeError where `gui` finds no display.
        """
        self._client = pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
        if self._client < 0:
            raise RuntimeError("PyBullet's window needs a display: set DISPLAY, or leave out gui:=true")
        self._gui = gui
        self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_")
        self._inertial_frames: Dict[int, Tuple[Pose, Pose]] = {}  # root from inertial, and its inverse
        self._floor = -1
        self._visual_cache: Dict[int, List[Tuple[Visual, Matrix]]] = {}
        pybullet.setGravity(0, 0, gravity, self._client)
        pybullet.setTimeStep(sub_step, self._client)
        if gui:
            pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)

    def close(self) -> None:
        """Free the world; may be called twice."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1
            self._folder.cleanup()

    # ---- building

    def add_floor(self, size: float, texture: str) -> int:
        """Add a square floor with its top at z = 0, `size` metres a side; return its body id."""
        half = [size / 2, size / 2, _FLOOR_THICKNESS / 2]
        collision = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=half,
            collisionFramePosition=[0, 0, -_FLOOR_THICKNESS / 2],
            physicsClientId=self._client,
        )
        visual = pybullet.createVisualShape(
            pybullet.GEOM_MESH, fileName=self._write_floor_mesh(size, texture), physicsClientId=self._client
        )
        self._floor = self._add_body(0.0, collision, visual, (0, 0, 0), (0, 0, 0, 1))
        image = pybullet.loadTexture(texture, physicsClientId=self._client)
        pybullet.changeVisualShape(self._floor, -1, textureUniqueId=image, physicsClientId=self._client)
        return self._floor

    def add_box(
        self,
        size: Sequence[float],
        position: Sequence[float],
        rpy: Sequence[float],
        color: Sequence[float],
        mass: float,
    ) -> int:
        """Add a box (m, rad, rgba in 0..1, kg; mass 0 stands still); return its body id."""
        half = [length / 2 for length in size]
        collision = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=color, physicsClientId=self._client
        )
        return self._add_body(mass, collision, visual, position, to_quaternion(from_rpy((0, 0, 0), rpy)))

    def add_rigid_body(self, body: RigidBody, pose: Pose) -> int:
        """Add a merged URDF with its root link at `pose`, at rest; return its body id."""
        path = Path(self._folder.name) / "body.urdf"
        path.write_text(body.xml, encoding="utf-8")
        # The merged inertia is right; what PyBullet would derive from the collision shapes' bounds is not.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        number = pybullet.loadURDF(
            str(path), pose.position, pose.orientation, flags=flags, physicsClientId=self._client
        )
        self._set_material(number)
        self.set_pose(number, pose)  # again, for PyBullet reads a URDF's pose in single precision
        return number

    def _add_body(
        self, mass: float, collision: int, visual: int, position: Sequence[float], orientation: Sequence[float]
    ) -> int:
        number = pybullet.createMultiBody(mass, collision, visual, position, orientation, physicsClientId=self._client)
        self._set_material(number)
        return number

    def _set_material(self, number: int) -> None:
        # V-REP's Bullet material: friction 1, no restitution, no damping (PyBullet's default damps).
        pybullet.changeDynamics(
            number,
            -1,
            lateralFriction=1,
            restitution=0,
            linearDamping=0,
            angularDamping=0,
            activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
            physicsClientId=self._client,
        )
        info = pybullet.getDynamicsInfo(number, -1, self._client)
        inertial = Pose(info[3], info[4])
        self._inertial_frames[number] = (inertial, inverse(inertial))

    def _write_floor_mesh(self, size: float, texture: str) -> str:
        """Write a square whose texture repeats every _FLOOR_TILE metres, centred; return its path."""
        half, reach = size / 2, size / 2 / _FLOOR_TILE
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        lines = [f"v {x * half} {y * half} 0" for x, y in corners]
        lines += [f"vt {x * reach} {y * reach}" for x, y in corners]
        lines += ["vn 0 0 1", "f 1/1/1 2/2/1 3/3/1", "f 1/1/1 3/3/1 4/4/1", ""]
        path = Path(self._folder.name) / "floor.obj"
        path.write_text("\n".join(lines), encoding="utf-8")
        self._floor_texture = texture
        return str(path)

    # ---- dynamics

    def inertial_frame(self, body: int) -> Matrix:
        """Return the transform root link from inertial frame (centre of mass, principal axes)."""
        return self._inertial_frames[body][0].matrix

    def state(self, body: int) -> State:
        """Return pose and velocity of a body's root link."""
        centre, turn = pybullet.getBasePositionAndOrientation(body, self._client)
        linear, angular = pybullet.getBaseVelocity(body, self._client)
        root = compose(Pose(centre, turn), self._inertial_frames[body][1])
        arm = (root.position[0] - centre[0], root.position[1] - centre[1], root.position[2] - centre[2])
        swing = cross(angular, arm)
        velocity = (linear[0] + swing[0], linear[1] + swing[1], linear[2] + swing[2])
        return State(*root, velocity, angular)

    def set_pose(self, body: int, pose: Pose) -> None:
        """Move a body's root link to `pose` and stop it."""
        inertial = self._inertial_frames[body][0]
        centre, turn = compose(pose, inertial)
        pybullet.resetBasePositionAndOrientation(body, centre, turn, self._client)
        pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)

    def advance(self, wrenches: Mapping[int, Wrench], sub_steps: int) -> None:
        """Step `sub_steps` times, re-applying each body's wrench every time (PyBullet forgets it)."""
        # Local names and positional arguments: this loop is most of a step.
        client, in_world = self._client, pybullet.WORLD_FRAME
        where, push, turn, step = (
            pybullet.getBasePositionAndOrientation,
            pybullet.applyExternalForce,
            pybullet.applyExternalTorque,
            pybullet.stepSimulation,
        )
        for _ in range(sub_steps):
            for body, wrench in wrenches.items():
                centre, orientation = where(body, client)
                push(body, -1, wrench.force, centre, in_world, client)
                turn(body, -1, wrench.torque_under(orientation), in_world, client)
            step(client)

    # ---- pictures

    def visuals(self) -> List[Visual]:
        """Return everything that can be drawn, in the order of `visual_poses`."""
        return [visual for body in self._bodies() for visual, _ in self._shapes(body)]

    def visual_poses(self) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4)."""
        poses = []
        for body in self._bodies():
            shapes = self._shapes(body)
            root = np.eye(4)
            centre = pybullet.getBasePositionAndOrientation(body, self._client)
            at = compose(Pose(*centre), self._inertial_frames[body][1])
            root[:3] = np.reshape(at.matrix, (3, 4))
            local = np.tile(np.eye(4), (len(shapes), 1, 1))
            local[:, :3] = np.reshape([pose for _, pose in shapes], (-1, 3, 4))
            poses.append(root @ local)
        return np.concatenate(poses) if poses else np.empty((0, 4, 4))

    def place_visuals(self, body: int, places: Mapping[int, Matrix]) -> None:
        """Move some of a body's visuals, by index, to other places in its root link's frame."""
        shapes = self._shapes(body)
        for index, place in places.items():
            shapes[index] = (shapes[index][0], place)

    def _bodies(self) -> List[int]:
        count = pybullet.getNumBodies(self._client)
        return [pybullet.getBodyUniqueId(index, self._client) for index in range(count)]

    def _shapes(self, body: int) -> List[Tuple[Visual, Matrix]]:
        if body not in self._visual_cache:
            data = pybullet.getVisualShapeData(body, physicsClientId=self._client)
            self._visual_cache[body] = [self._shape((body, index), *row[2:8]) for index, row in enumerate(data)]
        return self._visual_cache[body]

    def _shape(
        self,
        key: Tuple[int, int],
        kind: int,
        dimensions: Sequence[float],
        file: bytes,
        position: Sequence[float],
        orientation: Sequence[float],
        rgba: Sequence[float],
    ) -> Tuple[Visual, Matrix]:
        shape, size = _shape_and_size(kind, dimensions)
        is_floor = key[0] == self._floor
        visual = Visual(
            key=key,
            shape=shape,
            size=size,
            rgba=(rgba[0], rgba[1], rgba[2], rgba[3]),
            file=file.decode() if shape == "mesh" else "",
            texture=self._floor_texture if is_floor else "",
            floor=is_floor,
        )
        return visual, from_quaternion(position, orientation)

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Return RGB (height, width, 3) and depth (height, width) of PyBullet's software renderer.

        Slow, but always there. `camera` is the (4, 4) pose world from optical frame; the field of view is
        in radians; depth is in metres along the optical z, NaN where nothing is nearer than `far`.
        """
        gl_from_optical = np.diag([1.0, -1.0, -1.0, 1.0])
        view = gl_from_optical @ np.linalg.inv(camera)
        aspect, degrees = width / height, np.degrees(vertical_fov)
        projection = pybullet.computeProjectionMatrixFOV(degrees, aspect, near, far, self._client)
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
        """Put the camera of PyBullet's window behind and above a place; nothing without `gui`."""
        if self._gui:
            pybullet.resetDebugVisualizerCamera(2.0, np.degrees(yaw) - 90, -20, position, self._client)


def _shape_and_size(kind: int, dimensions: Sequence[float]) -> Tuple[str, Tuple[float, ...]]:
    if kind == pybullet.GEOM_CYLINDER or kind == pybullet.GEOM_CAPSULE:
        length, radius = dimensions[:2]  # PyBullet's order
        return ("cylinder" if kind == pybullet.GEOM_CYLINDER else "capsule"), (radius, length)
    if kind == pybullet.GEOM_SPHERE:
        return "sphere", (dimensions[0],)
    if kind == pybullet.GEOM_PLANE:
        return "plane", ()
    return ("box" if kind == pybullet.GEOM_BOX else "mesh"), tuple(dimensions)
