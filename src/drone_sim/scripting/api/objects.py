"""`sim`: kinds, poses and velocities of objects, and forces on them."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from typing import Any

from drone_sim.mechanics import frames
from drone_sim.mechanics.object_tree import WORLD
from drone_sim.mechanics.scene_object import SceneObject
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import (
    AXIS,
    BASE,
    CONSTANTS,
    FIRST_FLAG,
    RESET_FORCE,
    RESET_TORQUE,
    WXYZ,
    bare,
    has,
)
from drone_sim.scripting.api.host import Functions
from drone_sim.scripting.api.matrices import unit
from drone_sim.scripting.api.types import (
    FourNumbers,
    Handle,
    SevenNumbers,
    ThreeNumbers,
    TwelveNumbers,
    WrongValue,
    numbers,
)

_ALL, _SCENE = CONSTANTS["handle_all"], CONSTANTS["handle_scene"]
_WITHOUT_ROOT, _ONLY_CHILDREN = 1, 2  # options of getObjectsInTree


class Objects(Functions):
    """Objects: poses, velocities, and forces on them.

    A pose relative to a joint is relative to the frame of the joint's children. With sim.handleflag_reljointbaseframe
    added to the object's handle, it is relative to the joint's own frame, which does not turn.
    """

    @sim("345")
    def getObjectParent(self, handle: Handle) -> int:
        """Return the handle of an object's parent, -1 for none."""
        return self._objects.handle_of(self._objects[handle].parent)

    @sim("345")
    def setObjectParent(self, handle: Handle, parent: Handle = WORLD, keepInPlace: bool = True) -> None:
        """Set the parent of an object, -1 for none. A joint that the dynamics moves holds its child."""
        operations = self._services.operations
        if operations is None:
            self._objects.set_parent(handle, parent, bool(keepInPlace))
        else:
            self._services.outside(lambda: operations.set_parent(handle, parent, bool(keepInPlace)))

    # ---- poses

    @sim("345")
    def getObjectPosition(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the position of an object."""
        m = self._matrix(handle, relativeTo)
        return [m[3], m[7], m[11]]

    @sim("345")
    def setObjectPosition(self, handle: Handle, relativeTo: Handle, position: ThreeNumbers = ()) -> None:
        """Move an object: (handle, relativeTo, position), or (handle, position, relativeTo) as in 4.x."""
        frame, place = _frame_and_values(relativeTo, position, 3)
        if handle < FIRST_FLAG:
            self._objects.set_position(handle, frame, place)
        else:
            self._objects.set_position(bare(handle), frame, place, has(handle, BASE))

    @sim("345")
    def getObjectOrientation(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the Euler angles of an object."""
        if handle < FIRST_FLAG:
            return list(frames.to_euler(self._objects.turn(handle, relativeTo)))
        return list(frames.to_euler(self._objects.turn(bare(handle), relativeTo, has(handle, BASE))))

    @sim("345")
    def setObjectOrientation(self, handle: Handle, relativeTo: Handle, angles: ThreeNumbers = ()) -> None:
        """Turn an object: (handle, relativeTo, angles), or (handle, angles, relativeTo) as in 4.x."""
        frame, turn = _frame_and_values(relativeTo, angles, 3)
        m = self._matrix(handle, frame)
        self._put(handle, frame, frames.from_euler((m[3], m[7], m[11]), turn))

    @sim("345")
    def getObjectQuaternion(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the quaternion of an object: (x, y, z, w), and (w, x, y, z) with sim.handleflag_wxyzquat."""
        return _to_script(handle, frames.to_quaternion(self._matrix(handle, relativeTo)))

    @sim("345")
    def setObjectQuaternion(self, handle: Handle, relativeTo: Handle, quaternion: FourNumbers = ()) -> None:
        """Turn an object to a quaternion, as getObjectQuaternion returns it; the arguments in either order."""
        frame, turn = _frame_and_values(relativeTo, quaternion, 4)
        m = self._matrix(handle, frame)
        self._put(handle, frame, frames.from_quaternion((m[3], m[7], m[11]), _from_script(handle, turn)))

    @sim("45")
    def getObjectPose(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return an object's position and quaternion, 7 numbers; the quaternion is that of getObjectQuaternion."""
        m = self._matrix(handle, relativeTo)
        return [*frames.position(m), *_to_script(handle, frames.to_quaternion(m))]

    @sim("45")
    def setObjectPose(self, handle: Handle, relativeTo: Handle, pose: SevenNumbers = ()) -> None:
        """Move and turn an object to a position and a quaternion; the arguments in either order."""
        frame, place = _frame_and_values(relativeTo, pose, 7)
        self._put(handle, frame, frames.from_quaternion(place[:3], _from_script(handle, place[3:])))

    @sim("345")
    def getObjectMatrix(self, handle: Handle, relativeTo: Handle = WORLD) -> list[float]:
        """Return the 12 numbers of an object's transform."""
        return list(self._matrix(handle, relativeTo))

    @sim("345")
    def setObjectMatrix(self, handle: Handle, relativeTo: Handle, matrix: TwelveNumbers = ()) -> None:
        """Move and turn an object to a transform; the arguments in either order."""
        frame, place = _frame_and_values(relativeTo, matrix, 12)
        self._put(handle, frame, place)

    def _matrix(self, handle: int, frame: int) -> frames.Matrix:
        if frame == WORLD and handle < FIRST_FLAG:  # the usual case, several times in a step
            return self._objects.by_handle[handle].matrix()
        return self._objects.matrix(bare(handle), frame, has(handle, BASE))

    def _put(self, handle: int, frame: int, matrix: frames.Matrix) -> None:
        if handle < FIRST_FLAG:
            self._objects.set_matrix(handle, frame, matrix)
        else:
            self._objects.set_matrix(bare(handle), frame, matrix, has(handle, BASE))

    # ---- velocities

    @sim("345")
    def getObjectVelocity(self, handle: Handle) -> tuple[list[float], list[float]]:
        """Return an object's velocity (m/s, world) and angular velocity (rad/s), both as means over the last step.

        The angular velocity is the Euler angles of the rotation in the step, in the object's frame before the step,
        divided by the time step. With sim.handleflag_axis added to the handle, it is a rotation vector in the world
        frame.
        """
        meter = self._context.velocities
        if handle < AXIS:
            linear, angular = meter.velocity(handle)
        else:
            linear, angular = meter.velocity(bare(handle))[0], meter.rotation(bare(handle))
        return list(linear), list(angular)

    @sim("345")
    def getVelocity(self, handle: Handle) -> tuple[list[float], list[float]]:
        """Return an object's current linear (m/s) and angular velocity (rad/s), in the world frame."""
        linear, angular = self._objects[handle].velocity()
        return list(linear), list(angular)

    @sim("345")
    def addForceAndTorque(
        self, handle: Handle, force: ThreeNumbers = (0, 0, 0), torque: ThreeNumbers = (0, 0, 0)
    ) -> None:
        """Apply a force (N) at a body's center of mass, and a torque (N m), in the next step.

        Both are in the world frame, and keep their directions in all sub-steps of the step. With
        sim.handleflag_resetforce, _resettorque or _resetforcetorque added to the handle, earlier forces or torques of
        this step are removed.
        """
        found = self._target_of_force(handle, RESET_FORCE, RESET_TORQUE)
        push = getattr(found, "push", None)  # shapes of the scene have it
        if push is None:
            self._host.add_force(found.name, _vector(force), _vector(torque), (0.0, 0.0, 0.0))
        else:
            push(_vector(force), _vector(torque))

    @sim("345")
    def addForce(self, handle: Handle, position: ThreeNumbers, force: ThreeNumbers) -> None:
        """Apply a force (N) at a position (m) in the next step, both in the frame of the body.

        For a shape of the scene, the position is relative to its center of mass. With sim.handleflag_resetforcetorque
        added to the handle, earlier forces and torques of this step are removed.
        """
        found = self._target_of_force(handle, RESET_FORCE | RESET_TORQUE, RESET_FORCE | RESET_TORQUE)
        push = getattr(found, "push", None)  # shapes of the scene have it
        matrix, lever, local_force = found.matrix(), _vector(position), _vector(force)
        if push is None:
            self._host.add_force(found.name, frames.rotate(matrix, local_force), (0.0, 0.0, 0.0), lever)
        else:
            push(frames.rotate(matrix, local_force), frames.rotate(matrix, frames.cross(lever, local_force)))

    def _target_of_force(self, handle: int, forces: int, torques: int) -> SceneObject:
        """Return the object of a force; if its handle has one of these flags, remove earlier forces or torques."""
        if handle < RESET_FORCE:
            return self._objects[handle]
        found = self._objects[bare(handle)]
        drop = getattr(found, "drop_pushes", functools.partial(self._host.drop_forces, found.name))
        drop(has(handle, forces), has(handle, torques))
        return found


def _frame_and_values(first: Any, second: Any, count: int) -> tuple[int, tuple[float, ...]]:
    """Return handle and values from two arguments in either order; the handle may be missing (the world)."""
    if isinstance(first, (int, float)):
        return int(first), numbers(second, count)
    if isinstance(second, (int, float)):
        return int(second), numbers(first, count)
    if second != ():
        raise WrongValue(f"expected a handle and {count} numbers")
    return WORLD, numbers(first, count)


def _to_script(handle: int, quaternion: frames.Quaternion) -> list[float]:
    x, y, z, w = quaternion
    return [w, x, y, z] if has(handle, WXYZ) else [x, y, z, w]


def _from_script(handle: int, quaternion: Sequence[float]) -> frames.Quaternion:
    return unit((*quaternion[1:], quaternion[0]) if has(handle, WXYZ) else quaternion)


def _vector(values: Sequence[float]) -> frames.Vector:
    x, y, z = numbers(values, 3)
    return x, y, z


class ObjectKinds(Functions):
    """Kinds of objects, and the tree of objects."""

    @sim("345")
    def getObjectType(self, handle: Handle) -> int:
        """Return the type of an object: sim.object_shape_type (4.x: sim.sceneobject_shape), _joint_type and so on."""
        return self._kind(self._objects[handle])

    @sim("345")
    def getObjects(self, index: int, kind: int = _ALL) -> int:
        """Return the handle of an object of a type by its index, from 0; -1 if there are no more."""
        found = self._of_kind(iter(self._objects), kind)
        return found[int(index)] if 0 <= index < len(found) else -1

    @sim("345")
    def getObjectsInTree(self, root: Handle, kind: int = _ALL, options: int = 0) -> list[int]:
        """Return an object and its descendants of a type (sim.handle_scene: all objects).

        `options`: 1 excludes the root, 2 includes only its children.
        """
        of_scene = root in (_SCENE, -1)
        parent = None if of_scene else self._objects[root]
        below = list(self._below(parent, deep=not int(options) & _ONLY_CHILDREN))
        if not of_scene and not int(options) & _WITHOUT_ROOT:
            below.insert(0, int(root))
        return self._of_kind(iter(below), kind)

    @sim("345")
    def getObjectChild(self, handle: Handle, index: int) -> int:
        """Return the handle of an object's child by its index, from 0; -1 if there are no more."""
        children = [child for child, _ in self._objects.children(self._objects[handle])]
        return children[int(index)] if 0 <= index < len(children) else -1

    @sim("5")
    def isHandle(self, handle: Handle, _kind: int = -1) -> bool:
        """Return whether an object has this handle (4.x)."""
        return bare(handle) in set(self._objects)

    @sim("345")
    def isHandleValid(self, handle: Handle, _kind: int = -1) -> int:
        """Return 1 if an object has this handle, otherwise 0 (3.x)."""
        return int(self.isHandle(handle))

    @sim("5", getObjectUniqueIdentifier="345")
    def getObjectUid(self, handle: Handle) -> int:
        """Return an object's handle, which is unique in the whole run."""
        self._objects[handle]
        return int(handle)

    def _below(self, above: SceneObject | None, deep: bool) -> Iterator[int]:
        for handle, child in self._objects.children(above):
            yield handle
            if deep:
                yield from self._below(child, deep)

    def _of_kind(self, handles: Iterator[int], kind: int) -> list[int]:
        return [handle for handle in handles if kind == _ALL or self._kind(self._objects[handle]) == kind]

    def _kind(self, found: SceneObject) -> int:
        return CONSTANTS[f"object_{found.kind.replace('_', '')}_type"]
