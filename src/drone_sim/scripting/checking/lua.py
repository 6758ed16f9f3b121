"""Syntax and unknown names of a Lua script."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterator

from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.checking.findings import MOST, Finding, Known, not_defined

_ERROR = re.compile(r":(\d+): (.*)", re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w*")
# What is no code: long strings and comments, comments, strings. Each is matched once, whatever stands in it.
_TEXT = re.compile(
    r"--\[(=*)\[.*?(?:\]\1\]|\Z)|--[^\n]*|\[(=*)\[.*?(?:\]\2\]|\Z)|\"(?:\\.|[^\"\\\n])*\"?|'(?:\\.|[^'\\\n])*'?",
    re.DOTALL,
)
_KEYWORD_LIST = """
    and break do else elseif end false for function goto if in local nil not or repeat return then true until while
"""
_KEYWORDS = frozenset(_KEYWORD_LIST.split())
_ATTRIBUTE = re.compile(r"(?<![\w.:])(sim[A-Z]*\w*)[ \t]*\.[ \t]*([A-Za-z_]\w*)")
_REQUIRED = re.compile(r"(?<![\w.:])(sim[A-Z]*\w*)[ \t]*=[ \t]*require[ \t]*\(?[ \t]*['\"]\1(?:-[\w-]+)?['\"]")
_REQUIRE = re.compile(r"\brequire[ \t]*\(?[ \t]*['\"]([\w./-]+)['\"]")
_UNTOLD = re.compile(r"\b(?:dofile|loadfile|loadstring|load|setfenv|_G|_ENV)\b")  # which may give names values
_FLAT = re.compile(r"(?<![\w.:])(sim[A-Z_]\w*)")
_CALL = re.compile(r"(?<![\w.:])([A-Za-z_]\w*)[ \t]*\(")
_OWN_LIST = """
    assert bit32 collectgarbage coroutine debug dofile error getfenv getmetatable io ipairs load loadfile loadstring
    math module next os package pairs pcall print printf rawequal rawget rawlen rawset require select setfenv
    setmetatable string table tonumber tostring type unpack utf8 xpcall _G _VERSION Matrix Vector Vector3 Vector4
    Matrix3x3 Matrix4x4 self
"""
_OWN = frozenset(_OWN_LIST.split())


def check_lua(text: str, known: Known, flat: Collection[str], syntax_error: str) -> list[Finding]:
    """Return what is wrong with a Lua script; `flat` are the API's names of 3.x.

    `syntax_error` is what Lua says when it compiles the text, '' for nothing.
    """
    if syntax_error:
        return [_of_syntax(syntax_error)]
    code = _TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    given = _given_values(code)
    found = [
        *_attributes(code, known, given - {match[1] for match in _REQUIRED.finditer(text)}),
        *_flat_names(code, flat, {*given, *known, *PLUGINS}),
    ]
    if not (_UNTOLD.search(code) or {match[1] for match in _REQUIRE.finditer(text)} - {*known, *_OWN}):
        found += _calls(code, {*given, *known, *PLUGINS, *flat, *_OWN})
    lines = _Lines(code)
    findings = {Finding(*lines.place(start), lines.place(end)[1], said) for start, end, said in found}
    return sorted(findings)[:MOST]


class _Lines:
    """Lines and columns of places in a text."""

    def __init__(self, text: str):
        self._starts = [0, *(one.end() for one in re.finditer("\n", text))]

    def place(self, at: int) -> tuple[int, int]:
        """Return line and column, both from 1."""
        line = bisect_right(self._starts, at)
        return line, at - self._starts[line - 1] + 1


def _of_syntax(error: str) -> Finding:
    match = _ERROR.search(error)
    line, said = (int(match[1]), match[2]) if match else (1, error)
    return Finding(line, 1, 0, f"syntax error: {' '.join(said.split())}")


def _given_values(code: str) -> set[str]:
    """Return every name that a script gives a value to somewhere, be it as a local, a parameter or a field."""
    names: set[str] = set()
    for match in re.finditer(r"\b(?:local|for|function)\b([^=\n]*)", code):
        names.update(_NAME.findall(match[1]))
    for match in re.finditer(r"\bfunction\b[\w.: \t]*\(([^)]*)\)", code):
        names.update(_NAME.findall(match[1]))
    for match in re.finditer(r"([A-Za-z_][\w \t,.]*)=(?!=)", code):
        names.update(_NAME.findall(match[1]))
    return names - _KEYWORDS


def _attributes(code: str, known: Known, given: set[str]) -> Iterator[tuple[int, int, str]]:
    for match in _ATTRIBUTE.finditer(code):
        module, name = match[1], match[2]
        if module in known and module not in given and name not in known[module]:
            yield match.start(2), match.end(2), not_there(f"{module}.", name, known[module])


def _flat_names(code: str, flat: Collection[str], there: set[str]) -> Iterator[tuple[int, int, str]]:
    for match in _FLAT.finditer(code):
        if match[1] not in flat and match[1] not in there:
            yield match.start(1), match.end(1), not_there("", match[1], flat)


def _calls(code: str, there: set[str]) -> Iterator[tuple[int, int, str]]:
    """Yield calls of functions that are not defined; names that begin with sim are reported elsewhere."""
    for match in _CALL.finditer(code):
        name = match[1]
        if name not in there and name not in _KEYWORDS and not name.startswith("sim"):
            yield match.start(1), match.end(1), not_defined(name, there)
