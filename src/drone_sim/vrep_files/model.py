"""The content of a V-REP file as immutable values, in m, kg, rad, quaternions xyzw."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from drone_sim.mechanics.state import Pose

SUFFIXES = (".ttt", ".ttm")


class VrepFileError(ValueError):
    """A V-REP file cannot be read. The message is one line with the place and the reason."""


@contextmanager
def within(where: str) -> Iterator[None]:
    """Prefix a VrepFileError with the place in the file."""
    try:
        yield
    except VrepFileError as error:
        raise VrepFileError(f"{where}: {error}") from None


Rgba = tuple[float, float, float, float]
ORIGIN = Pose((0.0, 0.0, 0.0))
# Flags of a model, which apply to all objects below it too.
NOT_DYNAMIC, NOT_RESPONDABLE, INVISIBLE, WITHOUT_SCRIPTS = 0x20, 0x40, 0x100, 0x200


@dataclass(frozen=True)
class VrepPrimitive:
    """A primitive: its type, full extents along x, y and z (m), and pose in the shape's frame."""

    word: str  # plane, disc, cuboid, spheroid, cylinder, cone, heightfield or capsule
    size: tuple[float, float, float]
    pose: Pose


@dataclass(frozen=True, eq=False)
class VrepTexture:
    """An image (h, w, 3 or 4), 0..255, top row first."""

    name: str
    image: np.ndarray


@dataclass(frozen=True, eq=False)
class VrepCover:
    """A texture on a mesh. `corners`: uv of each corner of each face, (m, 3, 2), 0..1, v upwards.

    `is_decal`: the texture replaces the mesh's colour.
    """

    texture: VrepTexture
    corners: np.ndarray
    is_decal: bool


@dataclass(frozen=True)
class VrepMesh:
    """One surface of a shape: vertices (n, 3), m, in the shape's frame; faces (m, 3); colour 0..1."""

    vertices: np.ndarray
    faces: np.ndarray
    color: Rgba
    primitive: VrepPrimitive | None = None
    cover: VrepCover | None = None


@dataclass(frozen=True)
class VrepInertia:
    """Principal moments of inertia divided by the mass (m²), and the principal frame in the shape's frame."""

    pose: Pose
    moments: tuple[float, float, float]


@dataclass(frozen=True)
class VrepShape:
    """A shape: meshes and a mass (kg)."""

    meshes: tuple[VrepMesh, ...]
    mass: float
    inertia: VrepInertia | None
    is_dynamic: bool
    is_respondable: bool


@dataclass(frozen=True)
class VrepJoint:
    """A joint along its z axis. `position` is in rad or m; `limits` is None for a cyclic joint."""

    kind: str  # revolute, prismatic, spherical or screw
    position: float
    limits: tuple[float, float] | None
    turn: Pose  # orientation of a spherical joint
    lead: float  # m per revolution of a screw
    mode: str  # kinematic, passive, velocity or position
    target: float  # rad/s or m/s in mode velocity, otherwise rad or m
    max_force: float  # N m or N


@dataclass(frozen=True)
class VrepDummy:
    """A dummy. `linked`: handle of the dummy that it is linked to, -1 for none; `path`: points of a 4.x path.

    Each point is x, y, z (m) and a quaternion x, y, z, w. `holds`: the dynamics keeps both linked dummies at one place.
    """

    size: float
    linked: int = -1
    holds: bool = False
    path: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class VrepControlPoint:
    """A control point of a path: pose, Bézier factors and count, flags, channels, speed (0 to 1, of the path's own)."""

    pose: Pose
    before: float
    after: float
    count: int
    speed: float
    pause: float = 0.0
    flags: int = 0
    channels: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VrepPath:
    """A path of 3.x. `counts`: how its length is computed (0 to 6); `along`: position on it (m).

    `has_surface`: whether it has a visible body; `broken`: number of skipped points without a valid position.
    """

    points: tuple[VrepControlPoint, ...]
    switches: int
    counts: int
    metres_per_radian: float
    metres_per_pause: float
    along: float
    has_surface: bool
    broken: int = 0


@dataclass(frozen=True)
class VrepCamera:
    """A camera along +z, y up. `angle` (rad), or `size` (m) if orthographic, spans the larger side of the image."""

    is_perspective: bool
    angle: float
    size: float
    near: float
    far: float
    resolution: tuple[int, int] | None = None  # px, of a vision sensor only


@dataclass(frozen=True)
class VrepProximitySensor:
    """A proximity sensor along +z; kind: pyramid, cylinder, disc, cone or ray; m and rad."""

    kind: str
    offset: float
    range: float
    size: tuple[float, float]
    radius: float
    angle: float


@dataclass(frozen=True)
class Other:
    """An object whose type-specific data is not read: force sensor, light, graph, ..."""

    kind: str


Kind = VrepShape | VrepJoint | VrepDummy | VrepPath | VrepCamera | VrepProximitySensor | Other


@dataclass(frozen=True)
class VrepScript:
    """A script of an object (its handle; -1 for the main script). Since 4.9 a script is also an object itself.

    `parent_is_proxy`: object paths of such a script start at its parent, as in older files.
    """

    object: int
    kind: str  # main, child, customization or `of type NUMBER`
    text: str
    is_enabled: bool = True
    language: str = "lua"
    parameters: tuple[tuple[str, str], ...] = ()
    is_stock_main: bool = False
    own_object: int = -1  # handle of the script object, -1 if there is none
    parent_is_proxy: bool = False

    @property
    def is_embedded(self) -> bool:
        """Whether its object paths start at the object that it is attached to, not at the script object."""
        return self.own_object == -1 or self.parent_is_proxy


@dataclass(frozen=True)
class VrepCollectionItem:
    """An item of a collection: an object (handle), its tree, its chain of ancestors, or all objects of the scene."""

    what: str  # single, tree, chain or all
    object: int
    removes: bool  # whether it removes these objects from those of the items before
    without: bool  # for tree and chain: without the object itself


@dataclass(frozen=True)
class VrepCollection:
    """A named collection of objects."""

    name: str
    items: tuple[VrepCollectionItem, ...]


@dataclass(frozen=True)
class VrepObject:
    """An object: its handle in the file, its parent's handle (-1 for none), and its pose in the parent's frame."""

    handle: int
    parent: int
    name: str  # unique in the file
    alias: str  # '' if the file has none
    pose: Pose
    of: Kind
    is_model: bool = False
    model_flags: int = 0
    layers: int = 1
    size_factor: float = 1.0
    parameters: tuple[tuple[str, str], ...] = ()  # of its script, since 4.0
    children: list[VrepObject] = field(default_factory=list, compare=False, repr=False)  # filled by the reader

    @property
    def shape(self) -> VrepShape | None:
        """Its shape; None if it is not one."""
        return self.of if isinstance(self.of, VrepShape) else None


BULLET = 0  # V-REP's number for this physics engine; 1 is ODE, then Vortex, Newton, MuJoCo


@dataclass(frozen=True)
class VrepSettings:
    """World settings: time steps (s), gravity (m/s²). None if the file has none, as models."""

    time_step: float | None = None
    dynamics_step: float | None = None
    gravity: tuple[float, float, float] | None = None
    engine: int = BULLET
    visible_layers: int = 0x00FF


@dataclass(frozen=True)
class VrepFile:
    """A scene or model file."""

    version: int  # of the format
    program: str  # such as 3.6.1
    objects: tuple[VrepObject, ...]  # a parent before its children
    scripts: tuple[VrepScript, ...]
    settings: VrepSettings
    collections: tuple[VrepCollection, ...] = ()
