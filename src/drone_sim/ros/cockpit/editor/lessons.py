"""The texts beside the editor: the tutorial's sections and the tasks, from the same files that are read on paper.

Where readers in the browser need another text, it stands in a comment, which is invisible to other readers:

    <!-- browser:
    Press **Run**.
    -->
    Start the launch file in a terminal.
    <!-- end -->

Both may also stand within a line. Controls and keys of the page are in bold there, and nothing else is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drone_sim.files.resources import package_path, read_bytes
from drone_sim.grading import tasks
from drone_sim.ros.cockpit.editor.script_store import SOLUTIONS, ScriptFile

_LARGEST = 1 << 20  # bytes of a text
_TUTORIAL = "docs/tutorial.md"
_HEADING = re.compile(r"^## (.+)$")
_FENCE = re.compile(r"^\s*(```|~~~)")
_SCRIPT = re.compile(r"^\*Script: \[[^\]]+\]\(tutorial/([^)]+)\)\*$", re.MULTILINE)
_NUMBER = re.compile(r"\d_")  # with which the name of a stage's script begins
_FLOWN = re.compile(r"drone\.launch script:=docs/tutorial/\S+ scene:=(\S+)")
# What the text says to who reads it in the browser, hidden from other readers, and what it says to those.
_ALTERNATIVE = re.compile(r"<!-- browser:\n?(.*?)\n?-->(.*?)<!-- end -->", re.DOTALL)
_CONSOLE = re.compile(r"^( *)```console\n(.*?)^ *```\n", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"^ *[12]\$ ")
_FLEW = re.compile(r"^flew ([\d.]+ s) in .*?; ended at")
_PICTURE = re.compile(r"/(docs/pictures/(?:tutorial_\w+|cockpit_build)\.png|tasks/\w+/\w+\.png)")


@dataclass(frozen=True)
class Lesson:
    """A section of the tutorial, or a task."""

    name: str  # the section's anchor, such as stage-2-elevation; of a task tasks/hover
    title: str
    text: str  # Markdown
    folder: str  # in the package, from which its links and pictures are seen
    script: str = ""  # what it begins with, as the script store names it
    scene: str = ""  # of a section: the scene file that its command flies in, in the package; '' is any

    @property
    def stem(self) -> str:
        """The name of its script, without kind and ending; '' without one."""
        return Path(self.script).stem

    def is_begun_by(self, stem: str) -> bool:
        """Tell whether a script of the user's with this name is a continuation of this text's script."""
        return bool(self.stem) and f"{stem}_".startswith(f"{self.stem}_")

    @property
    def task(self) -> str:
        """The name of the task, '' for the tutorial's."""
        return self.name.partition("/")[2]


class Lessons:
    """All texts, in the order in which they are read. A package without them has none."""

    def __init__(self, package: Path | None = None):
        """Read from `package`, the folder that holds docs/ and tasks/; None is this package's."""
        self._package = package or package_path()

    def all(self) -> list[Lesson]:
        """Return all that there are now."""
        return [*self._sections(), *self._tasks()]

    def find(self, name: object) -> Lesson | None:
        """Return the text of a name, None where there is none."""
        return next((one for one in self.all() if one.name == name), None)

    def of_script(self, script: ScriptFile) -> Lesson | None:
        """Return the text that a script belongs to: one of the user's by its name, such as 2_elevation_mine.py.

        A stage in Lua belongs to the text of the same stage in Python.

        A solution, or a copy of one, belongs to the stage of its number.
        """
        texts = [one for one in self.all() if one.script]
        in_python = str(Path(script.name).with_suffix(".py"))
        shipped = next((one for one in texts if one.script in (script.name, in_python)), None)
        if shipped or not (script.is_own or script.group == SOLUTIONS):
            return shipped
        stem = Path(script.file_name).stem
        stages = [one for one in texts if _NUMBER.match(one.stem) and _NUMBER.match(stem)]
        of_number = next((one for one in stages if one.stem[0] == stem[0]), None)
        begun = [one for one in texts if one.is_begun_by(stem)]
        return max(begun, key=lambda one: len(one.script), default=of_number)

    def picture(self, path: str) -> tuple[str, bytes] | None:
        """Return content type and content of a picture that a text shows, by its path in the package."""
        if not _PICTURE.fullmatch(path):
            return None
        try:
            return "image/png", read_bytes(self._package / path[1:], _LARGEST)
        except (OSError, ValueError):
            return None

    def _sections(self) -> Iterator[Lesson]:
        for title, text in _parted(_text(self._package / _TUTORIAL)):
            script, scene = _SCRIPT.search(text), _FLOWN.search(text)
            yield Lesson(
                name=_anchor(title),
                title=title,
                text=_for_the_browser(text),
                folder="docs",
                script=f"tutorial/{script[1]}" if script else "",
                scene=str(self._package / scene[1]) if script and scene else "",
            )

    def _tasks(self) -> Iterator[Lesson]:
        for name in tasks.names():
            text = _text(self._package / "tasks" / name / "README.md")
            title = text.partition("\n")[0].removeprefix("# ").strip() or name
            yield Lesson(f"tasks/{name}", title, text, f"tasks/{name}", f"tasks/{name}.py")


def _parted(text: str) -> Iterator[tuple[str, str]]:
    """Yield title and text of each section; headings inside code blocks do not count."""
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


def _for_the_browser(text: str) -> str:
    """Return a text for readers in the browser: without commands, but with what these print."""
    return _CONSOLE.sub(_printed, _ALTERNATIVE.sub(lambda found: found[1], text))


def _printed(block: re.Match[str]) -> str:
    """Return a block of what its commands print, '' where they print nothing."""
    lines = [_FLEW.sub(r"after \1:", line) for line in block[2].splitlines() if not _COMMAND.match(line)]
    return "\n".join([f"{block[1]}```text", *lines, f"{block[1]}```", ""]) if lines else ""


def _anchor(title: str) -> str:
    """Return the name by which a link leads to a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def _text(path: Path) -> str:
    try:
        return read_bytes(path, _LARGEST).decode("utf-8")
    except (OSError, ValueError):
        return ""
