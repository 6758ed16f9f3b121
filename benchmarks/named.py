"""What there is to be measured, by name."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks import cockpit, fleet, grade, lockstep, loop, node, phases, remote, render, start
from benchmarks.cores import one_core

Row = dict[str, Any]


def _in_a_folder(measure: Callable[[Path], list[Row]]) -> Callable[[], list[Row]]:
    def measured() -> list[Row]:
        with tempfile.TemporaryDirectory() as folder, one_core():
            return measure(Path(folder))

    return measured


BENCHMARKS: dict[str, Callable[[], list[Row]]] = {
    "render": _in_a_folder(render.compare),
    "growth": _in_a_folder(render.growth),
    "loop": loop.compare,
    "phases": phases.measure,
    "start": start.measure,
    "node": node.measure,
    "lockstep": lockstep.measure,
    "fleet": fleet.measure,
    "remote": remote.measure,
    "grade": grade.measure,
    "cockpit": cockpit.measure,
}


def measured(name: str) -> list[Row]:
    """Return one benchmark's rows. It stands here, for another process does not find what `__main__` defines."""
    return BENCHMARKS[name]()
