"""The simulation, as any other node reaches it: its services, its parameters, and what it says."""

from __future__ import annotations

import http.client
import re
import threading
import xmlrpc.client
from collections.abc import Callable
from typing import Any, NamedTuple

import rosgraph
import rospy
from std_srvs.srv import SetBool, Trigger

FAILURES = (  # what calls raise where the node, or the master, is gone or refuses
    rospy.ServiceException,
    rospy.ROSException,
    rospy.exceptions.ROSInternalException,
    rosgraph.MasterException,
    http.client.HTTPException,
    xmlrpc.client.Error,
    OSError,
)
_ERROR = re.compile(r"\[(\w+)\] (.+?):(\d+): (.*)", re.DOTALL)


class ScriptFailure(NamedTuple):
    """Where a script failed: phase or callback, file, line (from 1), and what went wrong."""

    phase: str
    file: str
    line: int
    said: str


class Simulator:
    """The node of a name, with its services."""

    def __init__(self, node: str):
        """Reach the node whose name is `node`, as given to a launch."""
        self.node = rospy.resolve_name(node)

    def call(self, service: str, *request: Any) -> tuple[bool, str]:
        """Call a service; return whether it was done, and one line. Takes as long as the simulation takes."""
        kind = SetBool if request else Trigger
        try:
            answer = rospy.ServiceProxy(f"{self.node}/{service}", kind)(*request)
        except FAILURES as error:
            return False, " ".join(str(error).split()) or f"no answer from {self.node}"
        return answer.success, " ".join(answer.message.split())

    def call_aside(self, service: str, *request: Any, then: Callable[[bool, str], None]) -> None:
        """Call a service in a thread of its own; `then` hears the answer there."""
        threading.Thread(target=lambda: then(*self.call(service, *request)), name=service, daemon=True).start()

    def parameter(self, name: str, default: Any = None) -> Any:
        """Return a parameter of the node. Raises one of `FAILURES`."""
        return rospy.get_param(f"{self.node}/{name}", default)

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter of the node, which it reads when a service says so. Raises one of `FAILURES`."""
        rospy.set_param(f"{self.node}/{name}", value)


def script_failure(line: str) -> ScriptFailure | None:
    """Return the script's failure that a line of the simulation tells of, None for any other line."""
    found = _ERROR.search(line)
    return ScriptFailure(found[1], found[2], int(found[3]), found[4]) if found else None
