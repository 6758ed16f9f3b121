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
_EARLY, _LATE = 2, 20  # steps, by which the recorder may have heard of a command earlier or later than the simulator
_LEADS_TO = {"takeoff": "taking off", "land": "landing"}  # states, which are said in the step that obeys
_Action = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> int:
    """Write it; return 0, or 1 after a line on stderr for a file that cannot be read or written."""
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
        entries = sorted(_entries(bag, flight), key=lambda one: one["at"])
        begins = next((one.message.data for one in bag.read(f"{flight.namespace}/state", STATE)), "")
    if not entries:
        raise BagError(f"{options.bag}: it has no commands on {flight.namespace}/cmd_vel or another command topic")
    landed = " --set start=landed" if begins == "landed" else ""
    lines = [dump(entry, "line") for entry in entries]
    writing.write(options.timeline, f"# fly --commands{landed}\n{''.join(f'- {line}' for line in lines)}")
    print(f"{_NAME}: wrote {options.timeline}, {len(entries)} commands: fly --commands {options.timeline}{landed}")


def _entries(bag: Bag, flight: BagFlight) -> Iterator[_Action]:
    """Yield the entries of the timeline. Raises BagError."""
    steps = flight.steps()
    yield from _twists(bag.read(f"{flight.namespace}/cmd_vel", TWIST), steps)
    states = [(steps.row_after(one.at) - 1, one.message.data) for one in bag.read(f"{flight.namespace}/state", STATE)]
    for topic, (kind, read) in _READ.items():
        rows = [row for row, state in states if state == _LEADS_TO.get(topic)]
        for heard in bag.read(f"{flight.namespace}/{topic}", kind):
            action, row = read(heard.message), steps.row_after(heard.at)
            near = [one for one in rows if row - _LATE <= one <= row + _EARLY]
            row = min(near, key=lambda one: abs(one - row), default=row)
            if action is not None:
                yield {"at": steps.time(row), **action}


class _Heard(NamedTuple):
    """A twist: the row in which it was recorded, and its values."""

    row: int
    linear: tuple[float, ...]
    angular: tuple[float, ...]

    @property
    def command(self) -> tuple[float, ...]:
        """What is in force from it on: three velocities, and that of yaw."""
        return *self.linear, self.angular[2]


def _twists(messages: Iterator[RecordedMessage], steps: BagSteps) -> Iterator[_Action]:
    """Yield twists at the step that obeyed them, as far as the commands in force tell it."""
    told = [
        _Heard(steps.row_after(one.at), xyz(one.message.linear), xyz(one.message.angular))
        for one in messages
        if _finite(*xyz(one.message.linear), *xyz(one.message.angular))
    ]
    for one, row in zip(told, _rows(told, _obeyed(told, steps))):
        yield {"at": steps.time(row), "twist": {"linear": [*one.linear], "angular": [*one.angular]}}


class _Match(NamedTuple):
    """The best match of all twists up to one that came into force in `row`."""

    row: int
    found: int
    off: int  # rows between when they were heard and when they came into force, summed
    rows: tuple[Any, ...] = ()  # the last twist's number and its row, and the same of those before


def _obeyed(told: Sequence[_Heard], steps: BagSteps) -> dict[int, int]:
    """Return, by the number of each twist that came into force, the row in which it did; the twists keep their order.

    As many as possible are matched; of several solutions, the one whose rows are nearest to those of the recorder. A
    twist that was replaced by another within the same step never came into force, and one equal to the last changed
    nothing.
    """
    best = [_Match(-1, 0, 0)]  # by rows, each better than those before
    for number, one in enumerate(told):
        if number and one.command == told[number - 1].command:
            continue
        found = []
        for row in range(one.row - _LATE, one.row + _EARLY + 1):
            before = [match for match in best if match.row < row]
            if before and steps.begins(row, one.command):
                last = before[-1]
                found.append(_Match(row, last.found + 1, last.off + abs(one.row - row), (number, row, last.rows)))
        best = _better(sorted([*best, *found]))
    obeyed, rows = {}, best[-1].rows
    while rows:
        number, row, rows = rows
        obeyed[number] = row
    return obeyed


def _better(matches: Sequence[_Match]) -> list[_Match]:
    """Return the matches that are better than all earlier ones, in the order of their rows."""
    kept: list[_Match] = []
    for one in matches:
        if not kept or (one.found, -one.off) > (kept[-1].found, -kept[-1].off):
            kept = [*(other for other in kept[-2 * _LATE :] if other.row < one.row), one]
    return kept


def _rows(told: Sequence[_Heard], obeyed: dict[int, int]) -> Iterator[int]:
    """Yield the row of each twist, in order; a twist without a known row is as late as the last one that has one."""
    late = last = 0
    following = sorted(obeyed.items())
    for number, one in enumerate(told):
        if number in obeyed:
            last, late = obeyed[number], one.row - obeyed[number]
            following.pop(0)
            yield last
        else:
            yield min([max(one.row - late, last), *(row for _, row in following[:1])])


# ---- messages as actions of a timeline; None for one that the simulator refused


def _request(topic: str, _message: Any) -> _Action:
    return {topic: {}}


def _pose(kind: str, message: Any) -> _Action | None:
    place, quaternion = xyz(message.pose.position), xyzw(message.pose.orientation)
    if not _in_world(message) or not _finite(*place, *quaternion) or abs(math.hypot(*quaternion) - 1) > 0.01:
        return None
    rpy = frames.to_rpy(frames.from_quaternion((0, 0, 0), quaternion))
    return {kind: {"position": [*place], "rpy": [*rpy]}}


def _push(message: Any) -> _Action | None:
    force, torque = xyz(message.wrench.force), xyz(message.wrench.torque)
    if not _in_world(message) or not _finite(*force, *torque):
        return None
    return {"push": {"force": [*force], "torque": [*torque], "duration": 0.2}}  # config/drone.yaml's


def _wind(message: Any) -> _Action | None:
    wind = xyz(message.vector)
    return {"weather": {"wind": [*wind]}} if _in_world(message) and _finite(*wind) else None


def _change(kind: str, message: Any) -> _Action | None:
    try:
        return {kind: read_changes(message, _allowed()[kind])}
    except Refused:
        return None


@functools.cache
def _allowed() -> dict[str, Checked]:
    default = parameters.load()
    return {"weather": default.weather, "faults": default.first.faults}


_READ: dict[str, tuple[str, Callable[[Any], _Action | None]]] = {  # by topic: its kind of message, and what reads it
    **{topic: (kind, functools.partial(_request, topic)) for topic, kind in REQUESTS.items() if kind == EMPTY},
    "goto": (POSE, functools.partial(_pose, "goto")),
    "set_pose": (POSE, functools.partial(_pose, "pose")),
    "push": (PUSH, _push),
    "set_wind": ("geometry_msgs/Vector3Stamped", _wind),
    "weather": ("diagnostic_msgs/KeyValue", functools.partial(_change, "weather")),
    "faults": ("diagnostic_msgs/KeyValue", functools.partial(_change, "faults")),
}


def _finite(*values: float) -> bool:
    return all(map(math.isfinite, values))


def _in_world(message: Any) -> bool:
    return message.header.frame_id.lstrip("/") in ("", WORLD_FRAME)
