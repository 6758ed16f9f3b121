"""The folder of a report: the teacher's page, a folder per script, and a page for each pair of similar scripts.

    index.html  files/report.css, replay.js, ...  similar/1.html ...
    scripts/01-alice/index.html  scripts/01-alice/flights/0.js ...  scripts/01-alice/files/report.css, ..., scene.js
    scripts/01-alice/flights/0.html ...   the result card of a flight without a page around it, which the cockpit shows

A script's folder is complete, so that it can be given to the author. Figures are in JavaScript files, because a page
from file:// may load no other data; a page loads a flight's figures when the flight is shown. The templates escape all
text, and scripts set text only as text.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np

from drone_sim.files import writing
from drone_sim.files.containment import remove
from drone_sim.grading.flight_record import columns_of
from drone_sim.grading.outputs.html.charts import Chart, chart_of, scene_of
from drone_sim.grading.outputs.script_results import (
    ScriptResults,
    flight_label,
    format_figure,
    format_points,
    group_by_criterion,
    group_by_script,
    named_outcomes,
)
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Outcome, Result
from drone_sim.grading.submissions.similarity import find_similar, provided_sources
from drone_sim.message_text import escaped
from drone_sim.offline import recording
from drone_sim.offline.recording import COLUMNS

_HERE = Path(__file__).parent
_SHARED = ("replay.js", "report.css", "card.css", "view.js", "plots.js", "page.js", "index.js")  # the marker first
_MARKER = Path("files", "replay.js")  # exists in every folder of a report
_REPLACED_FOLDERS = ("scripts", "similar", "files")
_MAX_SLUG = 40  # characters of a folder's name
_BARS = 10
_MAX_ROWS = 6000  # five minutes with the usual time step; longer flights are thinned out
_DIGITS = 4  # after the point: 0.1 mm
_COLUMNS = (
    *("t", "x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "wz"),
    *("command_vx", "command_vy", "command_vz", "command_wz"),
    *("propeller1", "propeller2", "propeller3", "propeller4"),
)

Tables = Callable[[Result], Path | None]


class FlightEntry(NamedTuple):
    """A flight on its script's page."""

    key: str  # in file names and links
    label: str
    result: Result
    figures: str  # the file, '' if there is no table
    note: str  # about the figures
    rows: list[tuple[str, Outcome, Chart | None]]  # name, outcome and chart of each criterion
    hint: str  # what to try, '' if the flight passed


class ScriptPage(NamedTuple):
    file: str
    script: ScriptResults
    flights: tuple[FlightEntry, ...]
    rank: int  # from 1; equal for equal points


class SimilarPage(NamedTuple):
    file: str
    share: float
    pages: tuple[ScriptPage, ScriptPage]
    lines: tuple[list[tuple[str, bool]], list[tuple[str, bool]]]  # of each script, and whether both have it


def check(folder: str | Path) -> None:
    """Raise ValueError or OSError, in one line, if a report cannot be written there, or would overwrite other files."""
    path = Path(folder)
    if path.is_dir():
        if any(path.iterdir()) and not (path / _MARKER).is_file():
            raise ValueError(f"{folder}: has other files than those of a report; name an empty folder, or a new one")
    elif path.exists():
        raise ValueError(f"{folder}: is a file; a report is a folder")
    elif not path.absolute().parent.is_dir():
        raise FileNotFoundError(f"{folder}: no such folder: {path.absolute().parent}")


def write(
    plan: Plan,
    results: Sequence[Result],
    tables: Tables,
    folder: str | Path,
    names: Mapping[str, str] | None = None,
    sources: Mapping[str, str] | None = None,
) -> None:
    """Write a report, which replaces an existing one.

    `tables` returns the file with a result's table in the format of `fly --csv`, or None. `names` are as in
    group_by_script; `sources` are the sources of the scripts, which are compared with each other. Raises ValueError and
    OSError, in one line.
    """
    check(folder)
    path = Path(folder)
    for name in _REPLACED_FOLDERS:
        remove(path / name, within=path)
        (path / name).mkdir(parents=True)
    _write_shared_files(path / "files")
    scene = _assignment("scene", scene_of(plan.parameters().scene))
    templates = _templates()
    writer = _FlightWriter(plan, tables, path)
    scripts = group_by_script(results, names)
    pages = [writer.write_page(number, script, scripts) for number, script in enumerate(scripts, start=1)]
    for page in pages:
        own = (path / page.file).parent
        _write_shared_files(own / "files")
        _write(own / "files" / "scene.js", scene)
        _render(templates, "script.html", own / "index.html", plan=plan, page=page)
        for flight in page.flights:
            _render(templates, "card.html", own / "flights" / f"{flight.key}.html", flight=flight, script=page.script)
    similar_pages = _similar_pages(plan, pages, sources or {})
    for pair in similar_pages:
        _render(templates, "similar.html", path / pair.file, plan=plan, pair=pair)
    values = {
        "pages": sorted(pages, key=lambda page: page.rank),
        "criteria": group_by_criterion(results),
        "bars": _distribution(scripts),
        "similar_pages": similar_pages,
    }
    _render(templates, "index.html", path / "index.html", plan=plan, **values)


def _write_shared_files(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for name in _SHARED:
        _write(folder / name, (_HERE / "files" / name).read_text(encoding="utf-8"))


def _distribution(scripts: Sequence[ScriptResults]) -> list[tuple[str, int]]:
    """Return the label and the number of scripts of each tenth of the possible points."""
    possible = max((script.of for script in scripts), default=0.0) or 1.0
    tenths = [min(_BARS - 1, int(_BARS * script.points / possible)) for script in scripts]
    bounds = [format_points(possible * tenth / _BARS) for tenth in range(_BARS + 1)]
    return [(f"{bounds[tenth]} to {bounds[tenth + 1]}", tenths.count(tenth)) for tenth in range(_BARS)]


def _similar_pages(plan: Plan, pages: Sequence[ScriptPage], sources: Mapping[str, str]) -> list[SimilarPage]:
    by_name = {page.script.script: page for page in pages}
    similar_pages = []
    for number, pair in enumerate(find_similar(sources, provided_sources(plan)), start=1):
        both = pair.first, pair.second
        lines = []
        for name, marked in zip(both, pair.lines):
            texts = sources[name].removesuffix("\n").split("\n")  # as in find_similar: a form feed ends no line
            lines.append([(text.removesuffix("\r"), line in marked) for line, text in enumerate(texts, start=1)])
        first, second = (by_name[name] for name in both)
        similar_pages.append(SimilarPage(f"similar/{number}.html", pair.share, (first, second), (lines[0], lines[1])))
    return similar_pages


class _FlightWriter:
    """Writes the figures of flights into the folders of their scripts."""

    def __init__(self, plan: Plan, tables: Tables, folder: Path):
        """Write figures from the files that `tables` returns into the report's `folder`."""
        self._plan, self._tables, self._folder = plan, tables, folder

    def write_page(self, number: int, script: ScriptResults, scripts: Sequence[ScriptResults]) -> ScriptPage:
        """Write the flights of a script, and return its page; `number` counts all `scripts` from 1."""
        # The folder's name has the letters and digits of any language.
        name = re.sub(r"\.(py|lua)$", "", unicodedata.normalize("NFC", Path(script.label).name))
        marks = {"_", "-"} | {letter for letter in name if unicodedata.category(letter).startswith("M")}
        letters = (letter if letter.isalnum() or letter in marks else "_" for letter in name)
        own = f"scripts/{number:02}-{re.sub('_+', '_', ''.join(letters))[:_MAX_SLUG]}"
        (self._folder / own / "flights").mkdir(parents=True)
        flights = tuple(self._write_flight(own, str(key), result) for key, result in enumerate(script.flights))
        rank = 1 + sum(other.points > script.points for other in scripts)
        return ScriptPage(f"{own}/index.html", script, flights, rank)

    def _write_flight(self, own: str, key: str, result: Result) -> FlightEntry:
        label, table = flight_label(result), self._tables(result)
        figures = figures_of(table) if table is not None else Figures({}, {}, "no table of this flight was kept")
        hint = _hint(self._plan, result)
        rows: list[tuple[str, Outcome, Chart | None]]
        if not figures.columns:
            rows = [(name, outcome, None) for name, outcome in named_outcomes(result)]
            return FlightEntry(key, label, result, "", figures.note, rows, hint)
        scene = scene_of(self._plan.parameters(result.seed).scene)
        marks = [
            {"name": escaped(name), "at": outcome.at}
            for name, outcome in named_outcomes(result)
            if not outcome.passed and outcome.at is not None and math.isfinite(outcome.at)
        ]
        content = {**figures.columns, "marks": marks}
        if self._plan.spread.objects and result.seed:  # the seed has moved objects
            content["scene"] = scene
        file = f"flights/{key}.js"
        _write(self._folder / own / file, _assignment(f'flights["{key}"]', content))
        rows = [
            (name, outcome, chart_of(criterion, figures.flown, scene, None if outcome.passed else outcome.at))
            for criterion, (name, outcome) in zip(self._plan.criteria, named_outcomes(result))
        ]
        return FlightEntry(key, label, result, file, figures.note, rows, hint)


def _hint(plan: Plan, result: Result) -> str:
    """Return the hint of the failed criterion with the most points, '' if none failed; errors come first."""
    if result.troubles:
        return "Correct the error first; the criteria judge only what was flown before it."
    failed = [
        (outcome.of - outcome.points, criterion)
        for criterion, outcome in zip(plan.criteria, result.outcomes)
        if not outcome.passed
    ]
    return max(failed, key=lambda failure: failure[0])[1].hint if failed else ""


def _assignment(name: str, value: Any) -> str:
    return f"report.{name} = {json.dumps(value, separators=(',', ':'), allow_nan=False)};\n"


def _templates() -> jinja2.Environment:
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE / "templates"),
        autoescape=True,
        finalize=lambda value: escaped(value) if type(value) is str else value,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(points=format_points, figure=format_figure, named=named_outcomes)
    return templates


def _render(templates: jinja2.Environment, name: str, path: Path, **values: Any) -> None:
    text = templates.get_template(f"{name}.j2").render(**values)
    _write(path, text)


def _write(path: Path, text: str) -> None:
    """Write a file of the report without waiting for the disk: an incomplete report is written again anyway."""
    with writing.name_in_errors(path):
        path.write_bytes(text.encode("utf-8", "replace"))  # a script's name may not be UTF-8


class Figures(NamedTuple):
    """Columns of equal length for plots and replay, by their names in criteria, and a note about them."""

    columns: dict[str, list[float]]
    flown: dict[str, np.ndarray]  # all columns, not rounded
    note: str = ""


def figures_of(table: Path) -> Figures:
    """Return the figures of a table in the format of `fly --csv`; without columns if it cannot be read."""
    try:
        rows = _rows(table)
    except (OSError, recording.TableRefused) as error:
        return Figures({}, {}, " ".join(str(error).split()))
    if not len(rows):
        return Figures({}, {}, "nothing was flown")
    step = -(-len(rows) // _MAX_ROWS)
    values = columns_of(rows[::step])
    columns = {name: list(map(float, np.round(values[name], _DIGITS))) for name in _COLUMNS}
    first = f" of the first {len(rows)}" if len(rows) == recording.MAX_ROWS else ""
    return Figures(columns, values, f"one row in {step}{first} is shown" if step > 1 else "")


def _rows(table: Path) -> np.ndarray:
    """Return a table's rows (N, 22), by NumPy if possible, which is ten times as fast. Raises as read_table does."""
    with open(table, encoding="utf-8", errors="replace") as file:
        has_header = file.readline().rstrip("\n").split(",") == list(COLUMNS)
        lines = list(itertools.islice(file, recording.MAX_ROWS)) if has_header else []
    if has_header and not lines:
        return np.empty((0, len(COLUMNS)))
    with contextlib.suppress(ValueError):
        rows = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.empty((0, 0))
        if rows.shape[1] == len(COLUMNS) and (np.abs(rows) < recording.LARGEST).all():
            return rows
    return np.array(recording.read_table(table).rows)  # which raises an error that explains the fault
