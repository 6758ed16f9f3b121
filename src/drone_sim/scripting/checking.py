"""Static checks of scripts: syntax, unknown names and misspelt phases.

As a program, it reads a request and writes its findings as a line of JSON each, until its input ends. It is a separate
process because a script may make a compiler of Python or Lua hang; its client ends it after a time.
"""

from __future__ import annotations

import ast
import builtins
import difflib
import json
import re
import resource
import symtable
import sys
import warnings
from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

from drone_sim.scripting import phase_names
from drone_sim.scripting.api.calls import contents, flat_name
from drone_sim.scripting.api.listing import apis
from drone_sim.scripting.api.unknown import PLUGINS, not_there

LARGEST = 1 << 18  # bytes of a script
MOST = 100  # findings
_MEMORY = 2 << 30  # bytes
_NEAR = 0.75  # least ratio of difflib

Known = Mapping[str, Collection[str]]  # names in each module of the API


class Finding(NamedTuple):
    """A mistake in a script: line and first column (from 1), column after the last one (0: end of line), a sentence."""

    line: int
    column: int
    end: int
    said: str  # the name in the cockpit's page
    severity: str = "error"  # or "warning"


def not_defined(name: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(name, sorted(known), cutoff=_NEAR)
    return f"'{name}' is not defined{'; near names are ' if near else ''}{', '.join(near)}"


# ---- Python

_PROVIDED = frozenset(("self", "require", "print", "__file__", "__name__", "__builtins__", "__doc__"))
_HIDING = frozenset(("exec", "eval", "globals"))  # may define names that the text does not show


def check_python(text: str, known: Known) -> list[Finding]:
    """Return the mistakes in a Python script; `known` are the names in each API module."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text)
            table = symtable.symtable(text, "script", "exec")
    except SyntaxError as error:
        line, column = max(1, error.lineno or 1), max(1, error.offset or 1)
        end = error.end_offset or 0 if error.end_lineno == error.lineno else 0
        return [Finding(line, column, end if end > column else 0, f"SyntaxError: {error.msg}")]
    except (ValueError, RecursionError, MemoryError) as error:  # a zero byte; nested too deeply
        return [Finding(1, 1, 0, str(error) or "is nested too deeply")]
    symbols = list(_symbols(table))
    bound = {symbol.get_name() for symbol, _ in symbols if symbol.is_assigned() or symbol.is_parameter()}
    found = [*_unknown_attributes(tree, known, bound - _required(tree)), *_misspelt_phases(tree)]
    if not any(_may_hide_names(node) for node in ast.walk(tree)):
        found += _undefined_names(tree, symbols, known)
    return sorted(set(found))[:MOST]


def _symbols(table: symtable.SymbolTable) -> Iterator[tuple[symtable.Symbol, bool]]:
    """Yield the symbols of a scope and of all scopes inside it, each with whether it is at the top level."""
    waiting = [table]
    while waiting:
        scope = waiting.pop()
        yield from ((symbol, scope.get_type() == "module") for symbol in scope.get_symbols())
        waiting += scope.get_children()


def _required(tree: ast.Module) -> set[str]:
    """Return the names assigned by `sim = require('sim')`."""
    return {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)
        for target in node.targets
        if isinstance(target, ast.Name) and ast.unparse(node.value) == f"require('{target.id}')"
    }


def _may_hide_names(node: ast.AST) -> bool:
    """Return whether a part of a script may define names that are not in its text, such as `import *`."""
    if isinstance(node, ast.ImportFrom):
        return node.names[0].name == "*"
    return isinstance(node, ast.Name) and node.id in _HIDING


def _undefined_names(tree: ast.Module, symbols: list[tuple[symtable.Symbol, bool]], known: Known) -> Iterator[Finding]:
    """Yield the names that are read but never assigned."""
    defined = {*known, *_PROVIDED, *dir(builtins), *PLUGINS}
    read = set()
    for symbol, is_top in symbols:
        is_own = is_top and (symbol.is_assigned() or symbol.is_imported())
        if is_own or (symbol.is_declared_global() and symbol.is_assigned()):
            defined.add(symbol.get_name())
        if symbol.is_referenced() and (is_top or symbol.is_global()):
            read.add(symbol.get_name())
    unknown = read - defined
    for node in ast.walk(tree) if unknown else ():
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in unknown:
            end = node.end_col_offset + 1 if node.end_col_offset and node.end_lineno == node.lineno else 0
            yield Finding(node.lineno, node.col_offset + 1, end, not_defined(node.id, defined))


def _unknown_attributes(tree: ast.Module, known: Known, own: set[str]) -> Iterator[Finding]:
    """Yield attributes that an API module does not have."""
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)):
            continue
        module = node.value.id
        if module in known and module not in own and node.attr not in known[module] and node.attr[:2] != "__":
            last = node.end_col_offset or 0
            line = node.end_lineno or node.lineno
            yield Finding(line, last - len(node.attr) + 1, last + 1, not_there(f"{module}.", node.attr, known[module]))


def _misspelt_phases(tree: ast.Module) -> Iterator[Finding]:
    functions = {node.name: node for node in tree.body if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))}
    for name, intended in phase_names.misspelt(functions):
        yield Finding(functions[name].lineno, 1, 0, phase_names.never_called(name, intended), "warning")


# ---- Lua

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
        match = _ERROR.search(syntax_error)
        line, message = (int(match[1]), match[2]) if match else (1, syntax_error)
        return [Finding(line, 1, 0, f"syntax error: {' '.join(message.split())}")]
    code = _TEXT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    defined = _defined_names(code)
    found = [
        *_attributes(code, known, defined - {match[1] for match in _REQUIRED.finditer(text)}),
        *_flat_names(code, flat, {*defined, *known, *PLUGINS}),
    ]
    if not (_HIDDEN.search(code) or {match[1] for match in _REQUIRE.finditer(text)} - {*known, *_BUILT_IN}):
        found += _calls(code, {*defined, *known, *PLUGINS, *flat, *_BUILT_IN})
    starts = [0, *(match.end() for match in re.finditer("\n", code))]  # of lines

    def place(index: int) -> tuple[int, int]:  # line and column, from 1
        line = bisect_right(starts, index)
        return line, index - starts[line - 1] + 1

    findings = {Finding(*place(start), place(end)[1], message) for start, end, message in found}
    return sorted(findings)[:MOST]


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


# ---- both


class Checker:
    """Checks scripts against the names in the API."""

    def __init__(self) -> None:
        modules = apis()
        self._known = {name: {*contents(api)[1], *contents(api)[2]} for name, api in modules.items()}
        flat = {flat_name(name, function) for name, api in modules.items() for function in contents(api)[1]}
        self._flat = {*flat, "sim_call_type", *(f"sim_{constant}" for constant in contents(modules["sim"])[2])}

    def check(self, text: str, is_lua: bool) -> list[Finding]:
        if not is_lua:
            return check_python(text, self._known)
        try:
            from drone_sim.scripting.lua import source, state  # imported here because Python scripts do not need lupa
        except ImportError:
            return []
        script = source.LuaSource(text.encode("utf-8", "replace"))
        error = state.syntax_error(script.text, bool(script.flat_names) or "phases" in script.form)
        mixed = [Finding(max(script.mixed), 1, 0, source.mixed_forms(*script.mixed))] if script.mixed else []
        return [*mixed, *check_lua(text, self._known, self._flat, error)]


def main() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    checker = Checker()
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(checker.check(request["text"], request["lua"])), flush=True)


if __name__ == "__main__":
    main()
