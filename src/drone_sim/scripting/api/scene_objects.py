"""`sim`: creating, copying, naming and removing objects of the scene; models in files.

Stopping the simulation undoes these changes. The shapes of vehicles, and the floor, are not objects of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2
from typing import Any

from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.constants import CONSTANTS, bare
from drone_sim.scripting.api.host import Functions, Operations
from drone_sim.scripting.api.types import Handle, Name, Number, Numbers, SevenNumbers, ThreeNumbers, WrongValue, numbers

_DENSITY = 1000.0  # kg/m³, for shapes without a given mass
_RESPONDABLE, _STATIC = 8, 16  # options of createPureShape
_PERSPECTIVE = 2  # an option of createVisionSensor
_WHOLE_MODELS = 1  # an option of copyPasteObjects
_THICKNESS = 1e-3  # m, of planes and discs
_PURE = ("cuboid", "sphere", "cylinder", "cone")  # by number
_PRIMITIVE = {
    CONSTANTS[f"primitiveshape_{word}"]: word
    for word in ("plane", "disc", "cuboid", "spheroid", "cylinder", "cone", "heightfield", "capsule")
}
_JOINTS = {CONSTANTS[f"joint_{word}_subtype"]: word for word in ("revolute", "prismatic", "spherical")}
_VOLUMES = {
    CONSTANTS[f"proximitysensor_{word}_subtype"]: word for word in ("pyramid", "cylinder", "disc", "cone", "ray")
}


class SceneObjects(Functions):
    """Objects of the scene: creating, copying, naming and removing them; models in files."""

    # ---- shapes

    @sim("345")
    def createPureShape(
        self, primitiveType: int, options: int, sizes: ThreeNumbers, mass: Number, _precision: Any = None
    ) -> int:
        """Create a cuboid (0), sphere (1) or cylinder (2) with sizes (m) and a mass (kg); return its handle.

        `options`: 8 respondable, 16 static; others have no effect. It is at the origin of the world.
        """
        kind = _PURE[int(primitiveType)] if primitiveType in range(len(_PURE)) else ""
        bits, (kilograms,) = int(options), numbers((mass,), 1)
        shape = _shape(kind, numbers(sizes, 3), "0 (cuboid), 1 (sphere), 2 (cylinder)", primitiveType)
        static, respondable = bool(bits & _STATIC), bool(bits & _RESPONDABLE)
        return self._add(kind.capitalize(), **shape, mass=kilograms, static=static, respondable=respondable)

    @sim("5")
    def createPrimitiveShape(self, primitiveType: int, sizes: ThreeNumbers, _options: int = 0) -> int:
        """Create a sim.primitiveshape_cuboid, _spheroid, _cylinder, _capsule, _plane or _disc; return its handle.

        It is at the origin of the world, static and not respondable, with a density of 1000 kg/m³.
        """
        kind = _PRIMITIVE.get(int(primitiveType), "")
        x, y, z = numbers(sizes, 3)
        flat = kind in ("plane", "disc")
        known = "sim.primitiveshape_cuboid, _spheroid, _cylinder, _capsule, _plane, _disc"
        shape = _shape(kind, (x, y, _THICKNESS) if flat else (x, y, z), known, primitiveType)
        mass = _DENSITY * x * y * (_THICKNESS if flat else z)
        return self._add(kind.capitalize(), **shape, mass=mass, static=True, respondable=False)

    @sim("345", createShape="5")
    def createMeshShape(
        self, _options: int, _shadingAngle: Number, vertices: Numbers, indices: Numbers, *_: Any
    ) -> int:
        """Create a static shape from vertices (m) and triangles, three indices from 0 each; return its handle."""
        corners = [int(index) for index in indices]
        if not vertices or len(vertices) % 3 or not corners or len(corners) % 3:
            raise WrongValue("expected three numbers for each vertex and three indices for each triangle")
        points = numbers(vertices, len(vertices))
        return self._do(lambda scene: scene.add_mesh(scene.free_name("Shape"), points, corners))

    # ---- other objects

    @sim("345")
    def createDummy(self, size: Number, _color: Any = None) -> int:
        """Create a dummy at the origin of the world; return its handle.

        Its name is Dummy, or Dummy0, Dummy1 and so on. Move it with setObjectPosition and setObjectParent.
        """
        (length,) = numbers((size,), 1)
        return self._add("Dummy", kind="dummy", **({"size": length} if length else {}))

    @sim("345")
    def setLinkDummy(self, dummyHandle: Handle, linkedDummyHandle: int) -> None:
        """Link two dummies, -1 to end the link: the dynamics keeps the bodies that carry them rigidly together."""
        self._do(lambda scene: scene.link(dummyHandle, linkedDummyHandle))

    @sim("345")
    def getLinkDummy(self, dummyHandle: Handle) -> int:
        """Return the handle of the dummy that a dummy is linked to, -1 if it has no link."""
        return self._do(lambda scene: scene.linked(dummyHandle))

    @sim("345")
    def createJoint(
        self, jointType: int, jointMode: int = 0, _options: int = 0, _sizes: Any = None, *_colors: Any
    ) -> int:
        """Create a sim.joint_revolute_subtype, _prismatic_ or _spherical_ joint at the origin; return its handle.

        In sim.jointmode_force (4.x: _dynamic), it turns freely; in any other mode, scripts move it.
        """
        if jointType not in _JOINTS:
            raise ValueError(
                f"type of joint {jointType!r}: must be sim.joint_revolute_subtype, _prismatic_, _spherical_"
            )
        dynamic = jointMode == CONSTANTS["jointmode_force"]
        return self._add("Joint", kind="joint", type=_JOINTS[jointType], mode="passive" if dynamic else "kinematic")

    @sim("345")
    def createForceSensor(self, _options: int, _intParams: Numbers, _floatParams: Numbers, *_color: Any) -> int:
        """Create a force sensor at the origin; return its handle. It does not break."""
        return self._add("Force_sensor", kind="force_sensor")

    @sim("345")
    def createProximitySensor(
        self, sensorType: int, _subType: int, _options: int, _intParams: Numbers, floatParams: Numbers, *_color: Any
    ) -> int:
        """Create a sim.proximitysensor_ray_subtype, _cone_, _disc_, _cylinder_ or _pyramid_; return its handle.

        `floatParams` by index from 0: 0 offset and 1 range (m), 4 width of a pyramid's end (m), 7 radius (m), 9 angle
        (rad).
        """
        if sensorType not in _VOLUMES:
            raise ValueError(
                f"type of proximity sensor {sensorType!r}: must be sim.proximitysensor_ray_subtype, _cone_"
            )
        kind, values = _VOLUMES[sensorType], numbers(floatParams, len(floatParams))
        if len(values) < 10:
            raise WrongValue("floatParams must have 15 numbers")
        keys: dict[str, Any] = {"type": kind, "offset": values[0], "range": values[1]}
        if kind in ("cone", "disc"):
            keys["angle"] = values[9]
        if kind == "cylinder":
            keys["radius"] = values[7]
        if kind == "pyramid":
            keys["angle"] = 2 * atan2(values[4] / 2, values[0] + values[1])
        return self._add("Proximity_sensor", kind="proximity_sensor", **keys)

    @sim("345")
    def createVisionSensor(self, options: int, intParams: Numbers, floatParams: Numbers, *_color: Any) -> int:
        """Create a vision sensor; return its handle. `options`: 2 perspective, otherwise orthographic.

        `intParams`: width and height (px); `floatParams`: near and far plane (m), and angle (rad) or size (m).
        """
        whole, values = numbers(intParams, len(intParams)), numbers(floatParams, len(floatParams))
        if len(whole) < 2 or len(values) < 3:
            raise WrongValue("expected width and height, and near, far and angle")
        keys = {"width": int(whole[0]), "height": int(whole[1]), "near": values[0], "far": values[1]}
        key = "fov" if int(options) & _PERSPECTIVE else "size"
        return self._add("Vision_sensor", kind="vision_sensor", **keys, **{key: values[2]})

    # ---- copies, names, removal

    @sim("345")
    def copyPasteObjects(self, handles: Sequence[Handle], options: int = 0) -> list[int]:
        """Copy objects at the same places; return the copies' handles. A copied child has the copied parent.

        `options`: 1 with all descendants. The copies of Ball are named Ball#0, Ball#1 and so on. Child scripts are also
        copied, and start before the scripts are called the next time.
        """
        wanted = _handles(handles)
        if int(options) & _WHOLE_MODELS:
            return self._do(lambda scene: scene.copy([handle for top in wanted for handle in scene.model(top)]))
        return self._do(lambda scene: scene.copy(wanted))

    @sim("345")
    def setObjectName(self, handle: Handle, name: Name) -> int:
        """Set the name of an object; it must be unique (3.x). Return 1.

        With sim.handleflag_altname, set the alias (4.2).
        """
        self._do(
            lambda scene: scene.set_alias(bare(handle), name) if handle != bare(handle) else scene.rename(handle, name)
        )
        return 1

    @sim("5")
    def setObjectAlias(self, handle: Handle, alias: Name) -> None:
        """Set the alias of an object; other objects may have the same alias (4.x)."""
        self._do(lambda scene: scene.set_alias(handle, alias))

    @sim("345")
    def removeObject(self, handle: Handle) -> int:
        """Remove an object, after its script's cleanup; its children stay. Return 1."""
        return self.removeObjects([handle])

    @sim("5")
    def removeObjects(self, handles: Sequence[Handle], _later: bool = False) -> int:
        """Remove objects; their children stay. Return 1."""
        self._do(lambda scene: scene.remove(_handles(handles)))
        return 1

    @sim("345")
    def removeModel(self, handle: Handle, _later: bool = False) -> int:
        """Remove an object with all objects below it. Return the number of removed objects."""

        def remove(scene: Operations) -> int:
            removed = scene.model(handle)
            scene.remove(removed)
            return len(removed)

        return self._do(remove)

    # ---- files

    @sim("345")
    def loadModel(self, filename: Name) -> int:
        """Add the objects and scripts of a model (.ttm; .yaml) or scene file (.yaml); return the first object's handle.

        The file is in the folder of the scene file; its other settings are ignored.
        """
        return self._do(lambda scene: scene.load_model(filename))

    @sim("345")
    def saveModel(self, handle: Handle, filename: Name) -> int:
        """Write an object and all objects below it to a file (.yaml) in the scene file's folder; return 1."""
        self._do(lambda scene: scene.save_model(handle, filename))
        return 1


class Shapes(Functions):
    """Shapes of the scene: their colors, masses, sizes and groups."""

    @sim("345")
    def setShapeColor(self, handle: Handle, _colorName: Any, colorComponent: int, rgbData: Numbers) -> int:
        """Set the color of a shape and its parts: red, green, blue from 0 to 1. Return 1.

        sim.colorcomponent_transparency takes one number, the opacity; other components have no effect.
        """
        if colorComponent == CONSTANTS["colorcomponent_transparency"]:
            (opacity,) = numbers(rgbData if isinstance(rgbData, Sequence) else (rgbData,), 1)
            self._do(lambda scene: scene.paint(handle, (None, None, None, opacity)))
        elif colorComponent == CONSTANTS["colorcomponent_ambient_diffuse"]:
            self._do(lambda scene: scene.paint(handle, (*numbers(rgbData, 3), None)))
        return 1

    @sim("345")
    def getShapeColor(
        self, handle: Handle, _colorName: Any = None, _colorComponent: int = 0
    ) -> tuple[int, list[float]]:
        """Return 1, and the color of a shape's first part: red, green, blue from 0 to 1."""
        return 1, list(self._do(lambda scene: scene.color(handle))[:3])

    @sim("345")
    def setShapeMass(self, handle: Handle, mass: Number) -> None:
        """Set the mass of a shape (kg); its distribution does not change. A static shape stays static."""
        self._do(lambda scene: scene.change(handle, mass=numbers((mass,), 1)[0]))

    @sim("45")
    def getShapeBB(self, handle: Handle) -> tuple[ThreeNumbers, SevenNumbers]:
        """Return the box around a shape along its own axes: its size (m), and position and quaternion in the shape."""
        size, centre = self._do(lambda scene: scene.box(handle))
        return list(size), [*centre, 0.0, 0.0, 0.0, 1.0]

    @sim("45")
    def setShapeBB(self, handle: Handle, size: ThreeNumbers) -> int:
        """Scale a shape until the box around it has a size (m). Return 1."""
        wanted = numbers(size, 3)

        def scale(scene: Operations) -> None:
            now, _ = scene.box(handle)
            scene.scale([handle], [new / old for new, old in zip(wanted, now)])

        self._do(scale)
        return 1

    @sim("345")
    def scaleObject(self, handle: Handle, xScale: Number, yScale: Number, zScale: Number, _options: int = 0) -> None:
        """Scale an object along x, y and z; its mass grows with its volume."""
        factors = numbers((xScale, yScale, zScale), 3)
        self._do(lambda scene: scene.scale([handle], factors))

    @sim("345")
    def scaleObjects(self, handles: Sequence[Handle], scaleFactor: Number, scalePositionsToo: bool) -> None:
        """Scale objects; with `scalePositionsToo`, also the distances from their parents."""
        (factor,) = numbers((scaleFactor,), 1)
        self._do(lambda scene: scene.scale(_handles(handles), (factor, factor, factor), bool(scalePositionsToo)))

    @sim("345")
    def getObjectSizeFactor(self, handle: Handle) -> float:
        """Return the factor by which an object was scaled along x."""
        return self._do(lambda scene: scene.factors(handle)[0])

    @sim("345")
    def getObjectSizeValues(self, handle: Handle) -> list[float]:
        """Return the factors by which an object was scaled along x, y and z."""
        return list(self._do(lambda scene: scene.factors(handle)))

    @sim("345")
    def groupShapes(self, handles: Sequence[Handle], _merge: bool = False) -> int:
        """Combine shapes into a rigid one, with the name and the frame of the first one; return its handle."""
        return self._do(lambda scene: scene.group(_handles(handles)))

    @sim("345")
    def ungroupShape(self, handle: Handle) -> list[int]:
        """Make each part of a shape a shape, with a mass according to its volume; return their handles."""
        return self._do(lambda scene: scene.ungroup(handle))


def _handles(handles: Sequence[Handle]) -> list[int]:
    if isinstance(handles, (int, float, str)):
        raise WrongValue("expected a table of handles")
    return [int(handle) for handle in handles]


def _shape(kind: str, sizes: tuple[float, ...], known: str, number: Any) -> dict[str, Any]:
    """Return the keys of a scene file for a shape with sizes along x, y, z (m). Raises ValueError."""
    x, y, z = sizes
    if kind in ("cuboid", "plane"):
        return {"shape": "box", "size": [x, y, z]}
    if kind in ("cylinder", "disc", "capsule", "sphere", "spheroid"):
        ball = kind in ("sphere", "spheroid")
        if x != y or (ball and x != z):
            raise ValueError(
                f"sizes = {x:g}, {y:g}, {z:g}: a {kind} must be round{' all over' if ball else ' about z'}"
            )
        if ball:
            return {"shape": "sphere", "size": [x / 2]}
        return (
            {"shape": "capsule", "size": [x / 2, z - x]}
            if kind == "capsule"
            else {"shape": "cylinder", "size": [x / 2, z]}
        )
    raise ValueError(f"primitiveType = {number!r}: must be one of {known}")
