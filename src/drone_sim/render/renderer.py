"""Pictures of a list of visuals, and what is true of their pixels, drawn by OpenGL without a display.

The shadow costs no pass over a shadow map: floor and ground leave their darkening in the picture's alpha, everything
else leaves 1; the things are then drawn once more, flattened onto the floor along the light, each multiplying
the colour by alpha and setting alpha to 1. So only what is floor or ground darkens, and only once. There
are shadows on these alone, in the plane of the first floor, and transparent things cast none.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import moderngl
import numpy as np

from drone_sim.render import context, counting
from drone_sim.render.batches import SHADE, Batch, DrawBatches
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic, Tiles
from drone_sim.render.lens_view import Colors, LensView
from drone_sim.render.outputs import COLOR, OUTPUTS
from drone_sim.render.programs import ALONE, Programs, Role
from drone_sim.render.sky import dome
from drone_sim.render.target import Box, Target, without_alpha
from drone_sim.shapes.visual import Visual

_MOST_LENSES = 16
_ROWS = 16  # the fewest that are drawn of a picture
_CLIP_DISTANCES = range(0x3000, 0x3004)  # OpenGL's numbers of those that keep tiles apart


class Moment(NamedTuple):
    """From where a picture was taken, world from optical (4, 4), and where the visuals were (N, 4, 4)."""

    camera_pose: np.ndarray
    poses: np.ndarray


class _View(NamedTuple):
    """What is to be drawn, as `Renderer.render_outputs` is asked for it."""

    intrinsics: Lens | Tiles
    camera_pose: np.ndarray
    poses: np.ndarray
    instances: np.ndarray | None = None
    before: Moment | None = None
    box: Box | None = None  # which alone is drawn of the picture

    @property
    def tiles(self) -> int:
        """How often everything is drawn, each time clipped to another part of the picture."""
        return len(self.intrinsics.bounds) if isinstance(self.intrinsics, Tiles) else 1

    @property
    def most(self) -> int:
        """The largest number of an instance."""
        return 0 if self.instances is None else int(np.max(self.instances, initial=0))

    def role(self, kind: str, outputs: tuple[str, ...] = ()) -> Role:
        """What something is drawn as."""
        return Role(kind, outputs, self.tiles, bool(outputs) and isinstance(self.intrinsics, Orthographic))

    def away(self, point: np.ndarray) -> float:
        """Tell how far a point in the world is, for the order in which transparent things are drawn, m."""
        if self.tiles > 1:
            return float(np.linalg.norm(point - self.camera_pose[:3, 3]))
        return float(self.camera_pose[:3, 2] @ point)


class Renderer:
    """Draws visuals for any number of cameras; belongs to the thread that made it.

    samples: per pixel, for smooth edges; 0 for none. Where the CPU draws, 4 make a frame three to four times as
    long. device_index: which EGL device to try first.
    Raises `RendererUnavailable` when there is no EGL context to be had, ValueError for samples it cannot do.
    """

    def __init__(self, *, samples: int = 0, device_index: int = 0) -> None:
        """Make the context; there is nothing to draw yet."""
        self._thread = threading.get_ident()
        self._gl: moderngl.Context | None = context.create(device_index)
        with self._gl as gl:
            if samples not in (0, 2, 4, 8) or samples > gl.max_samples:
                raise ValueError(f"samples {samples}: 0, 2, 4 or 8 are possible, at most {gl.max_samples} here")
            gl.depth_func = "<="
            gl.front_face = "cw"  # the flipped rows turn what is counter-clockwise
            self._samples = samples
            self.description: str = gl.info["GL_RENDERER"]
            self._programs = Programs(gl)
            self._batches = DrawBatches(gl, context.is_software(gl))
            self._dome = gl.buffer(dome())
            self._skies: dict[Role, moderngl.VertexArray] = {}
            self._targets: dict[tuple[Any, ...], Target] = {}
            self._lens_views: dict[Distorted, LensView] = {}

    def set_visuals(self, visuals: Sequence[Visual]) -> None:
        """Draw these from now on; only meshes not known yet are read, those no longer used are freed.

        Raises ValueError naming the file when a mesh or texture cannot be read; the old list then stays.
        """
        with self._current():
            self._batches.update(visuals)

    def render(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Picture (height, width, 3) uint8 RGB, top row first, written into `out` where given.

        camera_pose: world-from-optical (4, 4); poses: world-from-visual (N, 4, 4), in the visuals' order.
        Where rays are parallel, there is haze in the place of the sky; where a lens sees nothing, it is black.
        """
        return self._draw((COLOR,), _View(intrinsics, camera_pose, poses), out)[COLOR]

    def render_rows(
        self, intrinsics: Intrinsics, camera_pose: np.ndarray, poses: np.ndarray, rows: tuple[int, int]
    ) -> np.ndarray:
        """Rows of the picture that `render` returns: from the first to the one before the second of `rows`.

        Through a lens they take as long as the whole picture.
        """
        first, end = rows
        if isinstance(intrinsics, Distorted):
            return self.render(intrinsics, camera_pose, poses)[first:end]
        high = min(max(_ROWS, 1 << (end - first - 1).bit_length()), intrinsics.height)  # so that there are few targets
        box = Box(0, first, intrinsics.width, high)
        view = _View(intrinsics, camera_pose, poses, box=box)
        return self._draw((COLOR,), view)[COLOR][: end - first]

    def render_depth(self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """Depth (height, width) float32, metres along the optical z; NaN where nothing is within `far`.

        Transparent things count as solid. Arguments as for `render`.
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
        before: Moment | None = None,
    ) -> dict[str, np.ndarray]:
        """Some of `outputs.OUTPUTS`, by name, in one pass; transparent things count as solid.

        "depth": (height, width) float32, metres along the optical z (with a fisheye lens along the ray), NaN where
        nothing is. "instance": (height, width) uint16, of `instances` (N,), which says whose each visual is; 0 where
        nothing is. "normal": (height, width, 3) float32, of unit length in the optical frame, towards the camera; 0
        where nothing is. "before": (height, width, 3) float32, where what is seen was at the moment `before`, in the
        optical frame of then, m; NaN where nothing is. "color" is the picture that `render` returns.
        """
        return self._draw(tuple(names), _View(intrinsics, camera_pose, poses, instances, before))

    def count_alone(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, instances: np.ndarray
    ) -> np.ndarray:
        """How many pixels each of `instances` (N,) would have if it were alone, by its number, (largest + 1,)."""
        if isinstance(intrinsics, Distorted):
            return counting.pixels(
                instances, poses, lambda own, there: self.render_outputs(
                    ("instance",), intrinsics, camera_pose, there, instances=own
                )["instance"],
            )  # fmt: skip
        with self._current() as gl:
            view = _View(intrinsics, camera_pose, np.asarray(poses, dtype=np.float64), instances)
            self._place(("instance",), view)
            self._aim(ALONE, view)
            only = self._programs.one(ALONE)["only"]
            self._cleared(("depth",), view, 0.0)
            gl.enable_only(gl.DEPTH_TEST)

            def draw(number: int) -> None:
                only.value = float(number)
                self._draw_batches(gl, self._batches.all, ALONE)

            return counting.covered(gl, np.unique(instances), draw)

    def close(self) -> None:
        """Free the context and all it holds; the renderer cannot be used after. May be called twice."""
        if self._gl is None:
            return
        with self._current():
            self._batches.release()
        self._gl.release()
        self._gl = None

    def _current(self) -> moderngl.Context:
        """The context, to be made current by `with`: another one may have been used since."""
        if self._gl is None:
            raise RuntimeError("the renderer is closed")
        if threading.get_ident() != self._thread:
            raise RuntimeError("a renderer can only be used by the thread that made it")
        return self._gl

    # ---- drawing

    def _draw(self, names: tuple[str, ...], view: _View, out: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Draw colours, outputs or both; the colours into an array, if it is given."""
        view = view._replace(poses=np.asarray(view.poses, dtype=np.float64))
        if not isinstance(view.intrinsics, Distorted):
            return self._draw_straight(names, view, partial(without_alpha, out=out))
        through = self._lens_view(view.intrinsics)
        tiled = view._replace(intrinsics=through.tiles)
        turn = None if view.before is None else view.before.camera_pose[:3, :3].T @ view.camera_pose[:3, :3]
        return through.seen(names, lambda drawn, colors: self._draw_straight(drawn, tiled, colors), turn, out)

    def _draw_straight(self, names: tuple[str, ...], view: _View, colors: Colors) -> dict[str, np.ndarray]:
        """Draw by pinholes, or by parallel rays."""
        outputs = tuple(name for name in names if name != COLOR)
        if len(outputs) == len(names):
            return self._draw_outputs(outputs, view)
        if outputs and self._samples:  # of several samples there is no one depth
            return {**self._draw_picture((), view, colors), **self._draw_outputs(outputs, view)}
        return self._draw_picture(outputs, view, colors)

    def _draw_outputs(self, names: tuple[str, ...], view: _View) -> dict[str, Any]:
        role = view.role("bare", names)
        with self._current() as gl:
            self._place(names, view)
            self._aim(role, view)
            target = self._cleared(names, view, 0.0)
            gl.enable_only(gl.DEPTH_TEST)
            self._draw_batches(gl, self._batches.all, role)
            return target.read()

    def _draw_picture(self, outputs: tuple[str, ...], view: _View, colors: Colors) -> dict[str, Any]:
        """Draw solid things, floor, sky, shadows, what can be seen through; of the ground there are only outputs."""
        batches, role, shadow = self._batches, view.role("surface", outputs), view.role("shadow")
        with self._current() as gl:
            self._place(outputs, view)
            self._aim(role, view)
            self._aim(shadow, view)
            target = self._cleared((COLOR, *outputs), view, SHADE if batches.ground else 1.0)
            gl.enable_only(gl.DEPTH_TEST)
            self._draw_batches(gl, batches.solids, role)
            self._draw_batches(gl, batches.floors, role)
            if outputs:
                target.use(outputs=False)
            gl.disable(gl.CULL_FACE)
            if not isinstance(view.intrinsics, Orthographic):
                self._draw_sky(gl, view)
            height = batches.floor_height(view.poses)
            if height is not None:
                self._programs.one(shadow)["floor_height"] = height - view.camera_pose[2, 3]
                gl.enable_only(gl.BLEND)
                gl.blend_func = gl.ZERO, gl.DST_ALPHA, gl.ONE, gl.ZERO
                self._draw_batches(gl, batches.solids, shadow)
            if batches.glass:
                gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
                gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
                self._draw_batches(gl, batches.glass_from_far(view.away, view.poses), role)
            if outputs and (batches.glass or batches.ground):  # outputs are not blended
                target.use(color=False)
                gl.enable_only(gl.DEPTH_TEST)
                self._draw_batches(gl, [*batches.glass, *batches.ground], role)
            return target.read(colors)

    def _draw_sky(self, gl: moderngl.Context, view: _View) -> None:
        role = view.role("sky")
        if role not in self._skies:
            content = [(self._dome, "3f 3f", "direction", "tint")]
            self._skies[role] = gl.vertex_array(self._programs.one(role), content)
        self._point(self._programs.one(role), view)
        self._skies[role].render(instances=view.tiles)

    def _draw_batches(self, gl: moderngl.Context, batches: Sequence[Batch], role: Role) -> None:
        """Draw the batches; the far sides of closed meshes, which nobody can see, are left out."""
        for batch in batches:
            if batch.surface.closed:
                gl.enable(gl.CULL_FACE)
            else:
                gl.disable(gl.CULL_FACE)
            batch.draw(role)

    def _place(self, names: Sequence[str], view: _View) -> None:
        """Send where the visuals are, and of each what the outputs say."""
        batches = self._batches
        batches.move(view.camera_pose[:3, 3], view.poses)
        if "instance" in names:
            batches.identify(np.zeros(len(batches.visuals)) if view.instances is None else view.instances)
        if "before" in names:
            if view.before is None:
                raise ValueError("needs the moment before")
            batches.move_before(view.before.camera_pose[:3, 3], np.asarray(view.before.poses, dtype=np.float64))

    def _aim(self, role: Role, view: _View) -> None:
        """Let the batches be drawn in a role, by what depends on the camera alone."""
        programs = self._programs.of(role)
        self._batches.link(role, programs)
        given = {"optical_from_world": _bytes(_turn(view.camera_pose))}
        if view.before is not None:
            given["optical_before_from_world"] = _bytes(_turn(view.before.camera_pose))
        lens = view.intrinsics
        for program in set(programs.values()):
            self._point(program, view)
            for name, matrix in given.items():
                if name in program:
                    program[name].write(matrix)
            if "parallel" in program:
                program["parallel"] = lens.near, lens.far - lens.near

    def _point(self, program: Any, view: _View) -> None:
        """Let a program draw what the camera sees."""
        program["clip_from_world"].write(_bytes(view.intrinsics.projection() @ _turn(view.camera_pose)))
        if isinstance(view.intrinsics, Tiles) and "bounds" in program:
            program["bounds"].write(view.intrinsics.bounds.astype(np.float32).tobytes())

    def _cleared(self, names: tuple[str, ...], view: _View, alpha: float) -> Target:
        """Return what to draw into, empty."""
        whole = view.intrinsics.width, view.intrinsics.height
        box = view.box or Box(0, 0, *whole)
        size = box.width, box.height
        gl = self._current()
        held = tuple(OUTPUTS[name].held(view.most) for name in names if name != COLOR)
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
            if len(self._lens_views) >= _MOST_LENSES:  # of cameras that have been tuned since
                self._lens_views.clear()
            self._lens_views[lens] = LensView(lens)
        return self._lens_views[lens]


def _turn(camera_pose: np.ndarray) -> np.ndarray:
    """Optical axes from those of the world, (4, 4)."""
    turn = np.eye(4)
    turn[:3, :3] = camera_pose[:3, :3].T
    return turn


def _bytes(matrix: np.ndarray) -> bytes:
    """A matrix, or several, as GLSL has them, column by column."""
    return bytes(matrix.swapaxes(-1, -2).astype(np.float32).tobytes())
