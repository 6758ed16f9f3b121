"""The script API, under CoppeliaSim's names: what a child script reaches as `sim`.

Positions are [x, y, z] in metres, orientations V-REP's Euler angles [alpha, beta, gamma] in radians
(R = Rx Ry Rz), matrices 12 numbers, velocities world-frame. `relativeTo` is a handle, -1 the world.
A wrong name, handle or number of values raises ValueError with one line.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Sequence, Tuple

from drone_sim import frames
from drone_sim.objects import WORLD, ObjectTree, near_names

Parameters = Dict[str, Any]


class Sim:
    """The regular API functions, over one drone's objects and scripts."""

    handle_world = WORLD
    handle_parent = -11
    handle_self = -4

    def __init__(
        self,
        objects: ObjectTree,
        scripts: Mapping[str, Parameters],
        own_script: str,
        clock: Callable[[], float],
        time_step: float,
    ):
        """Take the objects, the simulation parameters of each object's script, and the clock (s)."""
        self._objects = objects
        self._scripts = list(scripts.items())
        self._own_script = own_script
        self._clock = clock
        self._time_step = time_step

    # ---- objects

    def getObject(self, path: str) -> int:
        """Return the handle of an object: its name, or a path that ends in it."""
        return self._objects.handle(path.rstrip("/").rpartition("/")[2])

    getObjectHandle = getObject

    def getObjectPosition(self, handle: int, relativeTo: int = WORLD) -> List[float]:
        """Return the position of an object."""
        return list(frames.position(self._objects.matrix(handle, self._frame(handle, relativeTo))))

    def setObjectPosition(self, handle: int, *arguments: Any) -> None:
        """Move an object: (handle, relativeTo, position), or (handle, position, relativeTo) as in 4.x."""
        relative_to, position = self._frame_and_values(handle, arguments, 3)
        m = list(self._objects.matrix(handle, relative_to))
        m[3], m[7], m[11] = position
        self._objects.set_matrix(handle, relative_to, tuple(m))

    def getObjectOrientation(self, handle: int, relativeTo: int = WORLD) -> List[float]:
        """Return the Euler angles of an object."""
        return list(frames.to_euler(self._objects.matrix(handle, self._frame(handle, relativeTo))))

    def setObjectOrientation(self, handle: int, *arguments: Any) -> None:
        """Turn an object: (handle, relativeTo, angles), or (handle, angles, relativeTo) as in 4.x."""
        relative_to, angles = self._frame_and_values(handle, arguments, 3)
        position = frames.position(self._objects.matrix(handle, relative_to))
        self._objects.set_matrix(handle, relative_to, frames.from_euler(position, angles))

    def getObjectMatrix(self, handle: int, relativeTo: int = WORLD) -> List[float]:
        """Return the 12 numbers of an object's transform."""
        return list(self._objects.matrix(handle, self._frame(handle, relativeTo)))

    def getObjectVelocity(self, handle: int) -> Tuple[List[float], List[float]]:
        """Return the linear and the angular velocity of an object, in the world frame."""
        linear, angular = self._objects[handle].velocity
        return list(linear), list(angular)

    getVelocity = getObjectVelocity

    def setObjectParent(self, handle: int, parent: int, keepInPlace: bool = True) -> None:
        """Hang an object on another one, or on nothing (-1)."""
        self._objects.set_parent(handle, parent, bool(keepInPlace))

    def getObjectParent(self, handle: int) -> int:
        """Return the handle of an object's parent, -1 for none."""
        return self._objects.handle_of(self._objects[handle].parent)

    # ---- matrices

    def multiplyVector(self, matrix: Sequence[float], vector: Sequence[float]) -> List[float]:
        """Return matrix · vector."""
        return list(frames.transform(_numbers(matrix, 12), _numbers(vector, 3)))

    def getMatrixInverse(self, matrix: Sequence[float]) -> List[float]:
        """Return the inverse of a transform."""
        return list(frames.invert(_numbers(matrix, 12)))

    getInvertedMatrix = getMatrixInverse

    # ---- time

    def getSimulationTime(self) -> float:
        """Return the simulated time in seconds."""
        return self._clock()

    def getSimulationTimeStep(self) -> float:
        """Return the simulation step in seconds."""
        return self._time_step

    # ---- scripts

    def getScriptHandle(self, name: str) -> int:
        """Return the handle of the script that is attached to an object."""
        names = [known for known, _ in self._scripts]
        if name not in names:
            raise ValueError(f"no script is attached to '{name}'; {near_names(name, names)}")
        return names.index(name)

    def getScriptSimulationParameter(self, script: int, name: str) -> Any:
        """Return a simulation parameter of a script."""
        parameters = self._parameters(script)
        if name not in parameters:
            raise ValueError(f"no script parameter '{name}'; {near_names(name, parameters)}")
        return parameters[name]

    def setScriptSimulationParameter(self, script: int, name: str, value: Any) -> None:
        """Set a simulation parameter of a script: `particleVelocity` (m/s) drives a propeller."""
        self._parameters(script)[name] = value

    def _parameters(self, script: int) -> Parameters:
        if script == self.handle_self:
            return dict(self._scripts)[self._own_script]
        if not 0 <= script < len(self._scripts):
            raise ValueError(f"no script has the handle {script}")
        return self._scripts[script][1]

    def _frame(self, handle: int, relative_to: int) -> int:
        if relative_to != self.handle_parent:
            return relative_to
        return self.getObjectParent(handle)

    def _frame_and_values(self, handle: int, arguments: Tuple[Any, ...], count: int) -> Tuple[int, Tuple[float, ...]]:
        first, second = arguments if len(arguments) == 2 else (*arguments, WORLD)
        relative_to, values = (first, second) if isinstance(first, (int, float)) else (second, first)
        return self._frame(handle, int(relative_to)), _numbers(values, count)


def _numbers(values: Sequence[float], count: int) -> Tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if len(numbers) != count:
        raise ValueError(f"{count} numbers are expected, not {len(numbers)}")
    return numbers
