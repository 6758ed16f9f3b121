"""The PyBullet world. Metres, kilograms, seconds, world frame ENU.

One thread owns it. Every call names its client, so several worlds can live in one process.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping, Sequence
from xml.etree import ElementTree as Xml

import numpy as np
import pybullet

from drone_sim.mechanics.frames import Matrix, Quaternion, Vector, cross, multiply_quaternions, turned
from drone_sim.mechanics.inertia import Inertia
from drone_sim.mechanics.state import Pose, State, compose, inverse
from drone_sim.mechanics.urdf import RigidBody
from drone_sim.mechanics.wrench import Wrench
from drone_sim.shapes.compound import parts_of
from drone_sim.shapes.mass import inertia_of
from drone_sim.shapes.shape import WHITE, DrawnShape, Rgba, SceneShape
from drone_sim.shapes.urdf import Urdf
from drone_sim.shapes.visual import Visual
from drone_sim.world import assemblies, bodies
from drone_sim.world.assemblies import Link
from drone_sim.world.bullet_files import BulletFiles
from drone_sim.world.collision_filter import CollisionFilter
from drone_sim.world.gyroscopic_term import GyroscopicTerm, NoGyroscopicTerm
from drone_sim.world.impacts import Impacts
from drone_sim.world.initial_poses import InitialPoses
from drone_sim.world.joints import Joints
from drone_sim.world.pictures import Pictures, Textures
from drone_sim.world.queries import Queries
from drone_sim.world.shape_forces import ShapeForces

_changes = itertools.count()  # of any world: what was seen in one is not mistaken for what is in another
_NO_TURN = (0.0, 0.0, 0.0, 1.0)
# (N s)², the square of the last change of an impulse after which Bullet holds the contacts for solved. With PyBullet's
# 1e-7 what lies still rattles at some 1e-3 m/s², which only an accelerometer feels; this is less than 1e-6 m/s².
_SOLVED = 1e-18
_FAR_UP = 1e6  # m
_Load = tuple[int, Vector, Vector, Sequence[tuple[float, ...]]]  # a body, and what Wrench has
_where, _pull, _turn = pybullet.getBasePositionAndOrientation, pybullet.applyExternalForce, pybullet.applyExternalTorque
_step, _IN_WORLD = pybullet.stepSimulation, pybullet.WORLD_FRAME
_ahead: list[int] = []  # clients that nobody has used yet


def connect_ahead() -> None:
    """Let the next world of this process, and the first of each of its forks, find its 30 MB allocated already."""
    if not _ahead:
        _ahead.append(pybullet.connect(pybullet.DIRECT))


class World:
    """A floor, objects and rigid bodies under gravity."""

    def __init__(self, sub_step: float, gravity: float, gui: bool = False, *, gyroscopic: bool = False):
        """Make an empty world that steps by `sub_step` (s); `gui` opens PyBullet's window.

        `gyroscopic`: bodies turn as Euler's equations say, and not as in V-REP, which leaves out their term ω × Iω.
        Raises RuntimeError where `gui` finds no display.
        """
        self._files = BulletFiles()
        self._client = (
            _ahead.pop() if _ahead and not gui else pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
        )
        if self._client < 0:
            raise RuntimeError("PyBullet's window needs a display: set DISPLAY, or leave out gui:=true")
        # Of each file it reads PyBullet would keep the content for good, and none of ours is read twice.
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._sub_step, self._gravity, self._gyroscopic = sub_step, gravity, gyroscopic
        self._snapshots: set[int] = set()
        self._gui = gui
        if gui:
            pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        self.clear()

    def clear(self) -> None:
        """Remove everything."""
        self._forget_snapshots()  # PyBullet would keep them
        pybullet.resetSimulation(physicsClientId=self._client)  # its first argument is another
        pybullet.setGravity(0, 0, self._gravity, self._client)
        pybullet.setTimeStep(self._sub_step, self._client)
        self._inertial_frames: dict[int, tuple[Pose, Pose]] = {}  # root from inertial, and its inverse
        self._centres: dict[int, tuple[Vector, Quaternion]] = {}  # inertial frames' poses, read since the last step
        self._initial_poses = InitialPoses(self._client)
        self._poses: tuple[int, np.ndarray] | None = None  # of all visuals, and the changes that they are of
        self._files.clear()
        self._made: bodies.Made = {}
        self.pictures = Pictures(self._client, self._files.origin)
        self._textures = Textures(self._client, self._files)
        self.joints = Joints(self._client, self._look_anew)
        self._gyroscopic_term = GyroscopicTerm(self._client) if self._gyroscopic else NoGyroscopicTerm(self._client)
        self._impacts = Impacts(self._client, self._sub_step)
        self._turns: dict[
            int, Quaternion
        ] = {}  # attitudes before the last (part of a) sub-step, of what wrenches act on
        self._speeds: dict[int, Vector] = {}  # m/s, of centres of mass, read since the last step
        self.collision_filter = CollisionFilter(self._client, self.pictures.moved)
        self.queries = Queries(self._client, self.collision_filter)
        self.shape_forces = ShapeForces(self._client)
        self._applied: list[tuple[int, Wrench]] = []  # through the next sub-step

    def _look_anew(self) -> None:
        self.changes = next(_changes)

    def _forget_snapshots(self) -> None:
        self.changes = next(_changes)
        for number in self._snapshots:
            pybullet.removeState(number, physicsClientId=self._client)
        self._snapshots.clear()

    def close(self) -> None:
        """Free the world; may be called twice."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1
            self._files.close()

    # ---- building

    def add_floor(self, size: float, texture: str, ground: bool = False) -> int:
        """Add a square floor with its top at z = 0, `size` metres a side, and bare ground around it if asked for.

        Returns its body id.
        """
        body = bodies.create_floor(self._client, self._files, size, ground)
        self._cover(body, texture, visual=0)
        self._set_material(body)
        self.pictures.set_floor(body, texture)
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

        mass: kg, 0 stands still; it fills the shape evenly, but for a URDF, which says its own; color: rgba, 0..1;
        texture: path of an image.
        Raises ValueError, in one line, for a file that cannot be read.
        """
        if mass and not isinstance(shape, Urdf):
            parts = parts_of(shape, color)
            return self.add_assembly([Link(parts, mass=mass, inertia=inertia_of(parts, mass))], pose, [texture])[0]
        body = bodies.create(self._client, self._files, shape, pose, moves=mass != 0, color=color, made=self._made)
        self._cover(body, texture)
        self._set_material(body)
        self.set_pose(body, pose)  # again, for PyBullet reads a URDF's pose in single precision
        if isinstance(shape, DrawnShape):
            self.pictures.set_looks(body, {-1: [(shape, texture)]})
        elif texture:
            self.pictures.set_texture(body, texture)
        return body

    def add_assembly(self, links: Sequence[Link], pose: Pose, textures: Sequence[str]) -> tuple[int, list[int]]:
        """Add a body of several links, its first one's frame at `pose`; return its id and the number of each link.

        `textures` has for each link the path of an image, or ''. Raises ValueError, in one line, for a file that
        cannot be read.
        """
        body, numbers = assemblies.create(self._client, self._files, links, pose)
        self._cover(body, textures[0])
        self._set_material(body)
        self.set_pose(body, pose)  # again, for PyBullet reads a URDF's pose in single precision
        looks = {
            number: [(part.shape, texture) for part in link.parts if isinstance(part.shape, DrawnShape)]
            for number, link, texture in zip(numbers, links, textures)
        }
        self.pictures.set_looks(body, looks)
        return body, numbers

    def add_rigid_body(self, body: RigidBody, pose: Pose) -> int:
        """Add a merged URDF with its root link at `pose`, at rest; return its body id."""
        path = self._files.urdf(Xml.fromstring(body.xml))
        # The merged inertia is right; what PyBullet would derive from the collision shapes' bounds is not.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        number = pybullet.loadURDF(path, pose.position, pose.orientation, flags=flags, physicsClientId=self._client)
        os.unlink(path)  # or there would be one more file for every vehicle that has come
        self._set_material(number)
        self.set_pose(number, pose)  # again, for PyBullet reads a URDF's pose in single precision
        return number

    def _cover(self, body: int, texture: str, visual: int = -1) -> None:
        self._textures.cover(body, texture, visual)
        if self._gui:
            self._textures.show()

    def remove(self, body: int) -> None:
        """Take a body out of the world."""
        self._forget_snapshots()  # of other bodies than there will be
        pybullet.removeBody(body, self._client)
        del self._inertial_frames[body]
        self._initial_poses.forget(body)
        self.joints.forget(body)
        self._gyroscopic_term.forget(body)
        self._turns.pop(body, None)
        self._impacts.forget(body)
        self.collision_filter.forget(body)
        self.shape_forces.forget(body)
        self._textures.forget(body)
        self._centres.pop(body, None)
        self._speeds.pop(body, None)
        self.pictures.remove(body)
        self._files.drop_old()

    def set_color(self, body: int, rgba: Sequence[float], link: int | None = None) -> None:
        """Paint a link of a body, or all of it (0..1 each)."""
        everything = range(-1, pybullet.getNumJoints(body, self._client))
        for one in everything if link is None else (link,):
            pybullet.changeVisualShape(body, one, rgbaColor=rgba, physicsClientId=self._client)
        self.pictures.forget(body)
        self.changes = next(_changes)

    def _set_material(self, number: int) -> None:
        self._forget_snapshots()
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
        backwards = inverse(inertial)
        if backwards.orientation == _NO_TURN:
            backwards = Pose(backwards.position, _NO_TURN)  # the very same one: `state` looks in every step
        self.changes = next(_changes)
        self._inertial_frames[number] = (inertial, backwards)
        self._gyroscopic_term.add(number)
        self._impacts.add(number)

    # ---- dynamics

    def solve_contacts_for_instruments(self) -> None:
        """Solve contacts so far that what lies still does so for an accelerometer, too.

        It costs nothing in flight; what touches something goes another way in its last bits.
        """
        pybullet.setPhysicsEngineParameter(solverResidualThreshold=_SOLVED, physicsClientId=self._client)

    def inertial_frame(self, body: int) -> Matrix:
        """Return the transform root link from inertial frame (centre of mass, principal axes)."""
        return self._inertial_frames[body][0].matrix

    def inertia(self, body: int, link: int = -1) -> Inertia:
        """Return how the mass of a link (-1: the root) lies in its frame: along its principal axes."""
        _, _, (a, b, c), place, turn, *_ = pybullet.getDynamicsInfo(body, link, self._client)
        return Inertia((a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c), Pose(place, turn).matrix)

    def state(self, body: int) -> State:
        """Return pose and velocity of a body's root link."""
        centre, turn = self._centres[body] = pybullet.getBasePositionAndOrientation(body, self._client)
        (vx, vy, vz), angular = pybullet.getBaseVelocity(body, self._client)
        self._speeds[body] = vx, vy, vz
        inertial, backwards = self._inertial_frames[body]
        orientation = turn if backwards.orientation is _NO_TURN else multiply_quaternions(turn, backwards.orientation)
        arm = turned(orientation, inertial.position)  # from the root link to the centre of mass
        sx, sy, sz = cross(angular, arm)
        position = (centre[0] - arm[0], centre[1] - arm[1], centre[2] - arm[2])
        return State(position, orientation, (vx - sx, vy - sy, vz - sz), angular)

    def is_finite(self) -> bool:
        """Whether every body is somewhere, and as fast as numbers go."""
        states = [self.state(body) for body in self._inertial_frames]
        return bool(np.isfinite([number for state in states for part in state for number in part]).all())

    def set_pose(self, body: int, pose: Pose) -> None:
        """Move a body's root link to `pose` and stop it."""
        inertial = self._inertial_frames[body][0]
        centre, turn = compose(pose, inertial)
        self.changes = next(_changes)
        self._centres.pop(body, None)
        self._speeds.pop(body, None)
        self.pictures.moved(body)
        pybullet.resetBasePositionAndOrientation(body, centre, turn, self._client)
        pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)

    def set_velocity(self, body: int, linear: Vector, angular: Vector) -> None:
        """Let the frame of a body's root link move so fast (m/s, rad/s)."""
        arm = turned(self.state(body).orientation, self._inertial_frames[body][0].position)
        velocity = [one + more for one, more in zip(linear, cross(angular, arm))]
        pybullet.resetBaseVelocity(body, velocity, angular, self._client)
        self._speeds.pop(body, None)

    def part(self, body: int) -> None:
        """Take a body out of every contact, which Bullet would remember wherever it goes; it is far up then."""
        self.set_pose(body, Pose((0.0, 0.0, _FAR_UP)))
        pybullet.performCollisionDetection(self._client)

    def advance(
        self, wrenches: Mapping[int, Wrench], sub_steps: int, between: Callable[[int], None] | None = None
    ) -> None:
        """Step `sub_steps` times, re-applying each body's wrench every time (PyBullet forgets it).

        `between` is called with 0 before the first of these sub-steps, and after each with how many there have been.
        """
        loads = [(body, wrench.force, *wrench.terms) for body, wrench in wrenches.items()]
        any_fast = self._impacts.begin_step(sub_steps, self._speeds)
        if not any_fast:
            self.queries.begin_sub_step()
        self._gyroscopic_term.begin_step()
        if between is not None:
            between(0)
        for count in range(1, sub_steps + 1):
            if any_fast:
                self._step(loads, self._impacts.parts())
            else:
                self._step_once(loads, self._sub_step)
            self._applied.clear()
            if between is not None:
                between(count)
        self.shape_forces.sums.clear()
        self._centres.clear()
        self._speeds.clear()
        self.changes = next(_changes)

    def _step(self, loads: Sequence[_Load], parts: int) -> None:
        """Do a sub-step, in equal parts."""
        self._gyroscopic_term.begin_step()  # the last one's parts may have been others
        if parts == 1:
            self.queries.begin_sub_step()
            self._step_once(loads, self._sub_step)
            return
        self.queries.begin_sub_step(body for body, *_ in loads)
        part = self._sub_step / parts
        with self._impacts.divided(part):
            for _ in range(parts):
                self._step_once(loads, part)
                self.queries.end_part(1 / parts)

    def _step_once(self, loads: Sequence[_Load], duration: float) -> None:
        # Positional arguments: this is most of a step.
        client, known, turns = self._client, self._centres, self._turns
        for applied in self._applied:
            self._act(*applied)
        for body, force, (torque_x, torque_y, torque_z), levers in loads:
            centre, orientation = (known and known.get(body)) or _where(body, client)
            x, y, z, w = turns[body] = orientation
            _pull(body, -1, force, centre, _IN_WORLD, client)
            for lx, ly, lz, ax, ay, az in levers:  # Wrench.torque_under, without a call
                tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
                ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
                torque_x += uy * az - uz * ay
                torque_y += uz * ax - ux * az
                torque_z += ux * ay - uy * ax
            _turn(body, -1, (torque_x, torque_y, torque_z), _IN_WORLD, client)
        if self.shape_forces.sums:
            self.shape_forces.apply()
        self._gyroscopic_term.begin_sub_step(turns, duration)
        _step(client)
        self._gyroscopic_term.end_sub_step(duration)
        if known:
            known.clear()

    def apply(self, body: int, wrench: Wrench) -> None:
        """Let a wrench act on a body through the next sub-step, beside what `advance` applies."""
        self._applied.append((body, wrench))

    def _act(self, body: int, wrench: Wrench) -> None:
        centre, orientation = self._centres.get(body) or _where(body, self._client)
        _pull(body, -1, wrench.force, centre, _IN_WORLD, self._client)
        _turn(body, -1, wrench.torque_under(orientation), _IN_WORLD, self._client)

    def keep_initial_poses(self) -> None:
        """Remember where everything stands, at rest, for `begin_anew`."""
        for body in self._inertial_frames:
            self.keep_initial_pose(body)
        self.begin_anew()  # so that the first time is like every other, to the last bit

    def keep_initial_pose(self, body: int) -> None:
        """Remember where a body stands, at rest, for `begin_anew`."""
        self._initial_poses.keep(body)

    def begin_anew(self) -> None:
        """Put everything where it stood, at rest."""
        self.changes = next(_changes)
        self._centres.clear()
        self._speeds.clear()
        self.shape_forces.sums.clear()
        self.pictures.all_moved()
        self._initial_poses.bring_back()

    def snapshot(self) -> int:
        """Remember the exact dynamic state, contacts included; return a number for `restore` and `forget`."""
        number = pybullet.saveState(self._client)
        self._snapshots.add(number)
        return number

    def restore(self, number: int) -> None:
        """Bring back what `snapshot` remembered, to the last bit."""
        self._centres.clear()
        self._speeds.clear()
        self.shape_forces.sums.clear()
        self.changes = next(_changes)
        self.pictures.all_moved()
        pybullet.restoreState(number, physicsClientId=self._client)

    def has_snapshot(self, number: int) -> bool:
        """Tell whether a snapshot is there: no body has come or gone since."""
        return number in self._snapshots

    def forget(self, number: int) -> None:
        """Free a snapshot; `clear` frees them all."""
        if number in self._snapshots:
            self._snapshots.remove(number)
            pybullet.removeState(number, physicsClientId=self._client)

    # ---- pictures

    def visuals(self, bodies: Sequence[int] | None = None) -> list[Visual]:
        """Return what can be drawn of these bodies, or of all, in the order of `visual_poses`."""
        return self.pictures.visuals(self._inertial_frames if bodies is None else bodies)

    def visual_poses(self, bodies: Sequence[int] | None = None) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4), of these bodies, or of all."""
        if bodies is not None:
            return self.pictures.poses({body: self._inertial_frames[body][1] for body in bodies})
        if self._poses is None or self._poses[0] != self.changes:  # once for all cameras of a step
            everything = {body: backwards for body, (_, backwards) in self._inertial_frames.items()}
            self._poses = self.changes, self.pictures.poses(everything)
        return self._poses[1]

    def place_visuals(self, body: int, places: Mapping[int, Matrix]) -> None:
        """Move some of a body's visuals, by index, to other places in its root link's frame."""
        if self.pictures.place(body, places):
            self.changes = next(_changes)

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB and depth of PyBullet's software renderer: see Pictures.tiny."""
        self._textures.show()
        return self.pictures.tiny(camera, (width, height), vertical_fov, (near, far))

    def look_from_behind(self, position: Sequence[float], yaw: float) -> None:
        """Put the camera of PyBullet's window behind and above a place (m), looking along a yaw (rad)."""
        pybullet.resetDebugVisualizerCamera(1.2, np.degrees(yaw) - 90, -20, position, self._client)
