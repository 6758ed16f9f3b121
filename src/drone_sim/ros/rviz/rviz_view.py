"""All that only rviz asks for, handles aside."""

from __future__ import annotations

from drone_sim.ros.rviz.bodies import Bodies
from drone_sim.ros.rviz.drawing_markers import DrawingMarkers
from drone_sim.ros.rviz.flight_markers import CommandMarkers, HeightMarkers, StateText
from drone_sim.ros.rviz.force_markers import ForceMarkers
from drone_sim.ros.rviz.marker_topic import namespace
from drone_sim.ros.rviz.path_markers import PathMarkers
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.ros.rviz.scene_markers import SceneMarkers
from drone_sim.ros.rviz.surroundings import Surroundings
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.drawings import Drawings


class RvizView:
    """The markers of one simulation; each topic is made only while somebody listens to it."""

    def __init__(self, simulation: Simulation, player: Player, drawings: Drawings):
        """Advertise where all that flies has its topics: see marker_topic.namespace."""
        self._files = RvizMeshes()
        self._markers = (
            Surroundings(simulation, self._files),
            SceneMarkers(simulation, self._files),
            Bodies(simulation, self._files),
            DrawingMarkers(namespace(simulation), drawings),
            PathMarkers(simulation),
            HeightMarkers(simulation),
            CommandMarkers(simulation),
            ForceMarkers(simulation),
            StateText(simulation, player),
        )

    def update(self) -> None:
        """Show what has changed."""
        for markers in self._markers:
            markers.update()

    def close(self) -> None:
        """Remove the files."""
        self._files.close()
