"""What the simulator says of itself, where it runs."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

from drone_sim.ros.doctor.line import HINT, OK, WRONG, Line
from drone_sim.ros.doctor.master import Master

PATIENCE = 4.0  # s; it speaks once a second
_MARKS = {0: OK, 1: HINT}
_APART = 1.0  # s, between this machine's clock and that of the simulator


def simulator(master: Master) -> Iterator[Line]:
    """Listen to its diagnostics."""
    if not master.there:
        return
    nodes = master.simulators()
    if not nodes:
        yield Line(HINT, "simulator", "does not run: `roslaunch drone_sim drone.launch`")
    for node in nodes:
        message = _heard(node)
        if message is None:
            yield Line(
                WRONG, "simulator", f"{node} says nothing on /diagnostics in {PATIENCE:g} s: end it, and start anew"
            )
            continue
        yield from _told(node, message)


def _heard(node: str) -> Any:
    """Return the first of its messages, or None where none comes in time."""
    import rospy
    from diagnostic_msgs.msg import DiagnosticArray

    if not rospy.core.is_initialized():
        rospy.init_node("drone_sim_doctor", anonymous=True, disable_signals=True, disable_rostime=True)
    heard: list[Any] = []
    came = threading.Event()

    def take(message: Any) -> None:
        if not heard and any(one.name.startswith(f"{node[1:]}: ") for one in message.status):
            heard.append(message)
            came.set()

    subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, take)
    came.wait(PATIENCE)
    subscriber.unregister()
    return heard[0] if heard else None


def _told(node: str, message: Any) -> Iterator[Line]:
    simulated = False
    for one in message.status:
        what = one.name.removeprefix(f"{node[1:]}: ")
        yield Line(_MARKS.get(one.level, WRONG), what, one.message)
        simulated |= any(pair.key == "stamps" and pair.value.startswith("simulated") for pair in one.values)
    apart = time.time() - message.header.stamp.to_sec()
    if not simulated and abs(apart) > _APART:
        said = (
            f"the clocks here and of {node} are {apart:.1f} s apart: transforms and pictures will not fit; run chrony"
        )
        yield Line(HINT, "clock", said)
