"""The meshes, textures and URDFs of a scene, looked through before PyBullet reads them: a bad one can crash it."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, Sequence
from xml.etree import ElementTree as Xml

from drone_sim.camera import mesh
from drone_sim.parameter_types import ParameterError
from drone_sim.scene_parameters import MeshParameters, SceneParameters, UrdfParameters
from drone_sim.visual import Visual

_MESHES = (".obj", ".stl")  # what PyBullet makes a body of by itself
_IN_URDF = (*_MESHES, ".dae")


def check(scene: SceneParameters) -> None:
    """Raise ParameterError, in one line, for the first file of the scene that cannot be read."""
    try:
        mesh.load(Visual("floor", "plane", (), mesh.WHITE, texture=scene.floor.texture))
        for one in scene.objects:
            if isinstance(one, MeshParameters):
                _check_mesh(one.file, _MESHES, one.texture)
            elif isinstance(one, UrdfParameters):
                for file in _meshes(Path(one.file)):
                    _check_mesh(file, _IN_URDF)
            elif one.texture:
                mesh.load(Visual("box", "box", (1.0, 1.0, 1.0), mesh.WHITE, texture=one.texture))
    except ValueError as error:
        raise ParameterError(" ".join(str(error).split())) from None


def _check_mesh(file: str, kinds: Sequence[str], texture: str = "") -> None:
    if Path(file).suffix.lower() not in kinds:
        elsewhere = "; in a URDF, .dae too" if kinds is _MESHES else ""
        raise ValueError(f"mesh {file}: must be one of {', '.join(kinds)}{elsewhere}")
    mesh.load(Visual("mesh", "mesh", (1.0, 1.0, 1.0), mesh.WHITE, file=file, texture=texture))


def _meshes(urdf: Path) -> Iterator[str]:
    """Yield the mesh files of a URDF; those of other packages are PyBullet's to find."""
    try:
        root = Xml.parse(urdf).getroot()
    except (Xml.ParseError, OSError) as error:
        raise ValueError(f"urdf {urdf}: {error}") from None
    if root.tag != "robot":
        raise ValueError(f"urdf {urdf}: its outermost element must be <robot>, not <{root.tag}>")
    for element in root.iter("mesh"):
        name = element.get("filename", "")
        if not name.startswith("package://"):
            if not (urdf.parent / name).is_file():
                raise ValueError(f"urdf {urdf}: no such mesh file: {name or '(no filename)'}")
            yield str(urdf.parent / name)
