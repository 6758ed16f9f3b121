"""Interventions from outside beyond flying are reported once per flight, with sender and call."""

from contextlib import closing, suppress
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from diagnostic_msgs.msg import KeyValue
from dynamic_reconfigure.msg import Config, DoubleParameter
from geometry_msgs.msg import WrenchStamped
from legacy_client import BLOCKING, command, floats, ints
from legacy_client import Client as LegacyClient
from nav_msgs.msg import Odometry
from remote_client import Client, Refusal
from std_msgs.msg import String

from drone_sim.grading import plan as plans
from drone_sim.remote.legacy.server import LegacyServer
from drone_sim.remote.server import RemoteApiServer
from drone_sim.ros.core.inbox import Inbox
from drone_sim.ros.grading.flight_listener import FlightListener, LiveRules
from drone_sim.ros.grading.grade_live import missed_steps
from drone_sim.ros.node import interventions, services
from drone_sim.ros.vehicle import inputs, tuning_server
from drone_sim.run import parameters
from drone_sim.run.pacing import Pace, Pacer
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation
from drone_sim.scripting.api.constants import CONSTANTS

CRATE = {"shape": "box", "name": "Crate", "size": [0.2] * 3, "position": [3, 0, 0.1], "mass": 1.0}
SET_POSITION, CUBOID = 0x101B, CONSTANTS["primitiveshape_cuboid"]
OUTSIDE = "by a client of the remote API"


class NodeStub:
    def __init__(self, monkeypatch):
        self.said, self.callbacks = [], {}
        topic = mock.MagicMock()
        topic.publish = self.said.append
        monkeypatch.setattr(rospy, "Publisher", lambda *_, **_named: topic)
        for kind in ("Subscriber", "Service"):
            monkeypatch.setattr(rospy, kind, self.listen)
        for name in ("get_param", "set_param", "delete_param"):
            monkeypatch.setattr(rospy, name, lambda *_: None)
        overrides = {"vehicles": {"drone": {}, "other": {"position": [1, 1, 0.8]}}, "scene": {"objects": [CRATE]}}
        self.simulation = Simulation(parameters.load(overrides))
        self.player = Player(self.simulation, lambda _: None, simulated_time=False)
        self.interventions = interventions.Interventions(self.simulation)
        self.inbox = Inbox(on_intervention=self.interventions.publish)
        self.simulation.step()

    def listen(self, name, _kind, callback, **_):
        self.callbacks[name] = callback
        return mock.MagicMock()

    def deliver(self, name, message, sender="/flyer"):
        """Deliver a message or request from the node `sender`."""
        message._connection_header = {"callerid": sender}
        with mock.patch.object(self.inbox, "ask", self.inbox.put):
            self.callbacks[name](message)
        self.inbox.run_jobs()

    def lines(self):
        found = self.said[:]
        self.said.clear()
        return found


@pytest.fixture(name="stage")
def _stage(monkeypatch):
    stage = NodeStub(monkeypatch)
    yield stage
    stage.simulation.close()


@pytest.fixture(name="client")
def _client(stage):
    with closing(RemoteApiServer(stage.player, "127.0.0.1", 0, watched=stage.interventions.watched)) as server:
        client = Client(server)
        yield client
        client.vanish()


def test_normal_flying_by_a_client_is_no_intervention(stage, client):
    drone, wheel = (client.sim("getObject", f"/{name}") for name in ("Drone", "Quadricopter_propeller_respondable1"))
    script = client.sim("getScriptAssociatedWithObject", wheel)
    client.sim("setScriptSimulationParameter", script, "particleVelocity", 5.0)
    client.sim("setObjectPosition", client.sim("createDummy", 0.1), -1, [1, 1, 1])
    client.sim("setObjectPosition", client.sim("getObject", "/target"), -1, [1, 1, 1])
    client.sim("setFloatSignal", "x", 1.0)
    client.sim("getObjectPosition", drone, -1)
    for name in ("startSimulation", "getSimulationState", "getSystemTime", "acquireLock", "releaseLock"):
        client.sim(name)
    client.sim("setStepping", True)
    client.sim("addDrawingObject", 0, 5, 0, -1, 1, [1, 0, 0])
    assert stage.lines() == []


@pytest.mark.parametrize(
    ("function", "of", "arguments", "said"),
    [
        ("addForce", "Drone", ([0, 0, 0], [0, 0, 0.1]), "push Drone"),
        ("addForceAndTorque", "Drone#0", ([0, 0, 0.1], [0, 0, 0]), "push Drone#0"),
        ("setObjectPosition", "Drone", (-1, [1, 0, 1]), "move Drone"),
        ("setObjectPosition", "Crate", (-1, [1, 0, 1]), "move Crate"),
        ("setObjectParent", "Crate", (-1, True), "move Crate"),
        ("setShapeMass", "Drone", (0.1,), "change Drone"),
        ("removeObject", "Crate", (), "change Crate"),
        ("createPrimitiveShape", "", (0, [1, 1, 1]), "change the scene"),
        ("setSimulationTimeStep", "", (0.1,), "change the scene"),
        ("pauseSimulation", "", (), "change the scene"),
        ("loadScene", "", ("",), "change the scene"),
        ("saveModel", "Crate", ("mine.ttm",), "write Crate"),
        ("loadModel", "", ("mine.yaml",), "load a model"),
        ("callScriptFunction", "", ("on_twist@Drone", 1), "call on_twist of the script of Drone"),
        ("executeScriptString", "", ("1@Drone", 1), "run a text in a script"),
        (
            "setScriptSimulationParameter",
            "",
            (-4, "Kzref", 1.0),
            "change the scene",
        ),  # a parameter of the drone's script, not of the client
    ],
)
def test_other_calls_of_a_client_are_reported_once(stage, client, function, of, arguments, said):
    handle = [client.sim("getObject", f"/{of}")] if of else []
    for _ in range(3):
        with suppress(Refusal):  # a refused call counts too
            client.sim(function, *handle, *arguments)
    assert stage.lines()[0] == f"{said} at 0.05 s (sim.{function}, {OUTSIDE})"
    assert not [one for one in stage.said if one.startswith(said)]


def test_the_number_of_lines_is_limited_per_kind_of_intervention(stage, client):
    for _ in range(50):
        client.sim("setObjectPosition", client.sim("createPrimitiveShape", CUBOID, [0.1] * 3), -1, [5, 5, 5])
    lines = stage.lines()
    assert len(lines) == 21 and len(set(lines)) == 21  # one line for all shapes, and one for each moved shape
    client.sim("addForce", client.sim("getObject", "/Drone"), [0, 0, 0], [0, 0, 0.1])
    assert [one.split(" at ")[0] for one in stage.lines()] == ["push Drone"]
    stage.simulation.start()
    client.sim("addForce", client.sim("getObject", "/Drone"), [0, 0, 0], [0, 0, 0.1])
    assert stage.lines() == [f"push Drone at 0.00 s (sim.addForce, {OUTSIDE})"]


def test_calls_of_a_legacy_api_client_are_reported(stage):
    objects = stage.simulation.context.objects
    with closing(LegacyServer(stage.player, "127.0.0.1", 0, watched=stage.interventions.watched)) as server:
        client = LegacyClient(server.port, server.wait)
        for name in ("DronePosition", "Crate"):
            where = ints(-1) + floats(1, 1, 1)
            client.ask(command(SET_POSITION | BLOCKING, ints(objects.handle(name)), where))
        client.peer.close()
    assert stage.lines() == [f"move Crate at 0.05 s (sim.setObjectPosition, {OUTSIDE})"]


def test_intervening_messages_are_reported_with_their_sender(stage):
    own = stage.simulation.vehicles["other"].parameters
    inputs.VehicleInputs(stage.simulation, own, stage.inbox)
    for sender in ("/flyer", "/flyer", "/other\n"):
        stage.deliver("other/push", WrenchStamped(), sender)
    stage.deliver("other/weather", KeyValue("wind", "[1, 0, 0]"))
    stage.deliver("other/weather", KeyValue("winds", "[1, 0, 0]"))  # refused
    assert stage.lines() == [
        "push other at 0.05 s (/other/push, by /flyer)",
        "push other at 0.05 s (/other/push, by /other?)",
        "change other at 0.05 s (/other/weather, by /flyer)",
    ]


def test_tuning_is_reported_and_again_at_every_start(stage):
    tuning = stage.simulation.child_scripts["drone"].tuning
    tuning_server.TuningServer("/drone", tuning, stage.inbox)
    pacer = Pacer(0.05)
    tuning_server.TuningServer("/drone_sim", Pace(stage.simulation, pacer), stage.inbox)

    def config_request(name, value):
        return SimpleNamespace(config=Config(doubles=[DoubleParameter(name, value)]))

    stage.deliver("/drone_sim/set_parameters", config_request("real_time_factor", 2.0))
    stage.deliver("/drone/set_parameters", SimpleNamespace(config=Config()))
    stage.lines()  # discards the lines of the first values
    stage.deliver("/drone/set_parameters", config_request("Kzref", 4.0))
    assert "change drone at 0.05 s (/drone/set_parameters, by /flyer)" in stage.lines()
    stage.player.restart()
    stage.interventions.update()
    assert stage.lines() == ["change drone at 0.00 s (Kzref, tuned before)"]
    stage.interventions.update()
    assert stage.lines() == []


def test_service_calls_except_snapshot_are_reported(stage):
    services.Services(stage.player, SimpleNamespace(summary=""), stage.inbox, lambda: None)
    for name in ("snapshot", "restore", "pause"):
        stage.deliver(f"~{name}", SimpleNamespace(data=True))
    said = [(one.split(" (")[0], one.rpartition("/")[0].rpartition("/")[2]) for one in stage.lines()]
    assert said == [("change the scene at 0.05 s", "restore, by "), ("change the scene at 0.05 s", "pause, by ")]


def test_a_plan_lists_the_functions_that_a_client_may_call(stage):
    rules = LiveRules(SimpleNamespace(allowed=["change"], calls=["shine"]), "/drone_sim")
    deliver = stage.callbacks["/drone_sim/interventions"]
    for line in ("call shine of the script of Lamp at 1 s (x)", "change Lamp at 1 s (x)", "run a text in a script"):
        deliver(String(line))
    deliver(String("call sysCall_init of the script of Lamp at 1 s (x)"))
    assert [one.split()[2:4] for one in rules.tried] == [["run", "a"], ["call", "sysCall_init"]]


@pytest.mark.parametrize("lost, missed", [([], 0), ([3], 1), ([0, 1, 5, 6], 2)])
def test_missed_steps_are_counted(lost, missed):
    times = np.delete(np.arange(2, 12) * 0.05, lost)
    assert missed_steps(times, 0.05) == missed


def test_odometry_from_another_node_is_ignored_and_reported_as_forged(stage, tmp_path):
    (tmp_path / "plan.yaml").write_text("duration: 1\ncriteria: [{kind: stays, of: z, at_least: 1}]")
    plan = plans.read(tmp_path / "plan.yaml")
    listener = FlightListener(plan, plan.parameters(), "/drone_sim", lambda _: None)
    for sender, height in (("/drone_sim", 0.5), ("/flyer", 3.0), ("/flyer", 3.1)):
        message = Odometry()
        message.header.stamp = rospy.Time(0.05)
        message.pose.pose.position.z, message.pose.pose.orientation.w = height, 1.0
        message._connection_header = {"callerid": sender}
        stage.callbacks["/drone/odom"](message)
    assert listener.record(1.0).rows[:, 3].tolist() == [0.5]
    assert [one.split(" at ")[0] for one in listener.forged] == ["tried to forge /drone/odom"]
