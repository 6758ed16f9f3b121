"""The connections of this node's topics: who is at the other end, and what still waits to be written to them."""

from __future__ import annotations

import time
from typing import Any

from rospy.impl.registration import get_topic_manager

_LOOK = 0.0005  # s, between two looks at what waits to be written


def publishers_of(topic: str) -> list[Any]:
    """Return the open connections by which this node receives a topic; `callerid_pub` is the publisher."""
    subscriber = get_topic_manager().get_subscriber_impl(topic)
    return [one for one in _connections(subscriber) if one.socket is not None and not one.done]


def subscribers_of(topic: str) -> list[Any]:
    """Return the open connections by which this node sends a topic; `endpoint_id` is the subscriber."""
    return [one for one in _connections(get_topic_manager().get_publisher_impl(topic)) if not one.done]


def received_topics() -> list[str]:
    """Return the topics that this node subscribes to."""
    return [topic for topic, _ in get_topic_manager().get_subscriptions()]


def sent(topic: str) -> int:
    """Return how many messages this node has published on a topic, to whomever."""
    publisher = get_topic_manager().get_publisher_impl(topic)
    return int(publisher.seq) if publisher is not None else 0


def all_connections() -> set[tuple[str, str]]:
    """Return topic and node (its name or its address) of every connection of this node."""
    return {(topic, node) for _, node, _, _, topic, is_open, *_ in get_topic_manager().get_pub_sub_info() if is_open}


def has_unwritten(connection: Any) -> bool:
    """Return whether messages wait until rospy's thread writes them to a subscriber's socket."""
    return bool(getattr(connection, "_queue", ()))


def wait_until_written(patience: float) -> bool:
    """Wait until no message waits to be written, for `patience` (s); return whether that is so.

    A subscriber that does not read must not block others: its messages are left waiting.
    """
    end = time.monotonic() + patience
    while any(map(has_unwritten, _all_subscribers())):
        if time.monotonic() > end:
            return False
        time.sleep(_LOOK)
    return True


def _all_subscribers() -> list[Any]:
    topics = [topic for topic, _ in get_topic_manager().get_publications()]
    return [connection for topic in topics for connection in subscribers_of(topic)]


def _connections(topic: Any) -> list[Any]:
    return list(topic.connections) if topic is not None else []
