"""Files of textured visuals for rviz: OBJ, its materials, and PNG."""

from __future__ import annotations

import tempfile
from collections.abc import Hashable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drone_sim.files.resources import identity_of
from drone_sim.render import surfaces
from drone_sim.render.surfaces import Surface
from drone_sim.shapes.visual import Visual

_MAX_TRANSPARENT = 0.98  # opacity below which rviz uses the alpha of a texture


class RvizMeshes:
    """Temporary folder with files of visuals, each with a new name: rviz never reads a file of one name again."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory | None = None  # made for the first file
        self._written: dict[Hashable, str] = {}

    def resource(self, visual: Visual, glow: float) -> str:
        """Return the URL of a visual's mesh, textured as in the cameras' pictures, and tinted with its rgba.

        `glow` (0..1) is the share of light that does not depend on the viewpoint; rviz's only lamp moves with the
        viewpoint. Raises ValueError for a file that cannot be read, OSError for one that cannot be written.
        """
        key = (replace(visual, key=None), glow, *map(identity_of, (*visual.shape.files, visual.texture)))
        if key not in self._written:
            self._written[key] = self._write(visual, glow)
        return self._written[key]

    def close(self) -> None:
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._written.clear()

    def _write(self, visual: Visual, glow: float) -> str:
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_rviz_")
        stem = Path(self._folder.name) / f"{len(self._written)}"
        lines, materials, first = [f"mtllib {stem.name}.mtl"], [], 1
        for number, surface in enumerate(surfaces.load(visual)):
            image = "" if surface.texture is None else f"{stem.name}_{number}.png"
            if surface.texture is not None:
                path = stem.with_name(image)
                order = cv2.COLOR_RGBA2BGRA if surface.texture.shape[2] == 4 else cv2.COLOR_RGB2BGR
                if not cv2.imwrite(str(path), cv2.cvtColor(surface.texture, order)):
                    raise OSError(f"{path}: cannot be written")
            materials += _material(number, surface, visual.rgba, glow, image)
            lines += [f"usemtl {number}", *_triangles(surface, first)]
            first += len(surface.vertices)
        stem.with_suffix(".mtl").write_text("\n".join([*materials, ""]), encoding="utf-8")
        stem.with_suffix(".obj").write_text("\n".join([*lines, ""]), encoding="utf-8")
        return f"file://{stem}.obj"


def _material(number: int, surface: Surface, tint: tuple[float, ...], glow: float, image: str) -> list[str]:
    red, green, blue, alpha = np.multiply(tint, surface.rgba)
    if surface.transparent:
        alpha = min(alpha, _MAX_TRANSPARENT)
    lines = [f"newmtl {number}", "Ka 0 0 0", "Ks 0 0 0", f"d {alpha:g}", "illum 1"]
    for name, share in (("Kd", 1 - glow), ("Ke", glow)):
        lines.append(f"{name} {red * share:g} {green * share:g} {blue * share:g}")
    return [*lines, f"map_Kd {image}"] if image else lines


def _triangles(surface: Surface, first: int) -> list[str]:
    """Return the OBJ lines of a surface; its vertices are numbered from `first`."""
    uv = np.zeros((len(surface.vertices), 2)) if surface.uv is None else surface.uv
    vertices: Any = surface.vertices.tolist()  # a str, by the types of numpy 2.2
    normals: Any = surface.normals.tolist()
    lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in vertices]
    lines += [f"vt {u:.7g} {v:.7g}" for u, v in np.asarray(uv, float).tolist()]
    lines += [f"vn {x:.5g} {y:.5g} {z:.5g}" for x, y, z in normals]
    lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}" for a, b, c in (surface.faces.astype(int) + first).tolist()]
    return lines
