"""The report's folder: the teacher's page, a folder per script, and a page for each two scripts that are alike.

    index.html  files/report.css, replay.js, ...  similar/1.html ...
    scripts/01-alice/index.html  scripts/01-alice/flights/0.js ...  scripts/01-alice/files/report.css, ..., scene.js

A script's folder is whole: it can be given to whoever wrote it. Figures lie in JavaScript files, because a page from
file:// may load those and no others; a page loads a flight's when it is looked at. All text is escaped by the
templates, or set as text.
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
from drone_sim.grading.outputs import by_script as naming
from drone_sim.grading.outputs.by_script import ScriptResults, by_script, criteria_of
from drone_sim.grading.outputs.html.scene import scene_of
from drone_sim.grading.plan import Plan
from drone_sim.grading.result import Result
from drone_sim.grading.submissions.similarity import given_by, similar
from drone_sim.message_text import escaped
from drone_sim.offline import recording
from drone_sim.offline.recording import COLUMNS

_HERE = Path(__file__).parent
_SHARED = ("replay.js", "report.css", "view.js", "plots.js", "page.js", "index.js")  # first what makes it a report
_OURS = Path("files", "replay.js")  # a folder that has this holds a report
_MADE_ANEW = ("scripts", "similar", "files")
_SLUG = 40  # characters of a folder's name
_BARS = 10
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
    rank: int  # from 1; of as many points the same


class Alike(NamedTuple):
    """Two scripts side by side."""

    file: str
    share: float
    pages: tuple[ScriptPage, ScriptPage]
    lines: tuple[list[tuple[str, bool]], list[tuple[str, bool]]]  # of each, and whether the other has it, too


class Bar(NamedTuple):
    """How many scripts have so many points."""

    said: str
    scripts: int


def check(folder: str | Path) -> None:
    """Raise ValueError or OSError, in one line, where no report may be written."""
    path = Path(folder)
    if path.is_dir():
        if any(path.iterdir()) and not (path / _OURS).is_file():
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
    """Write the report; one that is there already is replaced.

    `tables` returns the table of a result's flight, as `fly --csv` writes it, or None where none was kept. `names` are
    as in by_script; `sources` what the scripts hold, which are held against each other. Raises ValueError and OSError,
    in one line.
    """
    check(folder)
    path = Path(folder)
    for name in _MADE_ANEW:
        remove(path / name, within=path)
        (path / name).mkdir(parents=True)
    _lay_shared(path / "files")
    scene = _assignment("scene", scene_of(plan.parameters().scene))
    draw = _Drawing(plan, tables, path)
    scripts = by_script(results, names)
    pages = [draw.page(number, script, scripts) for number, script in enumerate(scripts, start=1)]
    templates = _templates()
    for page in pages:
        own = (path / page.file).parent
        _lay_shared(own / "files")
        _write(own / "files" / "scene.js", scene)
        _render(templates, "script.html", own / "index.html", plan=plan, page=page)
    alike = _alike(plan, pages, sources or {})
    for pair in alike:
        _render(templates, "similar.html", path / pair.file, plan=plan, pair=pair)
    made = {
        "pages": sorted(pages, key=lambda one: one.rank),
        "criteria": criteria_of(results),
        "bars": _distribution(scripts),
        "alike": alike,
    }
    _render(templates, "index.html", path / "index.html", plan=plan, **made)


def _lay_shared(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for name in _SHARED:
        _write(folder / name, (_HERE / "files" / name).read_text(encoding="utf-8"))


def _distribution(scripts: Sequence[ScriptResults]) -> list[Bar]:
    """Return how the points of a class are distributed, in tenths of the full points."""
    most = max((one.of for one in scripts), default=0.0) or 1.0
    tenths = [min(_BARS - 1, int(_BARS * one.points / most)) for one in scripts]
    bounds = [naming.points(most * tenth / _BARS) for tenth in range(_BARS + 1)]
    return [Bar(f"{bounds[tenth]} to {bounds[tenth + 1]}", tenths.count(tenth)) for tenth in range(_BARS)]


def _alike(plan: Plan, pages: Sequence[ScriptPage], sources: Mapping[str, str]) -> list[Alike]:
    by_name = {one.script.script: one for one in pages}
    found = []
    for number, pair in enumerate(similar(sources, given_by(plan)), start=1):
        both = pair.first, pair.second
        lines = [
            [(text, line in marked) for line, text in enumerate(_lines(sources[name]), start=1)]
            for name, marked in zip(both, pair.lines)
        ]
        first, second = (by_name[name] for name in both)
        found.append(Alike(f"similar/{number}.html", pair.share, (first, second), (lines[0], lines[1])))
    return found


def _lines(source: str) -> list[str]:
    """Return a script's lines, counted as `similar` counts them: a form feed ends none."""
    return [line.removesuffix("\r") for line in source.removesuffix("\n").split("\n")]


class _Drawing:
    """Writes the figures of the flights."""

    def __init__(self, plan: Plan, tables: Tables, folder: Path):
        """Draw flights of a `plan`, each from what `tables` returns for it, into the report's `folder`."""
        self._plan, self._tables, self._folder = plan, tables, folder

    def page(self, number: int, script: ScriptResults, scripts: Sequence[ScriptResults]) -> ScriptPage:
        """Return a script's page; `number` is from 1 among all `scripts`."""
        own = f"scripts/{number:02}-{_slug(script.label)}"
        (self._folder / own / "flights").mkdir(parents=True)
        flights = tuple(self._flight(own, str(place), result) for place, result in enumerate(script.flights))
        rank = 1 + sum(one.points > script.points for one in scripts)
        return ScriptPage(f"{own}/index.html", script, flights, rank)

    def _flight(self, own: str, key: str, result: Result) -> FlightEntry:
        label, table = naming.flight_label(result), self._tables(result)
        figures = figures_of(table) if table is not None else Figures({}, "no table of this flight was kept")
        if not figures.columns:
            return FlightEntry(key, label, result, "", figures.note)
        marks = [
            {"name": escaped(name), "at": one.at}
            for name, one in naming.named_outcomes(result)
            if not one.passed and one.at is not None and math.isfinite(one.at)
        ]
        content = {**figures.columns, **self._own_scene(result), "marks": marks}
        file = f"flights/{key}.js"
        _write(self._folder / own / file, _assignment(f'flights["{key}"]', content))
        return FlightEntry(key, label, result, file, figures.note)

    def _own_scene(self, result: Result) -> dict[str, Any]:
        """Return the scene of a flight whose seed has moved objects."""
        if not (self._plan.spread.objects and result.seed):
            return {}
        return {"scene": scene_of(self._plan.parameters(result.seed).scene)}


def _slug(label: str) -> str:
    """Return a name as that of a folder, with its letters and digits of any language."""
    name = re.sub(r"\.(py|lua)$", "", unicodedata.normalize("NFC", Path(label).name))
    marks = {"_", "-"} | {letter for letter in name if unicodedata.category(letter).startswith("M")}
    return re.sub("_+", "_", "".join(one if one.isalnum() or one in marks else "_" for one in name))[:_SLUG]


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
    templates.filters.update(points=naming.points, figure=naming.figure, named=naming.named_outcomes)
    return templates


def _render(templates: jinja2.Environment, name: str, path: Path, **values: Any) -> None:
    text = templates.get_template(f"{name}.j2").render(**values)
    _write(path, text)


def _write(path: Path, text: str) -> None:
    """Write a file of the report, without waiting for the disk each time: a report that is cut off is written anew."""
    with writing.name_in_errors(path):
        path.write_bytes(text.encode("utf-8", "replace"))  # a script's name need not be UTF-8


# ---- a flight's figures for the plots and the replay, out of its table


class Figures(NamedTuple):
    """Columns of equal length, by their names in criteria, or none; and a note about them."""

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
