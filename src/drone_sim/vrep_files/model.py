"""What stands in a V-REP file, as plain immutable values: metres, kilograms, radians, quaternions xyzw."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from drone_sim.mechanics.state import Pose

SUFFIXES = (".ttt", ".ttm")


class VrepFileError(ValueError):
    """A V-REP file is refused; the message is one line that says what is wrong, and where."""


@contextmanager
def within(where: str) -> Iterator[None]:
    """Put the place before what is said of a file."""
    try:
        yield
    except VrepFileError as error:
        raise VrepFileError(f"{where}: {error}") from None


Rgba = tuple[float, float, float, float]
ORIGIN = Pose((0.0, 0.0, 0.0))
# What a model says of itself and all below it.
NOT_DYNAMIC, NOT_RESPONDABLE, INVISIBLE, WITHOUT_SCRIPTS = 0x20, 0x40, 0x100, 0x200


@dataclass(frozen=True)
class VrepPrimitive:
    """A simple form: its word, full extents along x, y and z (m), and its place in the shape's frame."""

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
    """A texture on a mesh: where each corner of its faces lies on it, (m, 3, 2), 0..1, v upwards.

    `is_decal`: the mesh's own colour does not show.
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
    """Principal moments divided by the mass (m²), about a frame in the shape's."""

    pose: Pose
    moments: tuple[float, float, float]


@dataclass(frozen=True)
class VrepShape:
    """What has a surface, and may have a mass (kg)."""

    meshes: tuple[VrepMesh, ...]
    mass: float
    inertia: VrepInertia | None
    is_dynamic: bool
    is_respondable: bool


@dataclass(frozen=True)
class VrepJoint:
    """A joint along its z axis; its position (rad, m, or a pose), limits None where it is cyclic."""

    kind: str  # revolute, prismatic, spherical or screw
    position: float
    limits: tuple[float, float] | None
    turn: Pose  # of a spherical one
    lead: float  # m per turn, of a screw
    mode: str  # kinematic, passive, velocity or position
    target: float  # rad/s or m/s, rad or m, as the mode needs it
    max_force: float  # N m or N


@dataclass(frozen=True)
class VrepDummy:
    """A frame; the handle of the dummy that it is linked to, -1 for none; the points of a path of 4.x.

    Each is x, y, z (m) and a quaternion x, y, z, w. `holds`: the dynamics keeps both linked dummies at one place.
    """

    size: float
    linked: int = -1
    holds: bool = False
    path: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class VrepControlPoint:
    """A control point of a path: its pose, its curve, what it carries, and its speed, 0 to 1, of the path's own."""

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
    """A path of 3.x: its control points, switches, how its length is counted (0 to 6), and where a follower is (m).

    `has_surface`: whether a body is drawn along it; `broken`: how many more points there are, without a valid position.
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
    """What looks along +z, +y up; the angle (rad) spans the larger side, the size (m) of an orthographic one too."""

    is_perspective: bool
    angle: float
    size: float
    near: float
    far: float
    resolution: tuple[int, int] | None = None  # px, of a vision sensor


@dataclass(frozen=True)
class VrepProximitySensor:
    """What measures the distance along +z: kind pyramid, cylinder, disc, cone or ray; m and rad."""

    kind: str
    offset: float
    range: float
    size: tuple[float, float]
    radius: float
    angle: float


@dataclass(frozen=True)
class Other:
    """An object of which only its place is known: force sensor, light, path, graph, ..."""

    kind: str


Kind = VrepShape | VrepJoint | VrepDummy | VrepPath | VrepCamera | VrepProximitySensor | Other


@dataclass(frozen=True)
class VrepScript:
    """A script on an object (its handle; -1 for the main script); since 4.9 it is an object of its own.

    `parent_is_proxy`: whether paths of such an object begin at its parent, as if the script came from an older file.
    """

    object: int
    kind: str  # main, child or customization, or another's number
    text: str
    is_enabled: bool = True
    language: str = "lua"
    parameters: tuple[tuple[str, str], ...] = ()
    is_stock_main: bool = False
    own_object: int = -1  # handle of the script as an object, -1 where it is none
    parent_is_proxy: bool = False

    @property
    def is_embedded(self) -> bool:
        """Whether its paths begin at the object that it is on, not at the script as an object of its own."""
        return self.own_object == -1 or self.parent_is_proxy


@dataclass(frozen=True)
class VrepCollectionItem:
    """What belongs to a collection: an object by its handle, what hangs on it, what it hangs on, or all there are."""

    what: str  # single, tree, chain or all
    object: int
    removes: bool  # from what the items before it say
    without: bool  # of a tree or chain: whether it leaves out the object itself


@dataclass(frozen=True)
class VrepCollection:
    """Objects under a name."""

    name: str
    items: tuple[VrepCollectionItem, ...]


@dataclass(frozen=True)
class VrepObject:
    """An object: its handle in the file, its parent's (-1 for none), and its pose in the parent's frame."""

    handle: int
    parent: int
    name: str  # unique in the file
    alias: str  # '' where the file has none
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
        """What it is, where it is a shape."""
        return self.of if isinstance(self.of, VrepShape) else None


BULLET = 0  # the number of that physics engine; 1 is ODE, others Vortex, Newton, MuJoCo


@dataclass(frozen=True)
class VrepSettings:
    """What a file says of the world: steps (s), gravity (m/s²); None where it says nothing, as models do."""

    time_step: float | None = None
    dynamics_step: float | None = None
    gravity: tuple[float, float, float] | None = None
    engine: int = BULLET
    visible_layers: int = 0x00FF


@dataclass(frozen=True)
class VrepFile:
    """A scene or a model."""

    version: int  # of its format
    program: str  # such as 3.6.1
    objects: tuple[VrepObject, ...]  # a parent before its children
    scripts: tuple[VrepScript, ...]
    settings: VrepSettings
    collections: tuple[VrepCollection, ...] = ()
