"""Markers as the simulation makes them, and what a browser is told of them."""

import json

import numpy as np
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from drone_sim.ros.cockpit.scene.scene_state import SceneState


def marker(number, kind=Marker.CUBE, ns="a", **values):
    made = Marker(ns=ns, id=number, type=kind, **values)
    made.header.frame_id = "world"
    made.scale.x = made.scale.y = made.scale.z = 1.0
    made.color = ColorRGBA(1, 0, 0, 1)
    return made


class Browser:
    """What one browser knows: it reads messages as the page does."""

    def __init__(self, state=None):
        self.state = SceneState() if state is None else state
        self.version = -1
        self.frames, self.markers, self.poses = {}, {}, {}

    def hear(self):
        """Take what has changed; return what is said of it, None for nothing."""
        self.version, message = self.state.since(self.version)
        if not message:
            return None
        line, _, rest = message.partition(b"\n")
        said = json.loads(line)
        self._take(said, np.frombuffer(rest, "<f4").tolist())
        return said

    def _take(self, said, numbers):
        if said["whole"]:
            self.frames, self.markers, self.poses = {}, {}, {}
        for number in said["gone"]:
            del self.markers[number]
        self.frames.update({index: (name, parent) for index, name, parent in said["frames"]})
        moved = said["moved"] + said["placed"]
        poses = [tuple(numbers[at : at + 7]) for at in range(0, 7 * len(moved), 7)]
        numbers = numbers[7 * len(moved) :]
        self.poses.update({self.frames[index][0]: pose for index, pose in zip(said["moved"], poses)})
        for one in said["markers"]:
            for name, count in one.pop("arrays", []):
                one[name], numbers = numbers[:count], numbers[count:]
            self.markers[one["id"]] = one
        for number, pose in zip(said["placed"], poses[len(said["moved"]) :]):
            self.markers[number]["pose"] = pose
        assert not numbers

    def named(self, ns):
        return [one for one in self.markers.values() if one["ns"] == ns]
