"""Renders images and ground-truth outputs of a list of visuals with OpenGL, without a display.

Shadows need no shadow map: floor and ground write their shadow brightness into the image's alpha, all other objects
write 1. The solid objects are then drawn again, flattened onto the floor along the light; each fragment multiplies the
colour by alpha and sets alpha to 1. So only floor and ground darken, and only once. Shadows fall on these alone, in the
plane of the first floor, and transparent objects cast none.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import moderngl
import numpy as np

from drone_sim.render import context
from drone_sim.render.batches import SHADE, Batch, DrawBatches
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic, Tiles
from drone_sim.render.lens_view import Colors, LensView
from drone_sim.render.outputs import COLOR, OUTPUTS
from drone_sim.render.programs import ALONE, Programs, Role
from drone_sim.render.sky import dome
from drone_sim.render.target import Box, Target, without_alpha
from drone_sim.shapes.visual import Visual

_MAX_LENSES = 16
_MIN_ROWS = 16  # of an image, rendered at once
_CLIP_DISTANCES = range(0x3000, 0x3004)  # GL_CLIP_DISTANCE0 to 3, which clip each tile to its rectangle


class FrameState(NamedTuple):
    """The camera pose of an image, world-from-optical (4, 4), and its visuals' poses (N, 4, 4)."""

    camera_pose: np.ndarray
    poses: np.ndarray


@dataclass(frozen=True, eq=False)
class _View:
    """The arguments of `Renderer.render_outputs`."""

    intrinsics: Lens | Tiles
    camera_pose: np.ndarray
    poses: np.ndarray
    instances: np.ndarray | None = None
    before: FrameState | None = None
    box: Box | None = None  # the part of the image to render; None: all

    @property
    def tiles(self) -> int:
        """How often everything is drawn, each time clipped to another rectangle of the image."""
        return len(self.intrinsics.bounds) if isinstance(self.intrinsics, Tiles) else 1

    @cached_property
    def clip_from_world(self) -> np.ndarray:
        """The projection, (4, 4) or (tiles, 4, 4), with the camera as the world's origin."""
        return self.intrinsics.projection() @ _optical_from_world(self.camera_pose)

    @cached_property
    def uniforms(self) -> dict[str, bytes]:
        """The uniforms of the programs that depend on the camera."""
        lens = self.intrinsics
        uniforms = {
            "clip_from_world": _bytes(self.clip_from_world),
            "optical_from_world": _bytes(_optical_from_world(self.camera_pose)),
        }
        if self.before is not None:
            uniforms["optical_before_from_world"] = _bytes(_optical_from_world(self.before.camera_pose))
        if isinstance(lens, Tiles):
            uniforms["bounds"] = lens.bounds.astype(np.float32).tobytes()
        if isinstance(lens, Orthographic):
            uniforms["parallel"] = np.array([lens.near, lens.far - lens.near], np.float32).tobytes()
        return uniforms

    @property
    def max_instance(self) -> int:
        return 0 if self.instances is None else int(np.max(self.instances, initial=0))

    def role(self, kind: str, outputs: tuple[str, ...] = ()) -> Role:
        return Role(kind, outputs, self.tiles, bool(outputs) and isinstance(self.intrinsics, Orthographic))

    def distance(self, point: np.ndarray) -> float:
        """Return a distance of a point in the world, m, by which transparent objects are sorted."""
        if self.tiles > 1:
            return float(np.linalg.norm(point - self.camera_pose[:3, 3]))
        return float(self.camera_pose[:3, 2] @ point)


class Renderer:
    """Renders visuals for any number of cameras. Only the thread that created it may use it.

    samples: per pixel, for smooth edges; 0 for none. On the CPU renderer, 4 make a frame take three to four times as
    long. device_index: the EGL device to try first.
    Raises `RendererUnavailable` if EGL provides no context, ValueError for an unsupported number of samples.
    """

    def __init__(self, *, samples: int = 0, device_index: int = 0) -> None:
        """Create the context, without visuals."""
        self._thread = threading.get_ident()
        self._gl: moderngl.Context | None = context.create(device_index)
        with self._gl as gl:
            if samples not in (0, 2, 4, 8) or samples > gl.max_samples:
                raise ValueError(f"samples {samples}: must be 0, 2, 4 or 8, at most {gl.max_samples} on this device")
            gl.depth_func = "<="
            gl.front_face = "cw"  # flipping the rows inverts the orientation of faces
            self._samples = samples
            self.description: str = gl.info["GL_RENDERER"]
            self._programs = Programs(gl)
            self._batches = DrawBatches(gl, context.is_software(gl))
            self._dome = gl.buffer(dome())
            self._skies: dict[Role, moderngl.VertexArray] = {}
            self._targets: dict[tuple[Any, ...], Target] = {}
            self._lens_views: dict[Distorted, LensView] = {}

    def set_visuals(self, visuals: Sequence[Visual]) -> None:
        """Replace the visuals. Only new meshes are read, and meshes no longer used are freed.

        Raises ValueError that names the file if a mesh or texture cannot be read; the old list then stays.
        """
        with self._context():
            self._batches.update(visuals)

    def render(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the image (height, width, 3) uint8 RGB, top row first, written into `out` if given.

        camera_pose: world-from-optical (4, 4); poses: world-from-visual (N, 4, 4), in the visuals' order.
        An orthographic camera shows haze instead of the sky. Pixels of a lens without a ray are black.
        """
        return self._draw((COLOR,), _View(intrinsics, camera_pose, poses), out)[COLOR]

    def render_rows(
        self, intrinsics: Intrinsics, camera_pose: np.ndarray, poses: np.ndarray, rows: tuple[int, int]
    ) -> np.ndarray:
        """Return rows[0] to rows[1] - 1 of the image that `render` returns.

        With a distorted lens they take as long as the whole image.
        """
        first, end = rows
        if isinstance(intrinsics, Distorted):
            return self.render(intrinsics, camera_pose, poses)[first:end]
        high = min(max(_MIN_ROWS, 1 << (end - first - 1).bit_length()), intrinsics.height)  # few different framebuffers
        box = Box(0, first, intrinsics.width, high)
        view = _View(intrinsics, camera_pose, poses, box=box)
        return self._draw((COLOR,), view)[COLOR][: end - first]

    def render_depth(self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """Return depth (height, width) float32, metres along the optical z; NaN where nothing is within `far`.

        Transparent objects count as solid. Arguments as for `render`.
        """
        return self._draw(("depth",), _View(intrinsics, camera_pose, poses))["depth"]

    def render_outputs(
        self,
        names: Sequence[str],
        intrinsics: Lens,
        camera_pose: np.ndarray,
        poses: np.ndarray,
        *,
        instances: np.ndarray | None = None,
        before: FrameState | None = None,
    ) -> dict[str, np.ndarray]:
        """Return the named entries of `outputs.OUTPUTS`, rendered in one pass. Transparent objects count as solid.

        "depth": (height, width) float32, metres along the optical z (for a fisheye lens along the ray), NaN for no
        surface. "instance": (height, width) uint16, the visual's number in `instances` (N,); 0 for no surface.
        "normal": (height, width, 3) float32, unit vector in the optical frame, towards the camera; 0 for no surface.
        "before": (height, width, 3) float32, position of the surface point at the moment `before`, in the optical frame
        of that moment, m; NaN for no surface. "color" is the image that `render` returns.
        """
        return self._draw(tuple(names), _View(intrinsics, camera_pose, poses, instances, before))

    def count_alone(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, instances: np.ndarray
    ) -> np.ndarray:
        """Return how many pixels each number of `instances` (N,) would have without occlusion, (largest + 1,)."""
        if isinstance(intrinsics, Distorted):
            return _covered_pixels(
                instances, poses, lambda numbers, moved_poses: self.render_outputs(
                    ("instance",), intrinsics, camera_pose, moved_poses, instances=numbers
                )["instance"],
            )  # fmt: skip
        with self._context() as gl:
            view = _View(intrinsics, camera_pose, np.asarray(poses, dtype=np.float64), instances)
            self._upload(("instance",), view)
            self._prepare(ALONE, view)
            only = self._programs.one(ALONE)["only"]
            self._clear_target(("depth",), view, 0.0)
            gl.enable_only(gl.DEPTH_TEST)

            def draw(number: int) -> None:
                only.value = float(number)
                self._draw_batches(gl, self._batches.all, ALONE)

            return _covered(gl, np.unique(instances), draw)

    def close(self) -> None:
        """Free the context and its memory; the renderer is unusable afterwards. May be called twice."""
        if self._gl is None:
            return
        with self._context():
            self._batches.release()
        self._gl.release()
        self._gl = None

    def _context(self) -> moderngl.Context:
        """Return the context for a `with` statement, which makes it current: another may have been current since."""
        if self._gl is None:
            raise RuntimeError("the renderer is closed")
        if threading.get_ident() != self._thread:
            raise RuntimeError("a renderer can only be used by the thread that created it")
        return self._gl

    # ---- drawing

    def _draw(self, names: tuple[str, ...], view: _View, out: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Render colour, outputs or both; colour into `out` if given."""
        view = replace(view, poses=np.asarray(view.poses, dtype=np.float64))
        if not isinstance(view.intrinsics, Distorted):
            return self._draw_undistorted(names, view, partial(without_alpha, out=out))
        lens_view = self._lens_view(view.intrinsics)
        tiles = replace(view, intrinsics=lens_view.tiles)
        rotation = None if view.before is None else view.before.camera_pose[:3, :3].T @ view.camera_pose[:3, :3]
        return lens_view.seen(names, lambda drawn, colors: self._draw_undistorted(drawn, tiles, colors), rotation, out)

    def _draw_undistorted(self, names: tuple[str, ...], view: _View, colors: Colors) -> dict[str, np.ndarray]:
        outputs = tuple(name for name in names if name != COLOR)
        if len(outputs) == len(names):
            return self._draw_outputs(outputs, view)
        if outputs and self._samples:  # multisampled framebuffers have no single depth per pixel
            return {**self._draw_picture((), view, colors), **self._draw_outputs(outputs, view)}
        return self._draw_picture(outputs, view, colors)

    def _draw_outputs(self, names: tuple[str, ...], view: _View) -> dict[str, Any]:
        role = view.role("bare", names)
        with self._context() as gl:
            self._upload(names, view)
            self._prepare(role, view)
            target = self._clear_target(names, view, 0.0)
            gl.enable_only(gl.DEPTH_TEST)
            self._draw_batches(gl, self._batches.all, role)
            return target.read()

    def _draw_picture(self, outputs: tuple[str, ...], view: _View, colors: Colors) -> dict[str, Any]:
        """Draw solid objects, floor, sky, shadows, transparent objects; of the ground, only its outputs."""
        batches, role, shadow = self._batches, view.role("surface", outputs), view.role("shadow")
        with self._context() as gl:
            floor_height = batches.floor_height(view.camera_pose[:3, 3], view.poses)
            self._upload(outputs, view, floor_height)
            self._prepare(role, view)
            self._prepare(shadow, view)
            target = self._clear_target((COLOR, *outputs), view, SHADE if batches.ground else 1.0)
            gl.enable_only(gl.DEPTH_TEST)
            self._draw_batches(gl, batches.solids, role)
            self._draw_batches(gl, batches.floors, role)
            if outputs:
                target.use(outputs=False)
            gl.disable(gl.CULL_FACE)
            if not isinstance(view.intrinsics, Orthographic):
                self._draw_sky(gl, view)
            if floor_height is not None:
                self._programs.one(shadow)["floor_height"] = floor_height
                gl.enable_only(gl.BLEND)
                gl.blend_func = gl.ZERO, gl.DST_ALPHA, gl.ONE, gl.ZERO
                self._draw_batches(gl, batches.solids, shadow)
            if batches.glass:
                gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
                gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
                self._draw_batches(gl, batches.glass_from_far(view.distance, view.poses), role)
            if outputs and (batches.glass or batches.ground):  # outputs need a pass without blending
                target.use(color=False)
                gl.enable_only(gl.DEPTH_TEST)
                self._draw_batches(gl, [*batches.glass, *batches.ground], role)
            return target.read(colors)

    def _draw_sky(self, gl: moderngl.Context, view: _View) -> None:
        role = view.role("sky")
        if role not in self._skies:
            content = [(self._dome, "3f 3f", "direction", "tint")]
            self._skies[role] = gl.vertex_array(self._programs.one(role), content)
        _set_uniforms(self._programs.one(role), view)
        self._skies[role].render(instances=view.tiles)

    def _draw_batches(self, gl: moderngl.Context, batches: Sequence[Batch], role: Role) -> None:
        """Draw the batches, with back-face culling for closed meshes."""
        for batch in batches:
            if batch.surface.closed:
                gl.enable(gl.CULL_FACE)
            else:
                gl.disable(gl.CULL_FACE)
            batch.draw(role)

    def _upload(self, names: Sequence[str], view: _View, floor_height: float | None = None) -> None:
        """Upload the poses of the visuals and the attributes for the outputs `names`; `floor_height` as for `move`."""
        batches, origin = self._batches, view.camera_pose[:3, 3]
        batches.move(origin, view.poses, view.clip_from_world, floor_height)
        if "instance" in names:
            batches.identify(np.zeros(len(batches.visuals)) if view.instances is None else view.instances)
        if "before" in names:
            if view.before is None:
                raise ValueError("the output 'before' needs the argument 'before'")
            batches.move_before(view.before.camera_pose[:3, 3], np.asarray(view.before.poses, dtype=np.float64))

    def _prepare(self, role: Role, view: _View) -> None:
        """Prepare the batches for a role, and set the uniforms that depend on the camera."""
        programs = self._programs.of(role)
        self._batches.link(role, programs)
        for program in set(programs.values()):
            _set_uniforms(program, view)

    def _clear_target(self, names: tuple[str, ...], view: _View, alpha: float) -> Target:
        """Return the cleared and bound framebuffer for the outputs `names`."""
        whole = view.intrinsics.width, view.intrinsics.height
        box = view.box or Box(0, 0, *whole)
        size = box.width, box.height
        gl = self._context()
        held = tuple(OUTPUTS[name].held(view.max_instance) for name in names if name != COLOR)
        if (names, held, size) not in self._targets:
            samples = self._samples if names == (COLOR,) else 0
            self._targets[names, held, size] = Target(gl, names, held, size, samples)
        target = self._targets[names, held, size]
        target.clear(alpha, box, whole)
        for distance in _CLIP_DISTANCES:
            (gl.enable_direct if view.tiles > 1 else gl.disable_direct)(distance)
        return target

    def _lens_view(self, lens: Distorted) -> LensView:
        if lens not in self._lens_views:
            if len(self._lens_views) >= _MAX_LENSES:  # e.g. of cameras whose parameters have changed since
                self._lens_views.clear()
            self._lens_views[lens] = LensView(lens)
        return self._lens_views[lens]


def _optical_from_world(camera_pose: np.ndarray) -> np.ndarray:
    """Return the rotation optical-from-world, (4, 4)."""
    rotation = np.eye(4)
    rotation[:3, :3] = camera_pose[:3, :3].T
    return rotation


def _bytes(matrix: np.ndarray) -> bytes:
    """Return one or several matrices as GLSL stores them, column by column."""
    return bytes(matrix.swapaxes(-1, -2).astype(np.float32).tobytes())


def _set_uniforms(program: Any, view: _View) -> None:
    """Set the uniforms that depend on the camera, and that the program has."""
    for name, value in view.uniforms.items():
        uniform = program.get(name, None)
        if uniform is not None:
            uniform.write(value)


# ---- pixel counts of objects, each rendered alone, without occlusion by others


def _covered(gl: moderngl.Context, numbers: np.ndarray, draw: Callable[[int], None]) -> np.ndarray:
    """Return how many pixels each of the objects `numbers` covers when alone, indexed by number, (largest + 1,).

    `draw` draws only the object with that number, without clearing, and gives all its fragments the same depth.
    The depth test `<` then passes one fragment per pixel, even where parts of the object overlap.
    """
    counts = np.zeros(int(numbers.max(initial=0)) + 1, dtype=np.int64)
    query = gl.query(samples=True)
    gl.depth_func = "<"
    for number in numbers:
        gl.fbo.clear()
        with query:
            draw(int(number))
        counts[number] = query.samples
    gl.depth_func = "<="
    return counts


def _covered_pixels(
    instances: np.ndarray, poses: np.ndarray, mask: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return the same as `_covered` for a distorted lens, by rendering one image per object; slower.

    instances, poses: each visual's object number, (N,), and pose, (N, 4, 4). `mask` renders the output "instance" for
    other numbers and poses.
    """
    counts = np.zeros(int(instances.max(initial=0)) + 1, dtype=np.int64)
    hidden_pose = np.eye(4)
    hidden_pose[2, 3] = -1e9  # m, far below everything that a camera sees
    for number in np.unique(instances):
        is_part = instances == number
        covered_pixels = mask(is_part.astype(np.uint16), np.where(is_part[:, None, None], poses, hidden_pose))
        counts[number] = covered_pixels.sum(dtype=np.int64)
    return counts
