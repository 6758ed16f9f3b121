"""The node: the simulation at the pace of the clock, with ROS around it.

Parameters (private): every key of config/drone.yaml.
Topics, in the drone's namespace: see inputs.py and outputs.py. /clock is published with use_sim_time.
Frames: world -> base_link, world -> Track_base; the rest comes from the URDF.
"""

from __future__ import annotations

import logging
import sys
import time
from typing import List, Union

import rospy
from rosgraph_msgs.msg import Clock

from drone_sim import parameters as parameters_module
from drone_sim.frames import position, to_euler
from drone_sim.pacing import Pacer
from drone_sim.parameters import ParameterError, Parameters
from drone_sim.ros.cameras import CameraOutput
from drone_sim.ros.inputs import DroneInput
from drone_sim.ros.master_watch import MasterWatch
from drone_sim.ros.outputs import DroneOutput
from drone_sim.scripting.python_script import ScriptError
from drone_sim.simulation import Simulation
from drone_sim.urdf import UrdfError


class Node:
    """Steps the simulation in the thread that calls `run`, and no other."""

    def __init__(self, parameters: Parameters):
        """Build the simulation and advertise. Raises what Simulation raises."""
        self._window = parameters.gui
        self.simulation = Simulation(parameters, script=parameters.script, gui=parameters.gui)
        simulation = self.simulation
        factor = parameters.real_time_factor
        self._pacer = Pacer(parameters.time_step / factor if factor else 0.0)
        self._simulated_time = bool(rospy.get_param("/use_sim_time", False))
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10) if self._simulated_time else None
        self._input = DroneInput(simulation.drone, parameters)
        self._outputs: List[Union[DroneOutput, CameraOutput]] = []
        settings = parameters.cameras
        mounted = {settings[name].frame: camera for name, camera in simulation.cameras.items() if settings[name].mount}
        self._outputs.append(DroneOutput(simulation.drone, mounted))
        for name, camera in simulation.cameras.items():
            self._outputs.append(CameraOutput(simulation.drone.name, camera, settings[name]))
            camera.take()  # the first picture takes long: compiling shaders must not make a step late

    def run(self) -> None:
        """Step until the node is shut down. Raises ScriptError."""
        simulation = self.simulation
        rospy.loginfo(f"drone_sim: flying; commands on {rospy.resolve_name(simulation.drone.name + '/cmd_vel')}")
        self._pacer.restart()
        began = time.monotonic()
        while not rospy.is_shutdown():
            late = self._pacer.wait(rospy.is_shutdown)
            if late:
                rospy.logwarn_throttle(5, f"step late by {late * 1e3:.0f} ms ({self._pacer.overruns} so far)")
            self.step()
        seconds = time.monotonic() - began
        factor = f"{simulation.time / seconds:.2f} times real time" if seconds else "no time"
        rospy.loginfo(f"drone_sim: flew {simulation.time:.2f} s at {factor}, {self._pacer.overruns} late steps")

    def step(self) -> None:
        """Take what has come in, run one step, publish it under one stamp."""
        stamp = rospy.Time.now()
        self._input.apply()
        self.simulation.step()
        if self._clock is not None:
            stamp = rospy.Time.from_sec(self.simulation.time)
            self._clock.publish(stamp)
        for output in self._outputs:
            output.publish(stamp)
        if self._window:
            track = self.simulation.drone.track
            self.simulation.world.look_from_behind(position(track), to_euler(track)[2])

    def close(self) -> None:
        """Run the script's cleanup and free the world. Raises ScriptError."""
        self.simulation.close()


class _ToRosout(logging.Handler):
    """Hands what the modules without ROS log to rosout."""

    def emit(self, record: logging.LogRecord) -> None:
        logging.getLogger("rosout").log(record.levelno, record.getMessage())


def main() -> int:
    """Run the node; return its exit status: 1, after one line, for a wrong parameter, file or script."""
    rospy.init_node("drone_sim")
    logging.getLogger("drone_sim").addHandler(_ToRosout())
    node = None
    try:
        node = Node(parameters_module.load(rospy.get_param("~", {})))
        MasterWatch().start()
        node.run()
    except (ParameterError, UrdfError, ScriptError, RuntimeError) as error:
        rospy.logfatal(f"drone_sim: {error}")
        return 1
    finally:
        if node is not None:
            node.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
