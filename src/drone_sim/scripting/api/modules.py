"""The script API, under CoppeliaSim's names: what a child script reaches as `sim`.

Positions are [x, y, z] in metres, orientations V-REP's Euler angles [alpha, beta, gamma] in radians
(R = Rx Ry Rz), matrices 12 numbers, velocities world-frame. `relativeTo` is a handle, -1 the world.
A wrong name, number or kind of values raises ValueError or TypeError; where the script does not catch it, the
log names the function, what it got, and what it takes.
"""

from __future__ import annotations

from drone_sim.scripting.api.calls import Api, public_functions
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.drawing import Drawing
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.joints import Joints
from drone_sim.scripting.api.matrices import Matrices
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.names import Names
from drone_sim.scripting.api.objects import Objects
from drone_sim.scripting.api.paths import Paths
from drone_sim.scripting.api.proximity import ProximitySensors
from drone_sim.scripting.api.script_calls import ScriptCalls
from drone_sim.scripting.api.scripts import Scripts
from drone_sim.scripting.api.sensors import Sensors
from drone_sim.scripting.api.threads import Threads
from drone_sim.scripting.api.vision import VisionSensors


def make_sim(host: Host, surroundings: Surroundings) -> Api:
    """Return `sim` for a script, on what it is attached to."""
    names = Names(host)
    of_the_scene = (Joints(host), ProximitySensors(host), Paths(host))
    vision, sensors = VisionSensors(host, surroundings), Sensors(host)
    scripts = (Scripts(host, surroundings, names), ScriptCalls(host, surroundings, names))
    parts = (Objects(host), *of_the_scene, Matrices(), *scripts, vision, sensors)
    others = (names, host.signals, Threads(surroundings, host.signals), Drawing(host))
    functions = {**public_functions(parts), **{name: f for one in others for name, f in one.functions().items()}}
    return Api("sim", functions, CONSTANTS, names.remember)


def make_sim_ros(bus: MessageBus) -> Api:
    """Return `simROS` for the script that flies a drone."""
    return Api("simROS", bus.functions(), {})
