"""What config/drone.yaml says of its keys: the comments that stand beside them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

from drone_sim.files.resources import package_path

CONFIG = package_path() / "config" / "drone.yaml"

_ENTRY = re.compile(r"^( *)(\w+):(?: +((?:\"[^\"]*\"|\[.*?\]|\{.*?\}|[^#\s])*))?(?: *# *(.*))?$")
_MORE = re.compile(r"^ +# *(.*)$")


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


@lru_cache(maxsize=1)
def comments() -> Mapping[str, str]:
    """Return what config/drone.yaml says of each of its keys, by names with slashes."""
    return {row.name: row.comment for row in rows(CONFIG.read_text(encoding="utf-8"))}
