#!/usr/bin/env python3
"""Write the table of parameters in docs/interface.md, from config/drone.yaml: its keys, values and comments."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
PAGE, CONFIG = ROOT / "docs/interface.md", ROOT / "config/drone.yaml"
BEGIN, END = "<!-- parameters: begin -->\n", "<!-- parameters: end -->\n"

_ENTRY = re.compile(r"^( *)(\w+):(?: +((?:\"[^\"]*\"|\[.*?\]|\{.*?\}|[^#\s])*))?(?: *# *(.*))?$")
_MORE = re.compile(r"^ +# *(.*)$")
_CAMERA = re.compile(r"^cameras/(\w+)/")


class Row(NamedTuple):
    """A parameter: its name with slashes, its default as the file writes it, what the file says of it."""

    name: str
    default: str
    comment: str


def rows(text: str) -> Iterator[Row]:
    """Yield the parameters of a file such as config/drone.yaml."""
    found: list[list[str]] = []
    above: list[tuple[int, str]] = []
    for line in text.splitlines():
        entry, more = _ENTRY.match(line), _MORE.match(line)
        if entry:
            indent, key, value, comment = len(entry[1]), entry[2], entry[3] or "", entry[4] or ""
            above = [(depth, name) for depth, name in above if depth < indent]
            found.append(["/".join([*(name for _, name in above), key]), value, comment])
            above.append((indent, key))
        elif more and found:
            found[-1][2] += f" {more[1]}"
    groups = {name.rpartition("/")[0] for name, _, _ in found}
    return (Row(*one) for one in found if one[0] not in groups)


def table() -> str:
    """Return the table. Of the cameras, which are all of one kind, the keys that the first has stand for all."""
    lines, cameras = ["| parameter | default | |", "|---|---|---|"], set()
    for name, default, comment in rows(CONFIG.read_text(encoding="utf-8")):
        camera = _CAMERA.match(name)
        if camera:
            key = name[camera.end() :]
            if key in cameras:
                continue
            cameras.add(key)
            name = f"cameras/{camera[1]}/{key}"
        cells = (f"`{name}`", f"`{default}`" if default else "", comment.replace("|", "\\|").replace("<", "&lt;"))
        lines.append(f"| {' | '.join(cells)} |".replace("|  |", "| |"))
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """Return the page with the table in its place."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}{table()}{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
