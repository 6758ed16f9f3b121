"""Syntax, unknown names and misspelt phases of a Python script."""

from __future__ import annotations

import ast
import builtins
import symtable
import warnings
from collections.abc import Iterator

from drone_sim.scripting import phase_names
from drone_sim.scripting.api.unknown import PLUGINS, not_there
from drone_sim.scripting.checking.findings import MOST, Finding, Known, not_defined

_FOUND = frozenset(("self", "require", "print", "__file__", "__name__", "__builtins__", "__doc__"))
_UNTOLD = frozenset(("exec", "eval", "globals"))  # who calls one of these may give names values that nobody sees


def check_python(text: str, known: Known) -> list[Finding]:
    """Return what is wrong with a Python script that finds these modules."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text)
            table = symtable.symtable(text, "script", "exec")
    except SyntaxError as error:
        return [_of_syntax(error)]
    except (ValueError, RecursionError, MemoryError) as error:  # a zero byte; nested too deeply
        return [Finding(1, 1, 0, str(error) or "is nested too deeply")]
    own = {one.get_name() for one in table.get_symbols() if one.is_assigned() or one.is_imported()}
    own |= _assigned_as_global(table)
    found = [*_unknown_attributes(tree, known, _bound(table) - _required(tree)), *_phases(tree)]
    if not any(_is_untold(one) for one in ast.walk(tree)):
        found += _undefined(tree, table, known, own)
    return sorted(set(found))[:MOST]


def _of_syntax(error: SyntaxError) -> Finding:
    line, column = max(1, error.lineno or 1), max(1, error.offset or 1)
    end = error.end_offset or 0 if error.end_lineno == error.lineno else 0
    return Finding(line, column, end if end > column else 0, f"SyntaxError: {error.msg}")


def _required(tree: ast.Module) -> set[str]:
    """Return the names that are given to modules by `sim = require('sim')`."""
    return {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)
        for target in node.targets
        if isinstance(target, ast.Name) and ast.unparse(node.value) == f"require('{target.id}')"
    }


def _is_untold(node: ast.AST) -> bool:
    """Tell whether a part of a script may define names that are not in its text, such as `import *`."""
    if isinstance(node, ast.ImportFrom):
        return node.names[0].name == "*"
    return isinstance(node, ast.Name) and node.id in _UNTOLD


def _tables(table: symtable.SymbolTable) -> Iterator[symtable.SymbolTable]:
    """Yield a scope, and all within it."""
    waiting = [table]
    while waiting:
        one = waiting.pop()
        yield one
        waiting += one.get_children()


def _bound(table: symtable.SymbolTable) -> set[str]:
    """Return the names that any scope gives a value, as parameters, too."""
    symbols = (one for scope in _tables(table) for one in scope.get_symbols())
    return {one.get_name() for one in symbols if one.is_assigned() or one.is_parameter()}


def _assigned_as_global(table: symtable.SymbolTable) -> set[str]:
    """Return the names to which functions give values after `global`."""
    return {
        one.get_name()
        for scope in _tables(table)
        for one in scope.get_symbols()
        if one.is_declared_global() and one.is_assigned()
    }


def _undefined(tree: ast.Module, table: symtable.SymbolTable, known: Known, own: set[str]) -> Iterator[Finding]:
    """Yield the names that are read and that nobody gives a value."""
    there = {*own, *known, *_FOUND, *dir(builtins), *PLUGINS}
    read = {
        one.get_name()
        for scope in _tables(table)
        for one in scope.get_symbols()
        if one.is_referenced() and (one.is_global() or scope.get_type() == "module")
    }
    unknown = read - there
    if not unknown:
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in unknown:
            yield _at(node, not_defined(node.id, there))


def _unknown_attributes(tree: ast.Module, known: Known, own: set[str]) -> Iterator[Finding]:
    """Yield what is asked of a module of the API that does not have it."""
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)):
            continue
        module = node.value.id
        if module in known and module not in own and node.attr not in known[module] and node.attr[:2] != "__":
            last = node.end_col_offset or 0
            line = node.end_lineno or node.lineno
            yield Finding(line, last - len(node.attr) + 1, last + 1, not_there(f"{module}.", node.attr, known[module]))


def _phases(tree: ast.Module) -> Iterator[Finding]:
    """Yield the functions that were meant to be phases."""
    functions = {one.name: one for one in tree.body if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef))}
    for name, meant in phase_names.misspelt(functions):
        line = functions[name].lineno
        yield Finding(line, 1, 0, phase_names.never_called(name, meant), "warning")


def _at(node: ast.expr, said: str) -> Finding:
    end = node.end_col_offset + 1 if node.end_col_offset and node.end_lineno == node.lineno else 0
    return Finding(node.lineno, node.col_offset + 1, end, said)
