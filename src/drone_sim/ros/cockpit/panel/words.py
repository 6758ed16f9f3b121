"""Lines of text in the panel. viser's own text fields are as narrow as a name, and show a few lines."""

from __future__ import annotations

import html
from typing import Any

_LONGEST = 600  # characters of a line
_STYLE = "font:11px/1.45 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere;margin:4px 10px"
_AT_THE_END = "display:flex;flex-direction:column-reverse;max-height:300px;overflow:auto"  # until somebody scrolls


class Words:
    """A heading, and lines below it, of whatever kind: they are text, never HTML."""

    def __init__(self, gui: Any, heading: str):
        """Draw it without lines."""
        self._heading = heading
        self._text = ""
        self._drawn = gui.add_html(self._html())

    def show(self, lines: list[str]) -> None:
        """Show these lines in the place of the last ones."""
        text = "\n".join(one[:_LONGEST] for one in lines)
        if text != self._text:
            self._text = text
            self._drawn.content = self._html()

    def _html(self) -> str:
        heading, text = html.escape(self._heading), html.escape(self._text)
        body = f'<div style="{_AT_THE_END}"><pre style="{_STYLE}">{text}</pre></div>'
        return f'<div style="margin:6px 10px;font-size:12px;font-weight:600">{heading}</div>{body}'
