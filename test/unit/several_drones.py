"""Drones without a world, several on one tree, for tests of the script API."""

from typing import ClassVar

from drone_sim.mechanics import frames
from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.object_tree import ObjectTree
from drone_sim.mechanics.velocity_meter import VelocityMeter
from drone_sim.scripting import load
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.api.host import SceneServices, ScriptContext
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.modules import make_sim, make_sim_ros
from drone_sim.scripting.api.registry import CHILD
from drone_sim.scripting.api.windows import Windows
from drone_sim.scripting.time_limit import TimeLimit

PARTS = ("Drone", "Quadricopter_base", "Quadricopter_propeller1", "Quadricopter_propeller_respondable1")


class Scene(ScriptContext):
    def __init__(self, shown=True):
        clock, objects = Clock(0.05), ObjectTree()
        measured = {"objects": objects, "velocities": VelocityMeter(objects, clock)}
        super().__init__(clock=clock, gravity=-9.81, drawings=Drawings(shown), windows=Windows(), **measured)
        self.objects.add("Floor", also=("ResizableFloor_5_25",))


class Drone:
    """A Host."""

    sensors: ClassVar[dict] = {}
    script_type = CHILD

    def __init__(self, scene, suffix="", own=None, also=()):
        self.context = scene
        self.own_script, base, propeller, respondable, *others = (f"{name}{suffix}" for name in (*PARTS, *also))
        add = scene.objects.add
        self.handles = [
            add(self.own_script, alias="Quadcopter", also=(f"Quadricopter{suffix}",)),
            add(base, self.own_script, frames.from_rpy((0, 0, -0.01), (0, 0, 0)), alias="base"),
            add(propeller, self.own_script, alias="propeller"),
            add(respondable, propeller, alias="respondable"),
            *(add(name, self.own_script) for name in others),
        ]
        scene.objects[self.handles[0]].is_model = True
        self.script_parameters = {
            self.own_script: {"gain": 2.0, **(own or {})},
            respondable: {"particleVelocity": 0.0},
        }
        for name, parameters in self.script_parameters.items():
            scene.scripts.add(name, parameters, is_law=name != self.own_script)
        self.forces = []
        self.bus = MessageBus(self.own_script)

    @property
    def parameters(self):
        return self.script_parameters[self.own_script]

    @property
    def velocity(self):
        return list(self.script_parameters.values())[1]["particleVelocity"]

    def add_force(self, shape, force, torque, offset):
        if shape not in self.script_parameters:
            raise ValueError(f"'{shape}' is not a dynamic shape")
        self.forces.append((shape, force))

    def turn_joint(self, joint, angle):
        return 0.0

    def sim(self):
        return make_sim(self, SceneServices())

    def load(self, path):
        return load.load(
            str(path), {"sim": self.sim(), "simROS": make_sim_ros(self.bus, self.context.clock)}, TimeLimit(20)
        )
