"""The PyBullet world. Metres, kilograms, seconds, world frame ENU.

One thread owns it. Every call names its client, so several worlds can live in one process.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pybullet

from drone_sim.mechanics.frames import Matrix, Vector, cross, turned
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.state import UNTURNED, Pose, compose, inverse
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.shapes.compound import parts_of
from drone_sim.shapes.mass import inertia_of
from drone_sim.shapes.shape import WHITE, DrawnShape, Rgba, SceneShape
from drone_sim.shapes.urdf import Urdf
from drone_sim.world import assemblies, bodies
from drone_sim.world.assemblies import Link
from drone_sim.world.bullet_files import BulletFiles
from drone_sim.world.collision_filter import CollisionFilter
from drone_sim.world.dynamics import Dynamics
from drone_sim.world.joints import Joints
from drone_sim.world.pictures import Pictures
from drone_sim.world.queries import Queries
from drone_sim.world.rigid_links import RigidLinks
from drone_sim.world.saved_states import SavedStates

# (N s)²: the contact solver stops when the squared change of an impulse is below this. With PyBullet's default, 1e-7,
# bodies at rest rattle by some 1e-3 m/s², which only accelerometers measure; with this, by less than 1e-6 m/s².
_RESIDUAL_THRESHOLD = 1e-18
_FAR_UP = 1e6  # m
_unused: list[int] = []  # clients


def connect_ahead() -> None:
    """Connect a client in advance: its 30 MB serve the next world of this process, and of each of its forks."""
    if not _unused:
        _unused.append(pybullet.connect(pybullet.DIRECT))


class World:
    """A floor, objects and rigid bodies under gravity."""

    def __init__(self, sub_step: float, gravity: float, gui: bool = False, *, gyroscopic: bool = False):
        """Create an empty world that steps by `sub_step` (s); `gui` opens PyBullet's window.

        `gyroscopic`: bodies rotate by Euler's equations, not as in V-REP, which omits their term ω × Iω.
        Raises RuntimeError if `gui` finds no display.
        """
        self._files = BulletFiles()
        self._client = (
            _unused.pop() if _unused and not gui else pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
        )
        if self._client < 0:
            raise RuntimeError("PyBullet's window needs a display: set DISPLAY, or leave out gui:=true")
        # By default PyBullet keeps the content of every file for good, but none of ours is read twice.
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._sub_step, self._gravity, self._gyroscopic = sub_step, gravity, gyroscopic
        self._gui = gui
        if gui:
            pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        self._set_up()

    def clear(self) -> None:
        self.saved_states.forget_snapshots()
        pybullet.resetSimulation(physicsClientId=self._client)  # its first argument is not the client
        self._files.clear()
        self._set_up()

    def _set_up(self) -> None:
        client = self._client
        pybullet.setGravity(0, 0, self._gravity, client)
        pybullet.setTimeStep(self._sub_step, client)
        self._inertial_frames: dict[int, tuple[Pose, Pose]] = {}  # root from inertial, and its inverse
        self._made: bodies.Made = {}
        self.pictures = Pictures(client, self._files, window=self._gui)
        self.joints = Joints(client, self.pictures.look_anew)
        self.collision_filter = CollisionFilter(client, self._forget_motion_of)
        self.queries = Queries(client, self.collision_filter)
        self.rigid_links = RigidLinks(client)
        parts = self.queries, self.pictures, self._inertial_frames
        dynamics = Dynamics(client, self._sub_step, *parts, gyroscopic=self._gyroscopic)
        self._dynamics, self.shape_forces = dynamics, dynamics.shape_forces
        self.state, self.apply, self.advance = dynamics.state, dynamics.apply, dynamics.advance
        self.saved_states = SavedStates(client, self._forget_all_motion)

    def _forget_motion_of(self, body: int) -> None:
        self._dynamics.moved(body)
        self.pictures.moved(body)

    def _forget_all_motion(self) -> None:
        self._dynamics.all_moved()
        self.pictures.all_moved()

    def close(self) -> None:
        """Free the world; may be called repeatedly."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1
            self._files.close()

    # ---- building

    def add_floor(self, size: float, texture: str, ground: bool = False) -> int:
        """Add a square floor with its top at z = 0, `size` metres a side; with `ground`, bare ground lies around it.

        Returns its body id.
        """
        planes = bodies.floor_planes(size, ground)
        body = bodies.create_floor(self._client, self._files, planes)
        self.pictures.cover(body, texture, visual=0)
        self._register(body)
        self.set_material(body, -1, friction=1.0, restitution=1.0)  # 1: only the other body's values count
        self.pictures.set_floor(body, list(zip(planes, (texture, ""))))
        return body

    def add_object(
        self,
        shape: SceneShape,
        pose: Pose,
        *,
        mass: float = 0.0,
        color: Rgba = WHITE,
        texture: str = "",
    ) -> int:
        """Add an object of a scene; return its body id.

        mass: kg, spread evenly over the shape (a URDF states its own masses), 0 if static; color: rgba, 0..1; texture:
        path of an image.
        Raises ValueError, in one line, for a file that cannot be read.
        """
        if mass and not isinstance(shape, Urdf):
            parts = parts_of(shape, color)
            return self.add_assembly([Link(parts, mass=mass, inertia=inertia_of(parts, mass))], pose, [texture])[0]
        body = bodies.create(self._client, self._files, shape, pose, moves=mass != 0, color=color, made=self._made)
        self.pictures.cover(body, texture)
        self._register(body)
        self.set_pose(body, pose)  # again: PyBullet reads a URDF's pose in single precision
        if isinstance(shape, DrawnShape):
            self.pictures.set_looks(body, {-1: [(shape, texture)]})
        elif texture:
            self.pictures.set_texture(body, texture)
        return body

    def add_assembly(self, links: Sequence[Link], pose: Pose, textures: Sequence[str]) -> tuple[int, list[int]]:
        """Add a body of several links with the first link's frame at `pose`; return its id and the number of each link.

        `textures` has a path or '' for each link. Raises ValueError, in one line, for a file that cannot be read.
        """
        body, numbers = assemblies.create(self._client, self._files, links, pose)
        self.pictures.cover(body, textures[0])
        self._register(body)
        self.set_pose(body, pose)  # again: PyBullet reads a URDF's pose in single precision
        looks = {
            number: [(part.shape, texture) for part in link.parts if isinstance(part.shape, DrawnShape)]
            for number, link, texture in zip(numbers, links, textures)
        }
        self.pictures.set_looks(body, looks)
        return body, numbers

    def add_rigid_body(self, body: RigidBody, pose: Pose) -> int:
        """Add a merged URDF with its root link at `pose`, at rest; return its body id."""
        number = bodies.load_rigid_body(self._client, self._files, body.xml, pose)
        self._register(number)
        self.set_pose(number, pose)  # again: PyBullet reads a URDF's pose in single precision
        return number

    def remove(self, body: int) -> None:
        self.saved_states.forget_snapshots()
        self.rigid_links.forget(body)
        pybullet.removeBody(body, self._client)
        del self._inertial_frames[body]
        self.saved_states.forget(body)
        self.joints.forget(body)
        self.collision_filter.forget(body)
        self._dynamics.forget(body)
        self.pictures.remove(body)
        self._files.drop_old()

    def set_material(self, body: int, link: int, friction: float, restitution: float) -> None:
        """Set friction and restitution of a link (-1: the root). Bullet multiplies those of two links in contact."""
        pybullet.changeDynamics(
            body, link, lateralFriction=friction, restitution=restitution, physicsClientId=self._client
        )

    def set_color(self, body: int, rgba: Sequence[float], link: int | None = None) -> None:
        """Set the color (rgba, 0..1) of a link of a body, or of all links."""
        all_links = range(-1, pybullet.getNumJoints(body, self._client))
        for number in all_links if link is None else (link,):
            pybullet.changeVisualShape(body, number, rgbaColor=rgba, physicsClientId=self._client)
        self.pictures.forget(body)

    def _register(self, number: int) -> None:
        self.saved_states.forget_snapshots()
        bodies.set_material(self._client, number)
        info = pybullet.getDynamicsInfo(number, -1, self._client)
        inertial = Pose(info[3], info[4])
        from_root = inverse(inertial)
        if from_root.orientation == UNTURNED:
            from_root = Pose(from_root.position)  # with the same object UNTURNED: `state` compares it in every step
        self._inertial_frames[number] = (inertial, from_root)
        self.pictures.add(number, from_root)
        self._dynamics.add(number)

    # ---- dynamics

    def solve_contacts_for_instruments(self) -> None:
        """Solve contacts so accurately that an accelerometer measures a body at rest as at rest.

        This costs nothing in flight; the motion of bodies in contact differs in the last bits.
        """
        pybullet.setPhysicsEngineParameter(solverResidualThreshold=_RESIDUAL_THRESHOLD, physicsClientId=self._client)

    def inertial_frame(self, body: int) -> Matrix:
        """Return the transform root link from inertial frame (centre of mass, principal axes)."""
        return self._inertial_frames[body][0].matrix

    def inertia(self, body: int, link: int = -1) -> Inertia:
        """Return the inertia of a link (-1: the root) along its principal axes, which are given in its frame."""
        _, _, (a, b, c), centre, orientation, *_ = pybullet.getDynamicsInfo(body, link, self._client)
        return Inertia((a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c), Pose(centre, orientation).matrix)

    def is_finite(self) -> bool:
        """Return whether the poses and velocities of all bodies are finite."""
        states = [self.state(body) for body in self._inertial_frames]
        return bool(np.isfinite([number for state in states for part in state for number in part]).all())

    def set_pose(self, body: int, pose: Pose) -> None:
        """Place a body's root link at `pose`, at rest."""
        inertial = self._inertial_frames[body][0]
        centre, orientation = compose(pose, inertial)
        self._forget_motion_of(body)
        pybullet.resetBasePositionAndOrientation(body, centre, orientation, self._client)
        pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)

    def set_velocity(self, body: int, linear: Vector, angular: Vector) -> None:
        """Set the velocity of the frame of a body's root link (m/s, rad/s)."""
        arm = turned(self.state(body).orientation, self._inertial_frames[body][0].position)
        velocity = [a + b for a, b in zip(linear, cross(angular, arm))]
        pybullet.resetBaseVelocity(body, velocity, angular, self._client)
        self._forget_motion_of(body)

    def part(self, body: int) -> None:
        """End all contacts of a body by moving it far up: Bullet would keep them wherever else it is placed."""
        self.set_pose(body, Pose((0.0, 0.0, _FAR_UP)))
        pybullet.performCollisionDetection(self._client)

    def keep_initial_poses(self) -> None:
        """Save the poses of all bodies, at rest, and restore them, so that all runs begin equal to the last bit."""
        for body in self._inertial_frames:
            self.saved_states.keep(body)
        self.saved_states.begin_anew()
