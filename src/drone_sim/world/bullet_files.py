"""The files that PyBullet reads: none but what this module wrote from what has been checked."""

from __future__ import annotations

import copy
import functools
import itertools
import tempfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import cv2

from drone_sim.files import images, mesh_files

# PyBullet keeps some files by name for as long as the process runs: no name comes twice.
_NUMBERS = itertools.count()
_MOST_MESHES = 1000  # that stay when bodies go


class BulletFiles:
    """A temporary folder of meshes, URDFs and textures."""

    def __init__(self) -> None:
        """Make the folder. Raises OSError."""
        self._folder = tempfile.TemporaryDirectory(prefix="drone_sim_")
        self._meshes: dict[tuple[str, bool], str] = {}
        self._origins: dict[str, str] = {}

    def close(self) -> None:
        """Remove them all; may be called twice."""
        self._folder.cleanup()

    def clear(self) -> None:
        """Read the meshes anew from now on."""
        self._meshes.clear()

    def drop_old(self) -> None:
        """Remove the oldest of many meshes: PyBullet reads each but once."""
        while len(self._meshes) > _MOST_MESHES:
            Path(self._meshes.pop(next(iter(self._meshes)))).unlink(missing_ok=True)

    def write(self, content: bytes, suffix: str) -> str:
        """Write a file; return its path. Raises RuntimeError, in one line, where the disk is full."""
        path = Path(self._folder.name) / f"{next(_NUMBERS)}{suffix}"
        try:
            path.write_bytes(content)
        except OSError as error:
            raise RuntimeError(f"{path}: cannot be written ({error.strerror or error})") from None
        return str(path)

    def mesh(self, path: str, hull: bool = False) -> str:
        """Write a mesh file once more, as an STL of which only the convex hull counts if `hull`; return its path.

        Raises what mesh_files.read raises.
        """
        if (path, hull) not in self._meshes:
            written = self.write(mesh_files.as_stl(path, hull), ".stl")
            self._meshes[path, hull] = written
            self._origins[written] = path
        return self._meshes[path, hull]

    def origin(self, path: str) -> str:
        """Return the mesh file that was written to `path`, with its materials."""
        return self._origins.get(path, path)

    def urdf(self, robot: Xml.Element) -> str:
        """Write a URDF with meshes of ours; return its path. Raises what mesh_files.read raises."""
        robot = copy.deepcopy(robot)
        for kind in ("visual", "collision"):
            for shape in robot.iter(kind):
                hull = kind == "collision" and shape.get("concave") != "yes"
                for mesh in shape.iter("mesh"):
                    mesh.set("filename", self.mesh(mesh.attrib["filename"], hull))
        return self.write(_indented(robot), ".urdf")

    def urdf_of(self, text: str) -> str:
        """Write a URDF, given as a text, with meshes of ours; return its path. Raises what mesh_files.read raises."""
        if "<mesh" in text:
            return self.urdf(Xml.fromstring(text))
        return self.write(_laid_out(text), ".urdf")

    def texture(self, path: str) -> str:
        """Write an image once more, as a PNG; return its path. Raises what images.read raises."""
        image = images.read(path)
        turned = cv2.cvtColor(image, cv2.COLOR_RGBA2BGRA if image.shape[2] == 4 else cv2.COLOR_RGB2BGR)
        return self.write(cv2.imencode(".png", turned, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes(), ".png")


@functools.lru_cache(16)
def _laid_out(text: str) -> bytes:
    return _indented(Xml.fromstring(text))


def _indented(robot: Xml.Element) -> bytes:
    Xml.indent(robot)  # PyBullet cuts long lines
    content: bytes = Xml.tostring(robot)
    return content
