"""Check of a Python script: syntax, unknown names and misspelt phases."""

from __future__ import annotations

import ast
import builtins
import symtable
import warnings
from collections.abc import Iterator

from drone_sim.scripting import phase_names
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.checking.findings import MOST, Finding, Known, not_defined

_PROVIDED = frozenset(("self", "require", "print", "__file__", "__name__", "__builtins__", "__doc__"))
_HIDDEN = frozenset(("exec", "eval", "globals"))  # may define names that the text does not show


def check_python(text: str, known: Known) -> list[Finding]:
    """Return the mistakes in a Python script; `known` are the names in each API module."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text)
            table = symtable.symtable(text, "script", "exec")
    except SyntaxError as error:
        return [_syntax_finding(error)]
    except (ValueError, RecursionError, MemoryError) as error:  # a zero byte; nested too deeply
        return [Finding(1, 1, 0, str(error) or "is nested too deeply")]
    own = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_assigned() or symbol.is_imported()}
    own |= _assigned_as_global(table)
    found = [*_unknown_attributes(tree, known, _bound(table) - _required(tree)), *_phases(tree)]
    if not any(_may_hide_names(node) for node in ast.walk(tree)):
        found += _undefined(tree, table, known, own)
    return sorted(set(found))[:MOST]


def _syntax_finding(error: SyntaxError) -> Finding:
    line, column = max(1, error.lineno or 1), max(1, error.offset or 1)
    end = error.end_offset or 0 if error.end_lineno == error.lineno else 0
    return Finding(line, column, end if end > column else 0, f"SyntaxError: {error.msg}")


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
    return isinstance(node, ast.Name) and node.id in _HIDDEN


def _tables(table: symtable.SymbolTable) -> Iterator[symtable.SymbolTable]:
    """Yield a scope and all scopes inside it."""
    waiting = [table]
    while waiting:
        scope = waiting.pop()
        yield scope
        waiting += scope.get_children()


def _bound(table: symtable.SymbolTable) -> set[str]:
    """Return the names that any scope assigns or has as parameters."""
    symbols = (symbol for scope in _tables(table) for symbol in scope.get_symbols())
    return {symbol.get_name() for symbol in symbols if symbol.is_assigned() or symbol.is_parameter()}


def _assigned_as_global(table: symtable.SymbolTable) -> set[str]:
    """Return the names that functions assign after `global`."""
    return {
        symbol.get_name()
        for scope in _tables(table)
        for symbol in scope.get_symbols()
        if symbol.is_declared_global() and symbol.is_assigned()
    }


def _undefined(tree: ast.Module, table: symtable.SymbolTable, known: Known, own: set[str]) -> Iterator[Finding]:
    """Yield the names that are read but never assigned."""
    defined = {*own, *known, *_PROVIDED, *dir(builtins), *PLUGINS}
    read = {
        symbol.get_name()
        for scope in _tables(table)
        for symbol in scope.get_symbols()
        if symbol.is_referenced() and (symbol.is_global() or scope.get_type() == "module")
    }
    unknown = read - defined
    if not unknown:
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in unknown:
            yield _finding_at(node, not_defined(node.id, defined))


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


def _phases(tree: ast.Module) -> Iterator[Finding]:
    """Yield misspelt phase functions."""
    functions = {node.name: node for node in tree.body if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))}
    for name, intended in phase_names.misspelt(functions):
        line = functions[name].lineno
        yield Finding(line, 1, 0, phase_names.never_called(name, intended), "warning")


def _finding_at(node: ast.expr, message: str) -> Finding:
    end = node.end_col_offset + 1 if node.end_col_offset and node.end_lineno == node.lineno else 0
    return Finding(node.lineno, node.col_offset + 1, end, message)
