"""The timeline of the parameter `timeline_file`: commands and events that every run executes at their steps."""

from __future__ import annotations

import contextlib

import rospy

from drone_sim.offline import timeline as timelines
from drone_sim.offline.timeline import Timeline, TimelineError
from drone_sim.ros.core.launch_parameters import from_shell
from drone_sim.ros.core.startup import MASTER_FAILURES
from drone_sim.run.parameters import Parameters
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.errors import ScriptError

_FILE = "~timeline_file"


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
