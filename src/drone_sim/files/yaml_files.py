"""YAML as this package reads it: of what YAML 1.1 allows, only what cannot surprise.

Refused are keys that come twice or are no text, and aliases, depths and sizes beyond the limits below; numbers are
those of YAML 1.2: `1e3` is one, `1:30` is none (YAML 1.1 takes it for 90), `010` is ten.
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
MAX_DEPTH = 32  # lists and mappings within each other
MAX_VALUES = 100_000  # keys and values, each alias counted with all that it stands for
_MAX_DIGITS = 400  # of a number
_TOO_DEEP = f"lists and mappings are nested more than {MAX_DEPTH} deep"
_OTHER = ("int", "float", "timestamp")  # what YAML 1.1 reads in ways of its own
_INT = re.compile(r"[-+]?(?:[0-9]+|0x[0-9a-fA-F]+)$")
_FLOAT = re.compile(
    r"(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
)


class YamlError(ValueError):
    """A YAML text is refused; one line that says where and why."""


def read(path: str | Path) -> Any:
    """Return what a YAML file holds; raises YamlError, which names the file."""
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
    """Return what a YAML text holds; raises YamlError."""
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
        said = " ".join(filter(None, (error.context, error.problem)))
        if "maximum nesting depth" in said:  # libyaml's own limit, which it may meet first, for it reads ahead
            said = _TOO_DEEP
        mark = error.problem_mark or error.context_mark
        raise YamlError(f"{' '.join(said.split())}{_at(mark)}") from None
    except yaml.YAMLError as error:
        raise YamlError(f"{' '.join(str(error).split()):.200}") from None


def dump(value: Any, **style: Any) -> str:
    """Return a YAML text that `parse` reads as this, keys in their order; `style` is as for yaml.dump."""
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, **style))


def compose(text: str) -> Any:
    """Return the nodes of a text that `parse` reads, with where they begin and end; None for an empty one."""
    return yaml.compose(text, Loader=_Loader)


class Depth(NamedTuple):
    """How far the way to a value leads in a file, and the line (from 1) where it ends."""

    depth: int
    line: int


class YamlLines:
    """Where the values of a YAML text stand."""

    def __init__(self, text: str):
        """Take a text that `parse` reads; of any other nothing is found."""
        try:
            self._root = compose(text)
        except (yaml.YAMLError, RecursionError):
            self._root = None

    def find(self, location: Sequence[int | str]) -> Depth:
        """Return how many of these keys and indices lead to a value, and the line of the last that does."""
        node, line = self._root, 1
        for depth, part in enumerate(location):
            inner = _inner(node, part)
            if inner is None:
                return Depth(depth, line)
            node, line = inner
        return Depth(len(location), line)


def lines(path: str | Path) -> YamlLines:
    """Return where the values of a YAML file stand, as far as it can be read."""
    try:
        return YamlLines(read_bytes(path, MAX_SIZE).decode("utf-8-sig"))
    except (OSError, ValueError):
        return YamlLines("")


def _inner(node: Any, part: int | str) -> tuple[Any, int] | None:
    """Return the node of a key or index, and its line."""
    if isinstance(node, yaml.SequenceNode) and isinstance(part, int) and part < len(node.value):
        return node.value[part], node.value[part].start_mark.line + 1
    merged = []
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        line = key.start_mark.line + 1
        if key.value == part:
            return value, line
        if key.tag == "tag:yaml.org,2002:merge":
            merged += [(one, line) for one in (value.value if isinstance(value, yaml.SequenceNode) else [value])]
    for one, line in merged:
        inner = _inner(one, part)
        if inner is not None:
            return inner[0], line
    return None


def _at(mark: Any) -> str:
    return f" (line {mark.line + 1}, column {mark.column + 1})" if mark else ""


# The C parser is ten times as fast; where PyYAML comes without it, its own one reads the same.
_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_Base):
    """PyYAML's safe loader with YAML 1.2's numbers."""

    yaml_implicit_resolvers: ClassVar = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag.rpartition(":")[2] not in _OTHER]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }


def _refused(node: Any, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)


def _too_deep(node: Any) -> yaml.MarkedYAMLError:
    return _refused(node, _TOO_DEEP)


def _too_much(node: Any) -> yaml.MarkedYAMLError:
    return _refused(node, f"holds more than {MAX_VALUES} values once its aliases are expanded")


def _number(loader: _Loader, node: Any) -> float:
    text = str(loader.construct_scalar(node))
    if len(text) > _MAX_DIGITS:
        raise _refused(node, f"a number of {len(text)} characters")
    if _INT.match(text):
        return int(text, 16 if "x" in text else 10)
    if not _FLOAT.match(text):
        raise _refused(node, f"{shown(text)} is not a number")
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


def _refuse_tag(_loader: _Loader, node: Any) -> Any:
    raise _refused(node, f"the tag {shown(node.tag)} is not allowed")


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which puts quotes around a text that either version of YAML takes for something else."""


for _tag, _pattern in (("int", _INT), ("float", _FLOAT)):
    for _kind in (_Loader, _Dumper):
        _kind.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", _pattern, list("-+0123456789."))
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _number)
for _tag in ("binary", "timestamp", "omap", "pairs", "set"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _refuse_tag)
_Loader.add_constructor(None, _refuse_tag)


def _check_events(text: str) -> None:
    """Refuse what is nested too deeply or too much before anything is made of it."""
    depth = 0
    for number, event in enumerate(yaml.parse(text, Loader=_Base)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise _too_deep(event)
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if number > 2 * MAX_VALUES:
            raise _too_much(event)


def _check_keys(node: yaml.MappingNode) -> None:
    seen = set()
    for key, _ in node.value:
        if key.tag == "tag:yaml.org,2002:merge":
            continue
        if key.tag != "tag:yaml.org,2002:str":
            raise _refused(key, f"key {shown(key.value) if isinstance(key, yaml.ScalarNode) else '?'} must be a string")
        if key.value in seen:
            raise _refused(key, f"key {shown(key.value)} is given twice")
        seen.add(key.value)


class _Size(NamedTuple):
    values: int
    depth: int


def _measure(node: Any, known: dict[int, _Size], depth: int) -> _Size:
    """Return how much a node stands for once its aliases are followed; raises where that is too much."""
    size = known.get(id(node))
    if size is None:
        values, deepest = 1, 0
        children = [] if isinstance(node, yaml.ScalarNode) else node.value
        if isinstance(node, yaml.MappingNode):
            _check_keys(node)
        if depth > MAX_DEPTH + 1:
            raise _too_deep(node)
        for child in children:
            for one in child if isinstance(child, tuple) else (child,):
                part = _measure(one, known, depth + 1)
                values, deepest = values + part.values, max(deepest, part.depth)
        size = known[id(node)] = _Size(values, deepest + 1)
    if size.values > MAX_VALUES:
        raise _too_much(node)
    if depth + size.depth > MAX_DEPTH + 2:
        raise _too_deep(node)
    return size
