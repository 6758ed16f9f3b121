"""Fly from the keyboard: the cockpit's keys, or those of the course's own node, the simulation's toolbar, a read-out.

A command holds until the next key, as on the topic. A key that means nothing stops the drone, and so does leaving in
any way.
"""

from __future__ import annotations

import contextlib
import curses
import os
import select
import signal
import sys
import termios
import time
from collections.abc import Callable
from typing import Any

from drone_sim.ros.core.shutdown import run_tool
from drone_sim.ros.tools.commands import ESCAPE, KeyDecoder
from drone_sim.ros.tools.teleop import Teleop

_NAME = "key_teleop"
_PERIOD = 0.1  # s between read-outs
_CONNECTING = 1.0  # s at most, before the first key counts
# Ctrl-C, Ctrl-\ and Ctrl-Z among them: a command would hold while nobody is at the keys.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
_INPUT_FLAGS = 0  # where they stand in what termios tells

_TOOLBAR = (
    "Enter      start / stop the simulation",
    "p          pause / resume",
    "backspace  restart",
    "t / l / x  take off / land / reset the drone",
    "ESC        stop the drone and leave",
)
_FLYING = {
    "cockpit": (
        "W S, or UP DOWN     forward, back",
        "A D, or LEFT RIGHT  left, right",
        "Q E                 turn left, right",
        "R F                 up, down; Shift: larger steps",
        "space, any other    stop the drone",
    ),
    "course": (
        "UP DOWN             forward, back",
        "LEFT RIGHT          left, right",
        "e r                 turn left, right",
        "u d                 up, down; Shift: larger steps",
        "space, any other    stop the drone",
    ),
}
HELP = {name: [f"{one:<52}{other}" for one, other in zip(keys, _TOOLBAR)] for name, keys in _FLYING.items()}


class Screen:
    """Reads keys and shows the read-out, until somebody wants to leave or the terminal is gone."""

    def __init__(self, teleop: Teleop, over: Callable[[], bool]):
        """Take the teleop that does the work, and what tells that it is over."""
        self._teleop, self._over = teleop, over
        self._decoder = KeyDecoder()
        self._terminal = sys.stdin.fileno()
        self._unknown = False  # whether the last key was
        self._help = HELP[teleop.map]

    def run(self, screen: Any) -> None:
        """Run in a curses screen."""
        self._screen = screen
        with contextlib.suppress(OSError, termios.error):  # the terminal is gone
            _ignore_control_s(self._terminal)
            self._connect()
            self._fly()

    def _fly(self) -> None:
        is_ready = False
        while not self._over():
            if self._teleop.connected and not is_ready:
                is_ready, self._teleop.said = True, "ready"
            self._draw()
            for key in self._read():
                if key == ESCAPE:
                    return
                self._unknown = not self._teleop.press(key)

    def _connect(self) -> None:
        """Give the topics a moment to connect, and forget what was typed meanwhile, sequences cut in two among it."""
        deadline = time.monotonic() + _CONNECTING
        while not self._teleop.connected and time.monotonic() < deadline and not self._over():
            self._teleop.said = "connecting ..."
            self._draw()
            time.sleep(_PERIOD / 2)
        self._teleop.said = ""
        termios.tcflush(self._terminal, termios.TCIFLUSH)

    def _read(self) -> list[str]:
        """Wait a little for keys, and return them. Raises OSError when there will be none any more."""
        if not select.select([self._terminal], [], [], _PERIOD)[0]:
            return self._decoder.feed(b"")
        data = os.read(self._terminal, 1024)
        if not data:
            raise OSError("the terminal was closed")
        return self._decoder.feed(data)

    def _draw(self) -> None:
        size = os.get_terminal_size(self._terminal)
        if curses.is_term_resized(size.lines, size.columns):
            curses.resizeterm(size.lines, size.columns)
        height, width = self._screen.getmaxyx()
        lines = self._teleop.lines()
        room = height > len(self._help) + len(lines)
        if self._unknown:
            where = "the keys are above" if room else "a larger window shows the keys"
            lines[-1] = f"no such key: the drone is stopped; {where}"
        if not room:
            lines = [line for line in (lines[-1], *lines[:-1]) if line]  # what there is to say comes first
        self._screen.erase()
        if room:
            self._write(0, self._help, width, curses.A_BOLD if self._unknown else curses.A_NORMAL)
        self._write(len(self._help) + 1 if room else 0, lines[:height], width, curses.A_NORMAL)
        self._screen.refresh()

    def _write(self, first: int, lines: list[str], width: int, look: int) -> None:
        for row, line in enumerate(lines, start=first):
            with contextlib.suppress(curses.error):  # how much fits into a tiny screen is curses' to know
                self._screen.addnstr(row, 0, line, width - 1, look)  # which cannot fill the last corner


def _ignore_control_s(terminal: int) -> None:
    """Let Ctrl-S not hold up the output, and with it the keys, while the drone flies on."""
    settings = termios.tcgetattr(terminal)
    settings[_INPUT_FLAGS] &= ~termios.IXON
    termios.tcsetattr(terminal, termios.TCSANOW, settings)


def _fly(over: Callable[[], bool]) -> None:
    """Show the screen until it is left in any way, and stop the drone."""
    teleop = Teleop()
    try:
        with contextlib.suppress(curses.error):  # there is no terminal any more to leave
            curses.wrapper(Screen(teleop, over).run)
    finally:
        teleop.stop()
        rest_of_line = (curses.tigetstr("el") or b"").decode()  # what was typed before it began stands there
        print(f"\r{rest_of_line}{_NAME}: {teleop.farewell}", flush=True)


def main() -> int:
    """Run the node until ESC, a signal, or the terminal closes; return its exit status."""
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        print(f"{_NAME}: must run in a terminal, to read its keys", file=sys.stderr)
        return 1
    try:
        curses.setupterm()
    except curses.error as error:
        print(f"{_NAME}: TERM = '{os.environ.get('TERM', '')}': {error}", file=sys.stderr)
        return 1
    return run_tool(_NAME, _fly, _SIGNALS)
