"""Values that change while the simulation runs: what comes is laid over what is, and checked like the YAML files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from drone_sim.config.errors import problems, told
from drone_sim.config.types import Checked, ParameterError, merged

_Model = TypeVar("_Model", bound=Checked)


def changed(model: _Model, changes: Mapping[str, Any]) -> _Model:
    """Return a model with other values laid over some of its own. Raises ParameterError."""
    try:
        return type(model).model_validate(merged(model.model_dump(), changes))
    except ValidationError as error:
        raise ParameterError(told([(None, one.text) for one in problems(error, type(model))])) from None
