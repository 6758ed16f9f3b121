"""Pictures and depth images of a list of visuals, drawn by OpenGL without a display.

The shadow costs no pass over a shadow map: floor and ground leave their darkening in the picture's alpha, everything
else leaves 1; the things are then drawn once more, flattened onto the floor along the light, each multiplying
the colour by alpha and setting alpha to 1. So only what is floor or ground darkens, and only once. There
are shadows on these alone, in the plane of the first floor, and transparent things cast none.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

import cv2
import moderngl
import numpy as np

from drone_sim.render import context, shaders, sky
from drone_sim.render.batches import SHADE, Batch, DrawBatches, Programs
from drone_sim.render.intrinsics import Intrinsics, Lens, Orthographic
from drone_sim.shapes.visual import Visual

TO_SUN = (-0.34, 0.30, 0.89)  # world frame, about 27 degrees from the vertical


class _Target:
    """What is drawn into, for one picture size."""

    def __init__(self, gl: moderngl.Context, size: tuple[int, int], samples: int) -> None:
        self.framebuffer = gl.framebuffer(
            [gl.renderbuffer(size, 4, samples=samples)], gl.depth_renderbuffer(size, samples=samples)
        )
        self.resolved = gl.framebuffer([gl.renderbuffer(size, 4)]) if samples else self.framebuffer
        self.rgba = np.empty((size[1], size[0], 4), dtype=np.uint8)


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
            self._depth_targets: dict[tuple[int, int], moderngl.Framebuffer] = {}

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
        Where rays are parallel, there is haze in the place of the sky.
        """
        size = (intrinsics.width, intrinsics.height)
        out = _output(out, (size[1], size[0], 3), np.uint8)
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
        size = (intrinsics.width, intrinsics.height)
        out = _output(out, (size[1], size[0]), np.float32)
        poses = np.asarray(poses, dtype=np.float64)
        with self._current() as gl:
            target = self._depth_targets.get(size)
            if target is None:
                target = gl.framebuffer([gl.renderbuffer(size, 1, dtype="f4")], gl.depth_renderbuffer(size))
                self._depth_targets[size] = target
            self._prepare(intrinsics, camera_pose, poses)
            parallel = isinstance(intrinsics, Orthographic)
            self._programs["depth"]["parallel"] = intrinsics.near, (intrinsics.far - intrinsics.near) * parallel
            target.use()
            target.clear(red=-1.0)
            gl.enable_only(gl.DEPTH_TEST)
            _draw(gl, self._batches.all, "depth")
            target.read_into(out, components=1, dtype="f4")
        out[out < 0.0] = np.nan
        return out

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

    def _prepare(self, intrinsics: Lens, camera_pose: np.ndarray, poses: np.ndarray) -> None:
        """Send the poses and what depends on the camera alone."""
        origin = camera_pose[:3, 3]
        self._batches.move(origin, poses)
        turn = np.eye(4)
        turn[:3, :3] = camera_pose[:3, :3].T
        clip_from_world = (intrinsics.projection() @ turn).T.astype(np.float32).tobytes()
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
        "depth": (shaders.DEPTH_VERTEX, shaders.DEPTH_FRAGMENT),
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
