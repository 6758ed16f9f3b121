"""`rosrun drone_sim doctor`: is all there that drone_sim needs?

A module here imports what may be missing only where it finds that out.
"""

from __future__ import annotations

from typing import NamedTuple

OK, HINT, WRONG = "ok", "hint", "WRONG"
_LONGEST = 400  # characters


class Line(NamedTuple):
    """`mark` is OK, HINT (it works, but), or WRONG; `said` tells what is so and, unless it is well, what to do."""

    mark: str
    what: str
    said: str

    def __str__(self) -> str:
        """Return it as it is printed."""
        said = " ".join(self.said.split())
        return f"{self.mark:5}  {self.what:14}  {said[:_LONGEST]}"
