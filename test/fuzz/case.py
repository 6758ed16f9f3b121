"""Types that strategies, worker and runner share: a case and its answer."""

from __future__ import annotations

from typing import Any, NamedTuple


class Case(NamedTuple):
    """Files by name, and further input; `data` has plain Python types, and each kind defines its meaning."""

    kind: str
    files: dict[str, bytes]
    data: Any = None


class Answer(NamedTuple):
    """Result of a case. `fault` is empty if the case was accepted, or refused correctly."""

    fault: str
    refusal: str = ""
    seconds: float = 0.0  # of processor time
    resident: int = 0  # bytes, afterwards
    busy: bool = False  # a thread that the case started is still busy
