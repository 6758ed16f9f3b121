"""`sim`: the objects of the scene, where they are, how they move, the forces on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.scripting.api.calls import WrongValue, numbers
from drone_sim.scripting.api.handles import AXIS, bare
from drone_sim.scripting.api.host import Host
from drone_sim.scripting.api.matrices import unit
from drone_sim.scripting.api.types import FourNumbers, Handle, SevenNumbers, ThreeNumbers, TwelveNumbers


class Objects:
    """The functions on objects."""

    def __init__(self, host: Host):
        """Take the drone whose objects they are."""
        self._host = host
        self._objects = host.objects

    def getObjectParent(self, handle: Handle) -> int:
        """Return the handle of an object's parent, -1 for none."""
        return self._objects.handle_of(self._objects[handle].parent)

    def setObjectParent(self, handle: Handle, parent: Handle = WORLD, keepInPlace: bool = True) -> None:
        """Hang an object on another one, or on nothing (-1)."""
        self._objects.set_parent(handle, parent, bool(keepInPlace))

    def getObjectSizeFactor(self, handle: Handle) -> float:
        """Return how much an object was scaled: 1, nothing here is."""
        self._objects[handle]
        return 1.0

    def getObjectSizeValues(self, handle: Handle) -> list[float]:
        """Return how much an object was scaled along x, y and z: 1, nothing here is."""
        return [self.getObjectSizeFactor(handle)] * 3

    # ---- where they are

    def getObjectPosition(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the position of an object."""
        m = self._objects.matrix(handle, relativeTo)
        return [m[3], m[7], m[11]]

    def setObjectPosition(self, handle: Handle, relativeTo: Handle, position: ThreeNumbers = ()) -> None:
        """Move an object: (handle, relativeTo, position), or (handle, position, relativeTo) as in 4.x."""
        frame, place = _frame_and_values(relativeTo, position, 3)
        self._objects.set_position(handle, frame, place)

    def getObjectOrientation(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the Euler angles of an object."""
        return list(frames.to_euler(self._objects.turn(handle, relativeTo)))

    def setObjectOrientation(self, handle: Handle, relativeTo: Handle, angles: ThreeNumbers = ()) -> None:
        """Turn an object: (handle, relativeTo, angles), or (handle, angles, relativeTo) as in 4.x."""
        frame, turn = _frame_and_values(relativeTo, angles, 3)
        m = self._objects.matrix(handle, frame)
        self._objects.set_matrix(handle, frame, frames.from_euler((m[3], m[7], m[11]), turn))

    def getObjectQuaternion(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the quaternion (x, y, z, w) of an object."""
        return list(frames.to_quaternion(self._objects.matrix(handle, relativeTo)))

    def setObjectQuaternion(self, handle: Handle, relativeTo: Handle, quaternion: FourNumbers = ()) -> None:
        """Turn an object to a quaternion (x, y, z, w); the arguments in either order."""
        frame, turn = _frame_and_values(relativeTo, quaternion, 4)
        m = self._objects.matrix(handle, frame)
        self._objects.set_matrix(handle, frame, frames.from_quaternion((m[3], m[7], m[11]), unit(turn)))

    def getObjectPose(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return position and quaternion of an object, 7 numbers."""
        m = self._objects.matrix(handle, relativeTo)
        return [*frames.position(m), *frames.to_quaternion(m)]

    def setObjectPose(self, handle: Handle, relativeTo: Handle, pose: SevenNumbers = ()) -> None:
        """Move and turn an object to a position and a quaternion; the arguments in either order."""
        frame, place = _frame_and_values(relativeTo, pose, 7)
        self._objects.set_matrix(handle, frame, frames.from_quaternion(place[:3], unit(place[3:])))

    def getObjectMatrix(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the 12 numbers of an object's transform."""
        return list(self._objects.matrix(handle, relativeTo))

    def setObjectMatrix(self, handle: Handle, relativeTo: Handle, matrix: TwelveNumbers = ()) -> None:
        """Move and turn an object to a transform; the arguments in either order."""
        frame, place = _frame_and_values(relativeTo, matrix, 12)
        self._objects.set_matrix(handle, frame, place)

    # ---- how they move

    def getObjectVelocity(self, handle: Handle) -> tuple[list[float], list[float]]:
        """Return linear (m/s) and angular velocity (rad/s) of an object, in the world frame.

        sim.handleflag_axis may be added to the handle, and changes nothing. V-REP takes the means over the last step,
        and without the flag the Euler angles of the turn in the frame that the object had before it, over the step.
        Here both are the angular velocity at the end of the step: see "Where this differs" in docs/scripts.md.
        """
        if handle >= AXIS:
            handle = bare(handle)
        linear, angular = self._objects[handle].velocity()
        return list(linear), list(angular)

    def getVelocity(self, handle: Handle) -> tuple[list[float], list[float]]:
        """Return linear (m/s) and angular velocity (rad/s) of an object, in the world frame."""
        linear, angular = self._objects[handle].velocity()
        return list(linear), list(angular)

    def addForceAndTorque(
        self, handle: Handle, force: ThreeNumbers = (0, 0, 0), torque: ThreeNumbers = (0, 0, 0)
    ) -> None:
        """Let a force (N) at a body's centre of mass and a torque (N m) act in the next step.

        Both are in the world frame, and keep their direction through the sub-steps of the step, whatever the body does.
        """
        shape = self._objects[handle].name
        self._host.add_force(shape, _vector(force), _vector(torque), (0.0, 0.0, 0.0))

    def addForce(self, handle: Handle, position: ThreeNumbers, force: ThreeNumbers) -> None:
        """Let a force (N) act in the next step at a position (m); both in the frame of the body."""
        shape = self._objects[handle]
        x, y, z = frames.rotate(shape.matrix(), _vector(force))
        self._host.add_force(shape.name, (x, y, z), (0.0, 0.0, 0.0), _vector(position))


def _frame_and_values(first: Any, second: Any, count: int) -> tuple[int, tuple[float, ...]]:
    """Tell a handle and values apart, which come in either order, or the values alone."""
    if isinstance(first, (int, float)):
        return int(first), numbers(second, count)
    if isinstance(second, (int, float)):
        return int(second), numbers(first, count)
    if second != ():
        raise WrongValue(f"a handle and {count} numbers are expected")
    return WORLD, numbers(first, count)


def _vector(values: Sequence[float]) -> frames.Vector:
    x, y, z = numbers(values, 3)
    return x, y, z
