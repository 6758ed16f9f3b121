"""Which scripts of a class are alike: winnowing, as MOSS does it (Schleimer, Wilkerson, Aiken, SIGMOD 2003).

What counts is the order of the words of a program: names, numbers and texts that the author chose are all alike;
comments and spaces are ignored. A hash is made of every GRAM words in a row, and of every WINDOW hashes the smallest is
kept: two scripts with GRAM + WINDOW - 1 words in common share at least one. Similar scripts are no proof of copying.
"""

from __future__ import annotations

import contextlib
import itertools
import keyword
import re
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from drone_sim.files.resources import package_path
from drone_sim.grading.jobs.files import Unreadable, read
from drone_sim.grading.plan import Plan
from drone_sim.scripting.python.helpers import BUILT_IN

GRAM, WINDOW = 12, 8  # words, hashes
LEAST = 0.5  # the share from which two scripts are told of
_FEWEST = 8  # hashes in common
_MOST_PAIRS = 100
_LONGEST = 2**17  # characters of a submission that are looked at
_CLASS = 6  # scripts, from which on it counts as given what most of them have
_LUA = "end function local then elseif repeat until nil"
_KEPT = {*keyword.kwlist, *_LUA.split()}
_LONG = {  # comments and texts of many lines
    "python": (r"\#[^\n]*", r"\"\"\".*?(?:\"\"\"|\Z) | '''.*?(?:'''|\Z)"),
    "lua": (r"--\[\[.*?(?:\]\]|\Z) | --[^\n]*", r"\[\[.*?(?:\]\]|\Z)"),
}
_WORDS = {
    language: re.compile(
        rf"""(?P<nothing>\s+ | {comment}) | (?P<text>{text} | \"(?:\\.|[^\"\\\n])*\" | '(?:\\.|[^'\\\n])*')
        | (?P<number>\d[\w.]*) | (?P<name>(?<![.:])[^\W\d]\w*) | (?P<other>[^\W\d]\w*|.)""",
        re.DOTALL | re.VERBOSE,
    )
    for language, (comment, text) in _LONG.items()
}
_SAME = {"text": "''", "number": "0", "name": "x"}
Lines = frozenset[int]


class Pair(NamedTuple):
    """Two scripts: the share of the shorter one's hashes that both have, and their lines (from 1) with these."""

    first: str
    second: str
    share: float
    lines: tuple[Lines, Lines]


def given_by(plan: Plan) -> dict[str, str]:
    """Return what everybody begins with: the built-in scripts, the tutorial's, and `start` beside the plan."""
    folders = BUILT_IN, package_path() / "docs" / "tutorial"
    paths = [*(path for one in folders for path in one.rglob("*.*")), *plan.folder.glob("start.*")]
    return {str(path): source_of([path]) for path in paths if path.is_file()}


def source_of(paths: Iterable[Path]) -> str:
    """Return what scripts among files hold, one after the other, as far as it can be read."""
    found = ""
    for path in paths:
        if path.suffix in (".py", ".lua"):
            with contextlib.suppress(Unreadable):
                found += read(path, _LONGEST).decode(errors="replace")
    return found[:_LONGEST]


def similar(sources: Mapping[str, str], given: Mapping[str, str]) -> list[Pair]:
    """Return the pairs among programs, by the names of their files, that are alike, the most alike first.

    Code in a file that everybody was `given`, or in the scripts of more than half of a class, is ignored.
    """
    found = {name: _hashes(name, text) for name, text in sources.items()}
    common = {one for name, text in given.items() for one in _hashes(name, text)}
    if len(found) >= _CLASS:
        count = Counter(one for hashes in found.values() for one in hashes)
        common |= {one for one, number in count.items() if 2 * number > len(found)}
    own = {name: {one: lines for one, lines in hashes.items() if one not in common} for name, hashes in found.items()}
    pairs = (_pair(first, second, own) for first, second in itertools.combinations(own, 2))
    alike = sorted((one for one in pairs if one is not None), key=lambda one: -one.share)
    return alike[:_MOST_PAIRS]


def _pair(first: str, second: str, hashes: Mapping[str, Mapping[int, Lines]]) -> Pair | None:
    one, other = hashes[first], hashes[second]
    both = one.keys() & other.keys()
    if len(both) < max(_FEWEST, LEAST * min(len(one), len(other))):
        return None
    lines = [frozenset(itertools.chain(*(some[key] for key in both))) for some in (one, other)]
    return Pair(first, second, len(both) / min(len(one), len(other)), (lines[0], lines[1]))


def _hashes(name: str, text: str) -> dict[int, Lines]:
    """Return the hashes that are kept of a program, and the lines that each is of."""
    words = list(_words(text, "lua" if name.endswith(".lua") else "python"))
    grams = [words[place : place + GRAM] for place in range(len(words) - GRAM + 1)]
    hashes = [zlib.crc32(" ".join(word for word, _ in gram).encode(errors="replace")) for gram in grams]
    kept: dict[int, set[int]] = {}
    last = -1
    for start in range(max(1, len(hashes) - WINDOW + 1) if hashes else 0):
        window = hashes[start : start + WINDOW]
        place = start + len(window) - 1 - window[::-1].index(min(window))  # of equal ones the last
        if place != last:
            kept.setdefault(hashes[place], set()).update(line for _, line in grams[place])
            last = place
    return {one: frozenset(lines) for one, lines in kept.items()}


def _words(text: str, language: str) -> Iterator[tuple[str, int]]:
    """Give the words of a program, each with its line."""
    line = 1
    for found in _WORDS[language].finditer(text):
        kind, word = found.lastgroup or "other", found[0]
        if kind != "nothing":
            yield (word if word in _KEPT else _SAME.get(kind, word)), line
        line += word.count("\n")
