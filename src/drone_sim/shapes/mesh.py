"""A mesh file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from drone_sim.config.types import File, Finite, Within
from drone_sim.files import mesh_files
from drone_sim.files.mesh_files import WHITE
from drone_sim.shapes.shape import Files, Geometry, Primitive, ReportedShape, SceneShape, Triangles

_Scale = Annotated[Finite, Within(1e-6, 1e6)]


@dataclass(frozen=True)
class Mesh(SceneShape, ReportedShape):
    """A mesh file (OBJ, STL, COLLADA); `size` is its scale along x, y and z."""

    word = "mesh"
    bullet_type = "GEOM_MESH"
    default_color = WHITE  # keeps the file's own materials
    has_uv = True  # if the file has them

    file: File
    size: Annotated[tuple[_Scale, _Scale, _Scale], Field(description="3 numbers, its scale along [x, y, z]")] = (
        1.0,
        1.0,
        1.0,
    )

    def __str__(self) -> str:
        return f"{self.word} {self.file}"

    @property
    def files(self) -> tuple[str]:
        """The mesh file; files that it refers to are read with it."""
        return (self.file,)

    def meshes(self) -> tuple[tuple[str, Sequence[float]]]:
        return ((self.file, self.size),)

    def for_bullet(self, files: Files, moves: bool) -> Geometry:
        """Return the mesh itself, which may be concave, for a static body; for a moving one its convex hull."""
        scale = {"meshScale": list(self.size)}
        visual = {**scale, "fileName": files.mesh(self.file)}
        if moves:
            return Geometry(self.bullet_type, {**scale, "fileName": files.mesh(self.file, hull=True)}, visual)
        return Geometry(self.bullet_type, visual, visual, flags="GEOM_FORCE_CONCAVE_TRIMESH")

    @classmethod
    def from_bullet(cls, dimensions: Sequence[float], file: str) -> Mesh:
        x, y, z = dimensions
        return cls(file, (x, y, z))

    def triangles(self) -> Iterator[Triangles]:
        for part in mesh_files.read(self.file):
            faces = part.faces
            if np.prod(self.size) < 0:
                faces = faces[:, ::-1]  # mirroring turns the faces inside out
            corners = (part.vertices * np.asarray(self.size))[faces]
            yield Triangles(corners, None if part.uv is None else part.uv[faces], part.rgba, part.texture)

    def for_rviz(self) -> tuple[Primitive]:
        """Return the file, which rviz itself reads."""
        return (Primitive("mesh", self.size, file=self.file),)
