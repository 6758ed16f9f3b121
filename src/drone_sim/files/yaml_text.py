"""A YAML text that says something else, otherwise as its author wrote it: comments, order, spelling, lines stay."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import yaml

from drone_sim.files import yaml_files

_WIDTH = 120
_MERGE = "<<"  # the key of what is merged from elsewhere
_LONG = 1e15  # with which a number gets an exponent
_MOST_LINES = 4  # of an entry in braces
_ALIAS = re.compile(r"\s*\*[^\s,\]}]+")
_ANCHOR = re.compile(r"&([^\s,\[\]{}]+)\s")
_Kept = Mapping[str, Sequence[int | None]]


class YamlText:
    """A text of a mapping, or an empty one."""

    def __init__(self, text: str):
        """Read it. Raises YamlError."""
        found = yaml_files.parse(text)
        self.text = text
        self.is_mapping = isinstance(found, dict)
        self.values: Mapping[str, Any] = found if self.is_mapping else {}

    @cached_property
    def _root(self) -> Any:
        return yaml_files.compose(self.text) if self.values else None

    def rewritten(self, new: Mapping[str, Any], kept: _Kept) -> str:
        """Return a text that says something new.

        `kept` has for lists under the mapping's keys the index that each new item had before, None for one that is new.
        """
        if self._root is None or self._root.flow_style:
            return dumped(new)
        return _Rewriting(self.text, self._root, kept).rewrite(self.values, new)


def says(text: str, wanted: Mapping[str, Any]) -> bool:
    """Tell whether a text says that: with anchors and aliases in odd places one may not."""
    try:
        return bool(yaml_files.parse(text) == wanted)
    except yaml_files.YamlError:
        return False


def dumped(values: Mapping[str, Any]) -> str:
    """Return a mapping as a person would write it."""
    return "".join(_line(key, value, "") for key, value in values.items())


class _Rewriting:
    """Collects what takes the place of what, by positions in the text."""

    def __init__(self, text: str, root: Any, kept: _Kept):
        self._text = text if text.endswith("\n") else text + "\n"
        self._root = root
        self._kept = kept
        self._parts: list[tuple[int, int, str]] = []

    def rewrite(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
        self._update(self._root, old, new, top=True)
        self._keep_anchors()
        made, at = [], 0
        for start, end, words in sorted(self._parts, key=lambda one: one[:2]):
            made += [self._text[at:start], words]
            at = end
        return "".join([*made, self._text[at:]])

    # ---- what is otherwise

    def _update(
        self, node: yaml.MappingNode, old: Mapping[str, Any], new: Mapping[str, Any], top: bool = False
    ) -> None:
        """Let a mapping say something else."""
        values = {key.value: (key, value) for key, value in node.value}
        for key, value in self._gone(node, new):
            self._remove_key(node, key, value)
        last = None
        for key, value in new.items():
            if key not in values:  # new, or merged from elsewhere
                if key not in old or old[key] != value:
                    self._add_key(node, key, value, last)
                continue
            last = values[key]
            if old[key] != value:
                self._change(node, *last, old[key], value, key if top else "")

    def _gone(self, node: Any, new: Collection[str]) -> list[tuple[Any, Any]]:
        """Return keys that are to be taken out, with their values; those behind the dash of an item are taken out."""
        pairs, new = list(node.value), {*new, _MERGE}
        if node.flow_style or self._is_first_of_line(pairs[0][0].start_mark.index):
            return [pair for pair in pairs if pair[0].value not in new]
        first = next(index for index, (key, _) in enumerate(pairs) if key.value in new)
        if first:
            self._parts.append((pairs[0][0].start_mark.index, pairs[first][0].start_mark.index, ""))
        return [pair for pair in pairs[first:] if pair[0].value not in new]

    def _change(self, above: Any, key: Any, node: Any, old: Any, new: Any, name: str) -> None:
        start, end = self._span(key, node)
        is_own = start == node.start_mark.index
        if is_own and isinstance(node, yaml.MappingNode) and _have_common_keys(old, new):
            self._update(node, old, new)
        elif is_own and name in self._kept and not node.flow_style and new:
            self._update_list(node, old, new, self._kept[name])
        elif not above.flow_style:
            self._parts.append(
                (key.start_mark.index, self._line_end(end), _line(key.value, new, _indent(key)).lstrip())
            )
        else:
            self._parts.append((start, end, _flow(new)))

    def _update_list(
        self, node: yaml.SequenceNode, old: Sequence[Any], new: Sequence[Any], kept: Sequence[Any]
    ) -> None:
        """Let a list of entries have others."""
        there = [index for index in kept if index is not None]
        if there != sorted(there):
            raise yaml_files.YamlError("a list in another order")
        for index in {*range(len(old))} - {*there}:
            self._parts.append((*self._item_lines(node.value[index]), ""))
        added = ""
        for index, value in zip(kept, new):
            if index is None:
                added += _item(value, " " * self._dash(node.value[0])[1])
            elif old[index] != value:
                self._update_item(node.value[index], old[index], value)
        if added:
            end = self._line_end(_end(node.value[-1]))
            self._parts.append((end, end, added))

    def _update_item(self, node: Any, old: Any, new: Any) -> None:
        if isinstance(node, yaml.MappingNode) and _have_common_keys(old, new):
            self._update(node, old, new)
        else:
            self._parts.append((node.start_mark.index, _end(node), _flow(new)))

    def _remove_key(self, node: yaml.MappingNode, key: Any, value: Any) -> None:
        start, end = key.start_mark.index, self._span(key, value)[1]
        if not node.flow_style:
            self._parts.append((self._line_start(start), self._line_end(end), ""))
            return
        behind = re.match(r"\s*,\s*", self._text[end:])
        if behind:
            self._parts.append((start, end + behind.end(), ""))
            return
        before = re.search(r",\s*$", self._text[:start])
        self._parts.append((before.start() if before else start, end, ""))

    def _add_key(self, node: yaml.MappingNode, key: str, value: Any, last: tuple[Any, Any] | None) -> None:
        """Put a key behind another one, or at the end."""
        after = last or node.value[-1]
        end = self._span(*after)[1]
        if node.flow_style:
            self._parts.append((end, end, f", {key}: {_flow(value)}"))
        else:
            end = self._line_end(end)
            self._parts.append((end, end, _line(key, value, _indent(node.value[0][0]))))

    # ---- anchors

    def _keep_anchors(self) -> None:
        """Where an anchored value is replaced, write it out at the first alias that is kept and stands after it."""
        for start, end, _ in [*self._parts]:
            for found in _ANCHOR.finditer(self._text, start, end):
                node = _node_at(self._root, found.start())
                alias = re.compile(rf"\*{re.escape(found[1])}(?![^\s,\]}}])")
                if node is None:
                    continue
                for other in alias.finditer(self._text, end):
                    if not any(one <= other.start() < two for one, two, _ in self._parts):
                        self._parts.append((*other.span(), self._text[found.start() : _end(node)]))
                        break

    # ---- where it stands

    def _span(self, key: Any, node: Any) -> tuple[int, int]:
        """Return where a value begins and ends; an alias stands elsewhere than what it stands for."""
        begin = key.end_mark.index + 1
        alias = _ALIAS.match(self._text, begin)
        if alias:
            return begin + len(alias[0]) - len(alias[0].lstrip()), alias.end()
        return node.start_mark.index, _end(node)

    def _dash(self, node: Any) -> tuple[int, int]:
        """Return where the dash of an item is, and in which column."""
        at = self._text.rindex("-", 0, node.start_mark.index)
        return at, at - self._line_start(at)

    def _item_lines(self, node: Any) -> tuple[int, int]:
        return self._line_start(self._dash(node)[0]), self._line_end(_end(node))

    def _line_start(self, at: int) -> int:
        return self._text.rfind("\n", 0, at) + 1

    def _line_end(self, at: int) -> int:
        """Return where the line after a position begins."""
        found = self._text.find("\n", max(at - 1, 0) if self._text[at - 1 : at] == "\n" else at)
        return len(self._text) if found == -1 else found + 1

    def _is_first_of_line(self, at: int) -> bool:
        return not self._text[self._line_start(at) : at].strip()


def _have_common_keys(old: Any, new: Any) -> bool:
    return isinstance(old, Mapping) and isinstance(new, Mapping) and bool(old.keys() & new.keys())


def _end(node: Any) -> int:
    """Return where a node's last character is, comments behind it not counted."""
    if isinstance(node, yaml.ScalarNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    ends = [_end(one) for one in (last if isinstance(last, tuple) else (last,))]
    inside = [one for one in ends if one <= node.end_mark.index]  # not what an alias stands for
    return max(inside, default=int(node.end_mark.index))


def _node_at(node: Any, index: int) -> Any:
    """Return the node that begins at a position."""
    for one in _all(node):
        if one.start_mark.index == index:
            return one
    return None


def _all(node: Any) -> Iterator[Any]:
    yield node
    if not isinstance(node, yaml.ScalarNode):
        for one in node.value:
            for inner in one if isinstance(one, tuple) else (one,):
                yield from _all(inner)


def _indent(key: Any) -> str:
    return " " * int(key.start_mark.column)


# ---- as a person would write it


def _line(key: str, value: Any, indent: str) -> str:
    """Return a key with its value, in lines."""
    if _is_list_of_entries(value):
        return f"{indent}{_flow(key)}:\n" + "".join(_item(one, indent + "  ") for one in value)
    if isinstance(value, Mapping) and any(isinstance(one, Mapping) for one in value.values()):
        return f"{indent}{_flow(key)}:\n" + "".join(_line(one, inner, indent + "  ") for one, inner in value.items())
    return _wrapped(f"{indent}{_flow(key)}: ", value, indent + "  ") + "\n"


def _is_list_of_entries(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(one, Mapping) for one in value)


def _item(value: Any, indent: str) -> str:
    """Return an item of a list: in braces, or, where that is long, in lines."""
    text = _wrapped(f"{indent}- ", value, indent + "   ")
    is_flat = not isinstance(value, Mapping) or not any(map(_is_list_of_entries, value.values()))
    if is_flat and text.count("\n") < _MOST_LINES:
        return text + "\n"
    lines = "".join(_line(key, one, indent + "  ") for key, one in value.items())
    return f"{indent}- {lines[len(indent) + 2 :]}"


def _wrapped(begin: str, value: Any, indent: str) -> str:
    """Return a value behind something, in lines of no more than 120 characters where commas allow it."""
    if not isinstance(value, Mapping) or not value:
        return begin + _flow(value)
    lines, line = [], begin + "{"
    words = [f"{_flow(key)}: {_flow(one)}" for key, one in value.items()]
    for number, word in enumerate(words):
        word += "}" if number == len(words) - 1 else ", "
        if len(line) + len(word.rstrip()) > _WIDTH and number:
            lines.append(line.rstrip())
            line = indent
        line += word
    return "\n".join([*lines, line])


def _flow(value: Any) -> str:
    """Return a value on one line."""
    kinds: list[tuple[Any, Callable[[Any], str]]] = [
        (bool, lambda one: "true" if one else "false"),
        (float, _number),
        (Mapping, lambda one: "{" + ", ".join(f"{_flow(key)}: {_flow(inner)}" for key, inner in one.items()) + "}"),
        ((list, tuple), lambda one: "[" + ", ".join(map(_flow, one)) + "]"),
    ]
    for kind, write in kinds:
        if isinstance(value, kind):
            return write(value)
    dumped_value = yaml_files.dump([value], default_flow_style=True, width=10**6)
    return dumped_value.strip()[1:-1]


def _number(value: float) -> str:
    if math.isfinite(value) and value.is_integer() and abs(value) < _LONG:
        return str(int(value))
    return yaml_files.dump(value).split("\n")[0]
