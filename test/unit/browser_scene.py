"""A scene of viser's without a browser, and markers to put into it."""

import asyncio
from types import SimpleNamespace

from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker


class Scene:
    """Remembers what has been added, as viser would show it."""

    def __init__(self):
        self.nodes = {}
        self.added = []

    def configure_default_lights(self, enabled):
        self.lit = enabled

    def __getattr__(self, kind):
        if not kind.startswith("add_"):
            raise AttributeError(kind)

        def add(name, *arguments, **options):
            self.nodes[name] = node = Node(self, name, kind, arguments, options)
            self.added.append(name)
            return node

        return add


class Node:
    def __init__(self, scene, name, kind, arguments, options):
        self.scene, self.name, self.kind, self.arguments = scene, name, kind, arguments
        self.position, self.wxyz = options.get("position", (0.0, 0.0, 0.0)), options.get("wxyz", (1.0, 0.0, 0.0, 0.0))
        self.options, self.callbacks = options, []
        self.receive_shadow = options.get("receive_shadow")

    def remove(self):
        del self.scene.nodes[self.name]

    def on_update(self, callback):
        self.callbacks.append(callback)

    def drag(self, phase, browser=1, **pose):
        for key, value in pose.items():
            setattr(self, key, value)
        event = SimpleNamespace(phase=phase, client_id=browser, target=self)
        for callback in self.callbacks:
            asyncio.run(callback(event))


def marker(number, kind=Marker.CUBE, **values):
    made = Marker(ns="a", id=number, type=kind, **values)
    made.header.frame_id = "world"
    made.scale.x = made.scale.y = made.scale.z = 1.0
    made.color = ColorRGBA(1, 0, 0, 1)
    return made
