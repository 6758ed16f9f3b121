"""The table in the terminal: a row per script; for a single script, also a row per criterion of its worst flight."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from typing import TextIO

from drone_sim.grading.outputs.script_results import (
    ScriptResults,
    align_columns,
    describe,
    flight_label,
    format_points,
    group_by_script,
    named_outcomes,
)
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.message_text import printable

WIDTH = 80  # columns, if the output is not a terminal
_MAX_NAME = 28  # columns
_GREEN, _RED, _BOLD, _PLAIN = "\033[32m", "\033[31m", "\033[1m", "\033[0m"
_MIN_WIDTH, _MIN_SENTENCE = 40, 12  # columns


def show(
    plan: Plan, results: Sequence[Result], file: TextIO | None = None, names: Mapping[str, str] | None = None
) -> None:
    """Print the table, on a terminal in colour and with its width. `names` are as in group_by_script."""
    file = file or sys.stdout
    terminal = file.isatty()
    width = shutil.get_terminal_size((WIDTH, 24)).columns if terminal else WIDTH
    print(text(plan, results, max(_MIN_WIDTH, width), terminal, names), file=file, flush=True)


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
    scripts = group_by_script(results, names)
    if len(scripts) == 1:
        lines += _flight_lines(scripts[0], width, paint)
    if len(scripts) != 1 or len(scripts[0].flights) > 1:
        lines += _script_lines(scripts, width, paint)
    return "\n".join(lines)


class _Paint:
    def __init__(self, has_colour: bool):
        self._has_colour = has_colour

    def __call__(self, text: str, style: str) -> str:
        return f"{style}{text}{_PLAIN}" if self._has_colour else text

    def verdict(self, text: str, passed: bool) -> str:
        return self(text, _GREEN if passed else _RED)


def _script_lines(scripts: Sequence[ScriptResults], width: int, paint: _Paint) -> list[str]:
    if not scripts:
        return ["no flights"]
    name = min(_MAX_NAME, max(6, *(len(printable(script.label)) for script in scripts)))
    rows = [
        (
            _shorten(script.label, name),
            f"{script.passed}/{len(script.flights)}",
            f"{format_points(script.points)}/{format_points(script.of)}",
            f"{format_points(script.worst.points)} ({script.worst.seed})",
        )
        for script in scripts
    ]
    heads, *starts = align_columns([("script", "passed", "points", "worst (seed)"), *rows], left=1)
    lines = [paint(_cut(f"{heads}  failed in (flights)", width), _BOLD)]
    for script, start in zip(scripts, starts):
        criteria = ", ".join(f"{printable(name)} {count}" for name, count in script.failures)
        failures = "; ".join(filter(None, (*map(printable, script.errors[:1]), criteria)))
        line = _cut(f"{start}  {failures}".rstrip(), width)
        lines.append(paint.verdict(line, script.has_passed))
    if len(scripts) > 1:
        passed = sum(script.has_passed for script in scripts)
        lines.append(f"{passed} of {len(scripts)} scripts passed every flight")
    return lines


def _flight_lines(script: ScriptResults, width: int, paint: _Paint) -> list[str]:
    result, flights = script.worst, len(script.flights)
    worst = f", the worst of {flights}" if flights > 1 else ""
    lines = [_cut(f"{script.label}, {flight_label(result)}{worst}", width)]
    for trouble in result.troubles:
        wrapped = textwrap.wrap(printable(f"error: {trouble}"), width)
        lines += [paint.verdict(line, False) for line in wrapped]
    named = named_outcomes(result)
    widest = min(_MAX_NAME, max((len(printable(name)) for name, _ in named), default=0))
    for name, outcome in named:
        verdict = paint.verdict("ok  " if outcome.passed else "FAIL", outcome.passed)
        score = f"{format_points(outcome.points):>4}/{format_points(outcome.of):<4}"
        start = f"{_shorten(name, widest).ljust(widest)}  {score}  "
        room = width - 8 - len(start)
        first, *others = textwrap.wrap(printable(describe(outcome)), max(room, _MIN_SENTENCE)) or [""]
        lines.append(f"  {verdict}  {start}{_cut(first, room)}".rstrip())
        lines += [f"{' ' * (8 + len(start))}{_cut(other, room)}" for other in others]
    lines.append(paint(f"{format_points(result.points)} of {format_points(result.of)} points", _BOLD))
    return lines


def _cut(text: str, width: int) -> str:
    text = printable(text)
    return text if len(text) <= width else f"{text[: width - 1]}…"


def _shorten(name: str, width: int) -> str:
    """Return a name without its middle: the beginning often names the author, the end the file."""
    name = printable(name)
    if len(name) <= width:
        return name
    end = (width - 1) * 2 // 3
    return f"{name[: width - 1 - end]}…{name[-end:]}"
