"""What a driver of a real drone, or another simulator, calls a vehicle's topics, and what its commands mean.

A profile (config/profiles) sets these parameters: docs/drivers.md. The topics themselves are in ros/vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, get_args

from pydantic import Field, PlainValidator, model_validator

from drone_sim.config.types import FOREIGN_TOPIC, MESSAGE_TYPE, Checked, Finite, Switch, Unit, Within
from drone_sim.mechanics.frames import Vector
from drone_sim.message_text import near_names

MAX_TOPICS = 64
_Field = Literal["linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"]


class AxisMeaning(Checked):
    """One command: a field of the Twist, and what the number 1 in it commands. Beyond `largest` the driver cuts it."""

    field: _Field
    one: Annotated[Finite, Within(-1e3, 1e3)] = 1.0  # m/s, rad/s, or rad of tilt; negative: the other direction
    largest: Annotated[Finite, Within(1e-6, 1e6)] | None = None

    def value(self, fields: Mapping[str, float]) -> float:
        """Return what a Twist with these fields commands; NaN stays NaN."""
        number = fields[self.field]
        is_cut = self.largest is not None and abs(number) > self.largest
        return self.one * (math.copysign(self.largest or 0.0, number) if is_cut else number)


class CommandMeaning(Checked):
    """What the numbers of cmd_vel mean: speeds, or a tilt forward and to the left with a climb and turn rate.

    With `lifts_off`, a command upwards starts a drone that stands.
    """

    means: Literal["speed", "tilt"] = "speed"
    forward: AxisMeaning = AxisMeaning(field="linear.x")
    left: AxisMeaning = AxisMeaning(field="linear.y")
    up: AxisMeaning = AxisMeaning(field="linear.z")
    turn: AxisMeaning = AxisMeaning(field="angular.z")
    lifts_off: Switch = False

    @property
    def is_ours(self) -> bool:
        """Whether a Twist is a velocity in m/s and rad/s, as without a driver."""
        return self == CommandMeaning(lifts_off=self.lifts_off)

    def converted(self, linear: Vector, angular: Vector) -> tuple[Vector, Vector]:
        """Return linear (m/s) and angular (rad/s) of the command for the scripts.

        A tilt is in the first two of angular: roll (to the right) and pitch (forward), in rad.
        """
        if self.is_ours:
            return linear, angular
        fields = dict(zip(get_args(_Field), (*linear, *angular)))
        forward, left, up, turn = (axis.value(fields) for axis in (self.forward, self.left, self.up, self.turn))
        if self.means == "tilt":
            return (0.0, 0.0, up), (-left, forward, turn)
        return (forward, left, up), (0.0, 0.0, turn)


QUANTITIES = (
    *("header", "child_frame", "time", "state", "battery"),
    *("pose", "position", "orientation", "roll", "pitch", "yaw"),
    *("twist_body", "twist_level", "twist_world", "velocity_body", "velocity_level", "velocity_world"),
    *("angular_velocity", "specific_force"),
)


class Source(NamedTuple):
    """The value of a message's field: a quantity (of a vector, its `part` x, y or z) times `factor`, or a constant."""

    quantity: str = ""
    part: str = ""
    factor: float = 1.0  # alone, without a quantity: the constant


def _source(value: Any) -> Source:
    name, factor = (value[0], value[1]) if isinstance(value, (list, tuple)) and len(value) == 2 else (value, 1.0)
    if isinstance(value, Source):
        return value
    if isinstance(name, (int, float)) and not isinstance(value, (list, tuple)):
        return Source(factor=name)
    if not isinstance(name, str) or isinstance(factor, bool) or not isinstance(factor, (int, float)):
        raise ValueError("must be a quantity such as yaw, a quantity and a factor such as [yaw, 57.3], or a number")
    quantity, _, part = name.partition(".")
    if quantity not in QUANTITIES or part not in ("", "x", "y", "z"):
        raise ValueError(f"no such quantity; {near_names(quantity, QUANTITIES)}")
    return Source(quantity, part, factor)


_Taken = Literal["cmd_vel", "takeoff", "land", "reset", "emergency", "home", "goto", "motors", "nothing"]


class DriverTopic(Checked):
    """A topic under a driver's name: it `takes` a command, `copies` one of our topics, or has `fields` of its own.

    A name that begins with / is in the namespace of the node, another one in that of the vehicle.
    """

    topic: Annotated[str, Field(pattern=FOREIGN_TOPIC, max_length=128)]
    takes: _Taken | None = None
    service: Switch = False  # a service takes the command
    copies: Annotated[str, Field(pattern=FOREIGN_TOPIC, max_length=128)] | None = None  # such as front or imu/data
    type: Annotated[str, Field(pattern=MESSAGE_TYPE, max_length=128)] | None = None
    fields: Annotated[dict[str, Annotated[Source, PlainValidator(_source)]], Field(max_length=64)] = Field(
        default_factory=dict
    )
    frame: Literal["base_link", "world"] = "base_link"  # of its header
    states: dict[str, int | str] = Field(default_factory=dict)  # what `state` is, by our word; `other` for all others
    every: Annotated[int, Within(1, 1_000_000), Unit("steps")] = 1
    latch: Switch = False  # sent when it changes, and to each new subscriber

    @model_validator(mode="after")
    def _check_kind(self) -> DriverTopic:
        given = [name for name in ("takes", "copies", "fields") if getattr(self, name)]
        if len(given) != 1:
            raise ValueError(f"must have one of takes, copies and fields, not {' and '.join(given) or 'none'}")
        if self.type is None and (self.fields or self.service):
            raise ValueError("must have the key type, such as geometry_msgs/Pose")
        if (self.takes == "motors" and not self.service) or (self.service and self.takes in (None, "cmd_vel", "goto")):
            raise ValueError("a service takes a request without values, or motors; a topic cannot take motors")
        return self
