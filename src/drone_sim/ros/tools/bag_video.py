"""Make a video of the pictures in a bag, with the drone's height, speed, attitude and state over them."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator, Sequence
from contextlib import closing

import numpy as np

from drone_sim.command_line import Parser, status_of
from drone_sim.offline.hud import HudState
from drone_sim.ros.tools import pictures
from drone_sim.ros.tools.bags import ODOMETRY, STATE, Bag, BagFlight, RecordedMessage

_NAME = "video"
_IMAGES = ("sensor_msgs/Image", "sensor_msgs/CompressedImage")
_RATE_SAMPLE = 50  # pictures at the beginning, which give the frame rate
_MAX_STILL = 10.0  # s, for which a picture is shown if the next one is later
_MIN_RATE = 1.0  # pictures per second


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("bag", metavar="BAG", help="a bag with pictures (record_images:=true)")
    parser.add_argument("video", metavar="OUT.mp4")
    parser.add_argument(
        "--topic", metavar="NAME", help="the topic of the pictures, such as /drone/front (default: the first)"
    )
    options = parser.parse_args(arguments)
    return status_of(_NAME, lambda: _write_video(options))


def _write_video(options: argparse.Namespace) -> None:
    from drone_sim.offline import video  # needs PyAV, which is optional

    video.check(options.video)
    with closing(Bag(options.bag)) as bag:
        topic = bag.choose(options.topic, bag.topics(*_IMAGES), "image topic")
        vehicle = topic.split("/")[1]
        flight = _FlightOverlay(bag, vehicle) if f"/{vehicle}/odom" in bag.topics(ODOMETRY) else None
        rate = min(_rate(bag, topic), video.MAX_RATE)
        damaged: list[str] = []
        with video.writing_to(options.video, rate) as film:
            for stamp, picture, frames in _timed_pictures(bag, topic, rate, damaged):
                film.add(picture, flight.at(stamp) if flight else None, frames)
    notes = "" if flight else "; without a head-up display, because no odometry of its drone was recorded"
    notes += f"; {len(damaged)} are left out: {damaged[0]}" if damaged else ""
    print(f"{_NAME}: wrote {options.video} of {topic}: {film}{notes}", flush=True)


class _FlightOverlay:
    """Values of the head-up display, by time."""

    def __init__(self, bag: Bag, vehicle: str):
        """Read odometry and states of a vehicle. Raises BagError."""
        self._flight = BagFlight(bag, vehicle)
        states = bag.topics(STATE)
        own = [name for name in states if name == f"/{vehicle}/state"]
        of_all = [name for name in states if name.endswith("/state") and name.count("/") == 2]
        recorded = [state for name in (own or of_all)[:1] for state in bag.read(name, STATE)]
        self._times = np.array([state.at for state in recorded])
        self._states = [str(state.message.data)[:40] for state in recorded]

    def at(self, stamp: float) -> HudState:
        """Return the values at a stamp (s)."""
        last = int(np.searchsorted(self._times, stamp, "right")) - 1
        return HudState.of(self._flight.row_at(stamp), self._states[last] if last >= 0 else "")


def _stamp(recorded: RecordedMessage) -> float:
    return float(recorded.message.header.stamp.to_sec()) or recorded.at


def _rate(bag: Bag, topic: str) -> float:
    """Return the recorded pictures per second."""
    first = itertools.islice(bag.read(topic, bag.kinds[topic]), _RATE_SAMPLE)
    periods = np.diff([_stamp(recorded) for recorded in first])
    periods = periods[periods > 0]
    rate = 1 / float(np.median(periods)) if len(periods) else _MIN_RATE
    return round(max(rate, _MIN_RATE), 2)


def _timed_pictures(bag: Bag, topic: str, rate: float, damaged: list[str]) -> Iterator[tuple[float, np.ndarray, int]]:
    """Yield each picture with its stamp (s), and the number of frames at a constant rate for which it is shown.

    The errors of unreadable pictures are added to `damaged`. Raises ValueError if no picture is readable.
    """
    messages = bag.read(topic, bag.kinds[topic])
    current = next(messages, None)
    start, written = _stamp(current) if current else 0.0, 0
    while current is not None:
        following = next(messages, None)
        end = _stamp(following) if following else _stamp(current) + 1 / rate
        end = min(end, _stamp(current) + _MAX_STILL)
        frames = round((end - start) * rate) - written
        if frames > 0:
            try:
                picture = pictures.decode(current.message)
            except ValueError as error:
                damaged.append(str(error))
            else:
                yield _stamp(current), picture, frames
                written += frames
        if following and _stamp(following) > end:  # the rest of a long pause is cut out of the video
            start += _stamp(following) - end
        current = following
    if damaged and not written:
        raise ValueError(f"{topic}: {damaged[0]}")
