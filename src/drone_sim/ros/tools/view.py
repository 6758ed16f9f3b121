"""Show cameras: a window with the pictures of image topics or, without a display, a PNG file."""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
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
_PERIOD = 0.05  # s, between two looks at what has come
_ASKING = 0.5  # s, between two questions to the master
_PATIENCE = 3.0  # s, for somebody to publish, and then for a picture
_BUFFER = 1 << 24  # bytes; rospy's default makes large pictures late
_SHARE = 0.9  # of the screen, for the largest window
_FILE = "view.png"


class Topic:
    """One image topic: its last picture, or why there is none."""

    def __init__(self, name: str):
        """Take its name; begin without a publisher."""
        self.name = name
        self.why = "waiting for a publisher"
        self.shown: np.ndarray | None = None
        self._message: Any = None
        self.subscriber: rospy.Subscriber | None = None  # once somebody has published it
        self._said = False
        self._since = time.monotonic()

    def look_for(self, published: dict[str, str]) -> None:
        """Subscribe if somebody publishes; say, once, that nobody does or that it is no image."""
        kind = published.get(self.name)
        if self.subscriber is None and kind in _KINDS:
            self.why = "waiting for a picture"
            self._since = time.monotonic()
            self.subscriber = rospy.Subscriber(self.name, _KINDS[kind], self._keep, queue_size=1, buff_size=_BUFFER)
        elif self.subscriber is None and (kind or time.monotonic() - self._since > _PATIENCE):
            images = [name for name, one in published.items() if one in _KINDS]
            there = near_names(self.name, images) if images else "there are no image topics"
            self._say(f"is a {kind}, not an image; {there}" if kind else f"no node publishes it; {there}")
        elif self.subscriber and self.shown is None and time.monotonic() - self._since > _PATIENCE:
            self._say(f"is published, but no picture came within {_PATIENCE:g} s; is the simulation paused?")

    def _say(self, why: str) -> None:
        if not self._said:
            self._said = True
            self.why = why
            print(f"{_NAME}: {self.name}: {why}", file=sys.stderr, flush=True)

    @property
    def hopeless(self) -> bool:
        """Whether it has been said that there is no picture."""
        return self._said and self.shown is None

    def _keep(self, message: Any) -> None:
        self._message = message

    def update(self) -> bool:
        """Decode what has come since; return whether something has."""
        message, self._message = self._message, None
        if message is None:
            return False
        self._since = time.monotonic()
        try:
            self.shown = pictures.decode(message)
        except ValueError as error:
            self._say(str(error))
        return True

    @property
    def caption(self) -> str:
        """The name, and for how long no picture has come, if that is long."""
        silent = time.monotonic() - self._since
        old = self.shown is not None and silent > _PATIENCE
        return f"{self.name}   no picture for {silent:.0f} s" if old else self.name

    @property
    def picture(self) -> tuple[str, np.ndarray]:
        """The caption, and what there is to see."""
        return self.caption, pictures.blank(self.why.partition(";")[0]) if self.shown is None else self.shown


class Viewer:
    """Follows topics until somebody ends it; the thread that calls `show` owns the window."""

    def __init__(self, topics: list[str], asked: Callable[[], bool]):
        """Begin to listen to `topics`; `asked` tells whether it is time to end."""
        self.topics = [Topic(rospy.resolve_name(topic)) for topic in topics]
        self._asked_to_end, self._closed = asked, False
        self._asked = -math.inf

    def _wait(self) -> bool:
        """Wait a little, look for publishers now and then, and take what has come; return whether something has."""
        time.sleep(_PERIOD)
        if time.monotonic() - self._asked > _ASKING:
            self._asked = time.monotonic()
            seeking = not all(topic.subscriber for topic in self.topics)
            published = dict(rospy.get_published_topics()) if seeking else {}
            for topic in self.topics:
                topic.look_for(published)
        return any([topic.update() for topic in self.topics])

    def save(self, file: str) -> None:
        """Write a PNG with the next picture of each topic. Raises OSError; RuntimeError where there is not one."""
        while not self._over() and not all(topic.hopeless or topic.shown is not None for topic in self.topics):
            self._wait()
        if self._over():
            return
        if all(topic.hopeless for topic in self.topics):
            raise RuntimeError("no picture was received: nothing was written")
        picture = pictures.tile([topic.picture for topic in self.topics])
        Path(file).write_bytes(cv2.imencode(".png", picture)[1].tobytes())
        print(f"{_NAME}: wrote {file}, {picture.shape[1]} x {picture.shape[0]}", flush=True)

    def show(self, window: Any) -> None:
        """Show the pictures in a window of tkinter, until it is closed."""
        import tkinter

        with contextlib.suppress(tkinter.TclError):  # the window is gone, whoever has destroyed it
            self._show(window, tkinter)

    def _show(self, window: Any, tkinter: ModuleType) -> None:
        window.title(" ".join([_NAME, *(topic.name for topic in self.topics)]))
        window.protocol("WM_DELETE_WINDOW", self._close)
        label = tkinter.Label(window, borderwidth=0)
        label.pack()
        largest = int(_SHARE * window.winfo_screenwidth()), int(_SHARE * window.winfo_screenheight())
        told: list[tuple[str, str]] = []
        while not self._over():
            news = self._wait()
            if news or told != [(topic.why, topic.caption) for topic in self.topics]:
                told = [(topic.why, topic.caption) for topic in self.topics]
                picture = pictures.tile([topic.picture for topic in self.topics], largest)
                image = tkinter.PhotoImage(data=cv2.imencode(".ppm", picture)[1].tobytes())
                label.configure(image=image)
            window.update()
        window.destroy()

    def _close(self) -> None:
        self._closed = True

    def _over(self) -> bool:
        return self._closed or self._asked_to_end()


def _window() -> Any:
    """Return a window, or None, after a line that says why there is none."""
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


def _arguments() -> argparse.Namespace:
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("topics", metavar="TOPIC", nargs="*", default=["drone/front"], help="default: drone/front")
    parser.add_argument("--png", metavar="FILE", help="write the next pictures to one PNG file, and end")
    return parser.parse_args(rosgraph.myargv(sys.argv)[1:])


def _run(arguments: argparse.Namespace, over: Callable[[], bool]) -> None:
    viewer = Viewer(arguments.topics, over)
    window = None if arguments.png else _window()
    viewer.show(window) if window else viewer.save(arguments.png or _FILE)


def main() -> int:
    """Run until the window is closed or a signal comes; return the exit status."""
    arguments = _arguments()
    return run_tool(_NAME, lambda over: _run(arguments, over))
