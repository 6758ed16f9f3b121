"""The timeline of `timeline_file`, which every run executes, and ~set_object_pose, by which a client executes one."""

from __future__ import annotations

import contextlib

import rospy
from geometry_msgs.msg import TransformStamped

from drone_sim.grading.permissions import MOVE
from drone_sim.mechanics.frames import to_rpy
from drone_sim.offline import timeline as timelines
from drone_sim.offline.timeline import ObjectMove, Timeline, TimelineError
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.core.message_conversion import xyz, xyzw
from drone_sim.ros.core.shell_files import from_shell
from drone_sim.ros.core.startup import MASTER_FAILURES
from drone_sim.ros.core.validation import check_frame, intervention
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError
from drone_sim.vehicles import checks

_FILE = "~timeline_file"
_NO_ROTATION = (0.0,) * 4  # the quaternion of a message in which it is not set


class RunTimeline:
    """The timeline of the present run. Only the thread that owns the simulation uses it."""

    def __init__(self, parameters: Parameters):
        """Begin without entries; `parameters` are those of the node, with the file of a config."""
        self._timeline = Timeline((), parameters.time_step)
        self._config_file = "" if rospy.has_param(_FILE) else parameters.timeline_file
        self._file = ""

    def read(self, parameters: Parameters) -> None:
        """Read the timeline of a run that starts with `parameters`. Raises TimelineError."""
        with contextlib.suppress(*MASTER_FAILURES, OSError):  # without a master, the parameter cannot have changed
            given = rospy.get_param(_FILE, None)
            self._file = self._config_file if given is None else from_shell(str(given))
        entries = timelines.read(self._file, parameters).entries if self._file else ()
        self._timeline = Timeline(entries, parameters.time_step)

    def apply(self, simulation: Simulation) -> None:
        """Apply the entries of the step that runs next. Raises ScriptError, which stops the run."""
        try:
            self._timeline.apply(simulation.steps, simulation.vehicles)
        except TimelineError as error:
            raise ScriptError("timeline", self._file, 0, str(error)) from None

    @property
    def summary(self) -> str:
        """The digest of the timeline, to be added to the answer of a start; '' without entries."""
        return f"; timeline {self._timeline.digest}" if self._timeline.entries else ""


def subscribe_object_poses(simulation: Simulation, inbox: Inbox) -> None:
    """Subscribe to ~set_object_pose: it moves an object of the scene before the next step, which runs jobs of `inbox`.

    `child_frame_id` is the object's name. Without a rotation in the message, the object keeps its own.
    """

    def take(message: TransformStamped) -> None:
        name = message.child_frame_id
        try:
            check_frame(message.header.frame_id)
            position, rotation = xyz(message.transform.translation), xyzw(message.transform.rotation)
            parameters, is_turned = simulation.parameters, rotation != _NO_ROTATION
            pose = checks.pose(
                position, rotation if is_turned else (0, 0, 0, 1), parameters, -parameters.position_limit
            )
        except checks.Refused as refused:
            rospy.logwarn_throttle(1, f"set_object_pose of '{name}' refused: {refused}")
            return
        move = ObjectMove(name, pose.position, to_rpy(pose.matrix) if is_turned else None)
        inbox.put(lambda: put(move), intervention(MOVE, name, "~set_object_pose", message))

    def put(move: ObjectMove) -> None:
        try:
            move.apply(simulation.context.objects)
        except ValueError as error:
            rospy.logwarn_throttle(1, f"set_object_pose of '{move.name}' refused: {error}")

    rospy.Subscriber("~set_object_pose", TransformStamped, take, queue_size=100, tcp_nodelay=True)
