"""`sim`: graphs, that is, streams of numbers that the cockpit plots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from drone_sim.mechanics.saved_state import Restore, saved
from drone_sim.scripting.api.calls import sim
from drone_sim.scripting.api.types import Handle, Name, Number, check_name, numbers

_MOST = 1000  # streams


class Graphs:
    """Streams of graphs by handle: each with its graph, its name, and its latest value (None before the first)."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        self._streams: dict[int, tuple[int, str, float | None]] = {}

    def add(self, handle: int, graph: int, name: str) -> int:
        """Add a stream to a graph, unless the graph has one with this name; return its handle. Raises ValueError."""
        check_name(name, "a stream")
        existing = next((key for key, stream in self._streams.items() if stream[:2] == (graph, name)), None)
        if existing is not None:
            return existing
        if len(self._streams) >= _MOST:
            raise ValueError(f"at most {_MOST} streams of graphs are allowed: destroy some")
        self._streams[handle] = graph, name, None
        return handle

    def set(self, graph: int, stream: int, value: float | None) -> None:
        """Set the next value of a stream. Raises ValueError if the graph has no such stream."""
        if self._streams.get(stream, (None,))[0] != graph:
            raise ValueError(f"the graph {graph} has no stream with the handle {stream}")
        self._streams[stream] = (*self._streams[stream][:2], value)

    def remove(self, graph: int, stream: int) -> None:
        """Remove a stream. Raises ValueError if the graph has no such stream."""
        self.set(graph, stream, None)
        del self._streams[stream]

    def reset(self, graph: int) -> None:
        """Delete the values of a graph's streams."""
        self._streams = {
            key: (own, name, None if own == graph else value) for key, (own, name, value) in self._streams.items()
        }

    def values(self) -> dict[str, float]:
        """Return the latest value of each stream that has one, by the stream's name."""
        return {name: value for _, name, value in self._streams.values() if value is not None}

    def save_state(self) -> Restore:
        return saved(self, "_streams")


class GraphFunctions:
    """Graphs: numbers that the cockpit plots. Any object may be used as a graph.

    Colours, units and ranges are accepted and ignored.
    """

    def __init__(self, graphs: Graphs, new_handle: Callable[[], int]):
        """`graphs` are those of the simulation; `new_handle` returns an unused handle."""
        self._graphs, self._new_handle = graphs, new_handle

    @sim("45", addGraphDataStream="")
    def addGraphStream(self, graph: Handle, name: Name, *_look: Any) -> int:
        """Add a stream of numbers to a graph; return its handle."""
        return self._graphs.add(self._new_handle(), graph, name)

    @sim("45")
    def setGraphStreamValue(self, graph: Handle, stream: Handle, value: Number) -> None:
        """Set the next value of a stream."""
        self._graphs.set(graph, stream, numbers((value,), 1)[0])

    @sim("345")
    def setGraphUserData(self, graph: Handle, name: Name, value: Number) -> None:
        """Set the next value of the stream with a name (3.x)."""
        stream = self._graphs.add(self._new_handle(), graph, name)
        self._graphs.set(graph, stream, numbers((value,), 1)[0])

    @sim("45")
    def destroyGraphCurve(self, graph: Handle, stream: Handle) -> None:
        """Remove a stream from a graph."""
        self._graphs.remove(graph, stream)

    @sim("345")
    def resetGraph(self, graph: Handle) -> None:
        """Delete the values of a graph's streams."""
        self._graphs.reset(graph)
