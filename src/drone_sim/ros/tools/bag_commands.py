"""Write the commands in a bag as a timeline: `fly --commands` flies them again, step by step."""

from __future__ import annotations

import argparse
import functools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import Any, NamedTuple

from drone_sim.command_line import Parser, status_of
from drone_sim.config.types import Checked
from drone_sim.files import writing
from drone_sim.files.yaml_writing import dump
from drone_sim.mechanics import frames
from drone_sim.ros.core.message_conversion import WORLD_FRAME, xyz, xyzw
from drone_sim.ros.core.validation import read_changes
from drone_sim.ros.tools.bags import PUSH, STATE, TWIST, Bag, BagError, BagFlight, BagSteps, RecordedMessage
from drone_sim.run import parameters
from drone_sim.vehicles.checks import Refused
from drone_sim.vehicles.commands import EMPTY, POSE, REQUESTS

_NAME = "bag_commands"
_MAX_EARLY, _MAX_LATE = 2, 20  # steps by which the recorder may receive a command before or after the simulator
_NEXT_STATES = {"takeoff": "taking off", "land": "landing"}  # published in the step that executes the request
_Action = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
    parser = Parser(prog=_NAME, description=__doc__)
    parser.add_argument("bag", metavar="BAG", help="a bag with odometry")
    parser.add_argument("timeline", metavar="OUT.yaml")
    parser.add_argument("--vehicle", metavar="NAME", help="which of several vehicles (default: the first)")
    options = parser.parse_args(arguments)
    return status_of(_NAME, lambda: _write(options))


def _write(options: argparse.Namespace) -> None:
    if not options.timeline.endswith((".yaml", ".yml")):
        raise ValueError(f"{options.timeline}: must end in .yaml, .yml")
    writing.check_writable(options.timeline)
    with closing(Bag(options.bag)) as bag:
        flight = BagFlight(bag, options.vehicle)
        entries = sorted(_entries(bag, flight), key=lambda entry: entry["at"])
        first_state = next((state.message.data for state in bag.read(f"{flight.namespace}/state", STATE)), "")
    if not entries:
        raise BagError(f"{options.bag}: it has no commands on {flight.namespace}/cmd_vel or another command topic")
    landed = " --set start=landed" if first_state == "landed" else ""
    lines = "".join(f"- {dump(entry, 'line')}" for entry in entries)
    writing.write(options.timeline, f"# fly --commands{landed}\n{lines}")
    print(f"{_NAME}: wrote {options.timeline}, {len(entries)} commands: fly --commands {options.timeline}{landed}")


def _entries(bag: Bag, flight: BagFlight) -> Iterator[_Action]:
    """Yield the entries of the timeline. Raises BagError."""
    steps = flight.steps()
    yield from _twists(bag.read(f"{flight.namespace}/cmd_vel", TWIST), steps)
    states = bag.read(f"{flight.namespace}/state", STATE)
    state_rows = [(steps.row_after(state.at) - 1, state.message.data) for state in states]
    for topic, (kind, read) in _READERS.items():
        execution_rows = [row for row, state in state_rows if state == _NEXT_STATES.get(topic)]
        for recorded in bag.read(f"{flight.namespace}/{topic}", kind):
            action, row = read(recorded.message), steps.row_after(recorded.at)
            near = [other for other in execution_rows if row - _MAX_LATE <= other <= row + _MAX_EARLY]
            row = min(near, key=lambda other: abs(other - row), default=row)
            if action is not None:
                yield {"at": steps.time(row), **action}


class _RecordedTwist(NamedTuple):
    """A twist, and the row of odometry in which it was recorded."""

    row: int
    linear: tuple[float, ...]
    angular: tuple[float, ...]

    @property
    def command(self) -> tuple[float, ...]:
        """Linear velocity and yaw rate that the simulator publishes while this twist is in force."""
        return *self.linear, self.angular[2]


def _twists(messages: Iterator[RecordedMessage], steps: BagSteps) -> Iterator[_Action]:
    """Yield twists at the steps that executed them, as far as the recorded commands in force show it."""
    twists = [
        _RecordedTwist(steps.row_after(recorded.at), xyz(recorded.message.linear), xyz(recorded.message.angular))
        for recorded in messages
        if _is_finite(*xyz(recorded.message.linear), *xyz(recorded.message.angular))
    ]
    for twist, row in zip(twists, _execution_rows(twists, _match_rows(twists, steps))):
        yield {"at": steps.time(row), "twist": {"linear": [*twist.linear], "angular": [*twist.angular]}}


class _Match(NamedTuple):
    """Best match of all twists up to the one that came into force in `row`."""

    row: int
    total: int  # number of matched twists
    distance: int  # sum of the rows between when they were recorded and when they came into force
    rows: tuple[Any, ...] = ()  # the last twist's number, its row, and this tuple of the twist before


def _match_rows(twists: Sequence[_RecordedTwist], steps: BagSteps) -> dict[int, int]:
    """Return the row in which each twist came into force, by the twist's number, where that can be found.

    The twists keep their order, and as many as possible are matched; of several solutions, the result is the one whose
    rows are nearest to those of the recorder. A twist that was replaced within the same step never came into force, and
    a twist equal to the last one changed nothing.
    """
    best = [_Match(-1, 0, 0)]  # in the order of rows, each better than those before
    for number, twist in enumerate(twists):
        if number and twist.command == twists[number - 1].command:
            continue
        matches = []
        for row in range(twist.row - _MAX_LATE, twist.row + _MAX_EARLY + 1):
            earlier = [match for match in best if match.row < row]
            if earlier and steps.begins(row, twist.command):
                last = earlier[-1]
                distance = last.distance + abs(twist.row - row)
                matches.append(_Match(row, last.total + 1, distance, (number, row, last.rows)))
        best = _pareto_front(sorted([*best, *matches]))
    result, rows = {}, best[-1].rows
    while rows:
        number, row, rows = rows
        result[number] = row
    return result


def _pareto_front(matches: Sequence[_Match]) -> list[_Match]:
    """Return the matches that are better than all of earlier rows, in the order of their rows."""
    front: list[_Match] = []
    for match in matches:
        if not front or (match.total, -match.distance) > (front[-1].total, -front[-1].distance):
            front = [*(other for other in front[-2 * _MAX_LATE :] if other.row < match.row), match]
    return front


def _execution_rows(twists: Sequence[_RecordedTwist], matched: dict[int, int]) -> Iterator[int]:
    """Yield the row of each twist, in order; a twist without a match gets the delay of the last one that has one."""
    delay = last = 0
    following = sorted(matched.items())
    for number, twist in enumerate(twists):
        if number in matched:
            last, delay = matched[number], twist.row - matched[number]
            following.pop(0)
            yield last
        else:
            yield min([max(twist.row - delay, last), *(row for _, row in following[:1])])


# ---- messages as actions of a timeline; None for a message that the simulator refused


def _request(topic: str, _message: Any) -> _Action:
    return {topic: {}}


def _pose(kind: str, message: Any) -> _Action | None:
    position, quaternion = xyz(message.pose.position), xyzw(message.pose.orientation)
    if not _is_in_world(message) or not _is_finite(*position, *quaternion) or abs(math.hypot(*quaternion) - 1) > 0.01:
        return None
    rpy = frames.to_rpy(frames.from_quaternion((0, 0, 0), quaternion))
    return {kind: {"position": [*position], "rpy": [*rpy]}}


def _push(message: Any) -> _Action | None:
    force, torque = xyz(message.wrench.force), xyz(message.wrench.torque)
    if not _is_in_world(message) or not _is_finite(*force, *torque):
        return None
    return {"push": {"force": [*force], "torque": [*torque], "duration": 0.2}}  # the duration in config/drone.yaml


def _wind(message: Any) -> _Action | None:
    wind = xyz(message.vector)
    return {"weather": {"wind": [*wind]}} if _is_in_world(message) and _is_finite(*wind) else None


def _change(kind: str, message: Any) -> _Action | None:
    try:
        return {kind: read_changes(message, _default_parameters()[kind])}
    except Refused:
        return None


@functools.cache
def _default_parameters() -> dict[str, Checked]:
    default = parameters.load()
    return {"weather": default.weather, "faults": default.first.faults}


_READERS: dict[str, tuple[str, Callable[[Any], _Action | None]]] = {  # by topic, with its type
    **{topic: (kind, functools.partial(_request, topic)) for topic, kind in REQUESTS.items() if kind == EMPTY},
    "goto": (POSE, functools.partial(_pose, "goto")),
    "set_pose": (POSE, functools.partial(_pose, "pose")),
    "push": (PUSH, _push),
    "set_wind": ("geometry_msgs/Vector3Stamped", _wind),
    "weather": ("diagnostic_msgs/KeyValue", functools.partial(_change, "weather")),
    "faults": ("diagnostic_msgs/KeyValue", functools.partial(_change, "faults")),
}


def _is_finite(*values: float) -> bool:
    return all(map(math.isfinite, values))


def _is_in_world(message: Any) -> bool:
    return message.header.frame_id.lstrip("/") in ("", WORLD_FRAME)
