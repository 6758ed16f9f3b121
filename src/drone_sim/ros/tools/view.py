"""Show the pictures of image topics in a window or, without a display, write them to a PNG file."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rosgraph
import rospy
from sensor_msgs.msg import CompressedImage, Image

from drone_sim.command_line import Parser
from drone_sim.message_text import near_names
from drone_sim.ros.core.shutdown import run_tool
from drone_sim.ros.tools import pictures

_NAME = "view"
_KINDS = {"sensor_msgs/Image": Image, "sensor_msgs/CompressedImage": CompressedImage}
_PERIOD = 0.05  # s, between two updates
_MASTER_PERIOD = 0.5  # s, between two requests to the master
_TIMEOUT = 3.0  # s, for a publisher, and then for a picture
_BUFFER = 1 << 24  # bytes; with rospy's default, large images are delayed
_SCREEN_SHARE = 0.9  # of the screen, for the largest window
_FILE = "view.png"


class Topic:
    """An image topic with its last picture, or the reason why there is none."""

    def __init__(self, name: str):
        """`name` must be resolved."""
        self.name = name
        self.reason = "waiting for a publisher"
        self.picture: np.ndarray | None = None
        self._message: Any = None
        self.subscriber: rospy.Subscriber | None = None  # None until the topic is published
        self._is_reported = False
        self._since = time.monotonic()

    def subscribe(self, published: dict[str, str]) -> None:
        """Subscribe if the topic is among those that are `published`, by type; report once if that fails."""
        kind = published.get(self.name)
        if self.subscriber is None and kind in _KINDS:
            self.reason = "waiting for a picture"
            self._since = time.monotonic()
            self.subscriber = rospy.Subscriber(self.name, _KINDS[kind], self._keep, queue_size=1, buff_size=_BUFFER)
        elif self.subscriber is None and (kind or time.monotonic() - self._since > _TIMEOUT):
            images = [name for name, other in published.items() if other in _KINDS]
            hint = near_names(self.name, images) if images else "there are no image topics"
            self._report(f"is a {kind}, not an image; {hint}" if kind else f"no node publishes it; {hint}")
        elif self.subscriber and self.picture is None and time.monotonic() - self._since > _TIMEOUT:
            self._report(f"is published, but no picture came within {_TIMEOUT:g} s; is the simulation paused?")

    def _report(self, reason: str) -> None:
        if not self._is_reported:
            self._is_reported = True
            self.reason = reason
            print(f"{_NAME}: {self.name}: {reason}", file=sys.stderr, flush=True)

    @property
    def has_failed(self) -> bool:
        """Whether there is no picture, and the reason was reported."""
        return self._is_reported and self.picture is None

    def _keep(self, message: Any) -> None:
        self._message = message

    def update(self) -> bool:
        """Decode the last message; return whether there was a new one."""
        message, self._message = self._message, None
        if message is None:
            return False
        self._since = time.monotonic()
        try:
            self.picture = pictures.decode(message)
        except ValueError as error:
            self._report(str(error))
        return True

    @property
    def caption(self) -> str:
        """The name, and the age of the picture if it is old."""
        age = time.monotonic() - self._since
        is_old = self.picture is not None and age > _TIMEOUT
        return f"{self.name}   no picture for {age:.0f} s" if is_old else self.name

    @property
    def tile(self) -> tuple[str, np.ndarray]:
        """The caption, and the picture or the reason why there is none."""
        return self.caption, pictures.blank(self.reason.partition(";")[0]) if self.picture is None else self.picture


class Viewer:
    """Shows or saves the pictures of topics. The thread that calls `show` owns the window."""

    def __init__(self, topics: list[str], is_shutdown: Callable[[], bool]):
        """`is_shutdown` returns whether the node must end."""
        self.topics = [Topic(rospy.resolve_name(topic)) for topic in topics]
        self._is_shutdown, self._is_closed = is_shutdown, False
        self._requested_at = -math.inf

    def _wait(self) -> bool:
        """Wait for _PERIOD, subscribe to new topics, and decode messages; return whether there were any."""
        time.sleep(_PERIOD)
        if time.monotonic() - self._requested_at > _MASTER_PERIOD:
            self._requested_at = time.monotonic()
            is_incomplete = not all(topic.subscriber for topic in self.topics)
            published = dict(rospy.get_published_topics()) if is_incomplete else {}
            for topic in self.topics:
                topic.subscribe(published)
        return any([topic.update() for topic in self.topics])

    def save(self, file: str) -> None:
        """Write a PNG with the next picture of each topic. Raises OSError, and RuntimeError if there is no picture."""
        while not self._is_over() and not all(topic.has_failed or topic.picture is not None for topic in self.topics):
            self._wait()
        if self._is_over():
            return
        if all(topic.has_failed for topic in self.topics):
            raise RuntimeError("no picture was received: nothing was written")
        picture = pictures.tile([topic.tile for topic in self.topics])
        Path(file).write_bytes(cv2.imencode(".png", picture)[1].tobytes())
        print(f"{_NAME}: wrote {file}, {picture.shape[1]} x {picture.shape[0]}", flush=True)

    def show(self, window: Any) -> None:
        """Show the pictures in a window of tkinter, until it is closed."""
        import tkinter

        with contextlib.suppress(tkinter.TclError):  # the window was destroyed
            window.title(" ".join([_NAME, *(topic.name for topic in self.topics)]))
            window.protocol("WM_DELETE_WINDOW", self._close)
            label = tkinter.Label(window, borderwidth=0)
            label.pack()
            largest = int(_SCREEN_SHARE * window.winfo_screenwidth()), int(_SCREEN_SHARE * window.winfo_screenheight())
            texts: list[tuple[str, str]] = []
            while not self._is_over():
                has_news = self._wait()
                if has_news or texts != [(topic.reason, topic.caption) for topic in self.topics]:
                    texts = [(topic.reason, topic.caption) for topic in self.topics]
                    picture = pictures.tile([topic.tile for topic in self.topics], largest)
                    image = tkinter.PhotoImage(data=cv2.imencode(".ppm", picture)[1].tobytes())
                    label.configure(image=image)
                window.update()
            window.destroy()

    def _close(self) -> None:
        self._is_closed = True

    def _is_over(self) -> bool:
        return self._is_closed or self._is_shutdown()


def _open_window() -> Any:
    """Return a window; None, after a line on stderr, if there cannot be one."""
    try:
        import tkinter
    except ImportError:
        print(f"{_NAME}: no window without tkinter (on Debian: python3-tk); writing a file", file=sys.stderr)
        return None
    try:
        return tkinter.Tk(className=_NAME)
    except tkinter.TclError as error:
        print(f"{_NAME}: no window: {error}; writing a file", file=sys.stderr)
        return None


def main() -> int:
    """Run until the window is closed, or until a signal; return the exit status."""
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("topics", metavar="TOPIC", nargs="*", default=["drone/front"], help="default: drone/front")
    parser.add_argument("--png", metavar="FILE", help="write the next pictures to one PNG file, and end")
    options = parser.parse_args(rosgraph.myargv(sys.argv)[1:])

    def run(is_shutdown: Callable[[], bool]) -> None:
        viewer = Viewer(options.topics, is_shutdown)
        window = None if options.png else _open_window()
        viewer.show(window) if window else viewer.save(options.png or _FILE)

    return run_tool(_NAME, run)
