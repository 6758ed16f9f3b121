"""Pictures of a list of visuals, and what is true of their pixels, drawn by OpenGL without a display.

The shadow costs no pass over a shadow map: floor and ground leave their darkening in the picture's alpha, everything
else leaves 1; the things are then drawn once more, flattened onto the floor along the light, each multiplying
the colour by alpha and setting alpha to 1. So only what is floor or ground darkens, and only once. There
are shadows on these alone, in the plane of the first floor, and transparent things cast none.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import moderngl
import numpy as np

from drone_sim.render import context, shaders, sky
from drone_sim.render.batches import SHADE, Batch, DrawBatches, Programs
from drone_sim.render.distortion import Distorted
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic
from drone_sim.render.lens_view import LensView
from drone_sim.render.outputs import ALONE_FRAGMENT, ALONE_VERTEX, OUTPUTS, finished, sources
from drone_sim.shapes.visual import Visual

_MOST_LENSES = 16
_ALONE = "alone"  # the role of what draws one object
TO_SUN = (-0.34, 0.30, 0.89)  # world frame, about 27 degrees from the vertical


class _Target:
    """What is drawn into, for one picture size."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int], samples: int) -> None:
        self.framebuffer = gl.framebuffer(
            [gl.renderbuffer(size, 4, samples=samples)], gl.depth_renderbuffer(size, samples=samples)
        )
        self.resolved = gl.framebuffer([gl.renderbuffer(size, 4)]) if samples else self.framebuffer
        self.rgba = np.empty((size[1], size[0], 4), dtype=np.uint8)


class Moment(NamedTuple):
    """From where a picture was taken, world from optical (4, 4), and where the visuals were (N, 4, 4)."""

    camera_pose: np.ndarray
    poses: np.ndarray


class Renderer:
    """Draws visuals for any number of cameras; belongs to the thread that made it.

    samples: per pixel, for smooth edges; 0 for none. Where the CPU draws, 4 make a frame three to four times as
    long. device_index: which EGL device to try first.
    Raises `RendererUnavailable` when there is no EGL context to be had, ValueError for samples it cannot do.
    """

    def __init__(self, *, samples: int = 0, device_index: int = 0) -> None:
        """Make the context and the shaders; there is nothing to draw yet."""
        self._thread = threading.get_ident()
        self._gl: moderngl.Context | None = context.create(device_index)
        with self._gl as gl:
            if samples not in (0, 2, 4, 8) or samples > gl.max_samples:
                raise ValueError(f"samples {samples}: 0, 2, 4 or 8 are possible, at most {gl.max_samples} here")
            gl.depth_func = "<="
            gl.front_face = "cw"  # the flipped rows turn what is counter-clockwise
            self._samples = samples
            self.description: str = gl.info["GL_RENDERER"]
            self._programs = _programs(gl)
            self._batches = DrawBatches(gl, self._programs, context.is_software(gl))
            self._sky = gl.vertex_array(
                self._programs["sky"],
                [(gl.buffer(sky.dome()), "3f 3f", "direction", "tint")],
            )
            self._targets: dict[tuple[int, int], _Target] = {}
            self._output_targets: dict[tuple[Any, ...], moderngl.Framebuffer] = {}
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
        size = (intrinsics.width, intrinsics.height)
        out = _output(out, (size[1], size[0], 3), np.uint8)
        if isinstance(intrinsics, Distorted):
            lens = self._lens_view(intrinsics)
            stack = lens.stack((3,), np.uint8)
            for view, part in zip(lens.views, lens.parts(stack)):
                self.render(view.intrinsics, camera_pose @ view.turn, poses, part)
            return lens.colors(stack, out)
        poses = np.asarray(poses, dtype=np.float64)
        with self._current() as gl:
            target = self._targets.get(size)
            if target is None:
                target = self._targets[size] = _Target(gl, size, self._samples)
            self._prepare(intrinsics, camera_pose, poses)
            target.framebuffer.use()
            target.framebuffer.clear(*sky.HAZE, SHADE if self._batches.has_ground else 1.0)
            self._paint(gl, camera_pose, poses, with_sky=isinstance(intrinsics, Intrinsics))
            if self._samples:
                gl.copy_framebuffer(target.resolved, target.framebuffer)
            target.resolved.read_into(target.rgba, components=4)
        return cv2.cvtColor(target.rgba, cv2.COLOR_RGBA2RGB, dst=out)

    def render_depth(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, out: np.ndarray | None = None
    ) -> np.ndarray:
        """Depth (height, width) float32, metres along the optical z; NaN where nothing is within `far`.

        Transparent things count as solid. Arguments as for `render`.
        """
        return self.render_outputs(("depth",), intrinsics, camera_pose, poses, out=out)["depth"]

    def render_outputs(
        self,
        names: Sequence[str],
        intrinsics: Lens,
        camera_pose: np.ndarray,
        poses: np.ndarray,
        *,
        instances: np.ndarray | None = None,
        before: Moment | None = None,
        out: np.ndarray | None = None,
    ) -> dict[str, np.ndarray]:
        """Some of `outputs.OUTPUTS`, by name, in one pass; transparent things count as solid.

        "depth": (height, width) float32, metres along the optical z (with a fisheye lens along the ray), NaN where
        nothing is. "instance": (height, width) uint16, of `instances` (N,), which says whose each visual is; 0 where
        nothing is. "normal": (height, width, 3) float32, of unit length in the optical frame, towards the camera; 0
        where nothing is. "before": (height, width, 3) float32, where what is seen was at the moment `before`, in the
        optical frame of then, m; NaN where nothing is. `out` is for a depth alone.
        """
        names = tuple(names)
        if isinstance(intrinsics, Distorted):
            return self._gathered(names, intrinsics, camera_pose, poses, instances, before)
        poses = np.asarray(poses, dtype=np.float64)
        with self._current() as gl:
            program = self._output_program(names)
            target = self._output_target(names, (intrinsics.width, intrinsics.height))
            self._batches.link(_role(names), program)
            self._prepare(intrinsics, camera_pose, poses)
            self._send(program, intrinsics, camera_pose, instances, before)
            target.use()
            target.clear()
            gl.enable_only(gl.DEPTH_TEST)
            _draw(gl, self._batches.all, _role(names))
            return {name: finished(name, _read(target, place, name, out)) for place, name in enumerate(names)}

    def count_alone(
        self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray, instances: np.ndarray
    ) -> np.ndarray:
        """How many pixels each of `instances` (N,) would have if it were alone, by its number, (largest + 1,)."""
        counts = np.zeros(int(instances.max(initial=0)) + 1, dtype=np.int64)
        if isinstance(intrinsics, Distorted):
            return self._count_through(intrinsics, camera_pose, poses, instances, counts)
        with self._current() as gl:
            if _ALONE not in self._programs:
                self._programs[_ALONE] = gl.program(vertex_shader=ALONE_VERTEX.lstrip(), fragment_shader=ALONE_FRAGMENT)
            program = self._programs[_ALONE]
            target = self._output_target(("depth",), (intrinsics.width, intrinsics.height))
            self._batches.link(_ALONE, program)
            self._prepare(intrinsics, camera_pose, np.asarray(poses, dtype=np.float64))
            self._batches.identify(instances)
            target.use()
            gl.enable_only(gl.DEPTH_TEST)
            query = gl.query(samples=True)
            for number in np.unique(instances):
                program["only"] = float(number)
                target.clear()
                _draw(gl, self._batches.all, _ALONE)  # first, so that only what is nearest counts
                gl.depth_func = "=="
                with query:
                    _draw(gl, self._batches.all, _ALONE)
                gl.depth_func = "<="
                counts[number] = query.samples
        return counts

    def _count_through(
        self,
        lens: Distorted,
        camera_pose: np.ndarray,
        poses: np.ndarray,
        instances: np.ndarray,
        counts: np.ndarray,
    ) -> np.ndarray:
        for number in np.unique(instances):
            only = np.where(instances == number, 1, 0).astype(np.uint16)
            far = np.where((instances == number)[:, None, None], poses, _far_below(camera_pose))
            counts[number] = self.render_outputs(("instance",), lens, camera_pose, far, instances=only)[
                "instance"
            ].sum()
        return counts

    def _gathered(
        self,
        names: tuple[str, ...],
        lens: Distorted,
        camera_pose: np.ndarray,
        poses: np.ndarray,
        instances: np.ndarray | None,
        before: Moment | None,
    ) -> dict[str, np.ndarray]:
        """`render_outputs` through a lens."""
        view = self._lens_view(lens)
        drawn = names if "before" not in names or "depth" in names else (*names, "depth")
        parts = [
            self.render_outputs(
                drawn, one.intrinsics, camera_pose @ one.turn, poses, instances=instances, before=before
            )
            for one in view.views
        ]
        turn = None if before is None else before.camera_pose[:3, :3].T @ camera_pose[:3, :3]
        gathered = view.gather({name: np.concatenate([part[name] for part in parts]) for name in drawn}, turn)
        return {name: gathered[name] for name in names}

    def _lens_view(self, lens: Distorted) -> LensView:
        if lens not in self._lens_views:
            if len(self._lens_views) >= _MOST_LENSES:  # of cameras that have been tuned since
                self._lens_views.clear()
            self._lens_views[lens] = LensView(lens)
        return self._lens_views[lens]

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

    def _output_program(self, names: tuple[str, ...]) -> Any:
        """Return what draws some outputs, made when they are first asked for."""
        role = _role(names)
        if role not in self._programs:
            vertex, fragment = sources(names)
            self._programs[role] = self._current().program(vertex_shader=vertex.lstrip(), fragment_shader=fragment)
        return self._programs[role]

    def _output_target(self, names: tuple[str, ...], size: tuple[int, int]) -> moderngl.Framebuffer:
        if (names, size) not in self._output_targets:
            gl, made = self._current(), [OUTPUTS[name] for name in names]
            pictures = [gl.renderbuffer(size, one.components, dtype=one.dtype) for one in made]
            self._output_targets[names, size] = gl.framebuffer(pictures, gl.depth_renderbuffer(size))
        return self._output_targets[names, size]

    def _send(
        self,
        program: Any,
        intrinsics: Lens,
        camera_pose: np.ndarray,
        instances: np.ndarray | None,
        before: Moment | None,
    ) -> None:
        """Send what the outputs of a program need besides the poses."""
        if "parallel" in program:
            parallel = isinstance(intrinsics, Orthographic)
            program["parallel"] = intrinsics.near, (intrinsics.far - intrinsics.near) * parallel
        if "optical_from_world" in program:
            program["optical_from_world"].write(_turn(camera_pose).T.astype(np.float32).tobytes())
        if "identity" in program:
            self._batches.identify(np.zeros(len(self._batches.visuals)) if instances is None else instances)
        if "before0" in program:
            if before is None:
                raise ValueError("needs the moment before")
            program["optical_before_from_world"].write(_turn(before.camera_pose).T.astype(np.float32).tobytes())
            self._batches.move_before(before.camera_pose[:3, 3], np.asarray(before.poses, dtype=np.float64))

    def _prepare(self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray) -> None:
        """Send the poses and what depends on the camera alone."""
        self._batches.move(camera_pose[:3, 3], poses)
        clip_from_world = _clip_from_world(intrinsics, camera_pose)
        for program in self._programs.values():
            program["clip_from_world"].write(clip_from_world)

    def _paint(self, gl: Any, camera_pose: np.ndarray, poses: np.ndarray, with_sky: bool) -> None:
        """Solid things, floor, sky, shadows, then what can be seen through, into the bound framebuffer."""
        batches = self._batches
        gl.enable_only(gl.DEPTH_TEST)
        _draw(gl, batches.solids, "surface")
        _draw(gl, batches.floors, "surface")
        gl.disable(gl.CULL_FACE)
        if with_sky:
            self._sky.render()
        height = batches.floor_height(poses)
        if height is not None:
            self._programs["shadow"]["floor_height"] = height - camera_pose[2, 3]
            gl.enable_only(gl.BLEND)
            gl.blend_func = gl.ZERO, gl.DST_ALPHA, gl.ONE, gl.ZERO
            _draw(gl, batches.solids, "shadow")
        if batches.glass:
            gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
            gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
            _draw(gl, batches.glass_from_far(camera_pose[:3, 2], poses), "surface")


def _far_below(camera_pose: np.ndarray) -> np.ndarray:
    """A pose at which nothing is seen."""
    pose = np.eye(4)
    pose[:3, 3] = camera_pose[:3, 3] - (0.0, 0.0, 1e9)
    return pose


def _turn(camera_pose: np.ndarray) -> np.ndarray:
    """Optical axes from those of the world, (4, 4)."""
    turn = np.eye(4)
    turn[:3, :3] = camera_pose[:3, :3].T
    return turn


def _clip_from_world(intrinsics: Lens, camera_pose: np.ndarray) -> bytes:
    return bytes((intrinsics.projection() @ _turn(camera_pose)).T.astype(np.float32).tobytes())


def _role(names: Sequence[str]) -> str:
    return "outputs " + " ".join(names)


def _read(target: moderngl.Framebuffer, place: int, name: str, out: np.ndarray | None) -> np.ndarray:
    """Read one of a framebuffer's pictures, the top row first, into `out` where given."""
    one, (width, height) = OUTPUTS[name], target.size
    shape = (height, width) if one.components == 1 else (height, width, one.components)
    out = _output(out, shape, np.uint16 if one.dtype == "u2" else np.float32)
    target.read_into(out, components=one.components, attachment=place, dtype=one.dtype)
    return out


def _draw(gl: moderngl.Context, batches: Sequence[Batch], role: str) -> None:
    """Draw the batches; the far sides of closed meshes, which nobody can see, are left out."""
    for batch in batches:
        if batch.surface.closed:
            gl.enable(gl.CULL_FACE)
        else:
            gl.disable(gl.CULL_FACE)
        batch.draw(role)


def _programs(gl: moderngl.Context) -> Programs:
    def surface(*names: str) -> tuple[str, ...]:
        start = "\n".join(["#version 330 core", *(f"#define {name}" for name in names)])
        plain = (shaders.SURFACE_VERTEX, shaders.SURFACE_FRAGMENT)
        return tuple(source.replace("#version 330 core", start) for source in plain)

    sources = {
        "plain": surface(),
        "textured": surface("TEXTURED"),
        "floor": surface("TEXTURED", "FLAT"),
        "shadow": (shaders.SHADOW_VERTEX, shaders.SHADOW_FRAGMENT),
        "sky": (shaders.SKY_VERTEX, shaders.SKY_FRAGMENT),
    }
    programs = {
        name: gl.program(vertex_shader=vertex.lstrip(), fragment_shader=fragment.lstrip())
        for name, (vertex, fragment) in sources.items()
    }
    to_sun = np.array(TO_SUN) / np.linalg.norm(TO_SUN)
    for name in ("plain", "textured", "floor", "shadow"):
        programs[name]["to_sun"] = tuple(to_sun)
    return programs


def _output(out: np.ndarray | None, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    if out is None:
        return np.empty(shape, dtype=dtype)
    if out.shape != shape or out.dtype != dtype or not out.flags.c_contiguous:
        raise ValueError(f"out must be a C-contiguous {np.dtype(dtype).name} array of shape {shape}")
    return out
