"""Signal: a value that a script has published, as a signal or on a topic, such as a count of objects."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field

from drone_sim.config.types import Label, ParameterError, ScriptValue
from drone_sim.grading.criteria.criterion import (
    ROUNDING,
    Bound,
    Criterion,
    CriterionFailed,
    FlightPart,
    Hint,
    format_figure,
)
from drone_sim.grading.result import Outcome
from drone_sim.message_text import shown

_SourceName = Annotated[str, Field(max_length=200)]


def _check_field(field: str) -> str:
    if not all(field.split(".")):
        raise ValueError("must be names with dots between them, such as pose.position.x")
    return field


class Signal(Criterion):
    """The last value of `signal` or `topic` between `after` and `until` equals `equals`, numbers within `tolerance`.

    A signal may be an integer, a float or a string. `field` selects a field of a message, such as pose.position.x.
    """

    kind: Literal["signal"]
    hint: Hint = "Print the value with its time: when does it become wrong?"
    signal: _SourceName = ""
    topic: _SourceName = ""
    field: Annotated[Label, AfterValidator(_check_field)] = "data"
    equals: ScriptValue
    tolerance: Bound = 0.0

    def model_post_init(self, context: Any) -> None:
        """Refuse a criterion without a source, or with two."""
        super().model_post_init(context)
        if bool(self.signal) == bool(self.topic):
            raise ParameterError("there must be a `signal` or a `topic`, and not both", ("signal",))

    @property
    def allowed(self) -> str:
        tolerance = f" within {format_figure(self.tolerance)}" if self.tolerance else ""
        return f"{_format_value(self.equals)}{tolerance}"

    @property
    def signals(self) -> tuple[str, ...]:
        return (self.signal,) if self.signal else ()

    @property
    def topics(self) -> tuple[str, ...]:
        return (self.topic,) if self.topic else ()

    def _judge_part(self, part: FlightPart) -> Outcome:
        source = self.signal or self.topic
        begin, end = self.after - ROUNDING, part.end + ROUNDING
        changes = [change for change in part.flight.values.get(source, ()) if begin <= change.at <= end]
        if not changes or changes[-1].value is None:
            raise CriterionFailed(f"{source} has no value at {part.end:.2f} s")
        at, value = changes[-1]
        for name in self.field.split(".") if self.topic else ():
            value = value.get(name) if isinstance(value, dict) else getattr(value, name, None)
            if value is None:
                raise CriterionFailed(f"the message on {self.topic} at {at:.2f} s has no field {self.field}")
        sentence = f"{source} was {_format_value(value)} from {at:.2f} s on; expected is {self.allowed}"
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        passed = _is_equal(value, self.equals, self.tolerance)
        return self._make_outcome(passed, sentence, float(value) if is_number else None, "", at)


def _format_value(value: Any) -> str:
    return format_figure(value) if isinstance(value, float) else shown(value)


def _is_equal(value: Any, expected: Any, tolerance: float) -> bool:
    """Return whether two texts are equal, or two numbers, or lists of numbers, differ by at most the tolerance."""
    if isinstance(expected, str):
        return (value.decode("utf-8", "replace") if isinstance(value, bytes) else value) == expected
    try:
        first, second = np.asarray(value, float), np.asarray(expected, float)
    except (TypeError, ValueError):
        return False
    return first.shape == second.shape and bool((np.abs(first - second) <= tolerance).all())
