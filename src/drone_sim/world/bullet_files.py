"""The files that PyBullet reads: only files that this module wrote, from checked content."""

from __future__ import annotations

import copy
import functools
import itertools
import tempfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import cv2

from drone_sim.files import images, mesh_files
from drone_sim.files.containment import remove

# PyBullet caches some files by name until the process ends, so no name is used twice.
_NUMBERS = itertools.count()
_MAX_OLD_MESHES = 1000  # kept after bodies are removed


class BulletFiles:
    """A temporary folder of meshes, URDFs and textures."""

    def __init__(self) -> None:
        """Create the folder. Raises OSError."""
        self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_")
        self._meshes: dict[tuple[str, bool], str] = {}
        self._origins: dict[str, str] = {}

    def close(self) -> None:
        """Remove the folder; may be called repeatedly."""
        self._folder.cleanup()

    def clear(self) -> None:
        """Forget the meshes, so that they are read again."""
        self._meshes.clear()

    def drop_old(self) -> None:
        """Remove the oldest meshes if there are many: PyBullet reads each only once."""
        while len(self._meshes) > _MAX_OLD_MESHES:
            remove(self._meshes.pop(next(iter(self._meshes))), within=self._folder.name)

    def write(self, content: bytes, suffix: str) -> str:
        """Write a file; return its path. Raises RuntimeError, in one line, if it cannot be written."""
        path = Path(self._folder.name) / f"{next(_NUMBERS)}{suffix}"
        try:
            path.write_bytes(content)
        except OSError as error:
            raise RuntimeError(f"{path}: cannot be written ({error.strerror or error})") from None
        return str(path)

    def mesh(self, path: str, hull: bool = False) -> str:
        """Write a mesh file as STL, of which only the convex hull counts if `hull`; return its path.

        Raises what mesh_files.read raises.
        """
        if (path, hull) not in self._meshes:
            written = self.write(mesh_files.as_stl(path, hull), ".stl")
            self._meshes[path, hull] = written
            self._origins[written] = path
        return self._meshes[path, hull]

    def origin(self, path: str) -> str:
        """Return the mesh file, with its materials, from which `path` was written."""
        return self._origins.get(path, path)

    def urdf(self, robot: Xml.Element) -> str:
        """Write a URDF and its meshes; return its path. Raises what mesh_files.read raises."""
        robot = copy.deepcopy(robot)
        for kind in ("visual", "collision"):
            for shape in robot.iter(kind):
                hull = kind == "collision" and shape.get("concave") != "yes"
                for mesh in shape.iter("mesh"):
                    mesh.set("filename", self.mesh(mesh.attrib["filename"], hull))
        return self.write(_indented(robot), ".urdf")

    def urdf_of(self, text: str) -> str:
        """Write a URDF, given as text, and its meshes; return its path. Raises what mesh_files.read raises."""
        if "<mesh" in text:
            return self.urdf(Xml.fromstring(text))
        return self.write(_indented_text(text), ".urdf")

    def texture(self, path: str) -> str:
        """Write an image as PNG; return its path. Raises what images.read raises."""
        image = images.read(path)
        bgr = cv2.cvtColor(image, cv2.COLOR_RGBA2BGRA if image.shape[2] == 4 else cv2.COLOR_RGB2BGR)
        return self.write(cv2.imencode(".png", bgr, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes(), ".png")


@functools.lru_cache(16)
def _indented_text(text: str) -> bytes:
    return _indented(Xml.fromstring(text))


def _indented(robot: Xml.Element) -> bytes:
    Xml.indent(robot)  # PyBullet truncates long lines
    content: bytes = Xml.tostring(robot)
    return content
