"""Signal: what a script has said, by a signal of V-REP's or on a topic, such as how many objects it has counted."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from drone_sim.config.types import Label, ParameterError, ScriptValue
from drone_sim.grading.criteria.criterion import Bound, Criterion, FlightPart, Missed, figure
from drone_sim.grading.flight_record import ValueChange
from drone_sim.grading.result import Outcome
from drone_sim.message_text import shown

_Words = Annotated[str, Field(max_length=200)]


def _of_words(field: str) -> str:
    if not all(field.split(".")):
        raise ValueError("must be names with dots between them, such as pose.position.x")
    return field


class Signal(Criterion):
    """What `signal` or `topic` last said between `after` and `until` is to be `equals`, numbers within `tolerance`.

    A signal may be an integer, a float or a string; of a message `field` counts, such as pose.position.x.
    """

    kind: Literal["signal"]
    signal: _Words = ""
    topic: _Words = ""
    field: Annotated[Label, AfterValidator(_of_words)] = "data"
    equals: ScriptValue
    tolerance: Bound = 0.0

    def model_post_init(self, context: Any) -> None:
        """Check that it is one of the two."""
        super().model_post_init(context)
        if bool(self.signal) == bool(self.topic):
            raise ParameterError("there must be a `signal` or a `topic`, and not both", ("signal",))

    @property
    def allowed(self) -> str:
        """What passes."""
        return f"{_readable(self.equals)}{f' within {figure(self.tolerance)}' if self.tolerance else ''}"

    @property
    def signals(self) -> tuple[str, ...]:
        """What it asks for."""
        return (self.signal,) if self.signal else ()

    @property
    def topics(self) -> tuple[str, ...]:
        """What it asks for."""
        return (self.topic,) if self.topic else ()

    def _judged(self, part: FlightPart) -> Outcome:
        what = self.signal or self.topic
        heard = [one for one in part.flight.values.get(what, ()) if self.after - 1e-9 <= one.at <= part.end + 1e-9]
        if not heard or heard[-1].value is None:
            raise Missed(f"nothing was said by {what} until {part.end:.2f} s")
        said = self._inside(heard[-1])
        passed = _equal(said, self.equals, self.tolerance)
        sentence = f"{what} was {_readable(said)} from {heard[-1].at:.2f} s on; expected is {self.allowed}"
        is_number = isinstance(said, (int, float)) and not isinstance(said, bool)
        return self._outcome(passed, sentence, float(said) if is_number else None, "", heard[-1].at)

    def _inside(self, heard: ValueChange) -> Any:
        """Return a signal's value, or that of a field of a message. Raises Missed."""
        value = heard.value
        for name in self.field.split(".") if self.topic else ():
            value = value.get(name) if isinstance(value, dict) else getattr(value, name, None)
            if value is None:
                raise Missed(f"what was said on {self.topic} at {heard.at:.2f} s has no field {self.field}")
        return value


def _readable(value: Any) -> str:
    return figure(value) if isinstance(value, float) else shown(value)


def _equal(said: Any, expected: Any, tolerance: float) -> bool:
    """Tell whether two values are the same: numbers and lists of numbers within the tolerance, texts to the letter."""
    if isinstance(expected, str):
        return (said.decode("utf-8", "replace") if isinstance(said, bytes) else said) == expected
    try:
        first, second = np.asarray(said, float), np.asarray(expected, float)
    except (TypeError, ValueError):
        return False
    return first.shape == second.shape and bool((np.abs(first - second) <= tolerance).all())
