"""Writing of YAML: `dump` makes every YAML text and file of the package."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import yaml

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
        return "".join(format_key(key, item, "") for key, item in value.items())
    return str(yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, **_STYLES[layout]))


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper; it quotes strings that are a number in YAML 1.1 or YAML 1.2."""


for _type, _pattern in NUMBER_PATTERNS.items():
    _Dumper.add_implicit_resolver(f"tag:yaml.org,2002:{_type}", _pattern, list("-+0123456789."))


# ---- pieces of the layout "scene"


def format_key(key: str, value: Any, indent: str) -> str:
    """Return a key and its value as whole lines."""
    begin = f"{indent}{format_inline(key)}:"
    if _is_list_of_mappings(value):
        return f"{begin}\n" + "".join(format_item(item, indent + "  ") for item in value)
    if isinstance(value, Mapping) and any(isinstance(item, Mapping) for item in value.values()):
        return f"{begin}\n" + "".join(format_key(inner, item, indent + "  ") for inner, item in value.items())
    return _wrap(f"{begin} ", value, indent + "  ") + "\n"


def format_item(value: Any, indent: str) -> str:
    """Return a list item as whole lines: in braces, or, if that is long, with a line for each key."""
    text = _wrap(f"{indent}- ", value, indent + "   ")
    is_nested = isinstance(value, Mapping) and any(map(_is_list_of_mappings, value.values()))
    if not is_nested and text.count("\n") < _MAX_BRACE_LINES:
        return text + "\n"
    lines = "".join(format_key(key, item, indent + "  ") for key, item in value.items())
    return f"{indent}- {lines[len(indent) + 2 :]}"


def format_inline(value: Any) -> str:
    """Return a value on one line, with lists and mappings in brackets."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        is_short_integer = math.isfinite(value) and value.is_integer() and abs(value) < _MIN_EXPONENT
        return str(int(value)) if is_short_integer else dump(value).split("\n")[0]
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{format_inline(key)}: {format_inline(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(format_inline, value)) + "]"
    return dump([value], "line").strip()[1:-1]  # in a list, PyYAML does not append the line `...`


def _is_list_of_mappings(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _wrap(begin: str, value: Any, indent: str) -> str:
    """Return `begin` and the value; the lines of a mapping are broken behind commas, and continued at `indent`."""
    if not isinstance(value, Mapping) or not value:
        return begin + format_inline(value)
    lines, line = [], begin + "{"
    words = [f"{format_inline(key)}: {format_inline(item)}" for key, item in value.items()]
    for number, word in enumerate(words):
        word += "}" if number == len(words) - 1 else ", "
        if len(line) + len(word.rstrip()) > _MAX_COLUMNS and number:
            lines.append(line.rstrip())
            line = indent
        line += word
    return "\n".join([*lines, line])
