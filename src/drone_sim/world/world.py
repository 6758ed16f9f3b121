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
from drone_sim.shapes.shape import DrawnShape, SceneShape
from drone_sim.shapes.triangles import WHITE, Rgba
from drone_sim.shapes.urdf import Urdf
from drone_sim.shapes.visual import Visual
from drone_sim.world import assemblies, bodies, floor, probing
from drone_sim.world.assemblies import Link
from drone_sim.world.beginning import Beginning
from drone_sim.world.joints import Joints
from drone_sim.world.own_files import OwnFiles
from drone_sim.world.pictures import Pictures
from drone_sim.world.solidity import Solidity
from drone_sim.world.textures import Textures

_changes = itertools.count()  # of any world: what was seen in one is not mistaken for what is in another
_NO_TURN = (0.0, 0.0, 0.0, 1.0)
# (N s)², the square of the last change of an impulse after which Bullet holds the contacts for solved. With PyBullet's
# 1e-7 what lies still rattles at some 1e-3 m/s², which only an accelerometer feels; this is less than 1e-6 m/s².
_SOLVED = 1e-18
_FAR_UP = 1e6  # m
_ahead: list[int] = []  # clients that nobody has used yet


def connect_ahead() -> None:
    """Let the next world of this process, and the first of each of its forks, find its 30 MB allocated already."""
    if not _ahead:
        _ahead.append(pybullet.connect(pybullet.DIRECT))


class World:
    """A floor, objects and rigid bodies under gravity."""

    def __init__(self, sub_step: float, gravity: float, gui: bool = False):
        """Make an empty world that steps by `sub_step` (s); `gui` opens PyBullet's window.

        Raises RuntimeError where `gui` finds no display.
        """
        self._files = OwnFiles()
        self._client = (
            _ahead.pop() if _ahead and not gui else pybullet.connect(pybullet.GUI if gui else pybullet.DIRECT)
        )
        if self._client < 0:
            raise RuntimeError("PyBullet's window needs a display: set DISPLAY, or leave out gui:=true")
        # Of each file it reads PyBullet would keep the content for good, and none of ours is read twice.
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._sub_step, self._gravity = sub_step, gravity
        self._snapshots: set[int] = set()
        self._gui = gui
        if gui:
            pybullet.configureDebugVisualizer(pybullet.COV_ENABLE_GUI, 0, physicsClientId=self._client)
        self.clear()

    def clear(self) -> None:
        """Remove everything."""
        self.changes = next(_changes)
        for number in self._snapshots:  # PyBullet would keep them
            pybullet.removeState(number, physicsClientId=self._client)
        self._snapshots.clear()
        pybullet.resetSimulation(physicsClientId=self._client)  # its first argument is another
        pybullet.setGravity(0, 0, self._gravity, self._client)
        pybullet.setTimeStep(self._sub_step, self._client)
        self._inertial_frames: dict[int, tuple[Pose, Pose]] = {}  # root from inertial, and its inverse
        self._centres: dict[int, tuple[Vector, Quaternion]] = {}  # inertial frames' poses, read since the last step
        self._beginning = Beginning(self._client)
        self._poses: tuple[int, np.ndarray] | None = None  # of all visuals, and the changes that they are of
        self._files.clear()
        self._pictures = Pictures(self._client, self._files.origin)
        self._textures = Textures(self._client, self._files)
        self.joints = Joints(self._client, self._look_anew)
        self.solidity = Solidity(self._client, self._pictures.moved)

    def _look_anew(self) -> None:
        self.changes = next(_changes)

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
        body = floor.create(self._client, self._files, size, ground)
        self._cover(body, texture, visual=0)
        self._set_material(body)
        self._pictures.set_floor(body, texture)
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
        body = bodies.create(self._client, self._files, shape, pose, moves=mass != 0, color=color)
        self._cover(body, texture)
        self._set_material(body)
        self.set_pose(body, pose)  # again, for PyBullet reads a URDF's pose in single precision
        if isinstance(shape, DrawnShape):
            self._pictures.set_shape(body, shape)
        if texture:
            self._pictures.set_texture(body, texture)
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
        self._pictures.set_looks(body, looks)
        return body, numbers

    def hide(self, body: int, link: int = -1) -> None:
        """Let a link (-1: the root) be in no picture."""
        self._pictures.hide(body, link)

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
        self.changes = next(_changes)
        for number in self._snapshots:  # of other bodies than there will be
            pybullet.removeState(number, physicsClientId=self._client)
        self._snapshots.clear()
        pybullet.removeBody(body, self._client)
        del self._inertial_frames[body]
        self._beginning.forget(body)
        self.joints.forget(body)
        self.solidity.forget(body)
        self._textures.forget(body)
        self._centres.pop(body, None)
        self._pictures.remove(body)

    def set_color(self, body: int, rgba: Sequence[float]) -> None:
        """Paint all of a body (0..1 each)."""
        for link in range(-1, pybullet.getNumJoints(body, self._client)):
            pybullet.changeVisualShape(body, link, rgbaColor=rgba, physicsClientId=self._client)
        self._pictures.forget(body)
        self.changes = next(_changes)

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
        backwards = inverse(inertial)
        if backwards.orientation == _NO_TURN:
            backwards = Pose(backwards.position, _NO_TURN)  # the very same one: `state` looks in every step
        self.changes = next(_changes)
        self._inertial_frames[number] = (inertial, backwards)

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

    def overlaps(self) -> int:
        """Return how many pairs of moving bodies have bounds that overlap."""
        bounds, moves = [], []
        for body in self._inertial_frames:
            joints = pybullet.getNumJoints(body, self._client)
            boxes = [pybullet.getAABB(body, link, self._client) for link in range(-1, joints)]
            bounds.append((np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)))
            moves.append(joints > 0 or pybullet.getDynamicsInfo(body, -1, self._client)[0] > 0)
        low, high, moving = np.array(bounds)[:, 0], np.array(bounds)[:, 1], np.array(moves)
        meet = (low[:, None] <= high[None]).all(axis=2)
        return int(np.triu(meet & meet.T & moving[:, None] & moving, k=1).sum())

    def set_pose(self, body: int, pose: Pose) -> None:
        """Move a body's root link to `pose` and stop it."""
        inertial = self._inertial_frames[body][0]
        centre, turn = compose(pose, inertial)
        self.changes = next(_changes)
        self._centres.pop(body, None)
        self._pictures.moved(body)
        pybullet.resetBasePositionAndOrientation(body, centre, turn, self._client)
        pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], self._client)

    def part(self, body: int) -> None:
        """Take a body out of every contact, which Bullet would remember wherever it goes; it is far up then."""
        self.set_pose(body, Pose((0.0, 0.0, _FAR_UP)))
        pybullet.performCollisionDetection(self._client)

    def lowest(self, body: int) -> float:
        """Return the height (m) of the lowest point that may touch something, of a body without joints."""
        return float(pybullet.getAABB(body, -1, self._client)[0][2])

    def advance(
        self, wrenches: Mapping[int, Wrench], sub_steps: int, between: Callable[[int], None] | None = None
    ) -> None:
        """Step `sub_steps` times, re-applying each body's wrench every time (PyBullet forgets it).

        `between` is called with 0 before the first of these sub-steps, and after each with how many there have been.
        """
        # Local names and positional arguments: this loop is most of a step.
        client, in_world = self._client, pybullet.WORLD_FRAME
        where, pull, turn, step = (
            pybullet.getBasePositionAndOrientation,
            pybullet.applyExternalForce,
            pybullet.applyExternalTorque,
            pybullet.stepSimulation,
        )
        known = self._centres  # in the first sub-step
        loads = [(body, wrench.force, *wrench.terms) for body, wrench in wrenches.items()]
        if between is not None:
            between(0)
        for count in range(1, sub_steps + 1):
            for body, force, (torque_x, torque_y, torque_z), levers in loads:
                centre, (x, y, z, w) = (known and known.get(body)) or where(body, client)
                pull(body, -1, force, centre, in_world, client)
                for lx, ly, lz, ax, ay, az in levers:  # Wrench.torque_under, without a call
                    tx, ty, tz = y * lz - z * ly, z * lx - x * lz, x * ly - y * lx
                    ux, uy, uz = w * tx + y * tz - z * ty, w * ty + z * tx - x * tz, w * tz + x * ty - y * tx
                    torque_x += uy * az - uz * ay
                    torque_y += uz * ax - ux * az
                    torque_z += ux * ay - uy * ax
                turn(body, -1, (torque_x, torque_y, torque_z), in_world, client)
            step(client)
            known = {}
            if between is not None:
                between(count)
        self._centres.clear()
        self.changes = next(_changes)

    def apply(self, body: int, wrench: Wrench) -> None:
        """Let a wrench act on a body in the next sub-step, beside what `advance` applies."""
        centre, orientation = self._centres.get(body) or pybullet.getBasePositionAndOrientation(body, self._client)
        pybullet.applyExternalForce(body, -1, wrench.force, centre, pybullet.WORLD_FRAME, self._client)
        torque = wrench.torque_under(orientation)
        pybullet.applyExternalTorque(body, -1, torque, pybullet.WORLD_FRAME, self._client)

    def keep_beginning(self) -> None:
        """Remember where everything stands, at rest, for `begin_anew`."""
        for body in self._inertial_frames:
            self.keep_beginning_of(body)
        self.begin_anew()  # so that the first time is like every other, to the last bit

    def keep_beginning_of(self, body: int) -> None:
        """Remember where a body stands, at rest, for `begin_anew`."""
        self._beginning.keep(body)

    def begin_anew(self) -> None:
        """Put everything where it stood, at rest."""
        self.changes = next(_changes)
        self._centres.clear()
        self._pictures.all_moved()
        self._beginning.bring_back()

    def snapshot(self) -> int:
        """Remember the exact dynamic state, contacts included; return a number for `restore` and `forget`."""
        number = pybullet.saveState(self._client)
        self._snapshots.add(number)
        return number

    def restore(self, number: int) -> None:
        """Bring back what `snapshot` remembered, to the last bit."""
        self._centres.clear()
        self.changes = next(_changes)
        self._pictures.all_moved()
        pybullet.restoreState(number, physicsClientId=self._client)

    def forget(self, number: int) -> None:
        """Free a snapshot; `clear` frees them all."""
        if number in self._snapshots:
            self._snapshots.remove(number)
            pybullet.removeState(number, physicsClientId=self._client)

    # ---- for sensors

    def ray(self, start: Vector, end: Vector, ignoring: int = -1) -> probing.RayHit | None:
        """Return the nearest body between two points (m), but for the one that is ignored; None where there is none."""
        return probing.ray(self._client, start, end, ignoring)

    def rays(self, ends: Sequence[tuple[Vector, Vector]], counts: Callable[[int, int], bool]) -> list[probing.Met]:
        """Return what each of several rays (from, to, m) meets first of the bodies and links that count."""
        return probing.rays(self._client, ends, counts)

    def gaps(self, body: int, link: int, reach: float, counts: Callable[[int, int], bool]) -> list[probing.Gap]:
        """Return the gaps between a body's link (-1: the root) and those others within `reach` (m) that count."""
        return probing.gaps(self._client, body, link, reach, counts)

    def contacts(self, body: int) -> list[probing.Touch]:
        """Return where others pushed a body in the last sub-step."""
        return probing.contacts(self._client, body)

    # ---- pictures

    def visuals(self, bodies: Sequence[int] | None = None) -> list[Visual]:
        """Return what can be drawn of these bodies, or of all, in the order of `visual_poses`."""
        return self._pictures.visuals(self._inertial_frames if bodies is None else bodies)

    def visual_places(self, bodies: Sequence[int]) -> list[tuple[int, int]]:
        """Return body and link (-1: the root) of each of the `visuals` of these bodies."""
        return self._pictures.places(bodies)

    def visual_poses(self, bodies: Sequence[int] | None = None) -> np.ndarray:
        """Return the poses world from visual, (N, 4, 4), of these bodies, or of all."""
        if bodies is not None:
            return self._pictures.poses({body: self._inertial_frames[body][1] for body in bodies})
        if self._poses is None or self._poses[0] != self.changes:  # once for all cameras of a step
            everything = {body: backwards for body, (_, backwards) in self._inertial_frames.items()}
            self._poses = self.changes, self._pictures.poses(everything)
        return self._poses[1]

    def place_visuals(self, body: int, places: Mapping[int, Matrix]) -> None:
        """Move some of a body's visuals, by index, to other places in its root link's frame."""
        if self._pictures.place(body, places):
            self.changes = next(_changes)

    def tiny_picture(
        self, camera: np.ndarray, width: int, height: int, vertical_fov: float, near: float, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return RGB and depth of PyBullet's software renderer: see Pictures.tiny."""
        self._textures.show()
        return self._pictures.tiny(camera, (width, height), vertical_fov, (near, far))

    def look_from_behind(self, position: Sequence[float], yaw: float) -> None:
        """Put the camera of PyBullet's window behind and above a place (m), looking along a yaw (rad)."""
        pybullet.resetDebugVisualizerCamera(1.2, np.degrees(yaw) - 90, -20, position, self._client)
