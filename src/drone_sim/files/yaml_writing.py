"""Writing of YAML: new texts, and changes of a text that leave the rest as its author wrote it.

`dump` makes every YAML text and file of the package.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal

import yaml

from drone_sim.files import yaml_files
from drone_sim.files.yaml_files import NUMBER_PATTERNS

Layout = Literal["block", "compact", "line", "scene"]

_MAX_COLUMNS = 120
_MAX_BRACE_LINES = 4  # of a list entry in braces; a longer entry gets a line for each key
_MIN_EXPONENT = 1e15  # numbers from here on are written with an exponent
_STYLES: dict[str, dict[str, Any]] = {
    "block": {},
    "compact": {"default_flow_style": None, "width": _MAX_COLUMNS},
    "line": {"default_flow_style": True, "width": math.inf},
}


def dump(value: Any, layout: Layout = "block") -> str:
    """Return a YAML text that `yaml_files.parse` reads as `value`; mappings keep the order of their keys.

    Layouts: "block": one line for each value. "compact": the innermost lists and mappings in brackets. "line":
    everything in brackets, on one line. "scene", only for a mapping: as a scene is saved, with each entry of a list in
    braces, whole numbers without `.0`, and at most 120 columns where commas allow it.
    """
    if layout == "scene":
        return "".join(_format_key(key, item, "") for key, item in value.items())
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, **_STYLES[layout]))


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper; it quotes strings that are a number in YAML 1.1 or YAML 1.2."""


for _type, _pattern in NUMBER_PATTERNS.items():
    _Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{_type}", _pattern, list("-+0123456789."))


# ---- pieces of the layout "scene"


def _format_key(key: str, value: Any, indent: str) -> str:
    """Return a key and its value as whole lines."""
    begin = f"{indent}{_format_inline(key)}:"
    if _is_list_of_mappings(value):
        return f"{begin}\n" + "".join(_format_item(item, indent + "  ") for item in value)
    if isinstance(value, Mapping) and any(isinstance(item, Mapping) for item in value.values()):
        return f"{begin}\n" + "".join(_format_key(inner, item, indent + "  ") for inner, item in value.items())
    return _wrap(f"{begin} ", value, indent + "  ") + "\n"


def _format_item(value: Any, indent: str) -> str:
    """Return a list item as whole lines: in braces, or, if that is long, with a line for each key."""
    text = _wrap(f"{indent}- ", value, indent + "   ")
    is_nested = isinstance(value, Mapping) and any(map(_is_list_of_mappings, value.values()))
    if not is_nested and text.count("\n") < _MAX_BRACE_LINES:
        return text + "\n"
    lines = "".join(_format_key(key, item, indent + "  ") for key, item in value.items())
    return f"{indent}- {lines[len(indent) + 2 :]}"


def _format_inline(value: Any) -> str:
    """Return a value on one line, with lists and mappings in brackets."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        is_short_integer = math.isfinite(value) and value.is_integer() and abs(value) < _MIN_EXPONENT
        return str(int(value)) if is_short_integer else dump(value).split("\n")[0]
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_format_inline(key)}: {_format_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_format_inline, value)) + "]"
    return dump([value], "line").strip()[1:-1]  # in a list, PyYAML does not append the line `...`


def _is_list_of_mappings(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _wrap(begin: str, value: Any, indent: str) -> str:
    """Return `begin` and the value; the lines of a mapping are broken behind commas, and continued at `indent`."""
    if not isinstance(value, Mapping) or not value:
        return begin + _format_inline(value)
    lines, line = [], begin + "{"
    words = [f"{_format_inline(key)}: {_format_inline(item)}" for key, item in value.items()]
    for number, word in enumerate(words):
        word += "}" if number == len(words) - 1 else ", "
        if len(line) + len(word.rstrip()) > _MAX_COLUMNS and number:
            lines.append(line.rstrip())
            line = indent
        line += word
    return "\n".join([*lines, line])


# ---- changes of a text: comments, order, spelling and line breaks of the rest stay

_MERGE = "<<"  # the key that merges another mapping
_ALIAS = re.compile(r"\s*\*[^\s,\]}]+")
_ANCHOR = re.compile(r"&([^\s,\[\]{}]+)\s")
_OldIndices = Mapping[str, Sequence[int | None]]


class YamlText:
    """A YAML text that is a mapping, or empty."""

    def __init__(self, text: str):
        """Parse the text. Raises YamlError."""
        values = yaml_files.parse(text)
        self.text = text
        self.is_mapping = isinstance(values, dict)
        self.values: Mapping[str, Any] = values if self.is_mapping else {}

    @cached_property
    def _root(self) -> Any:
        return yaml_files.compose(self.text) if self.values else None

    def rewrite(self, values: Mapping[str, Any], old_indices: _OldIndices) -> str:
        """Return the text changed so that it has these values.

        `old_indices` has, for lists under top-level keys, each item's index in the old list; None for a new item.
        Raises YamlError if items that stay are in another order.
        """
        if self._root is None or self._root.flow_style:
            return dump(values, "scene")
        return _Rewriter(self.text, self._root, old_indices).rewrite(self.values, values)


def has_values(text: str, values: Mapping[str, Any]) -> bool:
    """Return whether a text is read as these values; a rewritten text may not be, if its aliases are in odd places."""
    try:
        return bool(yaml_files.parse(text) == values)
    except yaml_files.YamlError:
        return False


class _Rewriter:
    """Collects replacements (start, end, new text) of parts of a text, and applies them at the end."""

    def __init__(self, text: str, root: Any, old_indices: _OldIndices):
        self._text = text if text.endswith("\n") else text + "\n"
        self._root = root
        self._old_indices = old_indices
        self._replacements: list[tuple[int, int, str]] = []

    def rewrite(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
        self._update_mapping(self._root, old, new, is_top=True)
        self._expand_aliases()
        pieces, position = [], 0
        for start, end, text in sorted(self._replacements, key=lambda replacement: replacement[:2]):
            pieces += [self._text[position:start], text]
            position = end
        return "".join([*pieces, self._text[position:]])

    # ---- mappings and lists

    def _update_mapping(
        self, node: yaml.MappingNode, old: Mapping[str, Any], new: Mapping[str, Any], is_top: bool = False
    ) -> None:
        pairs = {key.value: (key, value) for key, value in node.value}
        self._remove_keys(node, new)
        last = None
        for name, value in new.items():
            if name in pairs:
                last = pairs[name]
                if old[name] != value:
                    self._update_value(node, *last, old[name], value, name if is_top else "")
            elif name not in old or old[name] != value:  # otherwise, the value is merged from another mapping
                self._add_key(node, name, value, last)

    def _update_value(self, mapping: Any, key: Any, node: Any, old: Any, new: Any, name: str) -> None:
        start, end = self._value_span(key, node)
        is_alias = start != node.start_mark.index
        if not is_alias and isinstance(node, yaml.MappingNode) and _have_common_keys(old, new):
            self._update_mapping(node, old, new)
        elif not is_alias and name in self._old_indices and not node.flow_style and new:
            self._update_list(node, old, new, self._old_indices[name])
        elif mapping.flow_style:
            self._replacements.append((start, end, _format_inline(new)))
        else:
            lines = _format_key(key.value, new, _indent(key)).lstrip()
            self._replacements.append((key.start_mark.index, self._next_line(end), lines))

    def _update_list(
        self, node: yaml.SequenceNode, old: Sequence[Any], new: Sequence[Any], old_indices: Sequence[int | None]
    ) -> None:
        remaining = [index for index in old_indices if index is not None]
        if remaining != sorted(remaining):
            raise yaml_files.YamlError("a list in another order")
        for index in {*range(len(old))} - {*remaining}:
            item = node.value[index]
            span = self._line_start(self._dash(item)), self._next_line(_end(item))
            self._replacements.append((*span, ""))
        added = ""
        for index, value in zip(old_indices, new):
            if index is None:
                dash = self._dash(node.value[0])
                added += _format_item(value, " " * (dash - self._line_start(dash)))
            elif old[index] != value:
                item = node.value[index]
                if isinstance(item, yaml.MappingNode) and _have_common_keys(old[index], value):
                    self._update_mapping(item, old[index], value)
                else:
                    self._replacements.append((item.start_mark.index, _end(item), _format_inline(value)))
        if added:
            end = self._next_line(_end(node.value[-1]))
            self._replacements.append((end, end, added))

    # ---- keys

    def _remove_keys(self, node: yaml.MappingNode, new: Collection[str]) -> None:
        """Remove the keys that are not in `new`, with their values."""
        pairs, names = list(node.value), {*new, _MERGE}
        begin = pairs[0][0].start_mark.index
        if not node.flow_style and self._text[self._line_start(begin) : begin].strip():
            # The first key stands behind the dash of a list item: the next key that stays moves there.
            first = next(index for index, (key, _) in enumerate(pairs) if key.value in names)
            if first:
                self._replacements.append((begin, pairs[first][0].start_mark.index, ""))
            pairs = pairs[first:]
        for key, value in pairs:
            if key.value not in names:
                self._replacements.append((*self._pair_span(node, key, value), ""))

    def _pair_span(self, node: yaml.MappingNode, key: Any, value: Any) -> tuple[int, int]:
        """Return where a key and its value begin and end: whole lines, or, in braces, with one comma."""
        start, end = key.start_mark.index, self._value_span(key, value)[1]
        if not node.flow_style:
            return self._line_start(start), self._next_line(end)
        comma = re.match(r"\s*,\s*", self._text[end:])
        if comma:
            return start, end + comma.end()
        comma = re.search(r",\s*$", self._text[:start])
        return (comma.start() if comma else start), end

    def _add_key(self, node: yaml.MappingNode, key: str, value: Any, previous: tuple[Any, Any] | None) -> None:
        """Add a key after `previous`, a pair of nodes, or at the end."""
        end = self._value_span(*(previous or node.value[-1]))[1]
        if node.flow_style:
            self._replacements.append((end, end, f", {key}: {_format_inline(value)}"))
        else:
            end = self._next_line(end)
            self._replacements.append((end, end, _format_key(key, value, _indent(node.value[0][0]))))

    # ---- anchors

    def _expand_aliases(self) -> None:
        """Replace the first remaining alias of each anchor that is removed by the value and its anchor."""
        for start, end, _ in [*self._replacements]:
            for anchor in _ANCHOR.finditer(self._text, start, end):
                node = next((node for node in _all_nodes(self._root) if node.start_mark.index == anchor.start()), None)
                if node is None:
                    continue
                for alias in re.compile(rf"\*{re.escape(anchor[1])}(?![^\s,\]}}])").finditer(self._text, end):
                    if not any(begin <= alias.start() < stop for begin, stop, _ in self._replacements):
                        self._replacements.append((*alias.span(), self._text[anchor.start() : _end(node)]))
                        break

    # ---- positions in the text

    def _value_span(self, key: Any, node: Any) -> tuple[int, int]:
        """Return where the value of a key begins and ends; for an alias, not the value that it refers to."""
        begin = key.end_mark.index + 1
        alias = _ALIAS.match(self._text, begin)
        if alias:
            return begin + len(alias[0]) - len(alias[0].lstrip()), alias.end()
        return node.start_mark.index, _end(node)

    def _dash(self, item: Any) -> int:
        return self._text.rindex("-", 0, item.start_mark.index)

    def _line_start(self, position: int) -> int:
        return self._text.rfind("\n", 0, position) + 1

    def _next_line(self, position: int) -> int:
        """Return where the next line begins; `position` itself if it is the beginning of a line."""
        if self._text[position - 1 : position] == "\n":
            return position
        newline = self._text.find("\n", position)
        return len(self._text) if newline == -1 else newline + 1


def _have_common_keys(old: Any, new: Any) -> bool:
    return isinstance(old, Mapping) and isinstance(new, Mapping) and bool(old.keys() & new.keys())


def _end(node: Any) -> int:
    """Return where a node's last character is; comments after it do not count."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    ends = [_end(child) for child in (last if isinstance(last, tuple) else (last,))]
    inside = [end for end in ends if end <= node.end_mark.index]  # the target of an alias may be outside
    return max(inside, default=int(node.end_mark.index))


def _all_nodes(node: Any) -> Iterator[Any]:
    yield node
    if not isinstance(node, yaml.ScalarNode):
        for child in node.value:
            for part in child if isinstance(child, tuple) else (child,):
                yield from _all_nodes(part)


def _indent(key: Any) -> str:
    return " " * int(key.start_mark.column)
