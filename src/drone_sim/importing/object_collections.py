"""Import of V-REP collections as entries of `collections:`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drone_sim.importing.folder import Report, label
from drone_sim.vrep_files.model import VrepCollection


def entries(
    collections: Sequence[VrepCollection], names: Mapping[int, str], report: Report
) -> Iterator[dict[str, Any]]:
    """Yield the entries of `collections:`; `names` maps handles of imported objects to their names."""
    used: set[str] = set()
    for collection in collections:
        name = label(collection.name)
        if not name or name in used:  # created by V-REP's editor; no script finds it by name
            continue
        used.add(name)
        items: list[dict[str, Any]] = []
        for item in collection.items:
            if item.what != "all" and item.object not in names:
                report.add(collection.name, "a collection: some of its objects are not imported")
                continue
            target = {"what": item.what, "object": names.get(item.object, "")}
            flags = {"removes": item.removes, "without": item.without}
            items.append({key: value for key, value in {**target, **flags}.items() if value})
        yield {"name": name, "items": items}
