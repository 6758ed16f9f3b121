"""Access to the simulator from another node: its services, its parameters, and the failures that it logs."""

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

FAILURES = (  # raised by calls if the node or the master is gone, or refuses
    rospy.ServiceException,
    rospy.ROSException,
    rospy.exceptions.ROSInternalException,
    rosgraph.MasterException,
    http.client.HTTPException,
    xmlrpc.client.Error,
    OSError,
)
_SCRIPT_ERROR = re.compile(r"\[(\w+)\] (.+?):(\d+): (.*)", re.DOTALL)


class ScriptFailure(NamedTuple):
    """Where a script failed: phase or callback, file, line (from 1); and the error. The page gets these keys."""

    phase: str
    file: str
    line: int
    said: str


class Simulator:
    """Services and parameters of a simulator node."""

    def __init__(self, node: str):
        """`node` is the node's name as in a launch file, which may be relative."""
        self.node = rospy.resolve_name(node)

    def call(self, service: str, *request: Any) -> tuple[bool, str]:
        """Call a Trigger service, or a SetBool service with `request`; return its success and its message in one line.

        Blocks until the simulator replies.
        """
        kind = SetBool if request else Trigger
        try:
            reply = rospy.ServiceProxy(f"{self.node}/{service}", kind)(*request)
        except FAILURES as error:
            return False, " ".join(str(error).split()) or f"no answer from {self.node}"
        return reply.success, " ".join(reply.message.split())

    def call_async(self, service: str, *request: Any, then: Callable[[bool, str], None]) -> None:
        """Call a service in a new thread, which calls `then` with the result."""
        threading.Thread(target=lambda: then(*self.call(service, *request)), name=service, daemon=True).start()

    def parameter(self, name: str, default: Any = None) -> Any:
        """Return a private parameter of the node. Raises one of `FAILURES`."""
        return rospy.get_param(f"{self.node}/{name}", default)

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a private parameter, which the node reads when a service tells it to; None deletes it.

        Raises one of `FAILURES`.
        """
        if value is not None:
            rospy.set_param(f"{self.node}/{name}", value)
        elif rospy.has_param(f"{self.node}/{name}"):
            rospy.delete_param(f"{self.node}/{name}")


def script_failure(line: str) -> ScriptFailure | None:
    """Return the script failure in a line of the simulator's log; None for another line."""
    match = _SCRIPT_ERROR.search(line)
    return ScriptFailure(match[1], match[2], int(match[3]), match[4]) if match else None
