"""Flight records made from formulas: some columns of the table are given as functions of time."""

from __future__ import annotations

from typing import Any

import numpy as np

from drone_sim.grading.criteria import KINDS
from drone_sim.grading.criteria.criterion import Criterion
from drone_sim.grading.flight_record import FlightRecord
from drone_sim.grading.result import Outcome
from drone_sim.offline.recording import COLUMNS

INDEX = {name.partition(" ")[0]: index for index, name in enumerate(COLUMNS)}


def times(seconds: float = 10.0, step: float = 0.01) -> np.ndarray:
    return np.arange(0, seconds + step / 2, step)


def flown(at: np.ndarray, is_whole: bool = True, more: dict[str, Any] | None = None, **columns: Any) -> FlightRecord:
    """Return the record of a level flight with the given columns; `vx` is in the world frame."""
    rows = np.zeros((len(at), len(COLUMNS)))
    rows[:, 0], rows[:, INDEX["qw"]] = at, 1.0
    for name, values in columns.items():
        rows[:, INDEX[name]] = values
    return FlightRecord(rows, is_whole, **(more or {}))


def criterion(kind: str, **values: Any) -> Criterion:
    (model,) = (kind_model for kind_model in KINDS if kind_model.model_fields["kind"].annotation.__args__ == (kind,))
    return model.model_validate({"kind": kind, **values})


def judged(flight: FlightRecord, kind: str, **values: Any) -> Outcome:
    return criterion(kind, **values).judge(flight)


def first_order(at: np.ndarray, lag: float, begins: float = 0.0) -> np.ndarray:
    return 1 - np.exp(-np.maximum(at - begins, 0) / lag)


def second_order(at: np.ndarray, frequency: float, damping: float) -> np.ndarray:
    """Return the step response of an underdamped system (Ogata, section 5-3), `frequency` the undamped one in rad/s."""
    root = np.sqrt(1 - damping**2)
    turn = frequency * root * at
    return 1 - np.exp(-damping * frequency * at) * (np.cos(turn) + damping / root * np.sin(turn))
