"""Search for similar scripts in a class by winnowing, as in MOSS (Schleimer, Wilkerson, Aiken, SIGMOD 2003).

A program is compared as a sequence of tokens, in which all names, numbers and texts are equal, and comments and spaces
are ignored. Every GRAM consecutive tokens give a hash, and of every WINDOW hashes the smallest is kept: two scripts
with GRAM + WINDOW - 1 tokens in common share at least one hash. Similar scripts are no proof of copying.
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

GRAM, WINDOW = 12, 8  # tokens, hashes
MIN_SHARE = 0.5  # of common hashes in a reported pair
_MIN_COMMON = 8  # hashes
_MAX_PAIRS = 100
_MAX_LENGTH = 2**17  # characters of a submission that are compared
_MIN_CLASS = 6  # scripts; in a smaller class, code of most scripts is not ignored
_LUA_KEYWORDS = "end function local then elseif repeat until nil"
_KEYWORDS = {*keyword.kwlist, *_LUA_KEYWORDS.split()}
_COMMENTS_AND_LONG_TEXTS = {  # patterns of comments and of texts with several lines
    "python": (r"\#[^\n]*", r"\"\"\".*?(?:\"\"\"|\Z) | '''.*?(?:'''|\Z)"),
    "lua": (r"--\[\[.*?(?:\]\]|\Z) | --[^\n]*", r"\[\[.*?(?:\]\]|\Z)"),
}
_TOKENS = {
    language: re.compile(
        rf"""(?P<ignored>\s+ | {comment}) | (?P<text>{text} | \"(?:\\.|[^\"\\\n])*\" | '(?:\\.|[^'\\\n])*')
        | (?P<number>\d[\w.]*) | (?P<name>(?<![.:])[^\W\d]\w*) | (?P<other>[^\W\d]\w*|.)""",
        re.DOTALL | re.VERBOSE,
    )
    for language, (comment, text) in _COMMENTS_AND_LONG_TEXTS.items()
}
_REPLACEMENTS = {"text": "''", "number": "0", "name": "x"}
Lines = frozenset[int]


class Pair(NamedTuple):
    """Two similar scripts: the common share of the shorter one's hashes, and the lines (from 1) with common hashes."""

    first: str
    second: str
    share: float
    lines: tuple[Lines, Lines]


def provided_sources(plan: Plan) -> dict[str, str]:
    """Return the sources that all students have: the built-in scripts, the tutorial's, and `start` beside the plan."""
    folders = BUILT_IN, package_path() / "docs" / "tutorial"
    paths = [*(path for folder in folders for path in folder.rglob("*.*")), *plan.folder.glob("start.*")]
    return {str(path): source_of([path]) for path in paths if path.is_file()}


def source_of(paths: Iterable[Path]) -> str:
    """Return the concatenated sources of the readable scripts among some files."""
    source = ""
    for path in paths:
        if path.suffix in (".py", ".lua"):
            with contextlib.suppress(Unreadable):
                source += read(path, _MAX_LENGTH).decode(errors="replace")
    return source[:_MAX_LENGTH]


def find_similar(sources: Mapping[str, str], provided: Mapping[str, str]) -> list[Pair]:
    """Return the similar pairs among programs, whose sources are given by file names, the most similar first.

    Code of the files `provided` to everybody, or of more than half of the scripts of a class, is ignored.
    """
    programs = {name: _hashes(name, text) for name, text in sources.items()}
    ignored = {value for name, text in provided.items() for value in _hashes(name, text)}
    if len(programs) >= _MIN_CLASS:
        count = Counter(value for hashes in programs.values() for value in hashes)
        ignored |= {value for value, number in count.items() if 2 * number > len(programs)}
    own = {
        name: {value: lines for value, lines in hashes.items() if value not in ignored}
        for name, hashes in programs.items()
    }
    pairs = (_compare(first, second, own) for first, second in itertools.combinations(own, 2))
    return sorted((pair for pair in pairs if pair is not None), key=lambda pair: -pair.share)[:_MAX_PAIRS]


def _compare(first: str, second: str, hashes: Mapping[str, Mapping[int, Lines]]) -> Pair | None:
    both = hashes[first], hashes[second]
    common, shorter = both[0].keys() & both[1].keys(), min(map(len, both))
    if len(common) < max(_MIN_COMMON, MIN_SHARE * shorter):
        return None
    lines = [frozenset(itertools.chain(*(lines_of[key] for key in common))) for lines_of in both]
    return Pair(first, second, len(common) / shorter, (lines[0], lines[1]))


def _hashes(name: str, text: str) -> dict[int, Lines]:
    """Return the hashes of a program that winnowing keeps, with the lines of each."""
    tokens = list(_tokens(text, "lua" if name.endswith(".lua") else "python"))
    grams = [tokens[index : index + GRAM] for index in range(len(tokens) - GRAM + 1)]
    hashes = [zlib.crc32(" ".join(token for token, _ in gram).encode(errors="replace")) for gram in grams]
    kept: dict[int, set[int]] = {}
    last = -1
    for start in range(max(1, len(hashes) - WINDOW + 1) if hashes else 0):
        window = hashes[start : start + WINDOW]
        index = start + len(window) - 1 - window[::-1].index(min(window))  # the last of equal hashes
        if index != last:
            kept.setdefault(hashes[index], set()).update(line for _, line in grams[index])
            last = index
    return {value: frozenset(lines) for value, lines in kept.items()}


def _tokens(text: str, language: str) -> Iterator[tuple[str, int]]:
    line = 1
    for match in _TOKENS[language].finditer(text):
        kind, token = match.lastgroup or "other", match[0]
        if kind != "ignored":
            yield (token if token in _KEYWORDS else _REPLACEMENTS.get(kind, token)), line
        line += token.count("\n")
