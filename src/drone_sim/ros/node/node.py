"""The node: the simulation at the pace of the clock, with ROS around it.

Parameters (private): every key of config/drone.yaml.
Topics, in the namespace of each vehicle: see ros/vehicle; for rviz: see ros/rviz; services: services.py.
/clock is published with use_sim_time: see ros/core/publishing.py; /diagnostics: see diagnostics.py.
Frames: see ros/vehicle/outputs.py.
"""

from __future__ import annotations

import contextlib
import gc
import logging
import time
from collections.abc import Callable, Iterable, Iterator

import rospy
from std_msgs.msg import String

from drone_sim.mechanics.frames import position, to_euler
from drone_sim.remote.remote_api import start_server
from drone_sim.ros.core.inbox import Inbox, open_gate
from drone_sim.ros.core.launch_parameters import parameters_of, use_sim_time
from drone_sim.ros.core.master_watch import MasterWatch
from drone_sim.ros.core.publishing import StepTime
from drone_sim.ros.core.shutdown import Shutdown
from drone_sim.ros.core.startup import MASTER_FAILURES, give_way, init_node, release_name, status_of_node
from drone_sim.ros.node.diagnostics import Diagnostics
from drone_sim.ros.node.inspection import InspectionTopics, SignalTopic
from drone_sim.ros.node.interventions import Interventions
from drone_sim.ros.node.lockstep import Lockstep
from drone_sim.ros.node.run_timeline import RunTimeline, subscribe_object_poses
from drone_sim.ros.node.scene_editing import SceneEditing
from drone_sim.ros.node.services import Services
from drone_sim.ros.node.start_checks import check_launch_arguments, check_others
from drone_sim.ros.node.windows import WindowTopics
from drone_sim.ros.rviz.drawing_markers import DrawingMarkers
from drone_sim.ros.rviz.flight_markers import CommandMarkers, HeightMarkers, PathMarkers, StateText
from drone_sim.ros.rviz.force_markers import ForceMarkers
from drone_sim.ros.rviz.handles import ObjectHandles, VehicleHandles
from drone_sim.ros.rviz.marker_topics import namespace
from drone_sim.ros.rviz.scene_markers import RvizMeshes, SceneMarkers, SurroundingsMarkers, VehicleMarkers
from drone_sim.ros.vehicle.cameras import MAX_LEFT_OUT
from drone_sim.ros.vehicle.script_backend import RosBackend
from drone_sim.ros.vehicle.tuning_server import TuningServer
from drone_sim.ros.vehicle.vehicle_topics import FleetTopics
from drone_sim.run.diagnosis.diagnosis import Diagnosis
from drone_sim.run.diagnosis.finding import Finding
from drone_sim.run.pacing import Beat, Pace, Pacer, period
from drone_sim.run.parameters import LockstepParameters, Parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.run.watchdog import Watchdog
from drone_sim.scripting.api.drawings import Drawings
from drone_sim.scripting.errors import ScriptError
from drone_sim.scripting.load import script_path
from drone_sim.vehicles.situation import hears_commands
from drone_sim.vehicles.vehicle import Vehicle

_NAME = "drone_sim"
_USE_SIM_TIME = "/use_sim_time"
_CHANGED_PERIOD, _IDLE_PERIOD = 0.05, 0.2  # s between two messages while no steps run: after a change, and without


class Node:
    """Steps the simulation. Only the thread that calls `run` touches it."""

    def __init__(self, parameters: Parameters):
        """Build the scene of `parameters`, and advertise. Raises the errors of Simulation."""
        self._parameters = parameters
        logging.getLogger("drone_sim").handlers = [_ToRosout()]
        drawings = Drawings()
        backend = RosBackend(
            self._is_camera_topic, lambda: self._time.stamp(), lambda topic, take: self._gate(topic, take)
        )
        self.simulation = Simulation(
            parameters,
            script=parameters.script,
            gui=parameters.gui,
            backend=backend,
            drawings=drawings,
            started=False,
        )
        self._time = StepTime(self.simulation, use_sim_time())
        self._state = rospy.Publisher("~state", String, queue_size=10, latch=True)
        self._timeline = RunTimeline(parameters)
        self.player = Player(self.simulation, self._state.publish, self._time.simulated, self._timeline.read)
        self._interventions = Interventions(self.simulation)
        self._remote = start_server(parameters.remote_api, self.player, backend, self._interventions.watched)
        self._pacer = Pacer(period(parameters), sleep=self._remote.wait)
        # While the inbox waits, clients of the remote APIs are served.
        sleep = self._remote.wait if self._remote.address else None
        self._inbox = Inbox(sleep=sleep, wake=self._remote.wake, on_intervention=self._interventions.publish)
        is_awaited = bool(parameters.lockstep.wait_for)
        self._lockstep = Lockstep(parameters.lockstep, self.simulation, self._inbox) if is_awaited else None
        self._gate = self._lockstep.gate if self._lockstep else open_gate
        self._topics = FleetTopics(self.simulation, self._inbox, self._time.stamp, self._gate)
        self._tuning = TuningServer(rospy.get_name(), Pace(self.simulation, self._pacer), self._inbox, "simulation")
        restored = self._lockstep.reset if self._lockstep else lambda: None
        self._services = Services(self.player, self._timeline, self._inbox, self._topics.follow, restored)
        self._editing = SceneEditing(self.player, self._inbox, self._services)
        self._windows = WindowTopics(self.simulation, self._inbox, self._time.stamp)
        self._signals = SignalTopic(self.simulation)
        subscribe_object_poses(self.simulation, self._inbox)
        self._inspection = InspectionTopics(self.player, self._inbox)
        self._meshes = RvizMeshes()
        self._rviz = (  # each publishes only to subscribers
            VehicleHandles(self.simulation, self._inbox),
            ObjectHandles(self.simulation, self._inbox),
            SurroundingsMarkers(self.simulation, self._meshes),
            SceneMarkers(self.simulation, self._meshes),
            VehicleMarkers(self.simulation, self._meshes),
            DrawingMarkers(namespace(self.simulation), drawings),
            PathMarkers(self.simulation),
            HeightMarkers(self.simulation),
            CommandMarkers(self.simulation),
            ForceMarkers(self.simulation),
            StateText(self.simulation, self.player),  # the last one: `show` waits for its topic
        )
        self._diagnosis = Diagnosis(
            self.player,
            self._pacer,
            self._topics.command_logs,
            self._time.simulated,
            frames_below=rospy.get_namespace().lstrip("/"),
            held=lambda: self._remote.holds,
            unheard=lambda: self._diagnostics.unheard,
        )
        self._diagnostics = Diagnostics(self._findings, self._time.stamp, self._inbox)
        self._beat = Beat(_CHANGED_PERIOD, _IDLE_PERIOD)
        self._shown = -1  # the world's changes, when it was shown
        self._left_out = 0  # times in a row that markers were left out, because the step was late
        for camera in [camera for vehicle in self._first() for camera in vehicle.cameras.values()]:
            camera.look()  # the first picture takes long: compiling shaders must not make a step late

    def run(self, ending: Callable[[], bool] = lambda: False) -> None:
        """Start, and step until it is time to end, or ROS shuts the node down."""

        def over() -> bool:
            return ending() or rospy.is_shutdown()

        if over():
            return
        if self._remote.address:
            rospy.loginfo(f"drone_sim: the remote API listens on {self._remote.address}")
        else:
            with contextlib.suppress(ScriptError):  # said already; the node waits for `start`
                self.player.start()
            self._topics.follow()  # so that cameras see the first step
        gc.collect()
        gc.freeze()  # what is there by now stays: the collector, looking through it again and again, makes steps late
        rospy.loginfo(f"drone_sim: {'flying' if self.player.playing else 'stopped'}; {self._describe_command_topics()}")
        self._diagnostics.start()
        give_way()
        steps, seconds = 0, 0.0
        self._pacer.restart()
        while not over():
            began = time.monotonic()
            if self._is_running():
                steps += self._wait(over) and self.step()
                seconds += time.monotonic() - began
            else:
                self._idle()
                self._reset_pacing()
        flown = steps * self._parameters.time_step
        factor = f"{flown / seconds:.2f} times real time" if seconds else "no time"
        late = f"{self._pacer.overruns} late steps, by {self._pacer.worst * 1e3:.0f} ms at most"
        rospy.loginfo(f"drone_sim: flew {flown:.2f} s at {factor}, {late}")

    def _wait(self, over: Callable[[], bool]) -> bool:
        """Wait until the next step is due; return whether it still is to be run."""
        if self.player.begun:  # reading scene and script took its time, which no step is late for
            self.player.begun = False
            self._pacer.restart()
        if self._lockstep is not None and not self._lockstep.is_ready():
            self._time.publish_to_new_subscribers()
            self._inbox.wait(_CHANGED_PERIOD)
            self._process_requests()
            self._pacer.excuse()  # the node may take as long as it needs
            return False
        if self.player.paused:  # steps that were ordered have no pace
            self._pacer.excuse()
            return True
        if self._pacer.is_far:  # the next step is far away, and requests must not wait for it
            self._inbox.wait(_CHANGED_PERIOD)
            self._process_requests()
            return False
        late = self._pacer.wait(over)
        if late:
            rospy.logwarn_throttle(5, f"step late by {late * 1e3:.1f} ms ({self._pacer.overruns} so far)")
        return True

    def _is_running(self) -> bool:
        return self.player.is_step_due and not self._remote.holds

    def _reset_pacing(self) -> None:
        """Do not count a step, or an answer, as late because of a pause."""
        if self._lockstep is not None:
            self._lockstep.skip_pause()
        if self.player.playing and not self.player.begun:
            self._pacer.excuse()
        else:
            self._pacer.restart()

    def step(self) -> bool:
        """Process requests, run one step, and publish it under one stamp; return whether a step was run."""
        self._process_requests()
        if not self._is_running():
            return False
        with self.player.stepping():
            self._step_and_publish()
        return self.player.end_step()

    def _first(self) -> list[Vehicle]:
        """Return the first vehicle, if one flies."""
        return list(self.simulation.vehicles.values())[:1]

    def _process_requests(self) -> None:
        self._inbox.run_jobs()
        self._remote.serve()

    def _step_and_publish(self) -> None:
        self._time.begin()
        self._timeline.apply(self.simulation)
        if self._lockstep is not None:
            self._time.stamp()  # publishes the present time after a restore, which is no trigger of the step
            self._lockstep.begin_waits()
        with self._topics.hurrying() if self._is_hurried else contextlib.nullcontext():
            self.simulation.step()
        if self._lockstep is not None:
            self._lockstep.begin_late_waits()
            self._time.end(at_once=True)
            if self.simulation.steps == 1:  # only starts the clock
                return
        self._publish(is_step=True)
        self._time.end(at_once=self.player.paused)  # each single step is published

    def _idle(self) -> None:
        """While paused, stopped or held by a client: wait for a request, and publish its changes."""
        if self._remote.holds:  # for an unknown time
            self.player.interrupt_steps("interrupted: a client of the remote API holds the simulation")
        self._inbox.wait(self._until_shown())
        self._time.begin()
        self._inbox.run_jobs()
        if self._is_running() or self._until_shown():
            return
        if self._time.simulated:
            self._publish_without_step()
        else:
            self.simulation.look()
            self._publish()

    @property
    def _is_hurried(self) -> bool:
        """Whether a late step leaves out what is only looked at; in lockstep, nodes may answer pictures."""
        return self._pacer.is_late and self._lockstep is None

    def _findings(self) -> list[Finding]:
        return self._diagnosis.look() + ([self._lockstep.finding()] if self._lockstep is not None else [])

    def _until_shown(self) -> float:
        return self._beat.left(self.simulation.world.pictures.changes != self._shown)

    def _is_camera_topic(self, topic: str) -> bool:
        """Return whether a resolved topic is that of a camera's images."""
        return any(
            topic == rospy.resolve_name(f"{vehicle.name}/{camera.topic}")
            for vehicle in self.simulation.vehicles.values()
            for camera in vehicle.parameters.cameras.values()
        )

    # ---- publishing

    def _publish(self, is_step: bool = False) -> None:
        self._topics.follow()
        self._topics.publish_state()
        self._topics.publish_transforms()
        if is_step:
            self._topics.publish_readings()
        self._topics.publish_pictures()
        self._shown = self.simulation.world.pictures.changes
        self._publish_displays()

    def _publish_without_step(self) -> None:
        """Publish changes under the last stamp; transforms only to new subscribers: tf2 takes one for each stamp."""
        self._topics.follow()
        self._time.end(at_once=True)
        self._time.publish_to_new_subscribers()
        if self._topics.tell_new_subscribers() or self.simulation.world.pictures.changes != self._shown:
            self.simulation.look()
            self._topics.publish_state()
            self._topics.publish_pictures()
            self._shown = self.simulation.world.pictures.changes
        self._publish_displays()

    def _publish_displays(self) -> None:
        self._topics.publish_command()
        self._left_out = self._left_out + 1 if self._is_hurried and self._left_out < MAX_LEFT_OUT else 0
        if not self._left_out:
            for markers in self._rviz:
                markers.update()
            self._editing.update()
        self._windows.update()
        self._signals.update()
        self._inspection.update()
        self._interventions.update()
        if self._parameters.gui:
            for track in [vehicle.track.matrix() for vehicle in self._first()]:
                self.simulation.world.pictures.look_from_behind(position(track), to_euler(track)[2])
        self._beat.restart()

    def _describe_command_topics(self) -> str:
        """Return a sentence with the command topics, and whether a script subscribes to them."""
        vehicles = self.simulation.vehicles
        if not vehicles:
            return "the scene has no vehicle"
        is_heard = not self.player.playing or any(map(hears_commands, vehicles.values()))
        topics = ", ".join(rospy.resolve_name(f"{name}/cmd_vel") for name in vehicles)
        return f"commands on {topics}{'' if is_heard else ', but no script subscribes to them'}"

    def descriptions(self) -> Iterable[str]:
        """Return the names of the parameters that hold the vehicles' URDFs; any thread may call it."""
        return self._topics.descriptions

    def close(self) -> None:
        """Run the script's cleanup, remove rviz's meshes, and free the world. Raises ScriptError."""
        self._diagnostics.close()
        self._remote.close()
        self._services.close()
        self._meshes.close()
        self.simulation.close()


class _ToRosout(logging.Handler):
    """Log handler that passes the records of modules without ROS to rosout, with their tracebacks."""

    def emit(self, record: logging.LogRecord) -> None:
        logging.getLogger("rosout").log(record.levelno, self.format(record))


@contextlib.contextmanager
def _simulated_time(lockstep: LockstepParameters) -> Iterator[None]:
    """Set /use_sim_time if lockstep needs it, and restore it at the end."""
    if not lockstep.wait_for or use_sim_time():
        yield
        return
    before = rospy.get_param(_USE_SIM_TIME, None)
    rospy.set_param(_USE_SIM_TIME, True)
    rospy.logwarn(f"lockstep needs simulated time: {_USE_SIM_TIME} is now true, for nodes that start from now on")
    try:
        yield
    finally:
        with contextlib.suppress(*MASTER_FAILURES, OSError):
            if before is None:
                rospy.delete_param(_USE_SIM_TIME)
            else:
                rospy.set_param(_USE_SIM_TIME, before)


def main(watchdog: Watchdog) -> int:
    """Run the node; return its exit status: 1, after one line, for a wrong parameter, file or script."""
    # The time of messages is the simulation's; hearing its own /clock would cost the node half of its speed.
    if not init_node(_NAME, is_required=True, disable_signals=True, disable_rostime=True):
        return 1
    shutdown = Shutdown(watchdog)
    nodes = []

    def run() -> None:
        check_launch_arguments()
        parameters = parameters_of(rospy.get_name())
        script_path(parameters.script)  # none there ends the node; an error in one that is there stops the flight
        with _simulated_time(parameters.lockstep):
            check_others([vehicle.name for vehicle in parameters.fleet], use_sim_time())
            nodes.append(Node(parameters))
            MasterWatch(nodes[0].descriptions).start()
            release_name()
            nodes[0].run(shutdown.is_requested)

    status = status_of_node(_NAME, run)
    for node in nodes:
        status = status_of_node(_NAME, node.close) or status
    shutdown.complete()
    return status


if __name__ == "__main__":
    its_watchdog = Watchdog(_NAME)
    its_watchdog.end_at_once(main(its_watchdog))
