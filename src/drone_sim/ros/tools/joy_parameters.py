"""What the values of config/joy.yaml may be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import ValidationError

from drone_sim.config.errors import line_of, problems, told
from drone_sim.config.types import Checked, FileName, Finite, ParameterError, Within, merged, read_yaml
from drone_sim.files import yaml_files
from drone_sim.files.resources import package_path, resolve
from drone_sim.wording import shown

_Number = Annotated[int, Within(-1, 255)]


class AxisParameters(Checked):
    """Which axis, and the speed (m/s or rad/s) at its end."""

    axis: _Number
    scale: Annotated[Finite, Within(-20, 20)]


class AxesParameters(Checked):
    """What the axes command."""

    vx: AxisParameters
    vy: AxisParameters
    vz: AxisParameters
    wz: AxisParameters


class ButtonParameters(Checked):
    """Which buttons ask for what."""

    takeoff: _Number
    land: _Number
    reset: _Number


class JoyParameters(Checked):
    """Everything in config/joy.yaml."""

    device: FileName
    dead_man: Annotated[int, Within(0, 255)]
    axes: AxesParameters
    dead_zone: Annotated[Finite, Within(0, 0.9)]
    buttons: ButtonParameters
    rate: Annotated[Finite, Within(1, 100)]
    timeout: Annotated[Finite, Within(0.1, 1000, or_zero=True)]


def load(given: Mapping[str, Any]) -> JoyParameters:
    """Return config/joy.yaml with the file under the key `config`, and the other keys, laid over it.

    Raises ParameterError.
    """
    file = given.get("config", "")
    if not isinstance(file, str):
        raise ParameterError(f"parameter config = {shown(file)}: must be the name of a file")
    values = read_yaml(package_path() / "config" / "joy.yaml")
    lines = yaml_files.Lines("")
    if file:
        try:
            path = resolve(file)
        except FileNotFoundError as error:
            raise ParameterError(f"parameter config = {shown(file)}: {error}") from None
        values, lines = merged(values, read_yaml(path)), yaml_files.lines(path)
    values = merged(values, {key: value for key, value in given.items() if key != "config"})
    try:
        return JoyParameters.model_validate(values)
    except ValidationError as error:
        found = [(line_of(lines, one), one.text) for one in problems(error, JoyParameters)]
        raise ParameterError(told(found, file if any(line for line, _ in found) else "")) from None
