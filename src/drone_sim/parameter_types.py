"""What a value in a YAML file may be, and the one line that a wrong one gets."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Optional, Tuple, Union

import yaml
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from typing_extensions import Annotated

from drone_sim.resources import resolve


class ParameterError(ValueError):
    """A parameter is wrong; the message is one line that names key, value and what is allowed."""


def _existing_file(name: str) -> str:
    try:
        return str(resolve(name))
    except FileNotFoundError as error:
        raise ValueError(str(error)) from None


def _none_from_word(value: Any) -> Any:
    # ROS's parameter server cannot hold YAML's null.
    return None if value in ("none", "null", "", []) else value


def _increasing(pair: Optional[Tuple[float, float]]) -> Optional[Tuple[float, float]]:
    if pair is not None and not pair[0] < pair[1]:
        raise ValueError("must be [lowest, highest] with lowest < highest")
    return pair


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Point = Tuple[Finite, Finite, Finite]
Fraction = Annotated[float, Field(ge=0, le=1)]
Color = Tuple[Fraction, Fraction, Fraction, Fraction]
File = Annotated[str, AfterValidator(_existing_file)]
OptionalFile = Annotated[str, AfterValidator(lambda name: _existing_file(name) if name else "")]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
AngleOrNone = Annotated[
    Optional[Annotated[float, Field(gt=0, lt=3.14, allow_inf_nan=False)]], BeforeValidator(_none_from_word)
]
Limits = Annotated[Optional[Tuple[Finite, Finite]], BeforeValidator(_none_from_word), AfterValidator(_increasing)]


class Checked(BaseModel):
    """Every key is known, every value checked, and nothing changes after that."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def read_yaml(path: Union[str, Path]) -> Dict[str, Any]:
    """Return the mapping in a YAML file; raises ParameterError, in one line, where there is none."""
    try:
        values = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(values, dict):
        raise ParameterError(f"{path}: must hold `key: value` lines, not {type(values).__name__}")
    return values
