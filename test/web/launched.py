"""drone.launch with its cockpit on a ROS master of its own, for tests and pictures; rospy here connects to it."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

_ADDRESS = re.compile(r"the cockpit is at (\S+)")
_PATIENCE = 120  # s


class Launched:
    """A running simulation: the address of its page, the folder of the editor's scripts, and the log file."""

    def __init__(self, address, scripts, log):
        self.address = address
        self.scripts = scripts
        self.log = log

    def call(self, service, *request):
        """Call a service of the simulation; return the message of its response."""
        import rospy
        from std_srvs.srv import SetBool, Trigger

        service = f"/drone_sim/{service}"
        rospy.wait_for_service(service, _PATIENCE)  # the cockpit may start before the simulation
        return rospy.ServiceProxy(service, SetBool if request else Trigger)(*request).message

    def load(self, scene):
        """Load a scene file; '' is the scene of a launch without a scene file."""
        import rospy

        rospy.set_param("/drone_sim/scene_file", scene)
        self.call("load_scene")

    def start_afresh(self):
        """Restart the pilot, as after the launch."""
        import rospy

        rospy.set_param("/drone_sim/script", "pilot")
        self.call("pause", False)
        self.call("restart")


@contextlib.contextmanager
def launched(*arguments):
    """Yield a running simulation with a cockpit."""
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        log = Path(folder) / "launch.log"
        environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://localhost:{port}",
            "ROS_HOSTNAME": "localhost",
            "HOME": folder,
            "ROS_HOME": f"{folder}/.ros",
        }
        environment.pop("PYTHONUNBUFFERED", None)  # the address must be in the log at once without it, too
        command = ["roslaunch", "-p", str(port), "drone_sim", "drone.launch", "rviz:=false", "web:=true"]
        options = [f"web_port:={free_port()}", *arguments]
        with log.open("w") as output:
            process = subprocess.Popen([*command, *options], env=environment, stdout=output, stderr=subprocess.STDOUT)
        try:
            os.environ["ROS_MASTER_URI"] = environment["ROS_MASTER_URI"]
            yield Launched(_address(process, log), Path(folder) / "drone_scripts", log)
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                raise


def _address(process, log):
    start = time.monotonic()
    while time.monotonic() - start < _PATIENCE and process.poll() is None:
        match = _ADDRESS.search(log.read_text())
        if match:
            return match[1]
        time.sleep(0.1)
    print(log.read_text(), file=sys.stderr)
    raise RuntimeError("the cockpit did not start")


def free_port():
    with socket.socket() as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]
