"""The log of scripts: what they print, within limits."""

from __future__ import annotations

import logging
from typing import Any

from drone_sim.wording import encodable

LOG = logging.getLogger("drone_sim.script")
LOG.setLevel(logging.INFO)  # a script's print is wanted, whatever the level of the rest

LONGEST = 1000  # characters of a line
THREAD_GOES_ON = "{}: its thread goes on where it is: a coroutine cannot be brought back"
MOST = 500  # lines of one call of the script: of a phase, a callback, or its top level


class _Lines:
    def __init__(self) -> None:
        self.count = 0

    def say(self, text: str, level: int) -> None:
        self.count += 1
        if self.count <= MOST:
            shortened = text if len(text) <= LONGEST else text[:LONGEST] + "… (the rest of the line is left out)"
            LOG.log(level, "%s", encodable(shortened))

    def end(self) -> None:
        left_out, self.count = self.count - MOST, 0
        if left_out > 0:
            LOG.info("… %d lines left out: a call of the script may write %d", left_out, MOST)


lines = _Lines()  # of the call that is under way


def say(text: Any, level: int = logging.INFO) -> None:
    """Write a line to the log, or count it where there were too many in this call of the script."""
    lines.say(text if type(text) is str else shown(text), level)


def end_call() -> None:
    """Begin to count anew, after a call of the script; say how many lines were left out."""
    lines.end()


def shown(value: Any) -> str:
    """Return what str() returns, or a word on why it does not."""
    if type(value) is bytes:
        return value[: 4 * LONGEST].decode("utf-8", "replace")
    try:
        return str.__getitem__(str(value), slice(0, LONGEST + 1))
    except Exception as error:
        return f"a {type(value).__name__} that cannot be shown ({type(error).__name__})"
