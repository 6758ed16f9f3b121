"""Markers as the simulation publishes them, and the scene that a browser builds from the messages it gets."""

import json

import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.ros.cockpit.scene.scene_state import SceneState


def marker(number, kind=Marker.CUBE, ns="a", **values):
    new_marker = Marker(ns=ns, id=number, type=kind, **values)
    new_marker.header.frame_id = "world"
    new_marker.scale.x = new_marker.scale.y = new_marker.scale.z = 1.0
    new_marker.color = ColorRGBA(1, 0, 0, 1)
    return new_marker


class Browser:
    """The scene as one browser knows it; messages are read as in the page."""

    def __init__(self, state=None):
        self.state = SceneState() if state is None else state
        self.version = -1
        self.frames, self.markers, self.poses = {}, {}, {}

    def hear(self):
        """Apply the changes since the last call; return their JSON part, or None if there are none."""
        self.version, message = self.state.since(self.version)
        if not message:
            return None
        line, _, rest = message.partition(b"\n")
        changes = json.loads(line)
        self._take(changes, np.frombuffer(rest, "<f4").tolist())
        return changes

    def _take(self, changes, numbers):
        if changes["whole"]:
            self.frames, self.markers, self.poses = {}, {}, {}
        for number in changes["gone"]:
            del self.markers[number]
        self.frames.update({index: (name, parent) for index, name, parent in changes["frames"]})
        moved = changes["moved"] + changes["placed"]
        poses = [tuple(numbers[at : at + 7]) for at in range(0, 7 * len(moved), 7)]
        numbers = numbers[7 * len(moved) :]
        self.poses.update({self.frames[index][0]: pose for index, pose in zip(changes["moved"], poses)})
        for entry in changes["markers"]:
            for name, count in entry.pop("arrays", []):
                entry[name], numbers = numbers[:count], numbers[count:]
            self.markers[entry["id"]] = entry
        for number, pose in zip(changes["placed"], poses[len(changes["moved"]) :]):
            self.markers[number]["pose"] = pose
        assert not numbers

    def named(self, ns):
        return [entry for entry in self.markers.values() if entry["ns"] == ns]
