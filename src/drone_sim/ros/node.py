"""The node: the simulation at the pace of the clock, with ROS around it.

Parameters (private): every key of config/drone.yaml.
Topics, in the drone's namespace: see inputs.py, outputs.py, cameras.py and markers.py; services: services.py.
/clock is published with use_sim_time.
Frames: world -> base_link, Track_base, and the cameras that have a `mount`; the rest comes from the URDF.
"""

from __future__ import annotations

import contextlib
import logging
import sys
import time
from typing import Callable

import rosgraph
import rospy
from rosgraph_msgs.msg import Clock

from drone_sim import parameters as parameters_module
from drone_sim.frames import position, to_euler
from drone_sim.pacing import Pacer
from drone_sim.parameters import Parameters
from drone_sim.ros.cameras import CameraOutput
from drone_sim.ros.drawing_markers import DrawingMarkers
from drone_sim.ros.ending import Ending
from drone_sim.ros.inbox import Inbox
from drone_sim.ros.inputs import DroneInput
from drone_sim.ros.markers import Handles
from drone_sim.ros.master_watch import MasterWatch, master_is_there
from drone_sim.ros.outputs import DroneOutput
from drone_sim.ros.paths import from_shell
from drone_sim.ros.player import Player
from drone_sim.ros.scene_markers import SceneMarkers
from drone_sim.ros.script_topics import RosBackend
from drone_sim.ros.services import Services
from drone_sim.scripting.drawings import Drawings
from drone_sim.scripting.errors import ScriptError
from drone_sim.simulation import Simulation

_STANDING = 0.2  # s between two messages while the simulation stands still


class Node:
    """Steps the simulation in the thread that calls `run`, and no other."""

    def __init__(self, parameters: Parameters):
        """Build the scene and advertise. Raises what Simulation raises."""
        self._parameters = parameters
        logging.getLogger("drone_sim").handlers = [_ToRosout()]
        self._simulated_time = bool(rospy.get_param("/use_sim_time", False))
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10) if self._simulated_time else None
        drone = parameters.drone.name
        images = {rospy.resolve_name(f"{drone}/{camera.topic}") for camera in parameters.cameras.values()}
        drawings = Drawings()
        self.simulation = Simulation(
            parameters,
            script=parameters.script,
            gui=parameters.gui,
            backend=RosBackend(images),
            drawings=drawings,
            started=False,
        )
        self.player = Player(self.simulation, self._simulated_time)
        self._inbox = Inbox()
        self._services = Services(self.player, self._inbox)
        factor = parameters.real_time_factor
        self._pacer = Pacer(parameters.time_step / factor if factor else 0.0)
        inputs = DroneInput(self.simulation, self._inbox)
        self._handles = Handles(self.simulation, inputs, self._inbox)
        self._markers = (SceneMarkers(self.simulation), DrawingMarkers(drone, drawings))
        self._cameras = [
            CameraOutput(drone, camera, parameters.cameras[name]) for name, camera in self.simulation.cameras.items()
        ]
        self._output = DroneOutput(self.simulation)
        for camera in self.simulation.cameras.values():
            camera.take()  # the first picture takes long: compiling shaders must not make a step late

    def run(self, ending: Callable[[], bool] = lambda: False) -> None:
        """Start, and step until it is time to end, or ROS shuts the node down."""

        def over() -> bool:
            return ending() or rospy.is_shutdown()

        with contextlib.suppress(ScriptError):  # said already; the node waits for `start`
            self.player.start()
        commands = rospy.resolve_name(f"{self._parameters.drone.name}/cmd_vel")
        rospy.loginfo(f"drone_sim: {'flying' if self.player.playing else 'stopped'}; commands on {commands}")
        steps, seconds = 0, 0.0
        self._pacer.restart()
        while not over():
            began = time.monotonic()
            if self.player.playing:
                self._wait(over)
                steps += self.step()
                seconds += time.monotonic() - began
            else:
                self._stand()
                self._pacer.restart()
        flown = steps * self._parameters.time_step
        factor = f"{flown / seconds:.2f} times real time" if seconds else "no time"
        rospy.loginfo(f"drone_sim: flew {flown:.2f} s at {factor}, {self._pacer.overruns} late steps")

    def _wait(self, over: Callable[[], bool]) -> None:
        if self.player.begun:  # reading scene and script took its time, which no step is late for
            self.player.begun = False
            self._pacer.restart()
        late = self._pacer.wait(over)
        if late:
            rospy.logwarn_throttle(5, f"step late by {late * 1e3:.0f} ms ({self._pacer.overruns} so far)")

    def step(self) -> bool:
        """Take what has come in, run one step, publish it under one stamp; return whether a step was run."""
        stamp = rospy.Time.now()
        self._inbox.empty()
        if not self.player.playing or not self.player.step():
            return False
        if self._clock is not None:
            stamp = rospy.Time.from_sec(self.simulation.time)
            self._clock.publish(stamp)
        self._publish(stamp)
        return True

    def _stand(self) -> None:
        """Paused or stopped: wait for something to do, and show what it changed."""
        self._inbox.wait(_STANDING)
        self._inbox.empty()
        if not self._simulated_time:  # in simulated time a second message of one stamp would be an error
            self._publish(rospy.Time.now())

    def _publish(self, stamp: rospy.Time) -> None:
        for camera in self._cameras:
            camera.publish(stamp)
        self._output.publish(stamp)
        self._handles.update()
        for markers in self._markers:
            markers.update()
        if self._parameters.gui:
            track = self.simulation.drone.track
            self.simulation.world.look_from_behind(position(track), to_euler(track)[2])

    def close(self) -> None:
        """Run the script's cleanup and free the world. Raises ScriptError."""
        self.simulation.close()


class _ToRosout(logging.Handler):
    """Hands what the modules without ROS log to rosout."""

    def emit(self, record: logging.LogRecord) -> None:
        logging.getLogger("rosout").log(record.levelno, record.getMessage())


def _parameters() -> Parameters:
    given = rospy.get_param("~", {})
    for key in ("config", "script", "scene_file"):
        if isinstance(given, dict) and isinstance(given.get(key), str):
            given[key] = from_shell(given[key])
    return parameters_module.load(given)


def main() -> int:
    """Run the node; return its exit status: 1, after one line, for a wrong parameter, file or script."""
    if not master_is_there():
        return 1
    rospy.init_node("drone_sim", disable_signals=True)
    ending = Ending()
    node = None
    try:
        node = Node(_parameters())
        MasterWatch().start()
        node.run(ending.asked)
    except (ValueError, ScriptError, RuntimeError) as error:  # each says in one line what is wrong
        rospy.logfatal(f"drone_sim: {error}")
        return 1
    except (OSError, rosgraph.MasterException):
        rospy.logfatal(f"drone_sim: the ROS master at {rosgraph.get_master_uri()} has gone")
        return 1
    finally:
        if node is not None:
            node.close()
        ending.complete()
    return 0


if __name__ == "__main__":
    sys.exit(main())
