"""What Lua tells of a script's variables, and of the lines that it reaches (variables.lua)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drone_sim.scripting.breakpoints import (
    LONGEST_NAME,
    LONGEST_VALUE,
    MOST_INSIDE,
    MOST_ROWS,
    Breakpoints,
    Row,
    Scope,
)

_FIELD, _ROW = "\x1f", "\x1e"
_LIMITS = {"most_rows": MOST_ROWS, "most_inside": MOST_INSIDE, "longest_value": LONGEST_VALUE}


def read_rows(text: bytes) -> list[Scope]:
    """Return the scopes that a text of rows has; what is sorted by chance in Lua is sorted by names here."""
    scopes: list[Scope] = []
    inside: list[Row] = []
    for one in reversed(text.decode("utf-8", "replace").split(_ROW)):
        depth, name, kind, value = (*one.split(_FIELD), "", "", "", "")[:4]
        if depth == "2":
            inside.append(Row(name[:LONGEST_NAME], kind, value))
        elif depth == "1":
            scopes = scopes or [Scope("", [])]
            scopes[-1].rows.append(Row(name[:LONGEST_NAME], kind, value, tuple(sorted(inside, key=_order))))
            inside = []
        elif depth == "0":
            scopes = [*(scopes or [Scope("", [])])]
            scopes[-1] = Scope(name, sorted(scopes[-1].rows))
            scopes.append(Scope("", []))
    return scopes[:-1][::-1]


def _order(row: Row) -> tuple[bool, float, str]:
    """Let the numbers of a list come first, in their order."""
    number = row.name[1:-1] if row.name[:1] == "[" else ""
    is_number = number.lstrip("-").isdigit()
    return not is_number, float(number) if is_number else 0.0, row.name


def bridge(
    breakpoints: Breakpoints, path_of: Callable[[str], str], known: Callable[[], Any]
) -> dict[str, Callable[..., Any] | int]:
    """Return what the Lua side needs: `path_of` returns the file of a chunk's name, `known` a table of names."""

    def reached(chunk: bytes, line: int, rows: bytes) -> None:
        breakpoints.reach(path_of(chunk.decode("utf-8", "replace")), int(line), lambda: read_rows(rows))

    return {**_LIMITS, "reached": reached, "is_first": lambda: breakpoints.reached is None, "known": known}
