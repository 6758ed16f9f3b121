"""A URDF as an object of a scene: links and joints with their shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

from drone_sim.config.types import File
from drone_sim.files import urdf_files
from drone_sim.shapes.shape import Files, SceneShape, UrdfFile
from drone_sim.shapes.urdf_inertials import complete_inertials


@dataclass(frozen=True)
class Urdf(SceneShape):
    """A URDF, which states its own looks and masses; with a mass of 0 its root link is fixed to the world."""

    word = "urdf"

    file: File
    size: tuple[()] = ()

    def __str__(self) -> str:
        return f"{self.word} {self.file}"

    def for_bullet(self, files: Files, moves: bool) -> UrdfFile:
        """Return the checked and cleaned file, with the inertia of each link."""
        robot = self._robot()
        try:
            moments = complete_inertials(robot)
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from None
        return UrdfFile(files.urdf(robot), moments)

    def meshes(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Yield path and scale of the meshes of its visuals and collisions."""
        for mesh in self._robot().iter("mesh"):
            yield mesh.attrib["filename"], [float(word) for word in mesh.attrib["scale"].split()]

    def _robot(self) -> Xml.Element:
        try:
            return urdf_files.read(self.file)
        except OSError as error:
            raise ValueError(f"{self}: {error.strerror or error}") from None
        except ValueError as error:
            raise ValueError(f"{self}: {error}") from None
