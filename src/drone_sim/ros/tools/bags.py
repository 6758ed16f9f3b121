"""Bags, read with care: what cannot be read gets one line, and no message's class is made from the bag's own words."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any, NamedTuple

import rosbag
import rosbag.bag

from drone_sim.files.resources import MEBIBYTE
from drone_sim.ros.vehicle.filling import message_class
from drone_sim.wording import near_names

MAX_MESSAGES = 500_000  # of one topic
MAX_CHUNK = 256 * MEBIBYTE  # of messages that are unpacked together; rosbag record makes chunks of 768 KiB


class BagRefused(ValueError):
    """A bag cannot be read; one line that names it and says why."""


class Heard(NamedTuple):
    """A message, and when it was recorded (s, of the recorder's clock)."""

    at: float
    message: Any


class Bag:
    """An open bag. Its messages are of the classes that are installed here; those of other versions are left out."""

    def __init__(self, path: str):
        """Open it. Raises OSError and BagRefused."""
        self.path = path
        if not os.path.isfile(path):
            os.stat(path)
            raise BagRefused(f"{path}: is no regular file")
        if not os.path.getsize(path):
            raise BagRefused(f"{path}: is empty")
        with self._reading():
            self._bag = rosbag.Bag(path)
            topics = self._bag.get_type_and_topic_info().topics
            largest = max((one.uncompressed_size for one in self._bag._chunk_headers.values()), default=0)
        if largest > MAX_CHUNK:
            raise BagRefused(f"{path}: a chunk of {largest} bytes; at most {MAX_CHUNK} are unpacked")
        self.kinds: dict[str, str] = {name: one.msg_type for name, one in topics.items()}
        self._counts = {name: one.message_count for name, one in topics.items()}

    def close(self) -> None:
        """Close it."""
        self._bag.close()

    def topics(self, *kinds: str) -> list[str]:
        """Return the names of the topics of these kinds of message."""
        return sorted(name for name, kind in self.kinds.items() if kind in kinds)

    def read(self, topic: str, kind: str) -> Iterator[Heard]:
        """Yield what was recorded of a topic, in the order of time; nothing for one that is not there.

        What is of another kind of message on it than that (nav_msgs/Odometry, say) is left out. Raises BagRefused.
        """
        if self._counts.get(topic, 0) > MAX_MESSAGES:
            raise BagRefused(f"{self.path}: {self._counts[topic]} messages on {topic}; at most {MAX_MESSAGES} are read")
        if self.kinds.get(topic) != kind:
            return
        sum_of_ours = message_class(kind)._md5sum
        rosbag.bag._message_types[sum_of_ours] = message_class(kind)  # or rosbag would run code made from the bag's own
        messages = self._bag.read_messages(
            [topic], connection_filter=lambda _topic, _type, md5sum, *_: md5sum == sum_of_ours
        )
        while True:
            with self._reading():
                found = next(messages, None)
            if found is None:
                return
            yield Heard(found[2].to_sec(), found[1])

    def named(self, topic: str | None, among: list[str], what: str) -> str:
        """Return the topic that is meant, by default the first of these. Raises BagRefused."""
        if topic is None and among:
            return among[0]
        if topic in among:
            return str(topic)
        there = near_names(topic or "", among) if among else f"there is no {what} in it"
        raise BagRefused(f"{self.path}: {f'no {what} {topic}; ' if topic else ''}{there}")

    @contextlib.contextmanager
    def _reading(self) -> Iterator[None]:
        """Let whatever a broken file leads to become one line."""
        try:
            yield
        except OSError:
            raise
        except rosbag.ROSBagUnindexedException:
            why = "was cut off while it was recorded; `rosbag reindex` mends a copy of it"
            raise BagRefused(f"{self.path}: {why}") from None
        except Exception as error:  # rosbag lets through what struct, bz2, genpy and the like raise
            said = " ".join(str(error).split()) or type(error).__name__
            raise BagRefused(f"{self.path}: is no bag that can be read: {said:.120}") from None
