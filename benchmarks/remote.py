"""The remote APIs: how long calls take, of CoppeliaSim's own client and of V-REP's legacy one, to drone.launch.

That is in a process of its own.
"""

import struct
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarks import node
from benchmarks.legacy_client import (
    HANDLE,
    OBJECTS,
    POSITION,
    START,
    STOP,
    STREAMING,
    SYNCHRONOUS,
    TOOLBAR,
    TRIGGER,
    LegacyClient,
    command,
)

Row = dict[str, Any]
_STREAMS = 200


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


def _legacy_calls(count: int) -> list[Row]:
    """While the simulation is stopped, and runs at real time."""
    client = LegacyClient()
    drone = client.call(HANDLE, b"Quadricopter\0")
    rows = []
    for name, begin in (("stopped", lambda: None), ("at real time", lambda: client.call(TOOLBAR, START))):
        begin()
        row = f"simxGetObjectPosition, {name}"
        print(f"  {row}", file=sys.stderr, flush=True)
        key = drone + struct.pack("<i", -1)
        rows.append(node.spread(row, _seconds(partial(client.call, POSITION, key), count)))
    client.call(TOOLBAR, STOP)
    return rows


def _legacy_steps(count: int) -> list[Row]:
    """As fast as it can, the client triggering each."""
    client = LegacyClient()
    client.call(SYNCHRONOUS)
    client.call(TOOLBAR, START)
    row = "simxSynchronousTrigger, as fast as it can"
    print(f"  {row}", file=sys.stderr, flush=True)
    rows = [node.spread(row, _seconds(lambda: client.call(TRIGGER), count))]
    client.call(TOOLBAR, STOP)
    return rows


def _legacy_streams(seconds: float) -> Row:
    """A client whose messages come every 5 ms, as V-REP's own do, has so many places in every step."""
    client = LegacyClient()
    (count, *handles), taken = _whole(client.call(OBJECTS, struct.pack("<i", -2))), []
    pairs = [(one, other) for one in handles for other in handles][:_STREAMS]
    print(f"  {len(pairs)} of {count * count} places, for {seconds:g} s of real time", file=sys.stderr, flush=True)
    client.call(TOOLBAR, START)
    client.ask(*(command(POSITION | STREAMING, struct.pack("<2i", *pair)) for pair in pairs))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        began = time.perf_counter()
        if client.ask():
            taken.append(time.perf_counter() - began)
        time.sleep(0.005)
    client.call(TOOLBAR, STOP)
    return node.spread(f"{_STREAMS} values that stream, in every step", taken)


def _whole(data: bytes) -> tuple[int, ...]:
    return struct.unpack(f"<{len(data) // 4}i", data)


def measure(count: int = 5000, seconds: float = 20.0) -> list[Row]:
    """Return all rows."""
    rows = []
    with node.master():
        for factor, calls in (("1", _calls), ("0", _steps), ("1", _legacy_calls), ("0", _legacy_steps)):
            with node.launched("remote_api:=true", "rviz:=false", f"real_time_factor:={factor}"):
                rows += calls(count)
        with node.launched("remote_api:=true", "rviz:=false") as lines:
            row = _legacy_streams(seconds)
        rows.append({**row, "late_steps": int(node.flew(lines).group(3))})
    return rows
