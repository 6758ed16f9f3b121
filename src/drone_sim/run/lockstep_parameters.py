"""Parameters of lockstep: which topics the next step waits for, and what triggers their messages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from drone_sim.config.types import Checked, Finite, Within

STEP = "step"
_NONE = "none"  # as the launch argument, for no topics: an empty one is hard to write
_MAX_TOPICS = 64
_LONGEST = 200  # characters of a topic
_TOPIC = re.compile(r"/?[A-Za-z]\w*(/\w+)*", re.ASCII)
_STEPS = re.compile(r"([1-9][0-9]{0,4}) steps?")


def _check_topic(topic: str) -> str:
    if not _TOPIC.fullmatch(topic):
        raise ValueError("must be a topic such as cmd_vel, drone2/cmd_vel or /drone/cmd_vel")
    return topic


def _check_trigger(trigger: str) -> str:
    if not (_STEPS.fullmatch(trigger) or _TOPIC.fullmatch(trigger)):
        raise ValueError("must be step, a number of steps such as `4 steps`, odom, or a camera's topic such as front")
    return trigger


class AwaitedTopic(Checked):
    """A topic that the vehicles listen to, and the message that each of its messages answers."""

    topic: Annotated[str, Field(max_length=_LONGEST), AfterValidator(_check_topic)]
    trigger: Annotated[str, Field(max_length=_LONGEST), AfterValidator(_check_trigger)]
    every: Annotated[int, Within(1, 100_000)]

    @property
    def steps(self) -> int:
        """Number of steps between two triggers; 0 if a vehicle's topic is the trigger."""
        if self.trigger == STEP:
            return 1
        found = _STEPS.fullmatch(self.trigger)
        return int(found[1]) if found else 0


def _check_list(value: Any) -> Any:
    if not isinstance(value, list):
        raise ValueError("must be a list of topics such as [cmd_vel]")
    return value


class LockstepParameters(Checked):
    """What the next step waits for, and for how long. Without topics in `wait_for`, no step waits."""

    wait_for: Annotated[list[AwaitedTopic], BeforeValidator(_check_list), Field(max_length=_MAX_TOPICS)]
    trigger: Annotated[str, Field(max_length=_LONGEST), AfterValidator(_check_trigger)]
    every: Annotated[int, Within(1, 100_000)]
    timeout: Annotated[Finite, Within(0.01, 1e4)]
    start_timeout: Annotated[Finite, Within(0.1, 1e4)]
    on_timeout: Literal["hold", "go on", "end"]

    @model_validator(mode="before")
    @classmethod
    def _complete_topics(cls, values: Any) -> Any:
        """Accept names in place of entries, and names separated by commas, as the launch argument has them."""
        if not isinstance(values, Mapping):
            return values
        entries = values.get("wait_for")
        if isinstance(entries, str):
            entries = [] if entries.strip() in ("", _NONE) else [name.strip() for name in entries.split(",")]
        if not isinstance(entries, (list, tuple)):
            return values
        common = {key: values[key] for key in ("trigger", "every") if key in values}
        named = [{"topic": entry} if isinstance(entry, str) else entry for entry in entries]
        completed = [{**common, **entry} if isinstance(entry, Mapping) else entry for entry in named]
        return {**values, "wait_for": completed}
