"""Formatting of values in messages, and suggestions for misspelled names."""

from __future__ import annotations

import difflib
import re
import reprlib
from collections.abc import Iterable
from typing import Any

MAX_NAME = 64  # characters of a name in any file
_MAX_NAMES = 12  # in an error message
# Control characters, what turns the direction of writing, and halves of characters.
_CONTROLS = re.compile("[^\t\n\x20-\x7e\xa0-\u2029\u202f-\u2065\u206a-\ud7ff\ue000-\U0010ffff]")
_SHORT = reprlib.Repr()
_SHORT.maxstring, _SHORT.maxother, _SHORT.maxlevel = 300, 60, 3


def shown(value: Any) -> str:
    """Return a short one-line text of any value, for a message."""
    if isinstance(value, str):
        return _SHORT.repr(value)
    try:
        return f"{_SHORT.repr(value):.60}"
    except Exception:  # such as an int with too many digits for Python, or a __repr__ that fails
        return f"(a {type(value).__name__})"


def printable(text: str) -> str:
    """Return a text with ? for unprintable characters: control characters, newlines, undecodable bytes."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def escaped(text: str) -> str:
    r"""Return a text in which control characters can be seen: ESC as `\x1b`. Tabs and line ends stay as they are."""
    return _CONTROLS.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def encodable(text: str) -> str:
    r"""Return a text that can be encoded in UTF-8: a lone surrogate, which is invalid, becomes `\ud800`."""
    return text if text.isascii() else text.encode("utf-8", "backslashreplace").decode("utf-8")


def near_names(name: str, known: Iterable[str]) -> str:
    """Return 'near names are a, b' for an error message, or the known names if none is similar."""
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=4, cutoff=0.5)
    if near:
        return f"near names are {', '.join(near)}"
    more = f" and {len(known) - _MAX_NAMES} more" if len(known) > _MAX_NAMES else ""
    return f"known are {', '.join(known[:_MAX_NAMES])}{more}"
