"""What the frames of vehicles are called: `base_link`, `drone2/base_link`, and below the namespace of the node.

Whoever broadcasts sends on the same /tf. Two simulators under one master, in a namespace each, make one tree below
`world`, as their topics do not mix either.
"""

from __future__ import annotations

import rospy

from drone_sim.ros.vehicle.messages import WORLD_FRAME
from drone_sim.vehicles.parameters import UNPREFIXED, VehicleParameters


def frame(vehicle: VehicleParameters, name: str) -> str:
    """Return what a vehicle's frame is called, such as `a/drone2/front_optical`; `world` is everybody's."""
    return name if name == WORLD_FRAME else f"{rospy.get_namespace()}{vehicle.frame_prefix}{name}".lstrip("/")


def prefix(vehicle: str, is_alone: bool) -> str:
    """Return what the names of a vehicle's frames begin with, by the namespace of its topics, such as `a/drone`."""
    above, slash, name = vehicle.rpartition("/")
    return f"{above}{slash}" if is_alone and name == UNPREFIXED else f"{vehicle}/"


def base_link(vehicle: VehicleParameters) -> str:
    """Return the name of the frame of its root link."""
    return frame(vehicle, "base_link")


def track_base(vehicle: VehicleParameters) -> str:
    """Return the name of its level frame, in which commands count."""
    return frame(vehicle, "Track_base")


def first(simulator: str) -> str:
    """Return the name of the frame that rviz follows: Track_base of the first vehicle of the node `simulator`."""
    return f"{simulator.strip('/')}/first"
