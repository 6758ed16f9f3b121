"""The report's folder: index.html, a page per script, a file of figures per flight, and the files that all share.

    index.html  scripts/01-alice.html ...  flights/01-0.js ...  files/report.css, replay.js, ..., scene.js

Figures lie in JavaScript files, because a page from file:// may load those and no others; a page loads a flight's when
it is looked at. All text is escaped by the templates, or set as text.
"""

from __future__ import annotations

import json
import math
import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jinja2

from drone_sim.grading.outputs import by_script as naming
from drone_sim.grading.outputs.by_script import ScriptResults, by_script, criteria_of
from drone_sim.grading.outputs.html.figures import Figures, figures_of
from drone_sim.grading.outputs.html.scene import scene_of
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Outcome, Result

_HERE = Path(__file__).parent
_SHARED = ("replay.js", "report.css", "view.js", "plots.js", "page.js", "index.js")  # first what makes it a report
_OURS = Path("files", "replay.js")  # a folder that has this holds a report
_MADE_ANEW = ("scripts", "flights", "files")
_SLUG = 40  # characters of a page's name

Tables = Callable[[Result], Path | None]


class Flight(NamedTuple):
    """A flight as its page shows it."""

    key: str  # in file names and links
    label: str
    result: Result
    figures: str  # the file, '' where the flight left no table
    note: str  # about the figures


class Page(NamedTuple):
    """A script's page."""

    file: str
    script: ScriptResults
    flights: tuple[Flight, ...]


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
        """Take what the flights are of, and where the figures belong."""
        self._plan, self._tables, self._folder = plan, tables, folder

    def page(self, number: int, script: ScriptResults) -> Page:
        """Return a script's page; `number` is from 1."""
        flights = tuple(self._flight(f"{number:02}-{place}", result) for place, result in enumerate(script.flights))
        slug = re.sub("[^A-Za-z0-9_-]+", "_", Path(script.label).stem)[:_SLUG]
        return Page(f"scripts/{number:02}-{slug}.html", script, flights)

    def _flight(self, key: str, result: Result) -> Flight:
        label, table = naming.flight_label(result), self._tables(result)
        figures = figures_of(table) if table is not None else Figures({}, "no table of this flight was kept")
        if not figures.columns:
            return Flight(key, label, result, "", figures.note)
        marks = [{"name": name, "at": one.at} for name, one in naming.named_outcomes(result) if _is_mark(one)]
        content = {**figures.columns, **self._own_scene(result), "marks": marks}
        file = f"flights/{key}.js"
        _write(self._folder / file, _assignment(f'flights["{key}"]', content))
        return Flight(key, label, result, file, figures.note)

    def _own_scene(self, result: Result) -> dict[str, Any]:
        """Return the scene of a flight whose seed has moved objects."""
        if not (self._plan.spread.objects and result.seed):
            return {}
        return {"scene": scene_of(self._plan.parameters(result.seed).scene)}


def _is_mark(outcome: Outcome) -> bool:
    return not outcome.passed and outcome.at is not None and math.isfinite(outcome.at)


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
    try:
        path.write_bytes(text.encode("utf-8", "replace"))  # a script's name need not be UTF-8
    except OSError as error:
        raise OSError(f"{path}: {error.strerror}") from None
