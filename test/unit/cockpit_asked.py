"""Stand-ins for the simulator, its scene and the timeline player in tests of the cockpit's scripts."""

from drone_sim.ros.cockpit.editor.backend import EditorBackend
from drone_sim.ros.cockpit.editor.lessons import Lessons

LESSONS = Lessons()


class Node:
    """A simulator that records its service calls; `fails` has the error messages of services that fail."""

    node = "/drone_sim"

    def __init__(self):
        self.parameters, self.asked, self.fails = {"scene_file": "none", "script": "pilot"}, [], {}

    def call(self, service, *_request):
        self.asked.append(service)
        return service not in self.fails, self.fails.get(service, service)

    def parameter(self, name, default=None):
        return self.parameters.get(name, default)

    def set_parameter(self, name, value):
        self.parameters[name] = value


class TimelinePlayer:
    """A timeline player that records the prepared plan."""

    def __init__(self):
        self.prepared = self.begun = None

    def prepare(self, plan, script=""):
        self.prepared, self.begun = plan, False

    def begin(self):
        self.begun = True

    def end(self):
        self.prepared = None


class Scene:
    """A scene that may name a script for its drone."""

    own_script, has_no_vehicle, is_modified, is_own = "", False, False, False

    opened, on_reopened = None, None

    def reopen(self, file, was_modified):
        self.opened, self.own_script = (file, was_modified), "pilot"
        self.on_reopened()

    def set_script(self, script):
        self.own_script = script


class Asked:
    def __init__(self, store):
        self.node = Node()
        self.player = TimelinePlayer()
        self.scene = Scene()
        backend = EditorBackend(store, LESSONS, self.node, self.player, self.scene)
        self.answers, self.grader = backend.answers, backend.grader

    def __call__(self, ask, **message):
        return self.answers[ask](message)
