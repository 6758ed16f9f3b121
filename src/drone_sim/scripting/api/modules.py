"""The script API, under CoppeliaSim's names: what a child script reaches as `sim`.

Positions are [x, y, z] in metres, orientations V-REP's Euler angles [alpha, beta, gamma] in radians
(R = Rx Ry Rz), matrices 12 numbers, velocities world-frame. `relativeTo` is a handle, -1 the world.
A wrong name, number or kind of values raises ValueError or TypeError; where the script does not catch it, the
log names the function, what it got, and what it takes.
"""

from __future__ import annotations

from collections.abc import Callable

from drone_sim.scripting.api.bits import Bits
from drone_sim.scripting.api.calls import Api, public_functions
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.custom_data import CustomDataFunctions
from drone_sim.scripting.api.dialogs import Dialogs
from drone_sim.scripting.api.distances import Distances
from drone_sim.scripting.api.drawing import Drawing
from drone_sim.scripting.api.dummies import Dummies
from drone_sim.scripting.api.dynamics import Dynamics
from drone_sim.scripting.api.host import Host, Surroundings
from drone_sim.scripting.api.ignored import Ignored
from drone_sim.scripting.api.joints import Joints
from drone_sim.scripting.api.matrices import Matrices
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.names import Names
from drone_sim.scripting.api.object_kinds import ObjectKinds
from drone_sim.scripting.api.objects import Objects
from drone_sim.scripting.api.packing import Packing
from drone_sim.scripting.api.paths import Paths
from drone_sim.scripting.api.poses import Poses
from drone_sim.scripting.api.proximity import ProximitySensors
from drone_sim.scripting.api.ros_functions import RosFunctions
from drone_sim.scripting.api.script_calls import ScriptCalls
from drone_sim.scripting.api.scripts import Scripts
from drone_sim.scripting.api.sensors import Sensors
from drone_sim.scripting.api.simulation import SimulationFunctions
from drone_sim.scripting.api.threads import Threads
from drone_sim.scripting.api.views import Views
from drone_sim.scripting.api.vision import VisionSensors


def make_sim(host: Host, surroundings: Surroundings) -> Api:
    """Return `sim` for a script, on what it is attached to."""
    names, ignored = Names(host), _ignored(host)
    parts = (
        Objects(host),
        Joints(host, ignored),
        ProximitySensors(host),
        Distances(host.objects, surroundings.nearest),
        Paths(host),
        ObjectKinds(host),
        Dummies(host),
        Dynamics(host, surroundings, ignored),
        Matrices(),
        Poses(),
        Bits(),
        Scripts(host, names),
        ScriptCalls(host, surroundings, names),
        SimulationFunctions(surroundings, ignored),
        Dialogs(host, ignored),
        Views(host),
        VisionSensors(host, surroundings),
        Sensors(host),
    )
    data = CustomDataFunctions(host, surroundings.data)
    threads = Threads(surroundings, host.signals)
    others = (names, host.signals, surroundings.tubes, data, Packing(), threads, Drawing(host, ignored))
    functions = {name: f for one in others for name, f in one.functions().items()}
    return Api("sim", {**ignored.functions(), **public_functions(parts), **functions}, CONSTANTS, names.remember)


def make_sim_ros(bus: MessageBus, clock: Callable[[], float] = float) -> Api:
    """Return `simROS` for the script that flies a drone; `clock` returns the simulated time in s."""
    return Api("simROS", {**bus.functions(), **RosFunctions(bus, clock).functions()}, {})


def make_plugins(host: Host) -> dict[str, Api]:
    """Return the plugins of CoppeliaSim's that are accepted and do nothing, by name."""
    return _ignored(host).modules()


def _ignored(host: Host) -> Ignored:
    return Ignored(host.own_script, host.drawings.new_handle)
