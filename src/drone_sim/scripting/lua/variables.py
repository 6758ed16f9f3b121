"""Variables and breakpoints of Lua scripts, as reported by variables.lua."""

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
    """Return the scopes encoded in a text, with their rows sorted by name, because Lua's order is random."""
    scopes: list[Scope] = []
    inside: list[Row] = []
    for row in reversed(text.decode("utf-8", "replace").split(_ROW)):
        depth, name, kind, value = (*row.split(_FIELD), "", "", "", "")[:4]
        if depth == "2":
            inside.append(Row(name[:LONGEST_NAME], kind, value))
        elif depth == "1":
            scopes = scopes or [Scope("", [])]
            scopes[-1].rows.append(Row(name[:LONGEST_NAME], kind, value, tuple(sorted(inside, key=_sort_key))))
            inside = []
        elif depth == "0":
            scopes = [*(scopes or [Scope("", [])])]
            scopes[-1] = Scope(name, sorted(scopes[-1].rows))
            scopes.append(Scope("", []))
    return scopes[:-1][::-1]


def _sort_key(row: Row) -> tuple[bool, float, str]:
    """Return a sort key: first the indices of lists, by number, then names."""
    number = row.name[1:-1] if row.name[:1] == "[" else ""
    is_number = number.lstrip("-").isdigit()
    return not is_number, float(number) if is_number else 0.0, row.name


def bridge(
    breakpoints: Breakpoints, path_of: Callable[[str], str], known: Callable[[], Any]
) -> dict[str, Callable[..., Any] | int]:
    """Return the functions and limits that variables.lua calls and uses.

    `path_of` returns the file of a chunk, `known` a Lua table of API names.
    """

    def reached(chunk: bytes, line: int, rows: bytes) -> None:
        breakpoints.reach(path_of(chunk.decode("utf-8", "replace")), int(line), lambda: read_rows(rows))

    return {**_LIMITS, "reached": reached, "is_first": lambda: breakpoints.reached is None, "known": known}
