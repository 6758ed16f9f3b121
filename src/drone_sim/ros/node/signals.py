"""Signals that end a node, whatever they interrupt."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterable

import rospy

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def end_on_signals(signals: Iterable[int] = SIGNALS) -> None:
    """Have a signal shut the node down; call it in the main thread, after init_node with disable_signals.

    rospy's own handler does that within whatever the signal interrupts, and waits for ever for a lock that this holds:
    of a message that is being written, of the log, of a call to the master. Here CPython's handler in C writes to a
    pipe, and a thread that reads from it shuts down. SIGHUP stays ignored under nohup.
    """
    read, write = os.pipe()
    os.set_blocking(write, False)
    for number in signals:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _do_nothing)
    signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    threading.Thread(target=_wait, args=(read, set(signals)), name="signals", daemon=True).start()


def _do_nothing(*_: object) -> None:
    """Be a handler: of a signal without one nothing is written."""


def _wait(pipe: int, signals: set[int]) -> None:
    while not signals.intersection(os.read(pipe, 64)):
        pass
    # Not a daemon: the process does not end before the master knows.
    threading.Thread(target=rospy.signal_shutdown, args=("signal",), name="end").start()
