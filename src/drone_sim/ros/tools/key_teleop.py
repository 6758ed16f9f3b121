"""Fly with the keyboard, and start, pause and stop the simulation; the terminal shows the drone's state.

A command holds until the next key. An unknown key stops the drone, and so does the end of the program.
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
_PERIOD = 0.1  # s, between two updates of the screen
_CONNECT_TIMEOUT = 1.0  # s
# Also the signals of Ctrl-\ and Ctrl-Z: otherwise the last command would hold while the program is suspended.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
_INPUT_FLAGS = 0  # index in the result of tcgetattr

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
HELP = {name: [f"{keys:<52}{tools}" for keys, tools in zip(lines, _TOOLBAR)] for name, lines in _FLYING.items()}


class Screen:
    """Curses screen that reads keys and shows the drone's state, until Escape or until the terminal is closed."""

    def __init__(self, teleop: Teleop, over: Callable[[], bool]):
        """`over` returns whether the node must end."""
        self._teleop, self._over = teleop, over
        self._decoder = KeyDecoder()
        self._terminal = sys.stdin.fileno()
        self._is_key_unknown = False
        self._help = HELP[teleop.key_map]

    def run(self, screen: Any) -> None:
        self._screen = screen
        with contextlib.suppress(OSError, termios.error):  # the terminal is gone
            # Without Ctrl-S, which would block the output, and with it the keys, while the drone flies on.
            settings = termios.tcgetattr(self._terminal)
            settings[_INPUT_FLAGS] &= ~termios.IXON
            termios.tcsetattr(self._terminal, termios.TCSANOW, settings)
            self._connect()
            self._fly()

    def _fly(self) -> None:
        is_ready = False
        while not self._over():
            if self._teleop.is_connected and not is_ready:
                is_ready, self._teleop.status = True, "ready"
            self._draw()
            data = b""
            if select.select([self._terminal], [], [], _PERIOD)[0]:
                data = os.read(self._terminal, 1024)
                if not data:
                    raise OSError("the terminal was closed")
            for key in self._decoder.feed(data):
                if key == ESCAPE:
                    return
                self._is_key_unknown = not self._teleop.press(key)

    def _connect(self) -> None:
        """Wait for a subscriber, at most _CONNECT_TIMEOUT, and discard the keys that were typed meanwhile."""
        deadline = time.monotonic() + _CONNECT_TIMEOUT
        while not self._teleop.is_connected and time.monotonic() < deadline and not self._over():
            self._teleop.status = "connecting ..."
            self._draw()
            time.sleep(_PERIOD / 2)
        self._teleop.status = ""
        termios.tcflush(self._terminal, termios.TCIFLUSH)

    def _draw(self) -> None:
        size = os.get_terminal_size(self._terminal)
        if curses.is_term_resized(size.lines, size.columns):
            curses.resizeterm(size.lines, size.columns)
        height, width = self._screen.getmaxyx()
        lines = self._teleop.lines()
        has_room = height > len(self._help) + len(lines)
        if self._is_key_unknown:
            hint = "the keys are above" if has_room else "a larger window shows the keys"
            lines[-1] = f"no such key: the drone is stopped; {hint}"
        if not has_room:
            lines = [line for line in (lines[-1], *lines[:-1]) if line]  # the status comes first
        self._screen.erase()
        if has_room:
            self._write(0, self._help, width, curses.A_BOLD if self._is_key_unknown else curses.A_NORMAL)
        self._write(len(self._help) + 1 if has_room else 0, lines[:height], width, curses.A_NORMAL)
        self._screen.refresh()

    def _write(self, first: int, lines: list[str], width: int, attributes: int) -> None:
        for row, line in enumerate(lines, start=first):
            with contextlib.suppress(curses.error):  # the screen is too small for this line
                self._screen.addnstr(row, 0, line, width - 1, attributes)  # curses cannot fill the last corner


def _fly(over: Callable[[], bool]) -> None:
    teleop = Teleop()
    try:
        with contextlib.suppress(curses.error):  # the terminal is gone, so curses cannot restore it
            curses.wrapper(Screen(teleop, over).run)
    finally:
        teleop.stop()
        erase_line = (curses.tigetstr("el") or b"").decode()  # keys typed before the start may be on this line
        print(f"\r{erase_line}{_NAME}: {teleop.farewell}", flush=True)


def main() -> int:
    """Run the node until Escape, a signal, or the end of the terminal; return its exit status."""
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        print(f"{_NAME}: must run in a terminal, to read its keys", file=sys.stderr)
        return 1
    try:
        curses.setupterm()
    except curses.error as error:
        print(f"{_NAME}: TERM = '{os.environ.get('TERM', '')}': {error}", file=sys.stderr)
        return 1
    return run_tool(_NAME, _fly, _SIGNALS)
