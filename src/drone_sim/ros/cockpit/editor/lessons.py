"""Lessons beside the editor: the sections of docs/tutorial.md and the README.md of each task.

Text for the browser only is in a comment, which other readers do not see; it replaces the text up to `end`:

    <!-- browser:
    Press **Run**.
    -->
    Start the launch file in a terminal.
    <!-- end -->

Both may also be within a line. In a lesson only controls and keys of the page are in bold.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drone_sim.files.resources import package_path, read_bytes
from drone_sim.grading import tasks
from drone_sim.ros.cockpit.editor.script_store import SOLUTIONS, ScriptFile

_MAX_SIZE = 1 << 20  # bytes of a text
_TUTORIAL = "docs/tutorial.md"
_HEADING = re.compile(r"^## (.+)$")
_FENCE = re.compile(r"^\s*(```|~~~)")
_SCRIPT = re.compile(r"^\*Script: \[[^\]]+\]\(tutorial/([^)]+)\)\*$", re.MULTILINE)
_NUMBER = re.compile(r"\d_")  # start of the file name of a stage's script
_LAUNCH = re.compile(r"drone\.launch script:=docs/tutorial/\S+ scene:=(\S+)")
# The text for the browser, and the text for other readers.
_ALTERNATIVE = re.compile(r"<!-- browser:\n?(.*?)\n?-->(.*?)<!-- end -->", re.DOTALL)
_CONSOLE = re.compile(r"^( *)```console\n(.*?)^ *```\n", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"^ *[12]\$ ")
_FLIGHT_RESULT = re.compile(r"^flew ([\d.]+ s) in .*?; ended at")
# A row of the table of tasks: name, what the script does, (what it needs,) difficulty, time.
_TASK_ROW = re.compile(r"^\| \[(\w+)\]\(\1/README\.md\) \| (.+?) \| .+ \| (\w+) \| ([^|]+) \|$", re.MULTILINE)
_PICTURE = re.compile(r"/(docs/pictures/(?:tutorial_\w+|cockpit_build)\.png|tasks/\w+/\w+\.png)")


@dataclass(frozen=True)
class Lesson:
    """A section of the tutorial, or a task."""

    name: str  # the section's anchor, such as stage-2-elevation; of a task tasks/hover
    title: str
    text: str  # Markdown
    folder: str  # in the package, to which links and pictures are relative
    script: str = ""  # name in the script store of the script that the lesson starts with
    scene: str = ""  # scene file of the section's command, in the package; '' for any scene
    summary: str = ""  # of a task: what the script does
    difficulty: str = ""  # of a task: easy, medium or hard
    time: str = ""  # that a task takes, such as 30 min

    @property
    def stem(self) -> str:
        """The file name of its script without extension; '' if it has none."""
        return Path(self.script).stem

    def is_begun_by(self, stem: str) -> bool:
        """Return whether a user's script with this stem continues the lesson's script, such as 2_elevation_mine."""
        return bool(self.stem) and f"{stem}_".startswith(f"{self.stem}_")

    @property
    def task(self) -> str:
        """The name of the task; '' for a section of the tutorial."""
        return self.name.partition("/")[2]


class Lessons:
    """All lessons, in reading order; none if the package has no docs."""

    def __init__(self, package: Path | None = None):
        """`package` is the folder with docs/ and tasks/; by default that of this package."""
        self._package = package or package_path()

    def all(self) -> list[Lesson]:
        return [*self._sections(), *self._tasks()]

    def find(self, name: object) -> Lesson | None:
        return next((lesson for lesson in self.all() if lesson.name == name), None)

    def of_script(self, script: ScriptFile) -> Lesson | None:
        """Return the lesson of a script; a user's script is found by its name, such as 2_elevation_mine.py.

        A stage in Lua belongs to the lesson of the same stage in Python; a solution, or a copy of one, to the stage
        with its number.
        """
        lessons = [lesson for lesson in self.all() if lesson.script]
        in_python = str(Path(script.name).with_suffix(".py"))
        shipped = next((lesson for lesson in lessons if lesson.script in (script.name, in_python)), None)
        if shipped or not (script.is_own or script.group == SOLUTIONS):
            return shipped
        stem = Path(script.file_name).stem
        stages = [lesson for lesson in lessons if _NUMBER.match(lesson.stem) and _NUMBER.match(stem)]
        same_number = next((lesson for lesson in stages if lesson.stem[0] == stem[0]), None)
        continued = [lesson for lesson in lessons if lesson.is_begun_by(stem)]
        return max(continued, key=lambda lesson: len(lesson.script), default=same_number)

    def picture(self, path: str) -> tuple[str, bytes] | None:
        """Return content type and content of a lesson's picture, by its path in the package; None if there is none."""
        if not _PICTURE.fullmatch(path):
            return None
        of_task = tasks.folders().get(path.split("/")[2]) if path.startswith("/tasks/") else None
        file = of_task / Path(path).name if of_task else self._package / path[1:]
        try:
            return "image/png", read_bytes(file, _MAX_SIZE)
        except (OSError, ValueError):
            return None

    def _sections(self) -> Iterator[Lesson]:
        for title, text in _split_sections(_read(self._package / _TUTORIAL)):
            script, scene = _SCRIPT.search(text), _LAUNCH.search(text)
            yield Lesson(
                name=re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-"),  # the anchor that GitHub generates
                title=title,
                text=_CONSOLE.sub(_command_output, _ALTERNATIVE.sub(lambda match: match[1], text)),
                folder="docs",
                script=f"tutorial/{script[1]}" if script else "",
                scene=str(self._package / scene[1]) if script and scene else "",
            )

    def _tasks(self) -> Iterator[Lesson]:
        """Yield the tasks in the order of the table in tasks/README.md, the easiest first, then those without a row."""
        rows = {row[0]: row[1:] for row in _TASK_ROW.findall(_read(self._package / "tasks/README.md"))}
        known = tasks.folders()
        for name in [*(name for name in rows if name in known), *(name for name in sorted(known) if name not in rows)]:
            text = _read(known[name] / "README.md")
            title = text.partition("\n")[0].removeprefix("# ").strip() or name
            script, described = f"tasks/{name}.py", rows.get(name, ("", "", ""))
            yield Lesson(f"tasks/{name}", title, text, f"tasks/{name}", script, "", *described)


def _split_sections(text: str) -> Iterator[tuple[str, str]]:
    """Yield title and text of each section; `##` inside a code block is no heading."""
    title, in_code = "", False
    lines: list[str] = []
    for line in text.splitlines():
        in_code ^= bool(_FENCE.match(line))
        heading = None if in_code else _HEADING.match(line)
        if heading:
            if title:
                yield title, "\n".join(lines)
            title, lines = heading[1], []
        lines.append(line)
    if title:
        yield title, "\n".join(lines)


def _command_output(block: re.Match[str]) -> str:
    """Return a code block with the output of the commands in `block`; '' if they print nothing."""
    lines = [_FLIGHT_RESULT.sub(r"after \1:", line) for line in block[2].splitlines() if not _COMMAND.match(line)]
    return "\n".join([f"{block[1]}```text", *lines, f"{block[1]}```", ""]) if lines else ""


def _read(path: Path) -> str:
    try:
        return read_bytes(path, _MAX_SIZE).decode("utf-8")
    except (OSError, ValueError):
        return ""
