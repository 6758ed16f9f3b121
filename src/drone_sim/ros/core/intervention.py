"""What somebody outside does to the world beyond flying: a message or a request that moves, pushes or changes."""

from __future__ import annotations

from typing import Any, NamedTuple

import rospy


class Intervention(NamedTuple):
    """What is done (a word of grading/permissions.py), to what, by which topic, service or function, and by whom."""

    action: str
    what: str
    way: str
    by: str


def intervention(action: str, what: str, name: str, message: Any) -> Intervention:
    """Return what a message on a topic does, or a request of a service, by its name."""
    return Intervention(action, what, rospy.resolve_name(name), sender(message))


def sender(message: Any) -> str:
    """Return the node that a message or a request comes from."""
    header = getattr(message, "_connection_header", None) or {}  # rospy's, of what came over a wire
    return str(header.get("callerid", "?"))
