"""`sim`: the objects of the scene: what they are, where they are, how they move, the forces on them."""

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
_WITHOUT_ROOT, _CHILDREN_ALONE = 1, 2  # options of getObjectsInTree


class Objects(Functions):
    """Objects: where they are, how they move, the forces on them.

    Relative to a joint is relative to what hangs on it; sim.handleflag_reljointbaseframe, added to the handle of the
    object, makes it relative to the joint's own frame, which does not turn.
    """

    @sim("345")
    def getObjectParent(self, handle: Handle) -> int:
        """Return the handle of an object's parent, -1 for none."""
        return self._objects.handle_of(self._objects[handle].parent)

    @sim("345")
    def setObjectParent(self, handle: Handle, parent: Handle = WORLD, keepInPlace: bool = True) -> None:
        """Give an object another parent, or none (-1). A joint that the dynamics moves holds its child."""
        operations = self._surroundings.operations
        if operations is None:
            self._objects.set_parent(handle, parent, bool(keepInPlace))
        else:
            self._surroundings.outside(lambda: operations.set_parent(handle, parent, bool(keepInPlace)))

    # ---- where they are

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
        if handle < FIRST_FLAG:  # most often, and often in a step
            return self._objects.matrix(handle, frame)
        return self._objects.matrix(bare(handle), frame, has(handle, BASE))

    def _put(self, handle: int, frame: int, matrix: frames.Matrix) -> None:
        if handle < FIRST_FLAG:
            self._objects.set_matrix(handle, frame, matrix)
        else:
            self._objects.set_matrix(bare(handle), frame, matrix, has(handle, BASE))

    # ---- how they move

    @sim("345")
    def getObjectVelocity(self, handle: Handle) -> tuple[list[float], list[float]]:
        """Return an object's velocity (m/s, world) and angular velocity (rad/s): the means over the last step.

        The latter has the Euler angles of the step's turn, in the frame that the object had before it, over the step.
        With sim.handleflag_axis added to the handle it is that turn as a rotation vector, in the world frame.
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

        Both are in the world frame, and keep their direction through the sub-steps of the step, whatever the body does.
        sim.handleflag_resetforce and _resettorque, or both, _resetforcetorque, added to the handle, forget what was
        added before.
        """
        found = self._pushed(handle, RESET_FORCE, RESET_TORQUE)
        push = getattr(found, "push", None)  # a shape of the scene
        if push is None:
            self._host.add_force(found.name, _vector(force), _vector(torque), (0.0, 0.0, 0.0))
        else:
            push(_vector(force), _vector(torque))

    @sim("345")
    def addForce(self, handle: Handle, position: ThreeNumbers, force: ThreeNumbers) -> None:
        """Apply a force (N) at a position (m) in the next step; both in the frame of the body.

        For a shape of the scene the position is from its centre of mass. sim.handleflag_resetforcetorque, added to the
        handle, forgets what was added before.
        """
        found = self._pushed(handle, RESET_FORCE | RESET_TORQUE, RESET_FORCE | RESET_TORQUE)
        push = getattr(found, "push", None)  # a shape of the scene
        place, lever, pull = found.matrix(), _vector(position), _vector(force)
        if push is None:
            self._host.add_force(found.name, frames.rotate(place, pull), (0.0, 0.0, 0.0), lever)
        else:
            push(frames.rotate(place, pull), frames.rotate(place, frames.cross(lever, pull)))

    def _pushed(self, handle: int, forces: int, torques: int) -> SceneObject:
        """Return the object to be pushed; if its handle has one of these flags, forget what was added before."""
        if handle < RESET_FORCE:
            return self._objects[handle]
        found = self._objects[bare(handle)]
        drop = getattr(found, "drop_pushes", functools.partial(self._host.drop_forces, found.name))
        drop(has(handle, forces), has(handle, torques))
        return found


def _frame_and_values(first: Any, second: Any, count: int) -> tuple[int, tuple[float, ...]]:
    """Return handle and values of two arguments in either order; without a handle, the world's and the values."""
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
        """Return what an object is: sim.object_shape_type (4.x: sim.sceneobject_shape), _joint_type and so on."""
        return self._kind(self._objects[handle])

    @sim("345")
    def getObjects(self, index: int, kind: int = _ALL) -> int:
        """Return the handle of an object of a kind by its index, from 0; -1 if there are no more."""
        found = self._of_kind(iter(self._objects), kind)
        return found[int(index)] if 0 <= index < len(found) else -1

    @sim("345")
    def getObjectsInTree(self, root: Handle, kind: int = _ALL, options: int = 0) -> list[int]:
        """Return an object and all objects of a kind below it (sim.handle_scene: all objects).

        `options`: 1 leaves out the root, 2 takes its children alone.
        """
        of_scene = root in (_SCENE, -1)
        above = None if of_scene else self._objects[root]
        below = list(self._below(above, deep=not int(options) & _CHILDREN_ALONE))
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
        """Return an object's handle: it is unique in the whole run."""
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
