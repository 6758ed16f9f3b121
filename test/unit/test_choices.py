"""What a YAML file may choose among by one word: wrong ones are told by that word's key."""

from typing import Annotated, Literal

import pytest
from pydantic import Field, ValidationError

from drone_sim.config.errors import problems
from drone_sim.config.types import Checked, Length, one_of


class Ranger(Checked):
    kind: Literal["ultrasonic", "laser"]
    reach: Length


class Scale(Checked):
    kind: Literal["scale"]
    weight: Annotated[tuple[Length, Length], Field(description="2 numbers, [low, high] in N")] = (1.0, 2.0)


class Sensors(Checked):
    sensors: dict[str, one_of(Ranger, Scale)]
    spare: one_of(Ranger, Scale) | None = None
    places: list[one_of(Ranger, Scale)] | None = None


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"sensors": {"a": {"reach": 1}}}, "sensors/a/kind: missing; must be one of 'ultrasonic', 'laser', 'scale'"),
        (
            {"sensors": {"a": {"kind": "nose"}}},
            "sensors/a/kind = 'nose': must be one of 'ultrasonic', 'laser', 'scale'",
        ),
        ({"sensors": {"a": 3}}, "sensors/a = 3: must have `key: value` lines, one of them `kind`"),
        ({"sensors": {"a": {"kind": "laser"}}}, "sensors/a/reach: missing"),
        (
            {"sensors": {"scale": {"kind": "scale", "weight": 3}}},
            "sensors/scale/weight = 3: must be 2 numbers, [low, high] in N",
        ),
        (
            {"sensors": {"a": {"kind": "laser", "raech": 1, "reach": 1}}},
            "sensors/a/raech: unknown key; near names are reach",
        ),
        ({"sensors": {}, "spare": {"kind": 5}}, "spare/kind = 5: must be one of 'ultrasonic', 'laser', 'scale'"),
        ({"sensors": {}, "places": [{}]}, "places/0/kind: missing; must be one of 'ultrasonic', 'laser', 'scale'"),
    ],
)
def test_a_wrong_choice_gets_one_line(given, told):
    with pytest.raises(ValidationError) as refused:
        Sensors.model_validate(given)
    (problem,) = problems(refused.value, Sensors)
    assert problem.sentence == f"parameter {told}"
