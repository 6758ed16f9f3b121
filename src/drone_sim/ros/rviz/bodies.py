"""The vehicles as they look, in rviz: `view/bodies`. Each part hangs on the frame of its link, and so moves with it."""

from __future__ import annotations

from visualization_msgs.msg import Marker

from drone_sim.ros.rviz.marker_topic import WORDS, MarkerTopic, namespace
from drone_sim.ros.rviz.rviz_meshes import RvizMeshes
from drone_sim.ros.rviz.scene_markers import markers_of
from drone_sim.ros.vehicle import frame_names
from drone_sim.run.simulation import Simulation
from drone_sim.vehicles.vehicle import Vehicle


class Bodies:
    """Shows every vehicle; published when one has come or gone."""

    def __init__(self, simulation: Simulation, files: RvizMeshes):
        """Advertise."""
        self._simulation = simulation
        self._files = files
        self._topic = MarkerTopic(f"{namespace(simulation)}/view/bodies", WORDS)
        self._shown = -1  # era

    def update(self) -> None:
        """Publish what is new, if anybody listens."""
        self._topic.repeat()
        if self._simulation.era != self._shown and self._topic.due():
            self._shown = self._simulation.era
            self._topic.show([one for vehicle in self._simulation.vehicles.values() for one in self._looks(vehicle)])

    def _looks(self, vehicle: Vehicle) -> list[Marker]:
        markers = []
        for visual, (link, matrix) in zip(
            self._simulation.world.visuals([vehicle.body.number]), vehicle.body.visual_places
        ):
            for marker in markers_of(visual, matrix, self._files):
                marker.header.frame_id = frame_names.frame(vehicle.parameters, link)
                marker.ns, marker.frame_locked = vehicle.name, True
                markers.append(marker)
        return markers
