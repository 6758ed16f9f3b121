"""What could not be brought, or is not as it was, object by object."""

from __future__ import annotations

from collections.abc import Iterator

_MOST_NAMES = 8  # in a line that is for people


class Report:
    """Lines for the end of an import, by what they say; objects of which the same is said share one."""

    def __init__(self) -> None:
        """Begin with nothing to say."""
        self.notes: list[str] = []  # what is the same by other means
        self._said: dict[str, list[str]] = {}

    def add(self, name: str, what: str) -> None:
        """Say something of an object; '' is the whole file."""
        names = self._said.setdefault(what, [])
        if name not in names:
            names.append(name)

    def __len__(self) -> int:
        """How much there is to say."""
        return len(self._said)

    def short(self) -> Iterator[str]:
        """Yield one line for everything that is said, with the first of its objects."""
        for what, names in self._said.items():
            more = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
            yield self._line([*names[:_MOST_NAMES]], more, what)

    def whole(self) -> Iterator[str]:
        """Yield one line for everything that is said, with all of its objects."""
        for what, names in self._said.items():
            yield self._line(names, "", what)

    @staticmethod
    def _line(names: list[str], more: str, what: str) -> str:
        return f"{', '.join(names)}{more}: {what}" if names != [""] else what
