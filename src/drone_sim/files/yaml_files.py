"""Reading of YAML, with limits and without the surprises of YAML 1.1.

Duplicate keys, keys that are not strings, tags, and sizes, depths and aliases beyond the limits below are refused.
Numbers are those of YAML 1.2: `1e3` is 1000, `010` is 10, and `1:30` is a string (in YAML 1.1 it is 90).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import yaml

from drone_sim.files.resources import MEBIBYTE, read_bytes
from drone_sim.message_text import shown

MAX_SIZE = MEBIBYTE  # bytes of a file
MAX_DEPTH = 32  # of nested lists and mappings
MAX_VALUES = 100_000  # keys and values; an alias counts as everything that it refers to
_MAX_DIGITS = 400  # of a number
_TOO_DEEP = f"lists and mappings are nested more than {MAX_DEPTH} deep"
_YAML_1_1_TYPES = ("int", "float", "timestamp")  # PyYAML's patterns for these are not used
NUMBER_PATTERNS = {
    "int": re.compile(r"[-+]?(?:[0-9]+|0x[0-9a-fA-F]+)$"),
    "float": re.compile(
        r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
    ),
}


class YamlError(ValueError):
    """A YAML text is refused. The message is one line, with the reason and the place."""


def read(path: str | Path) -> Any:
    """Return the value of a YAML file. Raises YamlError with the file's name."""
    try:
        content = read_bytes(path, MAX_SIZE)
    except OSError as error:
        raise YamlError(f"{shown(str(path))[1:-1]}: {error.strerror or error}") from None
    except ValueError as error:
        raise YamlError(f"{shown(str(path))[1:-1]}: {error}") from None
    try:
        return parse(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise YamlError(f"{path}: line {line}: must be text in UTF-8") from None
    except YamlError as error:
        raise YamlError(f"{path}: {error}") from None


def parse(text: str) -> Any:
    """Return the value of a YAML text. Raises YamlError."""
    if len(text) > MAX_SIZE:
        raise YamlError(f"larger than {MAX_SIZE / MEBIBYTE:g} MiB")
    try:
        _check_events(text)
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            if node is None:
                return None
            _measure(node, {}, 1)
            return loader.construct_document(node)
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        problem = " ".join(filter(None, (error.context, error.problem)))
        if "maximum nesting depth" in problem:  # libyaml reads ahead, so its own limit may be reached first
            problem = _TOO_DEEP
        mark = error.problem_mark or error.context_mark
        place = f" (line {mark.line + 1}, column {mark.column + 1})" if mark else ""
        raise YamlError(f"{' '.join(problem.split())}{place}") from None
    except yaml.YAMLError as error:
        raise YamlError(f"{' '.join(str(error).split()):.200}") from None


def compose(text: str) -> Any:
    """Return the root node of a text that `parse` accepts, with the positions of all nodes; None for an empty text."""
    return yaml.compose(text, Loader=_Loader)


class Depth(NamedTuple):
    """Number of keys and indices of a location that exist in a file, and the line (from 1) of the last of them."""

    depth: int
    line: int


class YamlLines:
    """Line numbers of the values in a YAML text."""

    def __init__(self, text: str):
        """Compose the text. If it is not valid YAML, `find` finds no value."""
        try:
            self._root = compose(text)
        except (yaml.YAMLError, RecursionError):
            self._root = None

    def find(self, location: Sequence[int | str]) -> Depth:
        """Return how many keys and indices of `location` exist, and the line of the last that does."""
        node, line = self._root, 1
        for depth, part in enumerate(location):
            child = _child(node, part)
            if child is None:
                return Depth(depth, line)
            node, line = child
        return Depth(len(location), line)


def lines(path: str | Path) -> YamlLines:
    """Return the line numbers of a YAML file's values; none if the file cannot be read."""
    try:
        return YamlLines(read_bytes(path, MAX_SIZE).decode("utf-8-sig"))
    except (OSError, ValueError):
        return YamlLines("")


def _child(node: Any, part: int | str) -> tuple[Any, int] | None:
    """Return the node of a key or index, and its line. A key may be in a mapping that is merged with `<<`."""
    if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
        return node.value[part], node.value[part].start_mark.line + 1
    merged = []
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        line = key.start_mark.line + 1
        if key.value == part:
            return value, line
        if key.tag == "tag:yaml.org,2002:merge":
            merged += [(source, line) for source in (value.value if isinstance(value, yaml.SequenceNode) else [value])]
    for source, line in merged:
        child = _child(source, part)
        if child is not None:
            return child[0], line
    return None


# The C parser is ten times as fast. PyYAML may be installed without it; the Python parser gives the same result.
_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Base):
    """PyYAML's safe loader with YAML 1.2's numbers."""

    yaml_implicit_resolvers: ClassVar = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag.rpartition(":")[2] not in _YAML_1_1_TYPES]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


def _error(node: Any, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)


def _number(loader: _Loader, node: Any) -> float:
    text = str(loader.construct_scalar(node))
    if len(text) > _MAX_DIGITS:
        raise _error(node, f"a number of {len(text)} characters")
    if NUMBER_PATTERNS["int"].match(text):
        return int(text, 16 if "x" in text else 10)
    if not NUMBER_PATTERNS["float"].match(text):
        raise _error(node, f"{shown(text)} is not a number")
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


def _refuse_tag(_loader: _Loader, node: Any) -> Any:
    raise _error(node, f"the tag {shown(node.tag)} is not allowed")


for _type, _pattern in NUMBER_PATTERNS.items():
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_type}", _pattern, list("-+0123456789."))
    _Loader.add_constructor(f"tag:yaml.org,2002:{_type}", _number)
for _type in ("binary", "timestamp", "omap", "pairs", "set"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_type}", _refuse_tag)
_Loader.add_constructor(None, _refuse_tag)


# ---- limits


def _too_many(node: Any) -> yaml.MarkedYAMLError:
    return _error(node, f"holds more than {MAX_VALUES} values once its aliases are expanded")


def _check_events(text: str) -> None:
    """Raise MarkedYAMLError for a text that is too deep or too large, before nodes are made of it."""
    depth = 0
    for number, event in enumerate(yaml.parse(text, Loader=_Base)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise _error(event, _TOO_DEEP)
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if number > 2 * MAX_VALUES:
            raise _too_many(event)


def _check_keys(node: yaml.MappingNode) -> None:
    keys = set()
    for key, _ in node.value:
        if key.tag == "tag:yaml.org,2002:merge":
            continue
        if key.tag != "tag:yaml.org,2002:str":
            raise _error(key, f"key {shown(key.value) if isinstance(key, yaml.ScalarNode) else '?'} must be a string")
        if key.value in keys:
            raise _error(key, f"key {shown(key.value)} is given twice")
        keys.add(key.value)


class _Size(NamedTuple):
    values: int
    depth: int


def _measure(node: Any, known: dict[int, _Size], depth: int) -> _Size:
    """Return a node's size with its aliases expanded. Raises MarkedYAMLError if it is too large, or for its keys.

    `known` has the sizes of nodes that have been measured, by id; `depth` is the node's own.
    """
    size = known.get(id(node))
    if size is None:
        values, deepest = 1, 0
        children = [] if isinstance(node, yaml.ScalarNode) else node.value
        if isinstance(node, yaml.MappingNode):
            _check_keys(node)
        if depth > MAX_DEPTH + 1:
            raise _error(node, _TOO_DEEP)
        for child in children:
            for part in child if isinstance(child, tuple) else (child,):
                inner = _measure(part, known, depth + 1)
                values, deepest = values + inner.values, max(deepest, inner.depth)
        size = known[id(node)] = _Size(values, deepest + 1)
    if size.values > MAX_VALUES:
        raise _too_many(node)
    if depth + size.depth > MAX_DEPTH + 2:
        raise _error(node, _TOO_DEEP)
    return size
