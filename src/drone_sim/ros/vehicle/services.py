"""Services of others that a child script calls, and those that it offers."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any

import genpy
import roslib.message
import rospy
from rosgraph.names import is_legal_name

from drone_sim.ros.vehicle.filling import fill
from drone_sim.scripting.api.backend import Ask
from drone_sim.scripting.api.service_servers import Unanswered

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


def serve(name: str, kind: str, ask: Ask) -> Callable[[], None]:
    """Offer a service, each of whose requests is handed to `ask` in a thread of rospy's; return what ends that.

    Raises ValueError where the type is not installed, or the name is none, or is this node's already.
    """
    found = _service_class(kind)
    if not is_legal_name(name) or name.endswith("/"):
        raise ValueError(f"'{name:.80}' is no name of a service: letters, digits, _ and / are allowed")

    def made(fields: Any) -> genpy.Message:
        return fill(found._response_class(), fields, f"{kind}Response")

    def handle(request: genpy.Message) -> genpy.Message:
        try:
            return ask(request, made)
        except Unanswered as error:
            raise rospy.ServiceException(str(error)) from None

    try:
        server = rospy.Service(name, found, handle)
    except rospy.ServiceException as error:
        raise ValueError(" ".join(str(error).split())) from None
    return lambda: server.shutdown("the script ended")


def _service_class(kind: str) -> Any:
    try:
        found = roslib.message.get_service_class(kind)
    except (ImportError, ValueError):
        found = None
    if found is None:
        raise ValueError(f"service type '{kind:.80}' is not installed")
    return found
