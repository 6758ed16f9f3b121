"""Records a flight, step by step: the graded vehicle, and what the plan's criteria ask for."""

from __future__ import annotations

import copy
import functools
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from drone_sim.grading.flight_record import ContactEvent, FlightRecord, ValueChange
from drone_sim.grading.plan import Plan
from drone_sim.mechanics.frames import position, to_quaternion, transform
from drone_sim.mechanics.path import Path
from drone_sim.offline.recording import COLUMNS, Recording
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api import object_paths
from drone_sim.scripting.api.backend import Ask
from drone_sim.scripting.api.control import STOP

_NOWHERE = (math.nan,) * 7


class FlightRecorder:
    """Keeps the rows of the graded vehicle, and beside them only what a criterion asks for."""

    def __init__(self, plan: Plan, simulation: Simulation, backend: OfflineBackend):
        """Record what a `plan` asks for of a `simulation` before its first step, and of its topics in the `backend`.

        Raises ValueError for a vehicle or object that is not there.
        """
        self._simulation = simulation
        self._duration = plan.duration
        own = plan.vehicle_of(simulation.parameters)
        self._vehicle = simulation.vehicles[own]
        self._recording = Recording(vehicle=own)
        self._contacts = simulation.world.queries.contacts  # asked ten times a step
        self._body = self._vehicle.body.number
        self._contact_events: list[ContactEvent] = []
        self._touched: set[str] = set()  # in the step that is under way
        self._values: dict[str, list[ValueChange]] = {}
        self._other_poses: dict[str, list[tuple[float, ...]]] = {}
        self._found: dict[str, list[str]] = {}
        self.goals: list[int] = []  # handles of the objects that criteria name, and of such vehicles' objects
        self.look: Callable[[int], None] | None = None  # for Simulation.step
        self._each_step: list[Callable[[], None]] = [functools.partial(self._recording.add, simulation)]
        self._add_recorders(plan, backend)
        self._lines = {name: self._line(name) for one in plan.criteria for name in one.lines}

    def _add_recorders(self, plan: Plan, backend: OfflineBackend) -> None:
        if any(one.needs_contacts for one in plan.criteria):
            self.look = self._look_for_contacts
            self._each_step.append(self._keep_contacts)
        if any(one.needs_states for one in plan.criteria):
            self._follow("", lambda: str(self._vehicle.flight_state))
        for signal in dict.fromkeys(name for one in plan.criteria for name in one.signals):
            self._follow(signal, lambda name=signal: self._simulation.context.signals.find(name))  # type: ignore[misc]
        own = self._vehicle.bus.said
        for topic, full in backend.wanted.items():
            self._follow(topic, lambda name=full: backend.last.get(name, own.get(name)))  # type: ignore[misc]
        others = dict.fromkeys(name for one in plan.criteria for name in one.others)
        objects = self._simulation.context.objects
        for path in filter(object_paths.is_path, others):
            self._found[path] = [one.name for one in object_paths.every(objects, path)] or [path]
        named = (self._found.get(other, [other]) for other in others)
        for other in dict.fromkeys(itertools.chain.from_iterable(named)):
            vehicle = self._simulation.vehicles.get(other)
            # Followed by its handle: another object may get the name later. Raises ValueError where there is none.
            handle = objects.handle(other) if vehicle is None else objects.handle_of(vehicle.object)
            self.goals.append(handle)
            self._other_poses[other] = []
            pose = functools.partial(self._pose, other if vehicle is not None else "", handle)
            self._each_step.append(lambda name=other, pose=pose: self._other_poses[name].append(pose()))  # type: ignore[misc]

    def record_step(self) -> None:
        """Record what there is now: before the first step, and after each."""
        for record in self._each_step:
            record()

    @property
    def rows(self) -> np.ndarray:
        """The rows so far, (N, 22)."""
        return np.array(self._recording.rows).reshape(-1, len(COLUMNS))

    def record(self) -> FlightRecord | None:
        """Return the flight so far; None before there is any."""
        rows = self.rows
        if not len(rows):
            return None
        return FlightRecord(
            rows,
            bool(rows[-1, 0] >= self._duration - 1e-9),
            tuple(self._contact_events),
            tuple(self._values.get("", ())),
            self._values,
            {name: np.array(poses) for name, poses in self._other_poses.items()},
            self._found,
            self._lines,
        )

    @property
    def is_over(self) -> bool:
        """Whether a script has stopped the simulation."""
        return self._simulation.context.control.asked == STOP

    # ---- what is asked for

    def _look_for_contacts(self, count: int) -> None:
        """See after a sub-step what the vehicle touches: a blow may be over before the step is."""
        if count and (touches := self._contacts(self._body)):
            names = self._simulation.context.names
            self._touched.update(names.get(one.body, ("", ""))[0] for one in touches)

    def _keep_contacts(self) -> None:
        if self._touched:
            now = self._simulation.time
            self._contact_events += [ContactEvent(now, what) for what in sorted(self._touched)]
            self._touched.clear()

    def _follow(self, name: str, value: Callable[[], Any]) -> None:
        """Record a value whenever it has changed."""
        kept = self._values[name] = []

        def look() -> None:
            now, last = value(), kept[-1].value if kept else None
            if now is not last and not _same(now, last):
                kept.append(ValueChange(self._simulation.time, now))

        self._each_step.append(look)

    def _line(self, name: str) -> np.ndarray:
        """Return the points (K, 3) of a path, in m, in the world. Raises ValueError for what is no path."""
        objects = self._simulation.context.objects
        handle = objects.handle(name)
        path = objects[handle]
        if not isinstance(path, Path) or len(path.points) < 2:
            raise ValueError(f"'{name}' is not a path with two points or more")
        matrix = objects.matrix(handle)
        return np.array([transform(matrix, one) for one in path.points])

    def _pose(self, vehicle_name: str, handle: int) -> tuple[float, ...]:
        """Return position (m) and quaternion (xyzw) of a vehicle or object, in the world; NaN once it is gone."""
        vehicle = self._simulation.vehicles.get(vehicle_name)
        if vehicle is not None:
            return (*vehicle.body.state.position, *vehicle.body.state.orientation)
        one = self._simulation.context.objects.get(handle)
        if one is None or vehicle_name:
            return _NOWHERE
        matrix = one.matrix()
        return (*position(matrix), *to_quaternion(matrix))


def _same(first: Any, second: Any) -> bool:
    """Tell whether two values are equal; those that cannot be compared, such as arrays in messages, are not."""
    try:
        return bool(first == second)
    except Exception:
        return False


# ---- what scripts publish


class OfflineBackend:
    """A backend (scripting.api.backend) with nobody at its other end.

    It keeps the last message on each topic that is asked for.
    """

    def __init__(self, wanted: Mapping[str, str]):
        """Keep the topics `wanted`: the full name of each, by its name in the plan."""
        self.wanted = wanted
        self.last: dict[str, Any] = {}  # the last message, by the topic's full name
        self.clock: Callable[[], float] = lambda: 0.0  # simulated time in s
        self.is_scene: Callable[[], bool] = lambda: False  # whether the script that runs is one of the scene's
        self._scenes: set[str] = set()  # topics that the scene's scripts have advertised
        self._parameters: dict[str, Any] = {}

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Do nothing: no message comes."""
        return lambda: None

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> OfflinePublisher:
        """Keep what will be published, if it is asked for; of a topic of the scene's only what its scripts publish."""
        is_scene = self.is_scene()
        if is_scene and topic not in self._scenes:
            self._scenes.add(topic)
            self.last.pop(topic, None)
        return OfflinePublisher(
            self.last if topic in self.wanted.values() else {}, topic, lambda: is_scene or topic not in self._scenes
        )

    def advertise_image(self, topic: str, queue: int) -> OfflinePublisher:
        """Keep nothing: no criterion reads pictures."""
        return OfflinePublisher({}, topic, lambda: True)

    def time(self) -> float:
        """Return what messages are stamped with, in s."""
        return self.clock()

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Do nothing."""

    def parameter(self, name: str) -> Any:
        """Return a parameter that a script has set."""
        return self._parameters.get(name)

    def set_parameter(self, name: str, value: Any) -> None:
        """Set a parameter."""
        self._parameters[name] = value

    def delete_parameter(self, name: str) -> None:
        """Forget a parameter."""
        self._parameters.pop(name, None)

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Do nothing: nobody calls."""
        return lambda: None

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Raise ValueError: there is no service."""
        raise ValueError(f"no service {name}: this flight is flown without ROS")


class OfflinePublisher:
    """An advertised topic."""

    def __init__(self, last: dict[str, Any], topic: str, may_publish: Callable[[], bool]):
        """Leave the last message on `topic` in `last`."""
        self._last, self._topic, self._may_publish = last, topic, may_publish

    def publish(self, message: Any) -> None:
        """Keep a message as it is now. Raises ValueError for a submission's on a topic of the scene's scripts."""
        if not self._may_publish():
            raise ValueError(f"{self._topic}: scripts of the scene publish on this topic, so a submission may not")
        self._last[self._topic] = copy.deepcopy(message)

    def subscribers(self) -> int:
        """Return the number of subscribers: one, the grader."""
        return 1

    def shutdown(self) -> None:
        """Do nothing: the last message is kept."""
