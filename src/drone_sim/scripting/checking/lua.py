"""Check of a Lua script: syntax and unknown names."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Collection, Iterator

from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.checking.findings import MOST, Finding, Known, not_defined

_ERROR = re.compile(r":(\d+): (.*)", re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w*")
# Long strings and comments, comments, strings. Each is matched as a whole, whatever it contains.
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
_HIDDEN = re.compile(r"\b(?:dofile|loadfile|loadstring|load|setfenv|_G|_ENV)\b")  # may define names out of sight
_FLAT = re.compile(r"(?<![\w.:])(sim[A-Z_]\w*)")
_CALL = re.compile(r"(?<![\w.:])([A-Za-z_]\w*)[ \t]*\(")
_BUILT_IN_LIST = """
    assert bit32 collectgarbage coroutine debug dofile error getfenv getmetatable io ipairs load loadfile loadstring
    math module next os package pairs pcall print printf rawequal rawget rawlen rawset require select setfenv
    setmetatable string table tonumber tostring type unpack utf8 xpcall _G _VERSION Matrix Vector Vector3 Vector4
    Matrix3x3 Matrix4x4 self
"""
_BUILT_IN = frozenset(_BUILT_IN_LIST.split())


def check_lua(text: str, known: Known, flat: Collection[str], syntax_error: str) -> list[Finding]:
    """Return the mistakes in a Lua script; `flat` are the API's V-REP 3.x names.

    `syntax_error` is the compiler's error message, '' for none.
    """
    if syntax_error:
        return [_syntax_finding(syntax_error)]
    code = _TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    defined = _defined_names(code)
    found = [
        *_attributes(code, known, defined - {match[1] for match in _REQUIRED.finditer(text)}),
        *_flat_names(code, flat, {*defined, *known, *PLUGINS}),
    ]
    if not (_HIDDEN.search(code) or {match[1] for match in _REQUIRE.finditer(text)} - {*known, *_BUILT_IN}):
        found += _calls(code, {*defined, *known, *PLUGINS, *flat, *_BUILT_IN})
    lines = _Lines(code)
    findings = {Finding(*lines.place(start), lines.place(end)[1], message) for start, end, message in found}
    return sorted(findings)[:MOST]


class _Lines:
    """Line and column of each index in a text."""

    def __init__(self, text: str):
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def place(self, index: int) -> tuple[int, int]:
        """Return line and column, both from 1."""
        line = bisect_right(self._starts, index)
        return line, index - self._starts[line - 1] + 1


def _syntax_finding(error: str) -> Finding:
    match = _ERROR.search(error)
    line, message = (int(match[1]), match[2]) if match else (1, error)
    return Finding(line, 1, 0, f"syntax error: {' '.join(message.split())}")


def _defined_names(code: str) -> set[str]:
    """Return every name that a script assigns anywhere, as a variable, a parameter or a field."""
    names: set[str] = set()
    for match in re.finditer(r"\b(?:local|for|function)\b([^=\n]*)", code):
        names.update(_NAME.findall(match[1]))
    for match in re.finditer(r"\bfunction\b[\w.: \t]*\(([^)]*)\)", code):
        names.update(_NAME.findall(match[1]))
    for match in re.finditer(r"([A-Za-z_][\w \t,.]*)=(?!=)", code):
        names.update(_NAME.findall(match[1]))
    return names - _KEYWORDS


def _attributes(code: str, known: Known, defined: set[str]) -> Iterator[tuple[int, int, str]]:
    for match in _ATTRIBUTE.finditer(code):
        module, name = match[1], match[2]
        if module in known and module not in defined and name not in known[module]:
            yield match.start(2), match.end(2), not_there(f"{module}.", name, known[module])


def _flat_names(code: str, flat: Collection[str], known: set[str]) -> Iterator[tuple[int, int, str]]:
    for match in _FLAT.finditer(code):
        if match[1] not in flat and match[1] not in known:
            yield match.start(1), match.end(1), not_there("", match[1], flat)


def _calls(code: str, known: set[str]) -> Iterator[tuple[int, int, str]]:
    """Yield calls of undefined functions, except those with names that begin with sim (see `_flat_names`)."""
    for match in _CALL.finditer(code):
        name = match[1]
        if name not in known and name not in _KEYWORDS and not name.startswith("sim"):
            yield match.start(1), match.end(1), not_defined(name, known)
