"""Other simulators under the same master: no two may fly the same vehicle, and one alone tells the time."""

from __future__ import annotations

from collections.abc import Iterable

import rosgraph
import rospy

from drone_sim.ros.doctor.master import FAILURES, asked

_OURS = "set_vehicles"  # a service that every simulator has, and nobody else
_OF_A_VEHICLE = "odom"
_CLOCK = "/clock"


def check_others(vehicles: Iterable[str], simulated: bool) -> None:
    """Raise ValueError where another simulator flies one of `vehicles`, or tells the time that this one would tell."""
    uri = rosgraph.get_master_uri()
    published, _, services = map(dict, asked(uri, "getSystemState"))
    own = rospy.get_name()

    def others(topic: str) -> list[str]:
        """Return the simulators that publish a topic, and still answer."""
        nodes = [one for one in published.get(topic, ()) if one != own and one in services.get(f"{one}/{_OURS}", ())]
        return [one for one in nodes if _answers(uri, one)]

    for name in vehicles:
        there = others(rospy.resolve_name(f"{name}/{_OF_A_VEHICLE}"))
        if there:
            cure = "a namespace (__ns:=a, or ns of <include>), or another drone/name"
            raise ValueError(f"vehicle {name} flies already, in {there[0]}: give one of the two {cure}")
    if simulated and others(_CLOCK):
        cure = "only in real time can two run under one master (use_sim_time:=false)"
        raise ValueError(f"/use_sim_time is true, and {others(_CLOCK)[0]} tells the time already: {cure}")


def _answers(master: str, node: str) -> bool:
    try:
        asked(asked(master, "lookupNode", node), "getPid")
    except FAILURES:
        return False
    return True
