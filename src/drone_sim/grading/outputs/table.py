"""The terminal's table: a row per script; of a single flight, a row per criterion."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from typing import TextIO

from drone_sim.grading.outputs.by_script import (
    ScriptResults,
    by_script,
    describe,
    flight_label,
    in_columns,
    named_outcomes,
    points,
)
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import printable

WIDTH = 80  # columns, where the output is no terminal
_SCRIPT = 28  # columns at most, of a script's name
_GREEN, _RED, _BOLD, _PLAIN = "\033[32m", "\033[31m", "\033[1m", "\033[0m"
_NARROWEST, _SENTENCE = 40, 12  # columns


def show(
    plan: Plan, results: Sequence[Result], file: TextIO | None = None, names: Mapping[str, str] | None = None
) -> None:
    """Print the table; in colour, and as wide as it is, on a terminal. `names` are as in by_script."""
    file = file or sys.stdout
    terminal = file.isatty()
    width = shutil.get_terminal_size((WIDTH, 24)).columns if terminal else WIDTH
    print(text(plan, results, max(_NARROWEST, width), terminal, names), file=file, flush=True)


def text(
    plan: Plan,
    results: Sequence[Result],
    width: int = WIDTH,
    colour: bool = False,
    names: Mapping[str, str] | None = None,
) -> str:
    """Return the table, lines of at most `width` columns."""
    paint = _Paint(colour)
    lines = [paint(_cut(plan.title or plan.name, width), _BOLD)]
    scripts = by_script(results, names)
    if len(scripts) == 1:
        lines += _flight_lines(scripts[0], width, paint)
    if len(scripts) != 1 or len(scripts[0].flights) > 1:
        lines += _script_lines(scripts, width, paint)
    return "\n".join(lines)


class _Paint:
    def __init__(self, on: bool):
        self._on = on

    def __call__(self, words: str, *styles: str) -> str:
        return f"{''.join(styles)}{words}{_PLAIN}" if self._on else words

    def verdict(self, words: str, passed: bool) -> str:
        return self(words, _GREEN if passed else _RED)


# ---- a row per script


def _script_lines(scripts: Sequence[ScriptResults], width: int, paint: _Paint) -> list[str]:
    if not scripts:
        return ["no flights"]
    name = min(_SCRIPT, max(6, *(len(printable(one.label)) for one in scripts)))
    rows = [(_fit(one.label, name), *_figures(one)) for one in scripts]
    heads, *starts = in_columns([("script", "passed", "points", "worst (seed)"), *rows], left=1)
    lines = [paint(_cut(f"{heads}  failed in (flights)", width), _BOLD)]
    for one, start in zip(scripts, starts):
        line = _cut(f"{start}  {_trouble(one)}".rstrip(), width)
        lines.append(paint.verdict(line, one.has_passed))
    done = sum(one.has_passed for one in scripts)
    if len(scripts) > 1:
        lines.append(f"{done} of {len(scripts)} scripts passed every flight")
    return lines


def _figures(one: ScriptResults) -> tuple[str, str, str]:
    worst = one.worst
    return (
        f"{one.passed}/{len(one.flights)}",
        f"{points(one.points)}/{points(one.of)}",
        f"{points(worst.points)} ({worst.seed})",
    )


def _trouble(one: ScriptResults) -> str:
    """Return what went wrong: an error first, then the criteria, the most frequent first."""
    failures = ", ".join(f"{printable(name)} {count}" for name, count in one.failures)
    return "; ".join(filter(None, (*map(printable, one.errors[:1]), failures)))


# ---- a row per criterion


def _flight_lines(script: ScriptResults, width: int, paint: _Paint) -> list[str]:
    result, flights = script.worst, len(script.flights)
    worst = f", the worst of {flights}" if flights > 1 else ""
    lines = [_cut(f"{script.label}, {flight_label(result)}{worst}", width)]
    for trouble in result.troubles:
        wrapped = textwrap.wrap(printable(f"error: {trouble}"), width)
        lines += [paint.verdict(line, False) for line in wrapped]
    named = named_outcomes(result)
    widest = min(_SCRIPT, max((len(printable(name)) for name, _ in named), default=0))
    for name, outcome in named:
        verdict = paint.verdict("ok  " if outcome.passed else "FAIL", outcome.passed)
        start = f"{_fit(name, widest).ljust(widest)}  {points(outcome.points):>4}/{points(outcome.of):<4}  "
        room = width - 8 - len(start)
        first, *others = textwrap.wrap(printable(describe(outcome)), max(room, _SENTENCE)) or [""]
        lines.append(f"  {verdict}  {start}{_cut(first, room)}".rstrip())
        lines += [f"{' ' * (8 + len(start))}{_cut(other, room)}" for other in others]
    lines.append(paint(f"{points(result.points)} of {points(result.of)} points", _BOLD))
    return lines


# ---- text of any kind in few columns


def _cut(words: str, width: int) -> str:
    words = printable(words)
    return words if len(words) <= width else f"{words[: width - 1]}…"


def _fit(name: str, width: int) -> str:
    """Return a name with both of its ends: the first says whose it is, the last what."""
    name = printable(name)
    if len(name) <= width:
        return name
    end = (width - 1) * 2 // 3
    return f"{name[: width - 1 - end]}…{name[-end:]}"
