"""The meshes, textures and URDFs of a scene, looked through and counted before anything is made of them."""

from __future__ import annotations

import numpy as np

from drone_sim.config.types import ParameterError
from drone_sim.files import images, mesh_files
from drone_sim.scene.object_parameters import ObjectParameters
from drone_sim.scene.scene_parameters import SceneParameters

MAX_TRIANGLES = 500_000  # of all meshes of a scene, each counted as often as it stands there
MAX_PIXELS = 4 * images.MAX_SIDE**2  # of all its textures
MAX_REACH = 1e5  # m, of a mesh from its own origin


def check(scene: SceneParameters) -> None:
    """Raise ParameterError, in one line, for the first file of the scene that cannot be used."""
    try:
        shapes = [one for one in scene.objects if isinstance(one, ObjectParameters)]
        _check_textures({scene.floor.texture, *(one.texture for one in shapes if one.texture)})
        _check_meshes(shapes)
    except ValueError as error:
        raise ParameterError(" ".join(str(error).split())) from None


def _check_textures(paths: set[str]) -> None:
    pixels = 0
    for path in sorted(paths):
        height, width = images.read(path).shape[:2]
        pixels += height * width
        if pixels > MAX_PIXELS:
            raise ValueError(f"texture {path}: with it, the scene's textures have more than {MAX_PIXELS} pixels")


def _check_meshes(shapes: list[ObjectParameters]) -> None:
    count = 0
    for path, scale in (mesh for one in shapes for mesh in one.to_shape().meshes()):
        count += mesh_files.triangles(path)
        if count > MAX_TRIANGLES:
            raise ValueError(f"mesh {path}: with it, the scene's meshes have more than {MAX_TRIANGLES} triangles")
        reach = float(np.max(mesh_files.reach(path) * np.abs(scale)))
        if reach > MAX_REACH:
            raise ValueError(f"mesh {path}: reaches {reach:g} m from its origin; at most {MAX_REACH:g} m are allowed")
