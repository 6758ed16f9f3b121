"""Connections of this node's topics in rospy: the nodes at the other end, and messages in rospy's queues."""

from __future__ import annotations

import time
from typing import Any

from rospy.impl.registration import get_topic_manager

_POLL_PERIOD = 0.0005  # s


def publishers_of(topic: str) -> list[Any]:
    """Return the open connections by which this node receives a topic; `callerid_pub` is the publisher."""
    subscriber = get_topic_manager().get_subscriber_impl(topic)
    return [each for each in _connections(subscriber) if each.socket is not None and not each.done]


def subscribers_of(topic: str) -> list[Any]:
    """Return the open connections by which this node sends a topic; `endpoint_id` is the subscriber."""
    return [each for each in _connections(get_topic_manager().get_publisher_impl(topic)) if not each.done]


def received_topics() -> list[str]:
    return [topic for topic, _ in get_topic_manager().get_subscriptions()]


def sent_count(topic: str) -> int:
    """Return how many messages this node has published on a topic."""
    publisher = get_topic_manager().get_publisher_impl(topic)
    return int(publisher.seq) if publisher is not None else 0


def all_connections() -> set[tuple[str, str]]:
    """Return topic and node (its name or its address) of every connection of this node."""
    return {(topic, node) for _, node, _, _, topic, is_open, *_ in get_topic_manager().get_pub_sub_info() if is_open}


def has_queued(connection: Any) -> bool:
    """Return whether messages wait in rospy's queue for a subscriber.

    rospy's thread takes all of them out of the queue before it writes them to the socket.
    """
    return bool(getattr(connection, "_queue", ()))


def wait_until_taken(timeout: float) -> bool:
    """Wait until rospy's threads have taken all messages out of their queues.

    Return False after `timeout` (s), as for a subscriber that does not read.
    """
    deadline = time.monotonic() + timeout
    topics = [topic for topic, _ in get_topic_manager().get_publications()]
    while any(has_queued(connection) for topic in topics for connection in subscribers_of(topic)):
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_PERIOD)
    return True


def _connections(topic: Any) -> list[Any]:
    return list(topic.connections) if topic is not None else []
