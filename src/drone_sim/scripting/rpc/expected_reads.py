"""Reads that a script is expected to make next; their results are sent in advance, with another reply."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from drone_sim.scripting.api.calls import Function
from drone_sim.scripting.rpc import effects, values
from drone_sim.scripting.rpc.connection import ScriptConnection
from drone_sim.scripting.rpc.places import Place, place_of
from drone_sim.scripting.rpc.values import InvalidMessage

_LOG = logging.getLogger(__name__)
_MAX_PHASE_LENGTH = 1000  # characters of a phase
_POSE_FUNCTION = f"sim.{effects.PLACED[-1]}"  # reads the complete pose of an object
_NOTHING: tuple[list[Any], list[int]] = ([], [])


class ExpectedReads:
    """The expected reads of a script, by phase and segment."""

    def __init__(self, connection: ScriptConnection, functions: Mapping[str, Function], value: Callable[[Any], Any]):
        """Create empty lists; `functions` are the script's API, `value` decodes an argument."""
        self._connection, self._functions, self._value = connection, functions, value
        self._expected: dict[tuple[str, int], tuple[list[tuple[Function, list[Any]]], list[int]]] = {}

    def note(self, item: list[Any]) -> None:
        """Store the reads that the script announces for a segment of a phase. Raises InvalidMessage."""
        if [type(field) for field in item[1:]] != [str, int, list, list]:
            raise InvalidMessage("malformed list of reads")
        if max(len(item[3]), len(item[4]), len(self._expected)) > effects.MAX_READS:
            raise InvalidMessage("too many reads")
        if not all(type(handle) is int for handle in item[4]):
            raise InvalidMessage("handles must be integers")
        reads = [self._read(read) for read in item[3]]
        handles = [handle for handle in item[4] if self._is_permitted(_POSE_FUNCTION, [handle])]
        self._expected[item[1][:_MAX_PHASE_LENGTH], item[2]] = reads, handles

    def _read(self, read: Any) -> tuple[Function, list[Any]]:
        if type(read) is not list or not read or type(read[0]) is not str:
            raise InvalidMessage("not a read")
        name = read[0]
        if name not in effects.READS or name not in self._functions:
            raise InvalidMessage("not a read")
        arguments = [self._value(value) for value in read[1:]]
        return (self._functions[name] if self._is_permitted(name, arguments) else _refused), arguments

    def _is_permitted(self, name: str, arguments: list[Any]) -> bool:
        try:
            self._connection.permit(name, arguments)
        except ValueError:
            return False
        return True

    def results_of(self, phase: str, segment: int) -> tuple[list[Any], list[Place]]:
        """Return the results of the expected reads (Ellipsis if a read fails), and poses of objects."""
        reads, handles = self._expected.get((phase, segment), _NOTHING)
        results = []
        for function, arguments in reads:
            try:
                results.append(values.outgoing(function(*arguments)))
            except Exception:  # raised again if the script makes the call
                _LOG.debug("an expected read failed:", exc_info=True)
                results.append(...)
        objects = self._connection.objects
        if objects is None:
            return results, []
        return results, [place for handle in handles if (place := place_of(objects, handle)) is not None]


def _refused(*_: Any) -> NoReturn:
    raise ValueError("the script may not read this")
