"""What a script is expected to read next: it is read before the script asks for it, and sent with another answer."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from drone_sim.scripting.api.calls import Function
from drone_sim.scripting.door import effects, values
from drone_sim.scripting.door.places import Place, place_of
from drone_sim.scripting.door.values import NoMessage

if TYPE_CHECKING:
    from drone_sim.scripting.door.simulation_end import SimulationEnd

_LOG = logging.getLogger(__name__)
_MOST = 200  # reads that are expected, at a time, and lists of them
_LONGEST = 1000  # characters of a phase
_PLACED = f"sim.{effects.PLACED[-1]}"  # which reads all of an object's place
_NOTHING: tuple[list[Any], list[int]] = ([], [])


class ExpectedReads:
    """The reads of a script, by phase and stretch of it."""

    def __init__(self, door: SimulationEnd, functions: Mapping[str, Function], value: Callable[[Any], Any]):
        """Expect none yet; `functions` are the script's modules', `value` returns what an argument stands for."""
        self._door, self._functions, self._value = door, functions, value
        self._expected: dict[tuple[str, int], tuple[list[tuple[Function, list[Any]]], list[int]]] = {}

    def note(self, item: list[Any]) -> None:
        """Take what a script says that it reads in a stretch of a phase. Raises NoMessage."""
        if [type(one) for one in item[1:]] != [str, int, list, list]:
            raise NoMessage("no reads")
        if max(len(item[3]), len(item[4]), len(self._expected)) > _MOST:
            raise NoMessage("too many reads")
        if not all(type(one) is int for one in item[4]):
            raise NoMessage("no handles")
        reads = [self._read(one) for one in item[3]]
        handles = [one for one in item[4] if self._may(_PLACED, [one])]
        self._expected[item[1][:_LONGEST], item[2]] = reads, handles

    def _read(self, said: Any) -> tuple[Function, list[Any]]:
        if type(said) is not list or not said or type(said[0]) is not str:
            raise NoMessage("no read")
        name = said[0]
        if name not in effects.READS or name not in self._functions:
            raise NoMessage("no read")
        arguments = [self._value(one) for one in said[1:]]
        return (self._functions[name] if self._may(name, arguments) else _refused), arguments

    def _may(self, name: str, arguments: list[Any]) -> bool:
        try:
            self._door.permit(name, arguments)
        except ValueError:
            return False
        return True

    def answers(self, phase: str, stretch: int) -> tuple[list[Any], list[Place]]:
        """Return the answers to what is expected, Ellipsis for what cannot be answered, and where objects are."""
        reads, handles = self._expected.get((phase, stretch), _NOTHING)
        found = []
        for function, arguments in reads:
            try:
                found.append(values.outgoing(function(*arguments)))
            except Exception:  # raised again if the script makes the call
                _LOG.debug("an expected read failed:", exc_info=True)
                found.append(...)
        objects = self._door.objects
        if objects is None:
            return found, []
        return found, [place for handle in handles if (place := place_of(objects, handle)) is not None]


def _refused(*_: Any) -> NoReturn:
    raise ValueError("the script may not read this")
