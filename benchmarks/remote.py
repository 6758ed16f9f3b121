"""The remote API: how long a call of CoppeliaSim's own client takes, to drone.launch in a process of its own."""

import sys
import time
from collections.abc import Callable
from typing import Any

from benchmarks import node

Row = dict[str, Any]


def _seconds(call: Callable[[], Any], count: int) -> list[float]:
    taken = []
    for _ in range(count):
        began = time.perf_counter()
        call()
        taken.append(time.perf_counter() - began)
    return taken


def _calls(count: int) -> list[Row]:
    """While the simulation is stopped, runs at real time, and waits for the client."""
    from coppeliasim_zmqremoteapi_client import RemoteAPIClient

    sim = RemoteAPIClient().require("sim")
    drone = sim.getObject("/Quadcopter")
    rows = []
    for name, begin in (
        ("stopped", lambda: None),
        ("at real time", sim.startSimulation),
        ("waiting for the client", lambda: sim.setStepping(True)),
    ):
        begin()
        row = f"getObjectPosition, {name}"
        print(f"  {row}", file=sys.stderr, flush=True)
        rows.append(node.spread(row, _seconds(lambda: sim.getObjectPosition(drone, -1), count)))
    sim.stopSimulation()
    return rows


def _steps(count: int) -> list[Row]:
    """As fast as it can, the client asking for each."""
    from coppeliasim_zmqremoteapi_client import RemoteAPIClient

    sim = RemoteAPIClient().require("sim")
    sim.setStepping(True)
    sim.startSimulation()
    row = "step, as fast as it can"
    print(f"  {row}", file=sys.stderr, flush=True)
    rows = [node.spread(row, _seconds(sim.step, count))]
    sim.stopSimulation()
    return rows


def measure(count: int = 5000) -> list[Row]:
    """Return all rows."""
    rows = []
    with node.master():
        for factor, calls in (("1", _calls), ("0", _steps)):
            with node.launched("remote_api:=true", "rviz:=false", f"real_time_factor:={factor}"):
                rows += calls(count)
    return rows
