"""Services of others that a child script calls."""

from __future__ import annotations

import queue
import threading
from typing import Any

import roslib.message
import rospy

from drone_sim.ros.vehicle.filling import fill

_LONGEST = 1.0  # s: the simulation waits meanwhile


def call(name: str, kind: str, request: Any) -> Any:
    """Return the response of a service of a type such as std_srvs/Trigger.

    Raises ValueError where the type is not installed, the request does not fit, or no answer comes within a second.
    """
    found = _service_class(kind)
    filled = fill(found._request_class(), request, f"{kind}Request")
    answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def ask() -> None:
        try:
            rospy.wait_for_service(name, _LONGEST)
            answers.put(rospy.ServiceProxy(name, found)(filled))
        except (rospy.ROSException, rospy.ServiceException) as error:
            answers.put(error)

    threading.Thread(target=ask, name=f"service {name}", daemon=True).start()
    try:
        answer = answers.get(timeout=_LONGEST)
    except queue.Empty:
        raise ValueError(f"the service {name} does not answer within {_LONGEST:g} s") from None
    if isinstance(answer, Exception):
        raise ValueError(f"the service {name}: {' '.join(str(answer).split())}")
    return answer


def _service_class(kind: str) -> Any:
    try:
        found = roslib.message.get_service_class(kind)
    except (ImportError, ValueError):
        found = None
    if found is None:
        raise ValueError(f"service type '{kind:.80}' is not installed")
    return found
