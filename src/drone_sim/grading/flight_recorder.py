"""Recorder of a flight without ROS: the graded vehicle, and what the plan's criteria need."""

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

_NO_POSE = (math.nan,) * 7


class FlightRecorder:
    """Records the graded vehicle's table, and whatever else the plan's criteria need."""

    def __init__(self, plan: Plan, simulation: Simulation, backend: OfflineBackend):
        """Prepare the recording of a `simulation` before its first step; `backend` keeps the messages of its scripts.

        Raises ValueError for a vehicle or object that does not exist.
        """
        self._simulation = simulation
        self._duration = plan.duration
        vehicle_name = plan.vehicle_of(simulation.parameters)
        self._vehicle = simulation.vehicles[vehicle_name]
        self._recording = Recording(vehicle=vehicle_name)
        self._find_contacts = simulation.world.queries.contacts  # a local name: this is called ten times a step
        self._body = self._vehicle.body.number
        self._contact_events: list[ContactEvent] = []
        self._touched: set[str] = set()  # names of the objects touched in the current step
        self._values: dict[str, list[ValueChange]] = {}
        self._object_poses: dict[str, list[tuple[float, ...]]] = {}
        self._objects_by_path: dict[str, list[str]] = {}
        self.goals: list[int] = []  # handles of the objects that criteria name; for a vehicle, of its object
        self.after_sub_step: Callable[[int], None] | None = None  # for Simulation.step
        self._step_recorders: list[Callable[[], None]] = [functools.partial(self._recording.add, simulation)]
        self._record_values(plan, backend)
        self._record_objects(plan)
        self._paths = {name: self._path_points(name) for criterion in plan.criteria for name in criterion.path_names}

    def _record_values(self, plan: Plan, backend: OfflineBackend) -> None:
        """Record the contacts, flight states, signals and topics that criteria need."""
        if any(criterion.needs_contacts for criterion in plan.criteria):
            self.after_sub_step = self._collect_contacts
            self._step_recorders.append(self._record_contacts)
        if any(criterion.needs_states for criterion in plan.criteria):
            self._record_changes("", lambda: str(self._vehicle.flight_state))
        signals = self._simulation.context.signals
        for signal in dict.fromkeys(name for criterion in plan.criteria for name in criterion.signals):
            self._record_changes(signal, functools.partial(signals.find, signal))
        own_topics = self._vehicle.bus.own_messages
        for topic, full in backend.topics.items():
            self._record_changes(topic, lambda name=full: backend.last.get(name, own_topics.get(name)))  # type: ignore[misc]

    def _record_objects(self, plan: Plan) -> None:
        """Record the poses of the vehicles and objects that criteria name."""
        references = dict.fromkeys(name for criterion in plan.criteria for name in criterion.object_names)
        objects = self._simulation.context.objects
        for path in filter(object_paths.is_path, references):
            self._objects_by_path[path] = [found.name for found in object_paths.every(objects, path)] or [path]
        names = (self._objects_by_path.get(reference, [reference]) for reference in references)
        for name in dict.fromkeys(itertools.chain.from_iterable(names)):
            vehicle = self._simulation.vehicles.get(name)
            # The handle identifies the object, because another object may get the name later.
            handle = objects.handle(name) if vehicle is None else objects.handle_of(vehicle.object)
            self.goals.append(handle)
            poses = self._object_poses[name] = []
            pose = functools.partial(self._pose, name if vehicle is not None else "", handle)
            self._step_recorders.append(lambda poses=poses, pose=pose: poses.append(pose()))  # type: ignore[misc]

    def record_step(self) -> None:
        """Record the current state: call this before the first step and after each step."""
        for record in self._step_recorders:
            record()

    @property
    def rows(self) -> np.ndarray:
        """The rows so far, (N, 22)."""
        return np.array(self._recording.rows).reshape(-1, len(COLUMNS))

    def record(self) -> FlightRecord | None:
        """Return the flight so far, or None if there is no row yet."""
        rows = self.rows
        if not len(rows):
            return None
        return FlightRecord(
            rows,
            bool(rows[-1, 0] >= self._duration - 1e-9),
            tuple(self._contact_events),
            tuple(self._values.get("", ())),
            self._values,
            {name: np.array(poses) for name, poses in self._object_poses.items()},
            self._objects_by_path,
            self._paths,
        )

    @property
    def is_over(self) -> bool:
        return self._simulation.context.control.asked == STOP

    def _collect_contacts(self, count: int) -> None:
        """Collect the names of touched objects after a sub-step: a short contact may end before the step does."""
        if count and (contacts := self._find_contacts(self._body)):
            names = self._simulation.context.names
            self._touched.update(names.get(contact.body, ("", ""))[0] for contact in contacts)

    def _record_contacts(self) -> None:
        if self._touched:
            now = self._simulation.time
            self._contact_events += [ContactEvent(now, name) for name in sorted(self._touched)]
            self._touched.clear()

    def _record_changes(self, name: str, get_value: Callable[[], Any]) -> None:
        changes = self._values[name] = []

        def record() -> None:
            value, last = get_value(), changes[-1].value if changes else None
            if value is not last and not _is_equal(value, last):
                changes.append(ValueChange(self._simulation.time, value))

        self._step_recorders.append(record)

    def _path_points(self, name: str) -> np.ndarray:
        """Return the points (K, 3) of a path, in m, in the world. Raises ValueError for an object that is no path."""
        objects = self._simulation.context.objects
        handle = objects.handle(name)
        path = objects[handle]
        if not isinstance(path, Path) or len(path.points) < 2:
            raise ValueError(f"'{name}' is not a path with two points or more")
        matrix = objects.matrix(handle)
        return np.array([transform(matrix, point) for point in path.points])

    def _pose(self, vehicle_name: str, handle: int) -> tuple[float, ...]:
        """Return position (m) and quaternion (xyzw) of a vehicle or object in the world, NaN once it is removed."""
        vehicle = self._simulation.vehicles.get(vehicle_name)
        if vehicle is not None:
            return (*vehicle.body.state.position, *vehicle.body.state.orientation)
        scene_object = self._simulation.context.objects.by_handle.get(handle)
        if scene_object is None or vehicle_name:
            return _NO_POSE
        matrix = scene_object.matrix()
        return (*position(matrix), *to_quaternion(matrix))


def _is_equal(first: Any, second: Any) -> bool:
    """Return whether two values are equal; values that cannot be compared, such as arrays in messages, are not."""
    try:
        return bool(first == second)
    except Exception:
        return False


class OfflineBackend:
    """A backend (scripting.api.backend) without ROS, which keeps the last message on each of some topics."""

    def __init__(self, topics: Mapping[str, str]):
        """Keep the messages on `topics`: their full names, by their names in the plan."""
        self.topics = topics
        self.last: dict[str, Any] = {}  # the last message, by the topic's full name
        self.clock: Callable[[], float] = lambda: 0.0  # simulated time in s
        self.is_scene: Callable[[], bool] = lambda: False  # whether the script that runs is one of the scene's
        self._scene_topics: set[str] = set()  # topics that the scene's scripts have advertised
        self._parameters: dict[str, Any] = {}

    def subscribe(self, topic: str, kind: str, take: Callable[[Any], None]) -> Callable[[], None]:
        """Do nothing: no message arrives."""
        return lambda: None

    def advertise(self, topic: str, kind: str, queue: int, latch: bool) -> OfflinePublisher:
        """Return a publisher; once a script of the scene advertises a topic, only the scene's scripts may publish."""
        is_scene = self.is_scene()
        if is_scene and topic not in self._scene_topics:
            self._scene_topics.add(topic)
            self.last.pop(topic, None)
        last = self.last if topic in self.topics.values() else {}
        return OfflinePublisher(last, topic, lambda: is_scene or topic not in self._scene_topics)

    def advertise_image(self, topic: str, queue: int) -> OfflinePublisher:
        """Return a publisher whose messages are not kept: no criterion reads images."""
        return OfflinePublisher({}, topic, lambda: True)

    def time(self) -> float:
        return self.clock()

    def send_transforms(self, transforms: Sequence[Mapping[str, Any]]) -> None:
        """Do nothing."""

    def parameter(self, name: str) -> Any:
        return self._parameters.get(name)

    def set_parameter(self, name: str, value: Any) -> None:
        self._parameters[name] = value

    def delete_parameter(self, name: str) -> None:
        self._parameters.pop(name, None)

    def serve(self, name: str, kind: str, ask: Ask) -> Callable[[], None]:
        """Do nothing: there are no clients."""
        return lambda: None

    def call_service(self, name: str, kind: str, request: Any) -> Any:
        """Raise ValueError: there are no services."""
        raise ValueError(f"no service {name}: this flight is flown without ROS")


class OfflinePublisher:
    """Publisher of a topic of an OfflineBackend."""

    def __init__(self, last: dict[str, Any], topic: str, may_publish: Callable[[], bool]):
        """Store each message as `last[topic]`."""
        self._last, self._topic, self._may_publish = last, topic, may_publish

    def publish(self, message: Any) -> None:
        """Store a copy of a message. Raises ValueError if a submission publishes on a topic of the scene's scripts."""
        if not self._may_publish():
            raise ValueError(f"{self._topic}: scripts of the scene publish on this topic, so a submission may not")
        self._last[self._topic] = copy.deepcopy(message)

    def subscribers(self) -> int:
        """Return the number of subscribers: one, the grader."""
        return 1

    def shutdown(self) -> None:
        """Do nothing: the last message is kept."""
