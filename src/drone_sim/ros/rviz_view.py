"""All that only rviz asks for, handles aside."""

from __future__ import annotations

from drone_sim.ros.drawing_markers import DrawingMarkers
from drone_sim.ros.flight_markers import CommandMarkers, HeightMarkers, StateText
from drone_sim.ros.path_markers import PathMarkers
from drone_sim.ros.player import Player
from drone_sim.ros.rviz_meshes import RvizMeshes
from drone_sim.ros.scene_markers import SceneMarkers
from drone_sim.ros.surroundings import Surroundings
from drone_sim.scripting.drawings import Drawings
from drone_sim.simulation import Simulation


class RvizView:
    """The markers of one simulation; each topic is made only while somebody listens to it."""

    def __init__(self, simulation: Simulation, player: Player, drawings: Drawings):
        """Advertise in the drone's namespace."""
        self._files = RvizMeshes()
        self._markers = (
            Surroundings(simulation, self._files),
            SceneMarkers(simulation, self._files),
            DrawingMarkers(simulation.drone.name, drawings),
            PathMarkers(simulation),
            HeightMarkers(simulation),
            CommandMarkers(simulation),
            StateText(simulation, player),
        )

    def update(self) -> None:
        """Show what has changed."""
        for markers in self._markers:
            markers.update()

    def close(self) -> None:
        """Remove the files."""
        self._files.close()
