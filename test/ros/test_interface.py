#!/usr/bin/env python3
"""docs/interface.md lists the node's interface; /diagnostics and the doctor report why a drone does not fly."""

import fnmatch
import itertools
import re
import sys
import tempfile
import threading
import unittest
from pathlib import Path

import roslib.message
import rospy
import rosservice
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, Twist
from listening import Listener, connected
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import Marker

from drone_sim.files.resources import package_path
from drone_sim.ros.doctor import HINT, OK, WRONG
from drone_sim.ros.doctor.doctor import run_checks
from drone_sim.ros.node import diagnostics
from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

PAGE = (package_path() / "docs/interface.md").read_text(encoding="utf-8")
SMALL = {name: {"width": 16, "height": 12} for name in ("front", "depth", "track", "floor")}
BOX = {"name": "Box", "shape": "box", "size": [0.3, 0.3, 0.3], "position": [2, 0, 0.15], "mass": 1.0}
DRAWS = """
fly = sysCall_init


def sysCall_init():
    fly()
    sim.addDrawingObjectItem(sim.addDrawingObject(sim.drawing_points, 5, 0, -1, 1, [1, 0, 0]), [0, 0, 1])
"""
STILL = {"contacts", "markers/update", "objects/update"}  # nothing is touched or dragged
SUB_STEP = 5_000_000  # ns
BROKEN = "def sysCall_actuation():\n    1 / 0\n"
ROSPY_TOPICS = {"/clock"}  # this process subscribes to it, since it uses simulated time


def table(title):
    """Return the rows of the tables in section `title` that begin with a code span."""
    section = re.search(rf"^## {title}\n(.*?)(?=^## |\Z)", PAGE, re.S | re.M).group(1)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in section.splitlines() if line[:3] == "| `"]
    return [[row[0].strip("`"), *row[1:]] for row in rows]


def expand(name, namespace="/drone"):
    return name if name.startswith("/") else f"{namespace}/{name}"


class Interface(unittest.TestCase):
    """A node in this process with every sensor; the tests run in the order of their names."""

    @classmethod
    def setUpClass(cls):
        diagnostics.PERIOD = 0.1
        cls.look_count, cls.ready = 0, threading.Event()
        cls.folder = tempfile.TemporaryDirectory()
        cls.script = Path(cls.folder.name) / "script.py"
        cls.script.write_text((package_path() / "src/drone_sim/child_scripts/tutorial.py").read_text() + DRAWS)
        cls.thread = threading.Thread(target=cls.run_node)
        cls.thread.start()
        cls.ready.wait(60)
        master = rospy.get_master()
        published, subscribed, _ = master.getSystemState()[2]
        own = rospy.get_name()
        cls.published = {topic for topic, nodes in published if own in nodes}
        cls.subscribed = {topic for topic, nodes in subscribed if own in nodes} - ROSPY_TOPICS
        cls.types = dict(master.getTopicTypes()[2])
        cls.services = {name: rosservice.get_service_type(name) for name in rosservice.get_service_list(node=own)}

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.thread.join()
        cls.folder.cleanup()

    @classmethod
    def run_node(cls):
        """Create and run the node in one thread, since an OpenGL context belongs to a thread."""
        settings = {
            "config": str(package_path() / "config/sensors.yaml"),
            **{"cameras": SMALL, "real_time_factor": 4.0, "script": str(cls.script)},
            "scene": {"objects": [BOX]},
        }
        cls.node = Node(parameters.load(settings))
        look = cls.node._diagnostics._look

        def counted():
            cls.look_count += 1
            return look()

        cls.node._diagnostics._look = counted
        cls.ready.set()
        cls.node.run()
        cls.node.close()

    def call(self, name, *arguments):
        return rospy.ServiceProxy(f"~{name}", SetBool if arguments else Trigger)(*arguments).message

    # ---- docs/interface.md

    def test_1_topics_and_services_are_those_of_the_page(self):
        expected = {(expand(row[0]).replace("/drone_sim", rospy.get_name()), row[1], row[2]) for row in table("Topics")}
        actual = {(topic, "→", self.types[topic]) for topic in self.published}
        actual |= {(topic, "←", self.types[topic]) for topic in self.subscribed}
        self.assertEqual(expected, actual)
        services = {expand(name, rospy.get_name()): kind for name, kind, _ in table("Services")}
        self.assertEqual(services, self.services)

    def test_2_parameters_are_those_of_the_page(self):
        expected = {row[0] for row in table("Parameters") if row[0].startswith("/")}
        self.assertEqual(expected, {name for name in rospy.get_param_names() if name.startswith("/drone/")})
        self.assertEqual(self.look_count, 0, "nobody has listened to /diagnostics")

    def test_3_diagnostics_before_any_command_report_that_none_was_received(self):
        listener = Listener("/diagnostics", DiagnosticArray)
        listener.wait_for(lambda m: any("no command has been received" in one.message for one in m.status), after=0)
        listener.close()

    def test_3_rates_and_frames_are_those_of_the_page(self):
        rows = [row for row in table("Topics") if row[1] == "→" and row[0] not in ("/rosout", "/clock")]
        listeners = {
            row[0]: Listener(expand(row[0]), roslib.message.get_message_class(row[2]))
            for row in rows
            if not row[0].startswith("/")
        }
        trees = {
            name: Listener(name, roslib.message.get_message_class("tf2_msgs/TFMessage"))
            for name in ("/tf", "/tf_static")
        }
        commands, command = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1)), Twist()
        command.linear.x, command.angular.z = 0.2, 0.2  # which `view/command` shows
        commands.publish(command)
        try:
            for topic, _, _, rate, frame, _ in rows:
                if topic in listeners:
                    with self.subTest(topic):
                        self.check_rate(listeners[topic], rate)
                        self.check_frames(listeners[topic], re.findall("`(.*?)`", frame), topic in STILL)
            for frame, parent, topic, _ in table("Frames"):
                wanted = (frame, parent.strip("`"))
                trees[topic.strip("`")].wait_for(lambda m, one=wanted: one in links(m), after=0)
            actual = {one for listener in trees.values() for message in listener.messages for one in links(message)}
            self.assertEqual({(frame, parent.strip("`")) for frame, parent, *_ in table("Frames")}, actual)
        finally:
            commands.publish(Twist())
            commands.unregister()
            for listener in (*listeners.values(), *trees.values()):
                listener.close()

    def check_frames(self, listener, expected, still):
        """Check that each pattern in `expected` has a frame (unless `still`), and each frame a pattern."""
        for name in () if still else expected:
            listener.wait_for(lambda m, one=name: fnmatch.filter(frames([m]), one), after=0)
        actual = frames(listener.messages)
        self.assertEqual({one for one in actual if not any(fnmatch.fnmatch(one, name) for name in expected)}, set())

    def check_rate(self, listener, rate):
        """Check the stamps of a topic whose rate is given in simulated time."""
        seconds = {"step": 0.05}.get(rate) or (1 / float(rate.split()[0]) if rate.endswith("Hz") else None)
        if seconds is None:
            return
        listener.wait_for(lambda _: len(listener.messages) > 2, after=0)
        headers = [m.header for m in listener.messages if hasattr(m, "header")]
        self.assertLessEqual({header.stamp.to_nsec() % SUB_STEP for header in headers}, {0})
        times = [header.stamp.to_sec() for header in headers]
        for before, after in itertools.pairwise(times):
            # A busy machine may drop a message, but it cannot add one in between.
            self.assertAlmostEqual((after - before) / seconds, max(1, round((after - before) / seconds)), delta=0.01)

    # ---- /diagnostics

    def test_4_diagnostics_explain_ignored_and_refused_commands(self):
        listener = Listener("/diagnostics", DiagnosticArray)
        own = rospy.get_name()

        def find_status(what, level, words, command=""):
            """Wait for a status, and return its values. Level None matches any: a busy machine is slow."""
            name = f"{own[1:]}: {what}"

            def fits(status):
                heard = {pair.key: pair.value for pair in status.values}.get("command", "")
                expected = level in (None, status.level) and words in status.message
                return status.name == name and expected and heard.startswith(command)

            array = listener.wait_for(lambda m: any(map(fits, m.status)))
            status = next(filter(fits, array.status))
            return {pair.key: pair.value for pair in status.values}

        self.assertEqual(find_status("simulation", None, "")["state"], "flying")
        commands = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        command = Twist()
        command.linear.x = 0.5
        commands.publish(command)
        values = find_status("vehicle drone", DiagnosticStatus.OK, f"as {own} commands", "0.50")  # not another test's
        self.assertEqual(values["command"], "0.50 0.00 0.00 m/s, 0.00 0.00 0.00 rad/s")
        self.assertEqual(values["connected commanders"], own)
        command.linear.x = 50.0
        commands.publish(command)
        values = find_status("vehicle drone", DiagnosticStatus.WARN, f"refused a message of {own} on cmd_vel")
        self.assertIn("linear.x = 50.0: must lie within", values["why refused"])
        command.linear.x = 0.5
        self.call("pause", True)
        commands.publish(command)
        find_status("vehicle drone", DiagnosticStatus.WARN, "but the simulation is paused")
        find_status("simulation", DiagnosticStatus.WARN, "/clock stands still")
        upside_down = PoseStamped()
        upside_down.pose.position.z, upside_down.pose.orientation.x = 2.0, 1.0
        poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=1))
        poses.publish(upside_down)
        find_status("vehicle drone", DiagnosticStatus.WARN, "leans (180 degrees)")
        self.call("restart")
        commands.publish(command)
        find_status("vehicle drone", DiagnosticStatus.OK, f"as {own} commands")
        commands.unregister()
        find_status("vehicle drone", DiagnosticStatus.WARN, f"still obeys the last command of {own}")
        camera = Listener("/drone/front", roslib.message.get_message_class("sensor_msgs/Image"))
        camera.wait_for()
        values = find_status("cameras", None, "")
        self.assertEqual(values["looked at"], "1 of 4 cameras")
        self.assertNotIn("none yet", values["renderer"])
        camera.close()
        self.script.write_text(BROKEN)
        self.call("restart")
        find_status("vehicle drone", DiagnosticStatus.ERROR, f"stopped: script error: [actuation] {self.script}:2")
        listener.close()

    def test_6_a_simulation_that_does_not_answer_is_reported(self):
        go_on = threading.Event()
        diagnostics.PATIENCE = 0.1
        listener = Listener("/diagnostics", DiagnosticArray)
        self.node._inbox.put(go_on.wait)
        try:
            array = listener.wait_for(lambda m: any("busy for" in one.message for one in m.status))
            self.assertEqual(max(one.level for one in array.status), DiagnosticStatus.ERROR)
        finally:
            go_on.set()
        listener.wait_for(lambda m: not any("busy for" in one.message for one in m.status))
        listener.close()

    # ---- the doctor

    def test_5_the_doctor_reports_the_errors_of_the_node(self):
        self.script.write_text(BROKEN)
        self.call("restart")
        Listener("~state", String).wait_for(lambda m: m.data == "stopped", after=0)
        rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        lines = list(run_checks(thorough=False))
        marks = {line.what: line.mark for line in lines}
        self.assertEqual(marks["master"], OK, lines)
        self.assertEqual(marks["clock"], OK, lines)
        self.assertEqual(marks["vehicle drone"], WRONG, lines)
        self.assertIn("script error", next(line.text for line in lines if line.what == "vehicle drone"))
        hint = next(line for line in lines if line.what == "commands")
        self.assertEqual(hint.mark, HINT)
        self.assertIn("start it with cmd_vel:=/drone/cmd_vel", hint.text)


def links(message):
    """Return (frame, parent) of each transform, with the node's own name replaced by its usual name."""
    own = rospy.get_name()[1:]
    return {(one.child_frame_id.replace(own, "drone_sim"), one.header.frame_id) for one in message.transforms}


def frames(messages):
    """Return the frame_ids of messages and of their markers and poses, without deleted markers."""
    frame_ids = set()
    for message in list(messages):
        held = [*getattr(message, "markers", ()), *getattr(message, "poses", ())]
        shown = [one for one in held if getattr(one, "action", Marker.ADD) == Marker.ADD]
        frame_ids |= {one.header.frame_id for one in (message, *shown) if hasattr(one, "header")}
    return frame_ids - {""}


if __name__ == "__main__":
    rospy.init_node("test_interface")
    sys.exit(rostest.rosrun("drone_sim", "interface", Interface))
