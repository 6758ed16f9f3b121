"""What a check found, in one line, and how checks are run: none hangs, none shows a traceback."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from types import FrameType
from typing import NamedTuple

OK, HINT, WRONG = "ok", "hint", "WRONG"
_LONGEST = 400  # characters
_SOON = 1e-3  # s; 0 would be never


class Line(NamedTuple):
    """`mark` is OK, HINT (it works, but), or WRONG; `said` tells what is so and, unless it is well, what to do."""

    mark: str
    what: str
    said: str

    def __str__(self) -> str:
        """Return it as it is printed."""
        said = " ".join(self.said.split())
        return f"{self.mark:5}  {self.what:14}  {said[:_LONGEST]}"


Check = Callable[[], Iterable[Line]]


class _TooLongError(Exception):
    pass


def lines(what: str, check: Check, seconds: float) -> list[Line]:
    """Return what a check finds; where it fails or takes longer than `seconds` (real time), that. Main thread only."""
    try:
        with _limited(seconds):
            found = list(check())
    except _TooLongError:
        found = [Line(WRONG, what, f"no answer within {seconds:g} s")]
    except Exception as error:  # whatever is broken here is what the user wants to know
        found = [Line(WRONG, what, f"cannot be checked: {type(error).__name__}: {error}")]
    return found


@contextlib.contextmanager
def _limited(seconds: float) -> Iterator[None]:
    def expire(_number: int, _frame: FrameType | None) -> None:
        raise _TooLongError

    before = signal.signal(signal.SIGALRM, expire)
    left, again = signal.setitimer(signal.ITIMER_REAL, seconds)  # of a timer that somebody else has set
    began = time.monotonic()
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        if left:
            signal.setitimer(signal.ITIMER_REAL, max(left - (time.monotonic() - began), _SOON), again)
