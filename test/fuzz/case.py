"""What is tried, and what became of it: all that strategies, worker and runner share."""

from __future__ import annotations

from typing import Any, NamedTuple


class Case(NamedTuple):
    """Files, by name, and what to do with them; `data` is of plain Python types, and its meaning is the kind's."""

    kind: str
    files: dict[str, bytes]
    data: Any = None


class Answer(NamedTuple):
    """What became of a case. `fault` is empty where it was taken, or refused as it should be."""

    fault: str
    refusal: str = ""
    seconds: float = 0.0  # of the processor
    resident: int = 0  # bytes, afterwards
    busy: bool = False  # with what the case began, though it is over
