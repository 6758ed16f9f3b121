#!/usr/bin/env python3
"""The node as a process: wrong parameters, signals, restarted ROS masters, and repeatable flights."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path
from unittest import mock
from xmlrpc.client import ServerProxy

import rosgraph
import roslaunch
import rosnode
import rospy
import rostest
from listening import Listener
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from drone_sim.files.resources import package_path
from drone_sim.ros.core.launch_parameters import parameters_of
from drone_sim.run.simulation_setup import script_of

HANGS = 90.0  # s; nothing here takes nearly as long unless it hangs


# The simulator with a call into PyBullet that does not return.
STUCK = """
import sys, time
from drone_sim.run.watchdog import Watchdog
watchdog = Watchdog("drone_sim")
from drone_sim.ros.node import node
from drone_sim.world.dynamics import Dynamics
def stuck(*_arguments, **_options):
    print("flying into it", flush=True)
    {call}
Dynamics.{function} = stuck
sys.exit(node.main(watchdog))
"""
HOLDS_THE_GIL, RELEASES_THE_GIL = "sum(range(10**13))", "time.sleep(1000)"

# A client that a new master connects with the simulator; then it closes its connections, like a network failure does.
CLIENT = """
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger
rospy.init_node("client")
heights = []
odometry = rospy.Subscriber("/drone/odom", Odometry, lambda o: heights.append(o.pose.pose.position.z))
commands = rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1, latch=True)
while len(heights) < 400 or not commands.get_num_connections():  # 4 s; every 2 s the simulator looks who is there
    rospy.rostime.wallsleep(0.05)
for connection in (*odometry.impl.connections, *commands.impl.connections):
    connection.close()
climb = Twist()
climb.linear.z = 1.0
commands.publish(climb)
while not heights or heights[-1] < 2.0:
    rospy.rostime.wallsleep(0.05)
print(rospy.ServiceProxy("/drone_sim/stop", Trigger)().message, rospy.get_param("/drone_sim/real_time_factor"))
"""


def spawn(*command, **environment):
    """Start a process with its output in a pipe; PYTHONUNBUFFERED is removed from its environment."""
    variables = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.Popen(
        command, env={**variables, **environment}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def spawn_script(name, *arguments, **environment):
    """Start a script of this package without rosrun, which needs half a second to find it."""
    return spawn(sys.executable, str(package_path() / "scripts" / name), *arguments, **environment)


def spawn_simulator(*arguments, **environment):
    return spawn_script("simulator", *arguments, **environment)


def spawn_stuck(function, call):
    return spawn(sys.executable, "-c", STUCK.format(function=function, call=call))


def launched_parameters(*arguments):
    """Return the parameters that a simulator started by this roslaunch command reads."""
    config = roslaunch.config.ROSLaunchConfig()
    file = roslaunch.rlutil.resolve_launch_arguments(["drone_sim", arguments[0]])[0]
    roslaunch.xmlloader.XmlLoader().load(file, config, argv=["rviz:=false", *arguments[1:]], verbose=False)
    for name, one in config.params.items():
        if name.startswith("/drone_sim/"):
            rospy.set_param(name, one.value)
    try:
        return parameters_of("/drone_sim")
    finally:
        rospy.delete_param("/drone_sim")


@contextlib.contextmanager
def master(port):
    """Run a private ROS master. It is killed at the end, so that it notifies no node."""
    process = subprocess.Popen(["rosmaster", "--core", "-p", port], stdout=subprocess.DEVNULL)
    try:
        while process.poll() is None:
            with contextlib.suppress(OSError), socket.create_connection(("localhost", int(port)), timeout=HANGS):
                break
        yield
    finally:
        process.kill()
        process.wait()


class Process(unittest.TestCase):
    """Output and exit status of a simulator process that cannot start or is asked to end."""

    def tearDown(self):
        if rospy.has_param("/drone_sim"):
            rospy.delete_param("/drone_sim")

    def test_wrong_parameters_end_the_simulator_with_one_line(self):
        for argument, expected in (
            ("_time_step:=0.012", "parameter time_step = 0.012: must be a whole multiple of sub_step = 0.005"),
            ("_drone:={urdf: /no/such.urdf}", "parameter drone/urdf = '/no/such.urdf': no such file"),
            ("_real_time_facter:=2", "parameter real_time_facter: unknown key; near names are real_time_factor"),
        ):
            with self.subTest(argument):
                for name in ("time_step", "drone", "real_time_facter"):
                    if rospy.has_param(f"/drone_sim/{name}"):
                        rospy.delete_param(f"/drone_sim/{name}")
                node = spawn_simulator(argument)
                output, _ = node.communicate(timeout=HANGS)
                self.assertEqual(node.returncode, 1, output)
                self.assertIn(expected, output)
                self.assertNotIn("Traceback", output)
                self.assertEqual(len([line for line in output.splitlines() if "FATAL" in line]), 1, output)

    def test_the_simulator_flies_if_no_log_can_be_written(self):
        for said in (["__log:=/dev/full"], []):
            with self.subTest(said):
                node = spawn_simulator(*said, **({} if said else {"ROS_LOG_DIR": "/proc/nowhere"}))
                printed = self.read_until(node, "flying")
                node.send_signal(signal.SIGINT)
                printed += node.communicate(timeout=HANGS)[0]
                self.assertEqual(node.returncode, 0, printed)
                self.assertEqual(printed.count("no log is written"), 1, printed)
                self.assertNotIn("Traceback", printed)

    def test_a_recorder_that_cannot_write_ends_with_one_line(self):
        for folder, why in (("/proc", ""), ("/no/such", "no such folder")):
            with self.subTest(folder):
                self.assert_refused(spawn_script("record", "--folder", folder), f"--folder {folder}: {why}")

    def test_invalid_parameters_end_the_simulator_with_one_line(self):
        for name, value, expected in (
            ("/drone_sim", 5, "parameter /drone_sim = 5: must be a namespace"),
            ("/use_sim_time", "foo", "parameter /use_sim_time = foo: must be true or false"),
            ("/drone_sim/script", "/" + "x" * 300 + ".py", "ile"),  # too long for a file name, or no such file
        ):
            with self.subTest(name):
                rospy.set_param(name, value)
                try:
                    self.assert_refused(spawn_simulator(), expected)
                finally:
                    rospy.delete_param(name)

    def test_an_unusable_ros_environment_ends_the_simulator_with_one_line(self):
        for name, value, expected in (
            ("ROS_MASTER_URI", "garbage", "ROS_MASTER_URI = 'garbage': must be like http://localhost:11311"),
            ("ROS_MASTER_URI", "http://localhost:1", "no ROS master at http://localhost:1"),
            (
                "ROS_MASTER_URI",
                "http://no.such.host.invalid:11311",
                "the host 'no.such.host.invalid' cannot be resolved",
            ),
            ("ROS_HOSTNAME", "no.such.host.invalid", "ROS_HOSTNAME = 'no.such.host.invalid': cannot be resolved"),
        ):
            with self.subTest(value), mock.patch.dict(os.environ):
                os.environ.pop("ROS_HOSTNAME", None)
                self.assert_refused(spawn_simulator(**{name: value}), expected)

    def assert_refused(self, node, expected):
        output, _ = node.communicate(timeout=HANGS)
        self.assertEqual(node.returncode, 1, output)
        self.assertEqual([expected in line for line in output.splitlines() if line], [True], output)

    def test_an_error_in_cleanup_is_one_line(self):
        with tempfile.NamedTemporaryFile("w", suffix=".py") as script:
            script.write("def sysCall_cleanup():\n    1 / 0\n")
            script.flush()
            node = spawn_simulator(f"_script:={script.name}")
            said = self.read_until(node, "flying")
            node.send_signal(signal.SIGINT)
            said += node.communicate(timeout=HANGS)[0]
        self.assertEqual(node.returncode, 1)
        self.assertNotIn("Traceback", said)
        fatal = [line for line in said.splitlines() if "FATAL" in line]
        self.assertEqual(len(fatal), 1, said)
        self.assertIn("[cleanup]", fatal[0])
        self.assertIn("ZeroDivisionError", fatal[0])

    def read_until(self, node, fragment):
        """Return the output of `node` up to the first line that contains `fragment`."""
        said = ""
        with self.kill_on_hang(node):
            for line in node.stdout:
                said += line
                if fragment in line:
                    return said
        self.fail(f"it ended, or was killed, without a line with {fragment!r}: {said}")

    @contextlib.contextmanager
    def kill_on_hang(self, node):
        """Kill `node` after a time limit, and if the body fails, so that it does not disturb the next test."""
        watchdog = threading.Timer(2 * HANGS, node.kill)
        watchdog.start()
        try:
            yield
        except BaseException:
            node.kill()
            raise
        finally:
            watchdog.cancel()

    def test_a_signal_kills_a_stuck_simulator_that_holds_the_gil(self):
        for function, number in (("advance", signal.SIGINT), ("__init__", signal.SIGTERM)):
            with self.subTest(function):
                node = spawn_stuck(function, HOLDS_THE_GIL)
                said = self.read_until(node, "flying into it")
                node.send_signal(number)
                self.assert_killed(node, said + node.communicate(timeout=HANGS)[0])

    def test_rosnode_kill_kills_a_stuck_simulator_that_releases_the_gil(self):
        node = spawn_stuck("advance", RELEASES_THE_GIL)
        said = self.read_until(node, "flying into it")
        rosnode.kill_nodes(["/drone_sim"])
        self.assert_killed(node, said + node.communicate(timeout=HANGS)[0])

    def assert_killed(self, node, said):
        self.assertEqual(node.returncode, -signal.SIGKILL, said)
        self.assertNotIn("Traceback", said)
        self.assertEqual(len([line for line in said.splitlines() if line.startswith("drone_sim: killed: ")]), 1, said)

    def test_silent_connections_do_not_block_other_subscribers(self):
        node = spawn_simulator()
        with self.kill_on_hang(node), contextlib.ExitStack() as silent:
            self.read_until(node, "flying")
            uri = rosgraph.Master("/test").lookupNode("/drone_sim")
            _, _, (_, host, port) = ServerProxy(uri).requestTopic("/test", "/drone/odom", [["TCPROS"]])
            for _ in range(20):
                silent.enter_context(socket.create_connection((host, port), timeout=HANGS))
            odometry = Listener("/drone/odom", Odometry)
            odometry.wait_for(timeout=HANGS)
            odometry.close()
            self.assertEqual(rospy.ServiceProxy("/drone_sim/stop", Trigger)().message, "stopped")
            node.send_signal(signal.SIGINT)
            node.communicate(timeout=HANGS)
        self.assertEqual(node.returncode, 0)

    def test_the_simulator_registers_with_a_new_master(self):
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = str(probe.getsockname()[1])
        variables = {"ROS_MASTER_URI": f"http://localhost:{port}"}
        with master(port):
            node = spawn_simulator("_real_time_factor:=5", **variables)
            self.read_until(node, "flying")
        with master(port):
            self.assertIn("a new ROS master", self.read_until(node, "there is a new ROS master"))
            client = spawn(sys.executable, "-c", CLIENT, **variables)
            said, _ = client.communicate(timeout=2 * HANGS)
            self.assertEqual(said, "stopped 5\n")
            node.send_signal(signal.SIGINT)
            node.communicate(timeout=HANGS)
        self.assertEqual(node.returncode, 0)

    def test_the_cockpit_waits_for_a_new_master_and_registers_with_it(self):
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = str(probe.getsockname()[1])
        variables = {"ROS_MASTER_URI": f"http://localhost:{port}"}
        with master(port):
            node = spawn_script("cockpit", "_port:=0", **variables)
            watchdog = threading.Timer(4 * HANGS, node.kill)
            watchdog.start()
            self.assertIn("the cockpit listens at", self.read_until(node, "the cockpit is at"))
        first_output = self.read_until(node, "the ROS master does not answer")
        with master(port):
            said = first_output + self.read_until(node, "there is a new ROS master")
            node.send_signal(signal.SIGINT)
            said += node.communicate(timeout=HANGS)[0]
        watchdog.cancel()
        self.assertEqual(node.returncode, 0)
        self.assertNotIn("Traceback", said)
        self.assertNotIn("out of sync", said)

    def test_an_argument_unknown_to_the_launch_file_ends_it_with_one_line(self):
        command = ["roslaunch", "drone_sim", "drone.launch", "rviz:=false", "scrpt:=mine.py"]
        launched = subprocess.run(command, capture_output=True, text=True, timeout=2 * HANGS, check=False)
        said = "scrpt:=mine.py: drone.launch has no argument scrpt; near names are script"
        self.assertEqual(launched.stderr.count(said) + launched.stdout.count(said), 1, launched.stderr)
        self.assertNotIn("Traceback", launched.stderr)
        rospy.delete_param("/drone_sim")

    def test_launch_defaults_do_not_override_a_scene_or_a_config(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, config = Path(folder) / "scene.yaml", Path(folder) / "config.yaml"
            scene.write_text("vehicles: {drone: {position: [0, 0, 0.8], script: none}}\n")
            config.write_text(
                f"scene_file: {scene}\nstart: landed\nreal_time_factor: 4\n"
                "remote_api: {serve: true, port: 0, legacy_port: 0}\n"
            )
            fleet = Path(folder) / "fleet.yaml"
            fleet.write_text("vehicles: {red: {position: [0, 0, 1]}, blue: {position: [0, 1, 1]}}\n")
            other = Path(folder) / "other.yaml"
            other.write_text("drone: {position: [0, 0, 2]}\n")
            for arguments, flown, where, config_counts in (
                (["drone.launch", f"scene:={scene}"], {"drone": "none"}, 0.8, False),
                (["drone.launch", f"scene:={scene}", "script:=pilot"], {"drone": "pilot"}, 0.8, False),
                (["drone.launch", f"config:={config}"], {"drone": "none"}, 0.8, True),
                (["drone.launch", f"config:={config}", f"scene:={other}"], {"drone": ""}, 2.0, True),
                (["drone.launch"], {"drone": ""}, 0.8, False),
                (["drone.launch", "script:=none"], {"drone": "none"}, 0.8, False),
                (["fleet.launch"], dict.fromkeys(("drone1", "drone2", "drone3"), ""), 0.8, False),
                (["fleet.launch", f"config:={fleet}"], {"red": "", "blue": ""}, 1.0, False),
                (["fleet.launch", "n:=1", f"config:={fleet}"], {"drone1": ""}, 0.8, False),
            ):
                with self.subTest(arguments):
                    parameters = launched_parameters(*arguments)
                    flown_by = {one.name: script_of(one, parameters, parameters.script) for one in parameters.fleet}
                    self.assertEqual(flown_by, flown)
                    self.assertEqual(parameters.fleet[0].position[2], where)
                    pace = (parameters.start, parameters.real_time_factor, parameters.remote_api.serve)
                    self.assertEqual(pace, ("landed", 4, True) if config_counts else ("flying", 1, False))
            overrides = launched_parameters("drone.launch", f"config:={config}", "start:=flying", "real_time_factor:=2")
            self.assertEqual((overrides.start, overrides.real_time_factor), ("flying", 2))

    def test_a_vehicle_with_script_none_falls_if_the_launch_sets_no_script(self):
        with tempfile.TemporaryDirectory() as folder, socket.create_server(("localhost", 0)) as free:
            scene, port = Path(folder) / "scene.yaml", str(free.getsockname()[1])
            scene.write_text("vehicles: {drone: {position: [0, 0, 0.8], script: none}}\n")
            free.close()
            node = spawn("roslaunch", "-p", port, "drone_sim", "drone.launch", "rviz:=false", f"scene:={scene}")
            try:
                self.read_until(node, "flying; commands on")
                command = ["rostopic", "echo", "-n", "1", "--filter", "m.pose.pose.position.z < 0.2", "/drone/odom"]
                environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}"}
                subprocess.run(command, env=environment, check=True, timeout=HANGS, stdout=subprocess.DEVNULL)
            finally:
                node.send_signal(signal.SIGINT)
                node.communicate(timeout=HANGS)

    def assert_ends_cleanly(self, end):
        """Check that a simulator with a subscriber ends without an error after `end(process)`."""
        node = spawn_simulator("_real_time_factor:=0")
        odometry, lines = Listener("/drone/odom", Odometry), []
        with self.kill_on_hang(node):
            for line in node.stdout:
                lines.append(line)
                if "flying" in line:
                    odometry.wait_for()
                    end(node)
        self.assertEqual(node.wait(HANGS), 0, "".join(lines))
        odometry.close()
        self.assertNotIn("Traceback", "".join(lines))
        self.assertNotIn("/drone_sim", rosnode.get_node_names())

    def test_sigint_and_sigterm_end_the_simulator_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number):
                self.assert_ends_cleanly(lambda node, number=number: node.send_signal(number))

    def test_rosnode_kill_ends_the_simulator_cleanly(self):
        self.assert_ends_cleanly(lambda _: rosnode.kill_nodes(["/drone_sim"]))

    def assert_replaced(self, node, said=""):
        said += node.communicate(timeout=HANGS)[0]
        self.assertEqual(node.returncode, 0, said)
        self.assertEqual(said.count("another node with this name was started"), 1, said)
        self.assertNotIn("Traceback", said)
        self.assertNotIn("killed", said)

    def test_a_new_simulator_replaces_one_with_the_same_name(self):
        nodes = []

        def add_simulator():
            nodes.append(spawn_simulator())
            return nodes[-1]

        watchdog = threading.Timer(4 * HANGS, lambda: [node.kill() for node in nodes])
        watchdog.start()
        older = add_simulator()
        said = self.read_until(older, "flying")
        newer = add_simulator()
        self.assert_replaced(older, said)
        self.read_until(newer, "flying")
        newer.kill()  # the master does not notice it
        newer.communicate(timeout=HANGS)
        both = add_simulator(), add_simulator()  # at the same time
        while all(node.poll() is None for node in both):
            rospy.rostime.wallsleep(0.05)
        first, last = sorted(both, key=lambda node: node.poll() is None)
        self.assert_replaced(first)
        self.read_until(last, "flying")
        said = "already flies in /drone_sim: give one of the two"
        self.assert_refused(spawn_simulator("__name:=other"), said)
        last.send_signal(signal.SIGSTOP)
        try:
            self.assert_refused(spawn_simulator(), "and does not answer")
        finally:
            last.send_signal(signal.SIGCONT)
        last.send_signal(signal.SIGINT)
        last.communicate(timeout=HANGS)
        watchdog.cancel()
        self.assertEqual(last.returncode, 0)

    def test_a_node_whose_launch_runs_the_master_is_not_replaced(self):
        with socket.create_server(("localhost", 0)) as free:
            port = str(free.getsockname()[1])
        first = spawn("roslaunch", "-p", port, "drone_sim", "drone.launch", "rviz:=false", "web:=true", "web_port:=0")
        try:
            said = self.read_until(first, "flying; commands on")
            if "the cockpit is at" not in said:
                self.read_until(first, "the cockpit is at")
            master_variables = {"ROS_MASTER_URI": f"http://localhost:{port}"}
            self.assert_refused(spawn_simulator(**master_variables), "its launch also runs the ROS master")
            cockpit = spawn_script("cockpit", "__name:=cockpit", "_port:=0", **master_variables)
            self.assert_refused(cockpit, "its launch also runs the ROS master")
            self.assertIsNone(first.poll())
        finally:
            first.send_signal(signal.SIGINT)
            said = first.communicate(timeout=HANGS)[0]
        self.assertNotIn("REQUIRED process", said)

    def test_two_processes_fly_bitwise_identical_flights(self):
        with tempfile.TemporaryDirectory() as folder:
            commands = Path(folder) / "commands.yaml"
            commands.write_text(
                "- {at: 0.5, twist: {linear: [1, -0.5, 0.2], angular: [0, 0, 0.7]}}\n"
                "- {at: 3.0, pose: {position: [1, 1, 3], rpy: [0.4, -0.3, 1]}}\n"
                "- {at: 6.0, twist: {linear: [0, 0, 0]}}\n"
            )
            flights = [Path(folder) / name for name in ("one.csv", "two.csv")]
            for csv in flights:
                fly = spawn_script("fly", "--commands", str(commands), "--csv", str(csv))
                said, _ = fly.communicate(timeout=HANGS)
                self.assertEqual(fly.returncode, 0, said)
            one, two = (csv.read_text() for csv in flights)
            self.assertGreater(len(one.splitlines()), 100)
            self.assertEqual(one, two)


if __name__ == "__main__":
    rospy.init_node("test_process")
    sys.exit(rostest.rosrun("drone_sim", "process", Process))
