"""Log of the lines that scripts print, limited in number and length."""

from __future__ import annotations

import logging
from typing import Any

from drone_sim.message_text import encodable

LOG = logging.getLogger("drone_sim.script")
LOG.setLevel(logging.INFO)  # scripts' prints are shown whatever the level of the rest

LONGEST = 1000  # characters of a line
THREAD_GOES_ON = "{}: its thread continues where it is now, because a coroutine cannot be restored"
MOST = 500  # lines in one call of the script: a phase, a callback, or its top level


class Lines:
    """Number of lines written in the current call."""

    count = 0


def say(text: Any, level: int = logging.INFO) -> None:
    """Write a line to the log, unless there were too many in this call of the script."""
    Lines.count += 1
    if Lines.count <= MOST:
        line = text if type(text) is str else shown(text)
        shortened = line if len(line) <= LONGEST else line[:LONGEST] + "… (the rest of the line is left out)"
        LOG.log(level, "%s", encodable(shortened))


def log_failure(error: Exception) -> None:
    """Log an error after which a script is not called any more, while the simulation continues."""
    LOG.error("%s; this script is no longer called", error)


def end_call() -> None:
    """Reset the count after a call of the script, and log how many lines were left out."""
    left_out, Lines.count = Lines.count - MOST, 0
    if left_out > 0:
        LOG.info("… %d lines were left out: one call of the script may write at most %d", left_out, MOST)


def shown(value: Any) -> str:
    """Return str() of a value, shortened, or a text that names the type if str() fails."""
    if type(value) is bytes:
        return value[: 4 * LONGEST].decode("utf-8", "replace")
    try:
        return str.__getitem__(str(value), slice(0, LONGEST + 1))
    except Exception as error:
        return f"a {type(value).__name__} that cannot be shown ({type(error).__name__})"
