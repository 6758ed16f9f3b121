"""Which object of the scene has arrows: one, or none. A click takes it, and another one lets it go."""

from __future__ import annotations


class Choice:
    """The same for all browsers."""

    def __init__(self) -> None:
        """Begin with none."""
        self.name = ""

    def toggle(self, name: str) -> None:
        """Take another one; let go of the one that has been taken."""
        self.name = "" if name == self.name else name
