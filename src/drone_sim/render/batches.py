"""What is on the graphics card: shared meshes, one record per instance, and the draws they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np

from drone_sim.files.mesh_part import WHITE
from drone_sim.render import surfaces
from drone_sim.render.programs import Role
from drone_sim.render.surfaces import Surface
from drone_sim.shapes.visual import Visual

SHADE = 0.55  # what a shadow leaves of the floor's brightness
VERTEX_LAYOUT = (("position", "3f", 12), ("normal", "3f", 12), ("uv", "2f", 8))
MOVING_LAYOUT = (("row0", "4f", 16), ("row1", "4f", 16), ("row2", "4f", 16))
FIXED_LAYOUT = (("paint", "4f", 16),)
IDENTITY_LAYOUT = (("identity", "1f", 4),)
BEFORE_LAYOUT = (("before0", "4f", 16), ("before1", "4f", 16), ("before2", "4f", 16))
ANISOTROPY = 8.0


@dataclass
class CardSurface:
    """A surface on the card."""

    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    texture: moderngl.Texture | None
    rgba: tuple[float, ...]
    transparent: bool
    closed: bool
    top: float
    centre: np.ndarray

    def release(self) -> None:
        """Free its memory on the card."""
        for resource in (self.vertices, self.indices, self.texture):
            if resource is not None:
                resource.release()


@dataclass
class Batch:
    """Instances of one surface that are drawn by one call."""

    surface: CardSurface
    members: list[int]  # indices into the visuals
    floor: bool = False
    transparent: bool = False
    ground: bool = False
    first: int = 0  # record
    arrays: dict[Role, moderngl.VertexArray] = field(default_factory=dict)

    @property
    def look(self) -> str:
        """Which of the programs of a role draws it."""
        return "plain" if self.surface.texture is None else "floor" if self.floor else "textured"

    def draw(self, role: Role) -> None:
        """Draw in a role that `DrawBatches.link` has linked."""
        if role.kind == "surface" and self.surface.texture is not None:
            self.surface.texture.use(0)
        self.arrays[role].render(instances=len(self.members) * role.tiles)


class DrawBatches:
    """The visuals as batches; must be used with its context current."""

    def __init__(self, context: moderngl.Context, software: bool) -> None:
        """Empty. software: whether the CPU draws."""
        self._context = context
        self._software = software
        self._linked: set[Role] = set()
        self._surfaces: dict[Visual, tuple[CardSurface, ...]] = {}
        self._buffers: list[moderngl.Buffer] = []
        self._members: np.ndarray = np.zeros(0, dtype=np.intp)
        self._scales = np.zeros((0, 1, 3))
        self.visuals: tuple[Visual, ...] = ()
        self.all: list[Batch] = []
        self.solids: list[Batch] = []
        self.floors: list[Batch] = []
        self.ground: list[Batch] = []  # which the picture is cleared to; it has a depth, too
        self.glass: list[Batch] = []

    def update(self, visuals: Sequence[Visual]) -> None:
        """Follow the list; on ValueError (an unreadable mesh) all stays as it was."""
        visuals = tuple(visuals)
        if visuals == self.visuals:
            return
        shared = [_shared(visual) for visual in visuals]
        loaded = {form: surfaces.load(form) for form, _ in shared if form not in self._surfaces}
        self._release_batches()
        for form in set(self._surfaces) - {form for form, _ in shared}:
            for surface in self._surfaces.pop(form):
                surface.release()
        for form, made in loaded.items():
            self._surfaces[form] = tuple(self._upload(one) for one in made)
        self.visuals = visuals
        self.all = self._sort(visuals, [form for form, _ in shared])
        self.solids = [batch for batch in self.all if not (batch.floor or batch.transparent or batch.ground)]
        self.floors = [batch for batch in self.all if batch.floor]
        self.ground = [batch for batch in self.all if batch.ground]
        self.glass = [batch for batch in self.all if batch.transparent]
        self._members = np.array([i for batch in self.all for i in batch.members], dtype=np.intp)
        self._scales = np.array([shared[i][1] for i in self._members]).reshape(-1, 1, 3)
        self._reserve()

    def move(self, origin: np.ndarray, poses: np.ndarray) -> None:
        """Write the instances' matrices, world-from-visual (N, 4, 4), relative to `origin` (3,), metres.

        The difference is taken in double precision, so that far from the world's origin nothing trembles.
        """
        if poses.shape != (len(self.visuals), 4, 4):
            raise ValueError(f"poses of shape {poses.shape} for {len(self.visuals)} visuals")
        if self._buffers:
            self._buffers[0].write(self._rows(origin, poses))

    def _rows(self, origin: np.ndarray, poses: np.ndarray) -> np.ndarray:
        rows = poses[self._members, :3, :]
        rows[:, :, 3] -= origin
        rows[:, :, :3] *= self._scales
        return np.asarray(rows, dtype=np.float32)

    def link(self, role: Role, programs: Mapping[str, Any]) -> None:
        """Let the batches be drawn in a role, with its programs by their look."""
        if role not in self._linked:
            self._linked.add(role)
            for batch in self.all:
                batch.arrays[role] = self._array(batch, programs[batch.look], role.tiles)

    def identify(self, instances: np.ndarray) -> None:
        """Write whose each visual is, (N,), for outputs that show it."""
        if self._buffers:
            self._buffers[2].write(np.asarray(instances)[self._members].astype(np.float32))

    def move_before(self, origin: np.ndarray, poses: np.ndarray) -> None:
        """Write where the visuals were in the picture before, as `move` does for this one."""
        if self._buffers:
            self._buffers[3].write(self._rows(origin, poses))

    def floor_height(self, poses: np.ndarray) -> float | None:
        """World z of the top of the first floor, metres, or None without a floor."""
        if not self.floors:
            return None
        floor = self.floors[0]
        return float(poses[floor.members[0], 2, 3] + floor.surface.top * self._scales[floor.first, 0, 2])

    def glass_from_far(self, away: Callable[[np.ndarray], float], poses: np.ndarray) -> list[Batch]:
        """The transparent batches, the farthest first; `away` says how far a point (3,) in the world is."""

        def depth(batch: Batch) -> float:
            pose = poses[batch.members[0]]
            return away(pose[:3, :3] @ (batch.surface.centre * self._scales[batch.first, 0]) + pose[:3, 3])

        return sorted(self.glass, key=depth, reverse=True) if len(self.glass) > 1 else self.glass

    def release(self) -> None:
        """Free everything on the card."""
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

    def _upload(self, one: Surface) -> CardSurface:
        uv = np.zeros((len(one.vertices), 2), dtype=np.float32) if one.uv is None else one.uv
        low, high = one.vertices.min(axis=0), one.vertices.max(axis=0)
        return CardSurface(
            vertices=self._context.buffer(np.hstack([one.vertices, one.normals, uv]).astype(np.float32)),
            indices=self._context.buffer(np.ascontiguousarray(one.faces, dtype=np.uint32)),
            texture=None if one.texture is None else self._upload_texture(one.texture),
            rgba=one.rgba,
            transparent=one.transparent,
            closed=one.closed,
            top=float(high[2]),
            centre=(low + high) / 2.0,
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

    def _sort(self, visuals: Sequence[Visual], forms: Sequence[Visual]) -> list[Batch]:
        """Solid instances of a surface share a batch; transparent ones are drawn singly, in the order of depth."""
        solids: dict[int, Batch] = {}
        singles: list[Batch] = []
        for index, (visual, form) in enumerate(zip(visuals, forms)):
            for surface in self._surfaces[form]:
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
        alike = sorted(solids.values(), key=lambda batch: (batch.surface.texture is not None, batch.surface.closed))
        batches = alike + singles
        first = 0
        for batch in batches:
            batch.first = first
            first += len(batch.members)
        return batches

    def _reserve(self) -> None:
        """Make the record buffers."""
        if not self.all:
            return
        records = [self._paint(batch, index) for batch in self.all for index in batch.members]
        moving = self._context.buffer(reserve=48 * len(records), dynamic=True)
        fixed = self._context.buffer(np.array(records, dtype=np.float32))
        identity = self._context.buffer(reserve=4 * len(records), dynamic=True)
        before = self._context.buffer(reserve=48 * len(records), dynamic=True)
        self._buffers = [moving, fixed, identity, before]

    def _paint(self, batch: Batch, index: int) -> tuple[float, ...]:
        red, green, blue, alpha = np.multiply(self.visuals[index].rgba, batch.surface.rgba)
        return (red, green, blue, SHADE if batch.floor else alpha if batch.transparent else 1.0)

    def _array(self, batch: Batch, program: Any, times: int) -> moderngl.VertexArray:
        """Let a program draw a batch, every instance so many times."""
        array = self._context.vertex_array(program, [], index_buffer=batch.surface.indices, index_element_size=4)
        layouts = (MOVING_LAYOUT, FIXED_LAYOUT, IDENTITY_LAYOUT, BEFORE_LAYOUT)
        for layout, buffer, first, divisor in (
            (VERTEX_LAYOUT, batch.surface.vertices, 0, 0),
            *((layout, buffer, batch.first, times) for layout, buffer in zip(layouts, self._buffers)),
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
    """The geometry to upload, one for all that share it, and the scale that makes it this visual's."""
    shape, scale = visual.shape.shared()
    return Visual(None, shape, WHITE, texture=visual.texture, edition=visual.edition), scale
