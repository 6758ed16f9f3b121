"""The collections of a file as those of a scene file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drone_sim.importing.folder import Report, label
from drone_sim.vrep_files.model import VrepCollection


def entries(
    collections: Sequence[VrepCollection], names: Mapping[int, str], report: Report
) -> Iterator[dict[str, Any]]:
    """Yield the entries of `collections:`; `names` are those of the objects that are brought, by handle."""
    given: set[str] = set()
    for one in collections:
        name = label(one.name)
        if not name or name in given:  # the editor's own, which nobody finds by a name
            continue
        given.add(name)
        items: list[dict[str, Any]] = []
        for item in one.items:
            if item.what != "all" and item.object not in names:
                report.add(one.name, "a collection: some of its objects are not imported")
                continue
            said = {"what": item.what, "object": names.get(item.object, "")}
            switches = {"removes": item.removes, "without": item.without}
            items.append({key: value for key, value in {**said, **switches}.items() if value})
        yield {"name": name, "items": items}
