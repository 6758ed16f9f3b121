"""GPU buffers of the visuals: shared meshes, one record per instance, and batches for instanced draw calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np

from drone_sim.files.mesh_files import WHITE
from drone_sim.render import surfaces
from drone_sim.render.culling import in_view
from drone_sim.render.programs import Role
from drone_sim.render.surfaces import Surface
from drone_sim.shapes.visual import Visual

SHADE = 0.55  # brightness of the floor in a shadow, relative to its brightness in the light
VERTEX_LAYOUT = (("position", "3f", 12), ("normal", "3f", 12), ("uv", "2f", 8))
MOVING_LAYOUT = (("row0", "4f", 16), ("row1", "4f", 16), ("row2", "4f", 16))
PAINT_LAYOUT = (("paint", "4f", 16),)
IDENTITY_LAYOUT = (("identity", "1f", 4),)
BEFORE_LAYOUT = (("before0", "4f", 16), ("before1", "4f", 16), ("before2", "4f", 16))
VERTEX_SIZE = 32  # bytes
INSTANCE_LAYOUTS = (MOVING_LAYOUT, PAINT_LAYOUT, IDENTITY_LAYOUT, BEFORE_LAYOUT)
ANISOTROPY = 8.0
MANY_VERTICES = 10_000  # of all visuals; fewer are drawn faster than it takes to find out which are in the view


@dataclass
class CardSurface:
    """A surface in GPU memory."""

    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    texture: moderngl.Texture | None
    rgba: tuple[float, ...]
    transparent: bool
    closed: bool
    top: float
    centre: np.ndarray  # of its bounding box
    half_size: np.ndarray

    def release(self) -> None:
        """Free the GPU memory of the surface."""
        for resource in (self.vertices, self.indices, self.texture):
            if resource is not None:
                resource.release()


@dataclass
class Batch:
    """Instances of one surface that one draw call renders."""

    surface: CardSurface
    members: list[int]  # indices of visuals
    floor: bool = False
    transparent: bool = False
    ground: bool = False
    first: int = 0  # index of its first record in the instance buffers
    visible: int = 0  # how many of its instances, from the first on, are drawn
    arrays: dict[Role, moderngl.VertexArray] = field(default_factory=dict)

    @property
    def look(self) -> str:
        """Return the key of `programs.LOOKS`: which of a role's shader programs renders this batch."""
        return "plain" if self.surface.texture is None else "floor" if self.floor else "textured"

    def draw(self, role: Role) -> None:
        """Render the batch in a role that `DrawBatches.link` prepared."""
        if role.kind == "surface" and self.surface.texture is not None:
            self.surface.texture.use(0)
        if self.visible:
            self.arrays[role].render(instances=self.visible * role.tiles)


class DrawBatches:
    """All visuals, sorted into batches. Its methods need the OpenGL context to be current."""

    def __init__(self, context: moderngl.Context, software: bool) -> None:
        """Create it without visuals. software: whether OpenGL renders on the CPU."""
        self._context = context
        self._software = software
        self._linked: set[Role] = set()
        self._surfaces: dict[Visual, tuple[CardSurface, ...]] = {}
        self._buffers: list[moderngl.Buffer] = []
        # For each record of the instance buffers: its visual, batch, scale, and bounding sphere in the mesh's frame.
        self._members: np.ndarray = np.zeros(0, dtype=np.intp)
        self._batch_of: np.ndarray = self._members
        self._scales = np.zeros((0, 1, 3))
        self._centres, self._radii = np.zeros((0, 3, 1)), np.zeros(0)
        self._has_many_vertices = False
        self._order: np.ndarray = self._members  # of the records; those that are not drawn last
        self._paints: np.ndarray = np.zeros((0, 4), dtype=np.float32)
        self.visuals: tuple[Visual, ...] = ()
        self.all: list[Batch] = []
        self.solids: list[Batch] = []
        self.floors: list[Batch] = []
        self.ground: list[Batch] = []  # not drawn: the image is cleared to its colour; but it has depth
        self.glass: list[Batch] = []

    def update(self, visuals: Sequence[Visual]) -> None:
        """Replace the visuals. Raises ValueError for an unreadable mesh, and then changes nothing."""
        visuals = tuple(visuals)
        if visuals == self.visuals:
            return
        shared = [_shared(visual) for visual in visuals]
        loaded = {geometry: surfaces.load(geometry) for geometry, _ in shared if geometry not in self._surfaces}
        self._release_batches()
        for geometry in set(self._surfaces) - {geometry for geometry, _ in shared}:
            for surface in self._surfaces.pop(geometry):
                surface.release()
        for geometry, surfaces_of_geometry in loaded.items():
            self._surfaces[geometry] = tuple(self._upload(surface) for surface in surfaces_of_geometry)
        self.visuals = visuals
        self.all = self._sort(visuals, [geometry for geometry, _ in shared])
        self.solids = [batch for batch in self.all if not (batch.floor or batch.transparent or batch.ground)]
        self.floors = [batch for batch in self.all if batch.floor]
        self.ground = [batch for batch in self.all if batch.ground]
        self.glass = [batch for batch in self.all if batch.transparent]
        self._members = np.array([i for batch in self.all for i in batch.members], dtype=np.intp)
        self._batch_of = np.repeat(np.arange(len(self.all)), [len(batch.members) for batch in self.all])
        self._scales = np.array([shared[i][1] for i in self._members]).reshape(-1, 1, 3)
        self._centres = np.array([batch.surface.centre for batch in self.all for _ in batch.members]).reshape(-1, 3, 1)
        half_sizes = np.array([batch.surface.half_size for batch in self.all for _ in batch.members]).reshape(-1, 1, 3)
        self._radii = np.linalg.norm(half_sizes * self._scales, axis=2)[:, 0]
        vertices = sum(len(batch.members) * batch.surface.vertices.size for batch in self.all) // VERTEX_SIZE
        self._has_many_vertices = vertices > MANY_VERTICES
        self._reserve()

    def move(
        self, origin: np.ndarray, poses: np.ndarray, clip_from_world: np.ndarray, floor_height: float | None
    ) -> None:
        """Upload the poses, world-from-visual (N, 4, 4), relative to `origin` (3,), metres.

        The subtraction is in double precision, so that objects far from the world's origin do not jitter. Visuals
        outside the view, (4, 4) or (tiles, 4, 4) with `origin` as the world's origin, are not drawn; with a
        `floor_height`, relative to `origin`, only if their shadows on it are outside, too.
        """
        if poses.shape != (len(self.visuals), 4, 4):
            raise ValueError(f"poses of shape {poses.shape} for {len(self.visuals)} visuals")
        if self._buffers:
            if self._has_many_vertices:
                self._hide(self._rows(np.arange(len(self._members)), origin, poses), clip_from_world, floor_height)
            self._buffers[0].write(self._rows(self._order, origin, poses).astype(np.float32))

    def _rows(self, records: np.ndarray, origin: np.ndarray, poses: np.ndarray) -> np.ndarray:
        rows: np.ndarray = poses[self._members[records], :3, :]
        rows[:, :, 3] -= origin
        rows[:, :, :3] *= self._scales[records]
        return rows

    def _hide(self, rows: np.ndarray, clip_from_world: np.ndarray, floor_height: float | None) -> None:
        """Sort the records of each batch so that those outside the view come last, and count the others."""
        centres = (rows[:, :, :3] @ self._centres)[:, :, 0] + rows[:, :, 3]
        visible = in_view(centres, self._radii, clip_from_world, floor_height)
        order = np.argsort(2 * self._batch_of - visible, kind="stable")
        for batch, count in zip(self.all, np.bincount(self._batch_of, visible, len(self.all))):
            batch.visible = int(count)
        if not np.array_equal(order, self._order):
            self._order = order
            self._buffers[1].write(self._paints[order])

    def link(self, role: Role, programs: Mapping[str, Any]) -> None:
        """Prepare the batches for a role, once. `programs` maps each `Batch.look` to the role's shader program."""
        if role not in self._linked:
            self._linked.add(role)
            for batch in self.all:
                batch.arrays[role] = self._array(batch, programs[batch.look], role.tiles)

    def identify(self, instances: np.ndarray) -> None:
        """Upload the instance number of each visual, (N,), for the output "instance"."""
        if self._buffers:
            self._buffers[2].write(np.asarray(instances)[self._members[self._order]].astype(np.float32))

    def move_before(self, origin: np.ndarray, poses: np.ndarray) -> None:
        """Upload the poses of the previous image, for the output "before"; arguments as for `move`."""
        if self._buffers:
            self._buffers[3].write(self._rows(self._order, origin, poses).astype(np.float32))

    def floor_height(self, origin: np.ndarray, poses: np.ndarray) -> float | None:
        """Return the z of the top of the first floor relative to `origin` (3,), metres; None without a floor."""
        if not self.floors:
            return None
        floor = self.floors[0]
        return float(poses[floor.members[0], 2, 3] - origin[2] + floor.surface.top * self._scales[floor.first, 0, 2])

    def glass_from_far(self, distance: Callable[[np.ndarray], float], poses: np.ndarray) -> list[Batch]:
        """Return the transparent batches, farthest first; `distance` is that of a point (3,) in the world."""

        def depth(batch: Batch) -> float:
            pose = poses[batch.members[0]]
            return distance(pose[:3, :3] @ (batch.surface.centre * self._scales[batch.first, 0]) + pose[:3, 3])

        return sorted(self.glass, key=depth, reverse=True) if len(self.glass) > 1 else self.glass

    def release(self) -> None:
        """Free all GPU memory."""
        self._release_batches()
        for shared in self._surfaces.values():
            for surface in shared:
                surface.release()
        self._surfaces = {}

    def _release_batches(self) -> None:
        for batch in self.all:
            for array in batch.arrays.values():
                array.release()
        for buffer in self._buffers:
            buffer.release()
        self._buffers, self.all, self.visuals = [], [], ()
        self._linked.clear()
        self.solids, self.floors, self.ground, self.glass = [], [], [], []

    def _upload(self, surface: Surface) -> CardSurface:
        uv = np.zeros((len(surface.vertices), 2), dtype=np.float32) if surface.uv is None else surface.uv
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        return CardSurface(
            vertices=self._context.buffer(np.hstack([surface.vertices, surface.normals, uv]).astype(np.float32)),
            indices=self._context.buffer(np.ascontiguousarray(surface.faces, dtype=np.uint32)),
            texture=None if surface.texture is None else self._upload_texture(surface.texture),
            rgba=surface.rgba,
            transparent=surface.transparent,
            closed=surface.closed,
            top=float(high[2]),
            centre=(low + high) / 2.0,
            half_size=(high - low) / 2.0,
        )

    def _upload_texture(self, image: np.ndarray) -> moderngl.Texture:
        height, width, channels = image.shape
        rgba = np.full((height, width, 4), 255, dtype=np.uint8)
        rgba[:, :, :channels] = image
        texture = self._context.texture((width, height), 4, rgba[::-1].tobytes())  # v counts from the bottom
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        if not self._software:
            texture.anisotropy = min(ANISOTROPY, self._context.max_anisotropy)
        return texture

    def _sort(self, visuals: Sequence[Visual], geometries: Sequence[Visual]) -> list[Batch]:
        """Group the solid instances by surface; a transparent one has its own batch, since it is sorted by depth."""
        solids: dict[int, Batch] = {}
        singles: list[Batch] = []
        for index, (visual, geometry) in enumerate(zip(visuals, geometries)):
            for surface in self._surfaces[geometry]:
                if visual.ground:
                    singles.append(Batch(surface, [index], ground=True))
                elif visual.floor:
                    singles.append(Batch(surface, [index], floor=True))
                elif surface.transparent or visual.rgba[3] < 1.0:
                    singles.append(Batch(surface, [index], transparent=True))
                elif id(surface) in solids:
                    solids[id(surface)].members.append(index)
                else:
                    solids[id(surface)] = Batch(surface, [index])
        shared = sorted(solids.values(), key=lambda batch: (batch.surface.texture is not None, batch.surface.closed))
        batches = shared + singles
        first = 0
        for batch in batches:
            batch.first, batch.visible = first, len(batch.members)
            first += len(batch.members)
        return batches

    def _reserve(self) -> None:
        if not self.all:
            return
        paints = [self._paint(batch, index) for batch in self.all for index in batch.members]
        self._paints, self._order = np.array(paints, dtype=np.float32), np.arange(len(paints))
        moving = self._context.buffer(reserve=48 * len(paints), dynamic=True)
        paint = self._context.buffer(self._paints, dynamic=True)
        identity = self._context.buffer(reserve=4 * len(paints), dynamic=True)
        before = self._context.buffer(reserve=48 * len(paints), dynamic=True)
        self._buffers = [moving, paint, identity, before]

    def _paint(self, batch: Batch, index: int) -> tuple[float, ...]:
        red, green, blue, alpha = np.multiply(self.visuals[index].rgba, batch.surface.rgba)
        return (red, green, blue, SHADE if batch.floor else alpha if batch.transparent else 1.0)

    def _array(self, batch: Batch, program: Any, times: int) -> moderngl.VertexArray:
        """Return the vertex array with which `program` draws every instance of a batch `times` times."""
        array = self._context.vertex_array(program, [], index_buffer=batch.surface.indices, index_element_size=4)
        for layout, buffer, first, divisor in (
            (VERTEX_LAYOUT, batch.surface.vertices, 0, 0),
            *((layout, buffer, batch.first, times) for layout, buffer in zip(INSTANCE_LAYOUTS, self._buffers)),
        ):
            stride = sum(size for _, _, size in layout)
            offset = first * stride
            for name, kind, size in layout:
                if name in program:
                    location = program[name].location
                    array.bind(location, "f", buffer, kind, offset=offset, stride=stride, divisor=divisor)
                offset += size
        return array


def _shared(visual: Visual) -> tuple[Visual, tuple[float, float, float]]:
    """Return the geometry to upload, equal for all visuals that share it, and the scale of this visual."""
    shape, scale = visual.shape.shared()
    return Visual(None, shape, WHITE, texture=visual.texture, edition=visual.edition), scale
