"""`rosrun drone_sim doctor`: checks of the machine and the shell that drone_sim runs in.

Modules here import packages that may be missing only in the functions that check for them.
"""

from __future__ import annotations

from typing import NamedTuple

OK, HINT, WRONG = "ok", "hint", "WRONG"
_MAX_LENGTH = 400  # characters


class Line(NamedTuple):
    """Result of a check: OK, HINT (it works, but could be better) or WRONG; subject; and facts with a cure, if any."""

    mark: str
    what: str
    text: str

    def __str__(self) -> str:
        text = " ".join(self.text.split())
        return f"{self.mark:5}  {self.what:14}  {text[:_MAX_LENGTH]}"
