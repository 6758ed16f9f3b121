"""What is said of a file that cannot be read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class VrepFileError(ValueError):
    """A V-REP file is refused; the message is one line that says what is wrong, and where."""


@contextmanager
def within(where: str) -> Iterator[None]:
    """Put the place before what is said of a file."""
    try:
        yield
    except VrepFileError as error:
        raise VrepFileError(f"{where}: {error}") from None
