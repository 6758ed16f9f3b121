"""The report's folder: index.html, a page per script, a file of figures per flight, and the files that all share.

    index.html  scripts/01-alice.html ...  flights/01-0.js ...  files/report.css, replay.js, ..., scene.js

Figures lie in JavaScript files, because a page from file:// may load those and no others; a page loads a flight's when
it is looked at. All text is escaped by the templates, or set as text.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np

from drone_sim.files import writing
from drone_sim.grading.flight_record import columns_of
from drone_sim.grading.outputs import by_script as naming
from drone_sim.grading.outputs.by_script import ScriptResults, by_script, criteria_of
from drone_sim.grading.outputs.html.scene import scene_of
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.offline import recording
from drone_sim.offline.recording import COLUMNS

_HERE = Path(__file__).parent
_SHARED = ("replay.js", "report.css", "view.js", "plots.js", "page.js", "index.js")  # first what makes it a report
_OURS = Path("files", "replay.js")  # a folder that has this holds a report
_MADE_ANEW = ("scripts", "flights", "files")
_SLUG = 40  # characters of a page's name
_MOST_ROWS = 6000  # five minutes of the usual step; longer flights are thinned
_DIGITS = 4  # after the point: 0.1 mm
_COLUMNS = (
    *("t", "x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "wz"),
    *("command_vx", "command_vy", "command_vz", "command_wz"),
    *("propeller1", "propeller2", "propeller3", "propeller4"),
)

Tables = Callable[[Result], Path | None]


class FlightEntry(NamedTuple):
    """A flight as its page shows it."""

    key: str  # in file names and links
    label: str
    result: Result
    figures: str  # the file, '' where the flight left no table
    note: str  # about the figures


class ScriptPage(NamedTuple):
    """A script's page."""

    file: str
    script: ScriptResults
    flights: tuple[FlightEntry, ...]


def check(folder: str | Path) -> None:
    """Raise ValueError or OSError, in one line, where no report may be written."""
    path = Path(folder)
    if path.is_dir():
        if any(path.iterdir()) and not (path / _OURS).is_file():
            raise ValueError(
                f"{folder}: holds other files than a report's; name an empty folder, or one that is not there"
            )
    elif path.exists():
        raise ValueError(f"{folder}: is a file; a report is a folder")
    elif not path.absolute().parent.is_dir():
        raise FileNotFoundError(f"{folder}: no such folder: {path.absolute().parent}")


def write(plan: Plan, results: Sequence[Result], tables: Tables, folder: str | Path) -> None:
    """Write the report; one that is there already is replaced.

    `tables` returns the table of a result's flight, as `fly --csv` writes it, or None where none was kept.
    Raises ValueError and OSError, in one line.
    """
    check(folder)
    path = Path(folder)
    for name in _MADE_ANEW:
        shutil.rmtree(path / name, ignore_errors=True)
        (path / name).mkdir(parents=True)
    for name in _SHARED:
        _write(path / "files" / name, (_HERE / "files" / name).read_text(encoding="utf-8"))
    _write(path / "files" / "scene.js", _assignment("scene", scene_of(plan.parameters().scene)))
    draw = _Drawing(plan, tables, path)
    pages = [draw.page(number, script) for number, script in enumerate(by_script(results), start=1)]
    templates = _templates()
    for page in pages:
        _render(templates, "script.html", path / page.file, plan=plan, page=page)
    _render(templates, "index.html", path / "index.html", plan=plan, pages=pages, criteria=criteria_of(results))


class _Drawing:
    """Writes the figures of the flights."""

    def __init__(self, plan: Plan, tables: Tables, folder: Path):
        """Draw flights of a `plan`, each from what `tables` returns for it, into the report's `folder`."""
        self._plan, self._tables, self._folder = plan, tables, folder

    def page(self, number: int, script: ScriptResults) -> ScriptPage:
        """Return a script's page; `number` is from 1."""
        flights = tuple(self._flight(f"{number:02}-{place}", result) for place, result in enumerate(script.flights))
        slug = re.sub("[^A-Za-z0-9_-]+", "_", Path(script.label).stem)[:_SLUG]
        return ScriptPage(f"scripts/{number:02}-{slug}.html", script, flights)

    def _flight(self, key: str, result: Result) -> FlightEntry:
        label, table = naming.flight_label(result), self._tables(result)
        figures = figures_of(table) if table is not None else Figures({}, "no table of this flight was kept")
        if not figures.columns:
            return FlightEntry(key, label, result, "", figures.note)
        marks = [
            {"name": name, "at": one.at}
            for name, one in naming.named_outcomes(result)
            if not one.passed and one.at is not None and math.isfinite(one.at)
        ]
        content = {**figures.columns, **self._own_scene(result), "marks": marks}
        file = f"flights/{key}.js"
        _write(self._folder / file, _assignment(f'flights["{key}"]', content))
        return FlightEntry(key, label, result, file, figures.note)

    def _own_scene(self, result: Result) -> dict[str, Any]:
        """Return the scene of a flight whose seed has moved objects."""
        if not (self._plan.spread.objects and result.seed):
            return {}
        return {"scene": scene_of(self._plan.parameters(result.seed).scene)}


def _assignment(name: str, value: Any) -> str:
    return f"report.{name} = {json.dumps(value, separators=(',', ':'), allow_nan=False)};\n"


def _templates() -> jinja2.Environment:
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(points=naming.points, figure=naming.figure, named=naming.named_outcomes)
    return templates


def _render(templates: jinja2.Environment, name: str, path: Path, **values: Any) -> None:
    text = templates.get_template(f"{name}.j2").render(**values)
    _write(path, text)


def _write(path: Path, text: str) -> None:
    """Write a file of the report. What is half written is written anew: nobody waits for the disk a thousand times."""
    with writing.naming(path):
        path.write_bytes(text.encode("utf-8", "replace"))  # a script's name need not be UTF-8


# ---- a flight's figures for the plots and the replay, out of its table


class Figures(NamedTuple):
    """Columns by name, as criteria have them, all equally long, or none; and what to say of them."""

    columns: dict[str, list[float]]
    note: str = ""


def figures_of(table: Path) -> Figures:
    """Return the figures of a table that `fly --csv` wrote; none, and why, where it cannot be read."""
    try:
        rows = _rows(table)
    except (OSError, recording.TableRefused) as error:
        return Figures({}, " ".join(str(error).split()))
    if not len(rows):
        return Figures({}, "nothing was flown")
    every = -(-len(rows) // _MOST_ROWS)
    thinned = columns_of(rows[::every])
    columns = {name: list(map(float, np.round(thinned[name], _DIGITS))) for name in _COLUMNS}
    first = f" of the first {len(rows)}" if len(rows) == recording.MAX_ROWS else ""
    return Figures(columns, f"one row in {every}{first} is shown" if every > 1 else "")


def _rows(table: Path) -> np.ndarray:
    """Return a table's rows (N, 22); numpy reads a good one ten times as fast. Raises what read_table does."""
    with open(table, encoding="utf-8", errors="replace") as file:
        is_ours = file.readline().rstrip("\n").split(",") == list(COLUMNS)
        lines = list(itertools.islice(file, recording.MAX_ROWS)) if is_ours else []
    if is_ours and not lines:
        return np.empty((0, len(COLUMNS)))
    with contextlib.suppress(ValueError):
        rows = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.empty((0, 0))
        if rows.shape[1] == len(COLUMNS) and (np.abs(rows) < recording.LARGEST).all():
            return rows
    return np.array(recording.read_table(table).rows)  # says what is wrong
