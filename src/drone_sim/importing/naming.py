"""Names for objects: unique, short enough, and such as a scene file may have."""

from __future__ import annotations

from collections.abc import Iterable

from drone_sim.importing.labels import label
from drone_sim.importing.placing import Placed
from drone_sim.importing.report import Report
from drone_sim.wording import MAX_NAME


class Names:
    """Gives every object a name of its own."""

    def __init__(self, taken: Iterable[str] = ()):
        """Take the names that are not free."""
        self._taken = set(taken)

    def give(self, objects: Iterable[Placed], report: Report) -> None:
        """Name every object as in the file, where that can be."""
        for one in objects:
            wanted = one.object.name or one.object.alias or f"object_{one.object.handle}"
            one.name = self.free(wanted)
            if one.name != wanted:
                report.add(wanted, f"is called {one.name} here")

    def free(self, wanted: str) -> str:
        """Return a name like the one wanted, and take it."""
        plain = label(wanted) or "object"
        name, number = plain, 2
        while name in self._taken:
            end = f"_{number}"
            name, number = plain[: MAX_NAME - len(end)] + end, number + 1
        self._taken.add(name)
        return name
