#!/usr/bin/env python3
"""The V-REP workflow over ROS: start, stop, pause, step, edit the script, save the scene, drag objects."""

import json
import math
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import rospy
import rostest
import trimesh
import yaml
from diagnostic_msgs.srv import AddDiagnostics
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped, WrenchStamped
from listening import Listener, connected
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback, InteractiveMarkerUpdate, Marker, MarkerArray

from drone_sim.mechanics import frames
from drone_sim.ros.node.node import Node
from drone_sim.run import parameters

SCRIPT = """
def sysCall_init():
    self.steps = 0
    self.out = simROS.advertise('/script/steps', 'std_msgs/Float64')
    simROS.subscribe('/script/bump', 'std_msgs/Float64', 'on_bump')
    simROS.advertiseService('/script/steps', 'std_srvs/SetBool', 'on_asked')

def on_asked(request):
    return {'success': request.data, 'message': str(self.steps)}

def on_bump(msg):
    self.steps += msg.data

def sysCall_sensing():
    self.steps += 1
    simROS.publish(self.out, {'data': self.steps})

def sysCall_cleanup():
    print('cleaned up')
"""

DETACHED_TARGET_SCRIPT = """
def sysCall_init():
    sim.setObjectParent(sim.getObjectHandle('DronePosition'), -1, True)
"""
SUBSCRIBING_SCRIPT = """
def sysCall_init():
    simROS.subscribe("cmd_vel", "geometry_msgs/Twist", "on_twist")

def on_twist(msg):
    pass
"""
DRAWING_SCRIPT = """
def sysCall_init():
    self.path = sim.addDrawingObject(sim.drawing_linestrip, 2, 0, -1, 100, [1, 0, 0])
    self.disc = sim.addDrawingObject(sim.drawing_discpoints | sim.drawing_50percenttransparency, 0.4)
    sim.addDrawingObjectItem(self.disc, [1, 2, 3, 0, 0, 1])
    self.ball = sim.addDrawingObject(sim.drawing_spherepoints | sim.drawing_cyclic, 0.5)
    self.x = -1

def sysCall_sensing():
    self.x += 1
    sim.addDrawingObjectItem(self.path, [self.x, 0, 1])
    sim.addDrawingObjectItem(self.ball, [self.x, 0, 1])
"""
DIALOG_SCRIPT = """
def sysCall_init():
    sim.adjustView(sim.floatingViewAdd(0.9, 0.9, 0.2, 0.2, 0), sim.getObject('/floorCamera'), 64)
    self.asked = sim.displayDialog('Land?', 'now?', sim.dlgstyle_yes_no, False)

def sysCall_actuation():
    if self.asked and sim.getDialogResult(self.asked) == sim.dlgret_no:
        sim.auxiliaryConsolePrint(sim.auxiliaryConsoleOpen('Said', 5, 0), 'no')
        self.asked = None
"""


class Toolbar(unittest.TestCase):
    """Services and topics of a node that runs in a thread of this process at ten times real time."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.script, cls.scene = Path(cls.folder.name) / "script.py", Path(cls.folder.name) / "scene.yaml"
        cls.script.write_text(SCRIPT)
        settings = {"script": str(cls.script), "real_time_factor": 10.0, "drone": {"position": [0, 0, 900]}}
        cls.node = Node(parameters.load(settings))
        cls.log = Listener("/rosout", Log)
        cls.odometry = Listener("/drone/odom", Odometry)
        cls.thread = threading.Thread(target=cls.node.run)
        cls.thread.start()
        cls.odometry.wait_for()

    @classmethod
    def tearDownClass(cls):
        rospy.signal_shutdown("done")
        cls.thread.join()
        cls.node.close()
        cls.folder.cleanup()

    def setUp(self):
        self.script.write_text(SCRIPT)
        rospy.set_param("~scene_file", "")
        self.call("load_scene")

    def call(self, name, expected=True):
        answer = rospy.ServiceProxy(f"~{name}", Trigger)()
        self.assertEqual(answer.success, expected, answer.message)
        return answer.message

    def pause(self, on, expected=True):
        answer = rospy.ServiceProxy("~pause", SetBool)(on)
        self.assertEqual(answer.success, expected, answer.message)

    @property
    def simulation(self):
        return self.node.simulation

    def test_stop_cleans_up_and_restores_the_scene(self):
        self.odometry.wait_for(lambda o: o.pose.pose.position.z < 899)  # the vehicle falls with this script
        self.assertEqual(self.call("stop"), "stopped")
        self.assertEqual(self.simulation.time, 0.0)
        self.assertAlmostEqual(self.simulation.drone.body.state.position[2], 900)
        self.log.wait_for(lambda m: m.msg == "cleaned up", after=0)
        self.assertEqual(self.call("stop"), "already stopped")
        self.assertEqual(self.call("start"), "started")
        self.odometry.wait_for(lambda o: o.pose.pose.position.z < 899)

    def test_a_service_that_the_script_advertises(self):
        ask = rospy.ServiceProxy("/script/steps", SetBool)
        self.assertTrue(float(ask(True).message) <= float(ask(True).message))
        self.assertFalse(ask(False).success)
        stop_timer = threading.Timer(0.1, lambda: self.call("stop"))
        self.pause(True)
        stop_timer.start()
        with self.assertRaisesRegex(rospy.ServiceException, "the script ended before it answered"):
            ask(True)
        stop_timer.join()

    def test_windows_of_a_script_are_published_and_a_dialog_is_answered(self):
        windows, answers = Listener("~windows", String), rospy.Publisher("~window_answers", String, queue_size=5)
        connected(answers)
        self.script.write_text(DIALOG_SCRIPT)
        self.call("restart")
        result = windows.wait_for(lambda m: '"Land?"' in m.data, after=0).data
        state = json.loads(result)
        self.assertEqual(state["views"][0]["topic"], "/drone/floor/image")
        for wrong in ("nonsense", '{"handle": 1000, "button": "no"}'):
            answers.publish(wrong)
        self.log.wait_for(lambda m: m.msg.startswith("window_answers: refused: "), after=0)
        answers.publish(json.dumps({"handle": state["dialogs"][0]["handle"], "button": "no"}))
        windows.wait_for(lambda m: json.loads(m.data)["consoles"][:1] and not json.loads(m.data)["dialogs"], after=0)
        self.call("stop")
        windows.wait_for(lambda m: not any(json.loads(m.data).values()), after=0)
        answers.unregister()

    def test_variables_of_a_script_and_a_breakpoint(self):
        variables, names = Listener("~variables", String), Listener("~names", String)
        self.call("restart")

        def steps(variables_text):
            rows = [row for script in json.loads(variables_text)["scripts"] for row in dict(script["scopes"])["self"]]
            return [int(value) for name, _, value, _ in rows if name == "steps"]

        variables.wait_for(lambda m: any(count > 0 for count in steps(m.data)), after=0)
        known_names = json.loads(names.wait_for(lambda m: '"objects"' in m.data, after=0).data)
        self.assertTrue("Quadricopter_base" in known_names["objects"] and "Kzref" in known_names["parameters"])
        breakpoints = rospy.Publisher("~breakpoints", String, queue_size=5, latch=True)
        connected(breakpoints)
        breakpoints.publish('{"script.py": [1]}')
        self.log.wait_for(lambda m: m.msg.startswith("breakpoints: refused: "), after=0)
        line = SCRIPT.split("\n").index("    self.steps += 1") + 1
        breakpoints.publish(json.dumps({str(self.script): [line]}))
        result = json.loads(variables.wait_for(lambda m: '"paused"' in m.data and '"line"' in m.data, after=0).data)
        self.assertEqual((result["reached"]["file"], result["reached"]["line"]), (str(self.script), line))
        scope_at_line = dict(result["reached"]["scopes"])["self"]
        self.assertEqual(int(scope_at_line[0][2]) + 1, steps(json.dumps(result))[0])
        self.call("step")
        variables.wait_for(lambda m: json.loads(m.data)["reached"].get("time", 0) > result["reached"]["time"], after=0)
        breakpoints.unregister()
        variables.close()
        names.close()
        self.pause(False)

    def test_pause_and_single_steps(self):
        self.call("step", expected=False)
        self.pause(True)
        before = self.simulation.steps
        self.assertEqual(self.call("step"), f"t = {(before + 1) * 0.05:.2f} s")
        self.assertEqual(self.call("step"), f"t = {(before + 2) * 0.05:.2f} s")
        self.assertEqual(self.simulation.steps, before + 2)
        self.pause(False)
        self.odometry.wait_for()
        self.call("stop")
        self.pause(True, expected=False)

    def test_the_state_topic_is_latched_and_publishes_each_change(self):
        states = Listener("~state", String)
        states.wait_for(lambda m: m.data == "flying", after=0)
        expected = ["flying"]
        for action, after in (
            (lambda: self.pause(True), ["paused"]),
            (lambda: self.call("step"), []),
            (lambda: self.pause(False), ["flying"]),
            (lambda: self.call("restart"), ["stopped", "flying"]),
            (lambda: self.call("stop"), ["stopped"]),
            (lambda: self.call("restart"), ["flying"]),
            (lambda: self.pause(True), ["paused"]),
            (lambda: self.script.write_text("def sysCall_actuation():\n    1 / 0\n"), []),
            (lambda: self.call("restart"), ["stopped", "flying", "stopped"]),
        ):
            action()
            expected += after
            states.wait_for(lambda m, last=expected[-1]: m.data == last, after=len(expected) - 1)
        self.assertEqual([m.data for m in states.messages], expected)
        Listener("~state", String).wait_for(lambda m: m.data == "stopped", after=0)
        self.script.write_text("def sysCall_cleanup():\n    1 / 0\n")
        self.call("start")
        self.script.write_text(SCRIPT)
        self.call("restart")  # the error in cleanup is logged, and the edited script runs
        self.log.wait_for(lambda m: "[cleanup]" in m.msg, after=0)
        self.assertTrue(self.simulation.running)

    def test_the_command_in_force_is_published(self):
        commands = Listener("/drone/command", TwistStamped)
        commander = connected(rospy.Publisher("/drone/cmd_vel", Twist, queue_size=1))
        twist = Twist()
        for vx, change in ((0.5, lambda: None), (0.25, lambda: self.pause(True)), (0.125, lambda: self.call("stop"))):
            change()
            twist.linear.x, twist.angular.z = vx, -vx
            commander.publish(twist)
            result = commands.wait_for(lambda m, vx=vx: m.twist.linear.x == vx)
            self.assertEqual((result.twist.angular.z, result.header.frame_id), (-vx, "Track_base"))
        self.call("start")
        commands.wait_for(lambda m: m.twist == Twist())

    def test_a_broken_script_stops_and_the_edited_script_starts(self):
        for broken, message in (
            ("def sysCall_init(:\n", "[load]"),
            ("def sysCall_init():\n    sim.getObjectPositon(1)\n", "[init]"),
            ("def sysCall_actuation():\n    1 / 0\n", "[actuation]"),
        ):
            with self.subTest(message):
                self.script.write_text(broken)
                errors = len(self.log.messages)
                rospy.ServiceProxy("~start", Trigger)()
                result = self.log.wait_for(lambda m, message=message: message in m.msg, after=errors)
                self.assertIn(str(self.script), result.msg)
                self.log.wait_for(lambda m: m.msg.startswith("stopped"), after=errors)
                self.assertFalse(self.simulation.running)
                self.assertEqual(len([m for m in self.log.messages[errors:] if message in m.msg]), 1)
                self.script.write_text(SCRIPT)
                self.assertEqual(self.call("start"), "started")

    def test_a_script_publishes_and_subscribes(self):
        steps = Listener("/script/steps", Float64)
        steps.wait_for()
        connected(rospy.Publisher("/script/bump", Float64, queue_size=1)).publish(1e6)
        steps.wait_for(lambda m: m.data >= 1e6)

    def test_the_scene_is_saved_and_loaded(self):
        self.scene.write_text(
            "objects: [{name: Box, shape: box, size: [1, 1, 1], position: [3, 0, 4], mass: 1}]\n"
            "drone: {position: [1, 2, 3], yaw: 0.5}\n"
        )
        rospy.set_param("~scene_file", str(self.scene))
        self.assertIn(str(self.scene), self.call("load_scene"))
        self.odometry.wait_for(lambda o: abs(o.pose.pose.position.y - 2) < 0.1 and o.pose.pose.position.z < 2.9)
        self.pause(True)
        self.assertIn(str(self.scene), self.call("save_scene"))
        saved = yaml.safe_load(self.scene.read_text())
        box = saved["objects"][0]
        self.assertEqual((box["name"], box["size"]), ("Box", [1.0, 1.0, 1.0]))
        self.assertLess(box["position"][2], 4.0)  # it was falling
        self.assertAlmostEqual(saved["drone"]["yaw"], 0.5, places=3)
        self.scene.write_text("object: []\n")
        result = self.call("load_scene", expected=False)
        self.assertIn("parameter object: unknown key; near names are objects", result)

    def test_the_scene_is_edited_by_two_clients_at_once(self):
        self.call("stop")
        scene_objects = Listener("~scene_objects", String)

        def names(_):
            rows = {}
            for result in (json.loads(message.data) for message in scene_objects.messages):
                rows = {} if result["since"] is None else rows
                rows.update((row["handle"], row["name"]) for row in result["objects"])
                for handle in result["gone"]:
                    rows.pop(handle)
            return {*rows.values()} >= {"Gate", "Mark", "Goal"}

        one, other = (rospy.ServiceProxy("~edit_scene", AddDiagnostics) for _ in range(2))
        gate = {"do": "add_model", "model": "gate", "position": [3, 0, 0]}
        mark = {"do": "add", "objects": [{"name": "Mark", "kind": "dummy"}]}
        goal = {"do": "add", "objects": [{"name": "Goal", "kind": "dummy"}]}
        edits = [(one, [gate]), (other, [mark]), (other, [goal])]
        threads = [threading.Thread(target=ask, args=(json.dumps({"edit": edit}),)) for ask, edit in edits]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        scene_objects.wait_for(names, after=0)
        refused = one(json.dumps({"edit": [{"do": "remove", "objects": ["Gat"]}]}))
        self.assertFalse(refused.success)
        self.assertIn("near names are Gate", refused.message)
        self.assertIn("not JSON", other("{").message)
        self.assertEqual(json.loads(one(json.dumps({"save": str(self.scene)})).message)["file"], str(self.scene))
        self.assertEqual(rospy.get_param("~scene_file"), str(self.scene))
        scene_objects.close()

    def test_rviz_shows_objects_and_their_motion(self):
        trimesh.creation.box().export(str(self.scene.parent / "one.stl"))
        self.scene.write_text(
            "objects:\n"
            "  - {shape: box, size: [1, 2, 3], position: [30, 0, 400], color: [1, 0, 0, 0.5], mass: 1}\n"
            "  - {shape: sphere, size: [0.5], position: [0, 4, 1], rpy: [0, 0, 1.5707963267948966]}\n"
            "  - {shape: cylinder, size: [0.1, 2], position: [0, 5, 1]}\n"
            "  - {shape: mesh, file: one.stl, size: [1, 1, 2], position: [0, 6, 1]}\n"
        )
        rospy.set_param("~scene_file", str(self.scene))
        self.call("load_scene")
        scene = Listener("/drone/scene", MarkerArray)
        _, box, sphere, cylinder, mesh = scene.wait_for(lambda m: len(m.markers) == 5, after=0).markers
        kinds = [Marker.TRIANGLE_LIST, Marker.SPHERE, Marker.CYLINDER, Marker.MESH_RESOURCE]
        self.assertEqual([marker.type for marker in (box, sphere, cylinder, mesh)], kinds)
        self.assertEqual((box.scale.x, box.scale.y, box.scale.z), (1, 2, 3))
        self.assertEqual((box.color.r, box.color.g, box.color.b, box.color.a), (1, 0, 0, 0.5))
        self.assertEqual((sphere.scale.x, cylinder.scale.y, cylinder.scale.z, mesh.scale.z), (1, 0.2, 2, 2))
        self.assertAlmostEqual(sphere.pose.orientation.z, 0.5**0.5)
        self.assertEqual(mesh.mesh_resource, f"file://{self.scene.parent}/one.stl")
        self.assertEqual({marker.header.frame_id for marker in (box, sphere, cylinder, mesh)}, {"world"})
        scene.wait_for(lambda m: m.markers[1].pose.position.z < box.pose.position.z - 1, after=0)
        self.call("stop")  # nothing moves, so nothing is published, but the topic is latched
        Listener("/drone/scene", MarkerArray).wait_for(lambda m: len(m.markers) == 5, after=0)

    def test_rviz_shows_the_drawing_objects_of_a_script(self):
        self.script.write_text(DRAWING_SCRIPT)
        self.call("start")
        drawing = Listener("/drone/drawing", MarkerArray)
        message = drawing.wait_for(lambda m: len(m.markers) == 4 and len(m.markers[1].points) > 5, after=0)
        _, path, disc, ball = message.markers
        self.assertEqual((path.type, ball.type), (Marker.LINE_STRIP, Marker.SPHERE_LIST))
        self.assertEqual([point.x for point in path.points[:6]], [0, 1, 2, 3, 4, 5])
        self.assertEqual((path.color.r, path.color.g, path.color.b, path.color.a), (1, 0, 0, 1))
        self.assertEqual((ball.scale.x, len(ball.points), ball.header.frame_id), (0.5, 1, "world"))
        self.assertEqual((disc.type, disc.color.a), (Marker.TRIANGLE_LIST, 0.5))
        self.assertEqual({round(math.hypot(p.x - 1, p.y - 2), 6) for p in disc.points}, {0.0, 0.2})
        self.assertEqual({p.z for p in disc.points}, {3.0})
        self.call("stop")
        drawing.wait_for(lambda m: len(m.markers) == 1, after=0)

    def test_a_snapshot_is_restored_and_the_next_steps_are_identical(self):
        self.pause(True)
        self.call("step")
        self.call("snapshot")
        first = [self.call("step") and self.simulation.drone.body.state for _ in range(5)]
        self.assertIn("restored t =", self.call("restore"))
        again = [self.call("step") and self.simulation.drone.body.state for _ in range(5)]
        self.assertEqual(first, again)
        self.call("stop")
        self.assertIn("earlier run", self.call("restore", expected=False))

    def test_the_sphere_and_the_drone_are_dragged(self):
        self.script.write_text(DETACHED_TARGET_SCRIPT)
        self.call("start")
        self.pause(True)
        handles = Listener("/drone/markers/update", InteractiveMarkerUpdate)
        handles.wait_for(lambda m: "DronePosition" in {one.name for one in (*m.markers, *m.poses)}, after=0)
        feedback = connected(rospy.Publisher("/drone/markers/feedback", InteractiveMarkerFeedback, queue_size=10))
        for name, where in (("DronePosition", (1.0, 2.0, 3.0)), ("Drone", (-1.0, 0.5, 2.0))):
            self.assertNotEqual(self.position_of(name), where)
            message = InteractiveMarkerFeedback(client_id="test", marker_name=name, control_name="slide")
            message.event_type = InteractiveMarkerFeedback.POSE_UPDATE
            message.header.frame_id = "world"
            message.pose.position.x, message.pose.position.y, message.pose.position.z = where
            message.pose.orientation.w = 1.0
            # Repeat it, like rviz during a mouse move: the server ignores feedback in a marker's first second.
            self.wait_until(lambda *, sent=message, name=name, where=where: self.drag_to(feedback, sent, name) == where)
        self.assertEqual(self.position_of("DronePosition"), (1.0, 2.0, 3.0), "the drone does not take it along")

    def test_a_drone_stands_still_while_it_is_dragged_and_then_flies_on(self):
        self.call("start")
        handles = Listener("/drone/markers/update", InteractiveMarkerUpdate)
        handles.wait_for(lambda m: "Drone" in {one.name for one in (*m.markers, *m.poses)}, after=0)
        feedback = connected(rospy.Publisher("/drone/markers/feedback", InteractiveMarkerFeedback, queue_size=10))

        def send(*kinds):
            for kind in kinds:
                message = InteractiveMarkerFeedback(client_id="rviz", marker_name="Drone", event_type=kind)
                message.pose.position.x, message.pose.position.y, message.pose.position.z = 1.0, 0.5, 2.0
                message.pose.orientation.w = 1.0
                feedback.publish(message)
            return self.simulation.drone.body.state

        held = InteractiveMarkerFeedback.MOUSE_DOWN, InteractiveMarkerFeedback.POSE_UPDATE
        self.wait_until(lambda: send(*held).position == (1.0, 0.5, 2.0))
        end_step = self.simulation.steps + 20
        self.wait_until(lambda: self.simulation.steps > end_step or send(InteractiveMarkerFeedback.KEEP_ALIVE) is None)
        state = self.simulation.drone.body.state
        self.assertEqual((state.position, state.linear_velocity), ((1.0, 0.5, 2.0), (0.0, 0.0, 0.0)))
        self.wait_until(lambda: send(InteractiveMarkerFeedback.MOUSE_UP).position[2] < 0.9)

    def test_vehicle_state_and_hears_commands_are_published(self):
        state, hears_commands = Listener("/drone/state", String), Listener("/drone/hears_commands", Bool)
        self.script.write_text(SUBSCRIBING_SCRIPT)
        self.call("restart")
        hears_commands.wait_for(lambda m: m.data, after=0)
        self.script.write_text(DETACHED_TARGET_SCRIPT)
        self.call("restart")
        hears_commands.wait_for(lambda m: not m.data, after=0)
        state.wait_for(lambda m: m.data == "flying", after=0)
        pose = PoseStamped()
        pose.pose.position.z, pose.pose.orientation.w = 0.1, 1.0
        connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=10)).publish(pose)
        state.wait_for(lambda m: m.data == "on the ground", after=0)

    def test_an_object_is_dragged_and_falls_when_it_is_released(self):
        ball = "{name: Ball, shape: sphere, size: [0.1], position: [1, 0, 0.1], mass: 1}"
        self.scene.write_text(f"objects: [{ball}, {{shape: box, size: [1, 1, 1], position: [3, 0, 0.5]}}]")
        rospy.set_param("~scene_file", str(self.scene))
        self.call("load_scene")
        handles = Listener("/drone/objects/update", InteractiveMarkerUpdate)
        handles.wait_for(lambda m: {"Ball", "Cuboid"} <= {one.name for one in m.markers}, after=0)
        feedback = connected(rospy.Publisher("/drone/objects/feedback", InteractiveMarkerFeedback, queue_size=10))

        def drag(*where):
            for kind in (InteractiveMarkerFeedback.MOUSE_DOWN, InteractiveMarkerFeedback.POSE_UPDATE):
                message = InteractiveMarkerFeedback(client_id="test", marker_name="Ball", event_type=kind)
                message.pose.position.x, message.pose.position.y, message.pose.position.z = where
                message.pose.orientation.w = 1.0
                feedback.publish(message)
            return self.position_of("Ball")

        self.wait_until(lambda: drag(1.0, 1.0, 2.0) == (1.0, 1.0, 2.0))
        last_held_step = self.simulation.steps + 20
        self.wait_until(lambda: self.simulation.steps > last_held_step or drag(1.0, 1.0, 2.0) is None)
        self.assertEqual(drag(1e9, 1.0, 2.0), (1.0, 1.0, 2.0), "it does not fall while it is held")
        self.log.wait_for(lambda m: "'Ball' cannot be dragged there: position.x = 1000000000.0: must" in m.msg, after=0)
        feedback.publish(InteractiveMarkerFeedback(client_id="test", marker_name="Ball", event_type=5))  # MOUSE_UP
        self.wait_until(lambda: self.position_of("Ball")[2] < 0.2)

    def drag_to(self, feedback, message, name):
        feedback.publish(message)
        return self.position_of(name)

    def position_of(self, name):
        """Return the position (m) of an object, rounded to 1e-9 m."""
        objects = self.simulation.context.objects
        return tuple(round(value, 9) for value in frames.position(objects.matrix(objects.handle(name))))

    def wait_until(self, condition):
        end = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), end, "nothing such in 60 s")
            rospy.rostime.wallsleep(0.01)

    def test_a_flood_of_set_pose_messages_causes_no_flood_of_odometry(self):
        poses = connected(rospy.Publisher("/drone/set_pose", PoseStamped, queue_size=10))
        self.pause(True)
        self.odometry.wait_for()
        before, start_time = len(self.odometry.messages), time.monotonic()
        message = PoseStamped()
        message.pose.orientation.w = 1.0
        for number in range(1, 1001):
            message.pose.position.z = float(number)
            poses.publish(message)
        self.odometry.wait_for(lambda o: o.pose.pose.position.z == 1000.0, after=before)
        self.assertLessEqual(len(self.odometry.messages) - before, 3 + 20 * (time.monotonic() - start_time))

    def test_a_handle_is_released_after_rviz_dies(self):
        handles = Listener("/drone/markers/update", InteractiveMarkerUpdate)
        feedback = connected(rospy.Publisher("/drone/markers/feedback", InteractiveMarkerFeedback, queue_size=10))
        self.pause(True)
        message = InteractiveMarkerFeedback(client_id="rviz", marker_name="Drone")
        message.event_type = InteractiveMarkerFeedback.MOUSE_DOWN
        feedback.publish(message)
        held = self.node._rviz[0]._held
        for expected in ({"Drone"}, set()):
            self.wait_until(lambda expected=expected: held.names() == expected)
        handles.wait_for(lambda m: any(pose.name == "Drone" for pose in m.poses))

    def test_target_pose_and_push(self):
        self.pause(True)
        target = rospy.Publisher("/drone/target_pose", PoseStamped, queue_size=1, latch=True)
        message = PoseStamped()
        message.pose.position.x, message.pose.position.z, message.pose.orientation.w = 1.5, 2.0, 1.0
        target.publish(message)
        push = rospy.Publisher("/drone/push", WrenchStamped, queue_size=1, latch=True)
        wrench = WrenchStamped()
        wrench.wrench.force.x = 1.04
        push.publish(wrench)
        connected(target)
        connected(push)
        self.wait_until(lambda: self.position_of("DronePosition") == (1.5, 0.0, 2.0))
        self.wait_until(lambda: self.simulation.drone.pushes.lasting)
        for _ in range(8):
            self.call("step")
        # 1.04 N on 0.52 kg for the 0.2 s that a push lasts
        self.assertAlmostEqual(self.simulation.drone.body.state.linear_velocity[0], 0.4, places=4)
        wrench.wrench.force.x = float("nan")
        push.publish(wrench)
        self.log.wait_for(lambda m: "push refused: force.x = nan" in m.msg, after=0)


if __name__ == "__main__":
    rospy.init_node("test_toolbar")
    sys.exit(rostest.rosrun("drone_sim", "toolbar", Toolbar))
