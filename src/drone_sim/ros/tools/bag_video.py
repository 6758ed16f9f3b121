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
_SAMPLE = 50  # pictures, whose distance is that of all
_LONGEST_STILL = 10.0  # s that a picture is shown, where for longer no other came
_SLOWEST = 1.0  # pictures per second


def main(arguments: Sequence[str] | None = None) -> int:
    """Make it; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("bag", metavar="BAG", help="a bag with pictures (record_images:=true)")
    parser.add_argument("video", metavar="OUT.mp4")
    parser.add_argument(
        "--topic", metavar="NAME", help="the topic of the pictures, such as /drone/front (default: the first)"
    )
    options = parser.parse_args(arguments)
    return status_of(_NAME, lambda: _film(options))


def _film(options: argparse.Namespace) -> None:
    from drone_sim.offline import video  # PyAV, which few have

    video.check(options.video)
    with closing(Bag(options.bag)) as bag:
        topic = bag.named(options.topic, bag.topics(*_IMAGES), "image topic")
        vehicle = topic.split("/")[1]  # in whose namespace the pictures are
        flight = _FlightOverlay(bag, vehicle) if f"/{vehicle}/odom" in bag.topics(ODOMETRY) else None
        rate = min(_rate(bag, topic), video.MAX_RATE)
        damaged: list[str] = []
        with video.writing_to(options.video, rate) as made:
            for stamp, picture, times in _timed(bag, topic, rate, damaged):
                made.add(picture, flight.at(stamp) if flight else None, times)
    without = "" if flight else "; without a head-up display, because no odometry of its drone was recorded"
    without += f"; {len(damaged)} are left out: {damaged[0]}" if damaged else ""
    print(f"{_NAME}: wrote {options.video} of {topic}: {made}{without}", flush=True)


class _FlightOverlay:
    """What is shown of the drone at a moment."""

    def __init__(self, bag: Bag, vehicle: str):
        """Read it. Raises BagError."""
        self._flight = BagFlight(bag, vehicle)
        states = bag.topics(STATE)
        own = [name for name in states if name == f"/{vehicle}/state"]
        of_all = [name for name in states if name.endswith("/state") and name.count("/") == 2]
        heard = [one for name in (own or of_all)[:1] for one in bag.read(name, STATE)]
        self._times = np.array([one.at for one in heard])
        self._states = [str(one.message.data)[:40] for one in heard]

    def at(self, stamp: float) -> HudState:
        """Return what is shown as of a stamp (s)."""
        last = int(np.searchsorted(self._times, stamp, "right")) - 1
        return HudState.of(self._flight.row_at(stamp), self._states[last] if last >= 0 else "")


def _stamp(heard: RecordedMessage) -> float:
    return float(heard.message.header.stamp.to_sec()) or heard.at


def _rate(bag: Bag, topic: str) -> float:
    """Return how many pictures a second were recorded."""
    steps = np.diff([_stamp(one) for one in itertools.islice(bag.read(topic, bag.kinds[topic]), _SAMPLE)])
    steps = steps[steps > 0]
    rate = 1 / float(np.median(steps)) if len(steps) else _SLOWEST
    return round(max(rate, _SLOWEST), 2)


def _timed(bag: Bag, topic: str, rate: float, damaged: list[str]) -> Iterator[tuple[float, np.ndarray, int]]:
    """Yield each picture with its stamp (s), and the number of frames at a constant rate for which it is shown.

    Pictures that cannot be read are left out, and why is added to `damaged`. Raises ValueError where all are.
    """
    heard = bag.read(topic, bag.kinds[topic])
    this = next(heard, None)
    start, shown = _stamp(this) if this else 0.0, 0
    while this is not None:
        following = next(heard, None)
        until = _stamp(following) if following else _stamp(this) + 1 / rate
        until = min(until, _stamp(this) + _LONGEST_STILL)
        times = round((until - start) * rate) - shown
        if times > 0:
            try:
                picture = pictures.decode(this.message)
            except ValueError as error:
                damaged.append(str(error))
            else:
                yield _stamp(this), picture, times
                shown += times
        if following and _stamp(following) > until:  # what was cut out is not made up for
            start += _stamp(following) - until
        this = following
    if damaged and not shown:
        raise ValueError(f"{topic}: {damaged[0]}")
