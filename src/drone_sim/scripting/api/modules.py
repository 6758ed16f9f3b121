"""Modules of the script API, with CoppeliaSim's names: `sim`, `simROS`, `simVision` and plugins.

Positions are [x, y, z] in m, orientations V-REP's Euler angles [alpha, beta, gamma] in rad (R = Rx Ry Rz), matrices
have 12 numbers, velocities are in the world frame. `relativeTo` is a handle, -1 means the world. A wrong name, number
or type of values raises ValueError or TypeError. If the script does not catch it, the log names the function, its
arguments and the expected arguments.
"""

from __future__ import annotations

from drone_sim.mechanics.clock import Clock
from drone_sim.mechanics.saved_state import in_turn
from drone_sim.scripting.api.calls import Api, functions_of
from drone_sim.scripting.api.constants import CONSTANTS
from drone_sim.scripting.api.custom_data import CustomDataFunctions
from drone_sim.scripting.api.distances import DistanceFunctions
from drone_sim.scripting.api.drawings import DrawingFunctions
from drone_sim.scripting.api.dynamics import Dynamics, ShapeMasses
from drone_sim.scripting.api.graphs import GraphFunctions
from drone_sim.scripting.api.host import Host, SceneServices
from drone_sim.scripting.api.ignored import PLUGINS, Ignored
from drone_sim.scripting.api.image_filters import ImageFilters
from drone_sim.scripting.api.joints import JointFunctions
from drone_sim.scripting.api.matrices import Matrices, Poses
from drone_sim.scripting.api.messages import MessageBus
from drone_sim.scripting.api.motions import MotionFunctions, TrajectoryFunctions
from drone_sim.scripting.api.names import NameFunctions
from drone_sim.scripting.api.object_collections import CollectionFunctions
from drone_sim.scripting.api.objects import ObjectKinds, Objects
from drone_sim.scripting.api.older_motions import OlderMotions
from drone_sim.scripting.api.packing import Bits, Packing, Tables
from drone_sim.scripting.api.path_planning import ENUMERATIONS, PathPlanning
from drone_sim.scripting.api.paths import Paths
from drone_sim.scripting.api.planning_problem import IS_INSTALLED
from drone_sim.scripting.api.remote_ports import OlderRemotePortFunctions, RemotePortFunctions
from drone_sim.scripting.api.ros_functions import RosFunctions, ServiceFunctions, TopicFunctions
from drone_sim.scripting.api.scene_objects import SceneObjects, Shapes
from drone_sim.scripting.api.scripts import ScriptCalls, ScriptFunctions
from drone_sim.scripting.api.sensors import ProximitySensors, Sensors
from drone_sim.scripting.api.signals import SignalFunctions, TubeFunctions
from drone_sim.scripting.api.simulation import SimulationFunctions
from drone_sim.scripting.api.threads import Threads
from drone_sim.scripting.api.vision import VisionSensors
from drone_sim.scripting.api.windows import Dialogs, Views
from drone_sim.scripting.api.wireless import Wireless


def make_sim(host: Host, services: SceneServices) -> Api:
    """Return `sim` for the script on `host`."""
    context = host.context
    names, ignored, trajectories = NameFunctions(host), _ignored(host), TrajectoryFunctions()
    arguments = host, services, ignored
    motions = MotionFunctions(*arguments)
    parts = (
        Sensors(*arguments),
        Objects(*arguments),
        JointFunctions(*arguments),
        ProximitySensors(*arguments),
        DistanceFunctions(context.objects, context.collections, services.nearest),
        CollectionFunctions(names, context.objects, context.collections),
        Paths(*arguments),
        ObjectKinds(*arguments),
        SceneObjects(*arguments),
        Shapes(*arguments),
        Dynamics(*arguments),
        ShapeMasses(*arguments),
        Matrices(),
        Poses(),
        Bits(),
        ScriptFunctions(names, *arguments),
        ScriptCalls(names, *arguments),
        SimulationFunctions(*arguments),
        Dialogs(context.windows, context.drawings.new_handle, ignored),
        Views(context.windows, context.drawings.new_handle, context.objects),
        VisionSensors(*arguments),
        names,
        SignalFunctions(context.signals),
        GraphFunctions(context.graphs, context.drawings.new_handle),
        TubeFunctions(context.tubes),
        Wireless(*arguments),
        CustomDataFunctions(context.objects, context.data),
        Packing(),
        Tables(),
        Threads(*arguments),
        trajectories,
        motions,
        OlderMotions(motions, *arguments),
        DrawingFunctions(context.drawings, context.objects, ignored),
        OlderRemotePortFunctions(RemotePortFunctions(context.remote_ports, ignored)),
    )
    return Api(
        "sim",
        {**ignored.functions("sim"), **functions_of(*parts)},
        CONSTANTS,
        lambda: in_turn(names.save_state(), trajectories.save_state()),
    )


def make_sim_ros(bus: MessageBus, clock: Clock) -> Api:
    """Return `simROS` for a script; `clock` is the simulation's."""
    return Api("simROS", functions_of(TopicFunctions(bus), ServiceFunctions(bus), RosFunctions(bus, clock)), {})


def make_sim_vision(host: Host, services: SceneServices) -> Api:
    """Return `simVision` for the script on `host`."""
    filters = ImageFilters(host, services, _ignored(host))
    return Api("simVision", functions_of(filters), {}, filters.save_state)


def make_plugins(host: Host, services: SceneServices) -> dict[str, Api]:
    """Return `simRemoteApi`, `simOMPL` if OMPL is installed, and the plugins that are accepted and ignored, by name."""
    ignored = _ignored(host)
    ports = functions_of(RemotePortFunctions(host.context.remote_ports, ignored))
    planning = functions_of(PathPlanning(host, services, ignored)) if IS_INSTALLED else {}
    return {
        **{name: Api(name, ignored.functions(name), {}) for name in PLUGINS},
        **({"simOMPL": Api("simOMPL", planning, ENUMERATIONS)} if planning else {}),
        "simRemoteApi": Api("simRemoteApi", ports, {}),
    }


def _ignored(host: Host) -> Ignored:
    return Ignored(host.own_script, host.context.drawings.new_handle, lambda: getattr(host, "flat_names", ()))
