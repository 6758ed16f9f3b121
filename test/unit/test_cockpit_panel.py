"""The contents of the page's panels and the requests of their buttons, without a browser."""

import re

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from dynamic_reconfigure.encoding import decode_config, encode_config, encode_description
from rosgraph_msgs.msg import Log

from drone_sim.hosting.tunable import tunables
from drone_sim.ros.cockpit.editor.lists import SceneList
from drone_sim.ros.cockpit.panel import tuning as tuning_module
from drone_sim.ros.cockpit.panel.board import Board
from drone_sim.ros.cockpit.panel.panel import Panel
from drone_sim.ros.cockpit.panel.tuning import SpeedControl, VehicleTuning
from drone_sim.ros.cockpit.topics import FoundTopics
from drone_sim.ros.vehicle.tuning_server import described
from drone_sim.run import parameters

HOSTILE = "<script>alert(1)</script>"


def test_a_board_sends_each_change_once_and_its_whole_content_on_request():
    told = []
    board = Board(told.append)
    for status in ("flying", "flying", "paused"):
        board.show("status", status)
    board.log("x" * 10_000)
    assert [one["panel"] for one in told[:2]] == [{"status": "flying"}, {"status": "paused"}]
    assert [one["version"] for one in told[:2]] == [1, 2]
    assert board.whole({}) == {"panel": {"status": "paused"}, "version": 2, "lines": ["x" * 600]}


# ---- parameters


@pytest.fixture(name="board")
def _board():
    return Board(lambda _: None)


@pytest.fixture(name="server")
def _server(monkeypatch):
    """A dynamic_reconfigure server of a vehicle that accepts all changes except of the weather."""
    descriptions = tunables(parameters.load().fleet[0], {"speed": 1.0})
    values = {name: one.kind(one.choices[0] if one.choices else one.low or 0) for name, one in descriptions.items()}
    values = {name: 0.0 if value == float("-inf") else value for name, value in values.items()}

    def reconfigure(_server, name, value):
        if not name.startswith("weather"):
            values[name] = value
        return encode_config(values)

    monkeypatch.setattr(tuning_module, "reconfigure", reconfigure)
    return encode_description(described(descriptions, values, "limits")), values


@pytest.fixture(name="tuning")
def _tuning(board, server):
    tuning = VehicleTuning(board)
    tuning._on_description(server[0])
    tuning._on_values(encode_config(server[1]))
    return tuning


def test_parameters_are_offered_in_groups_with_unit_and_limits(tuning, board):
    groups = {one["group"]: one["fields"] for one in board.get("tuning")}
    field = next(one for one in groups["Gains"] if one["name"] == "Kzref")
    assert field["unit"] == "(m/s) per m" and (field["low"], field["high"]) == (0, 10000)
    (own,) = groups["Script parameters"]
    assert own["name"] == "script_parameters/speed" and own["low"] is None and len(groups["Weather"]) > 5


@pytest.mark.parametrize(
    "name, value, said",
    [
        ("Kzref", 10001, "Kzref = 10001: must be a number from 0 to 10000"),
        ("Kzref", "2", "Kzref = '2': must be a number from 0 to 10000"),
        ("Kzref", True, "Kzref = True: must be a number"),
        ("Kzref", None, "Kzref = None: must be a number"),
        ("cameras/front/every", 1.5, "cameras/front/every = 1.5: must be a whole number"),
        ("faults/sensors/front", "lame", "faults/sensors/front = 'lame': does not exist; "),
        ("Kzreff", 2, "name = 'Kzreff': does not exist; near names are Kzref"),
        ("weather/wind/x", 1, "weather/wind/x = 1.0: refused (the log says why); "),
    ],
)
def test_a_wrong_value_gets_one_line(tuning, name, value, said):
    with pytest.raises(ValueError, match=f"^{re.escape(said)}[^\\n]*$"):
        tuning.set({"name": name, "value": value})


def test_numbers_are_set_without_rounding(tuning, board):
    for value in (2.5, 3, 0.123456789):
        assert tuning.set({"name": "Kzref", "value": value})["value"] == value
        assert board.get("values")["Kzref"] == value
    assert tuning.set({"name": "cameras/front/every", "value": 2.0}) == {"said": "cameras/front/every = 2", "value": 2}


def test_the_speed_follows_changes_by_other_clients(board, monkeypatch):
    speed = SpeedControl(board, "/drone_sim")
    speed.on_set(encode_config({"real_time_factor": 3.7}))
    assert board.get("speed") == 3.7
    speed.on_set(encode_config({"Kzref": 3.0}))
    assert board.get("speed") == 3.7
    monkeypatch.setattr(tuning_module, "reconfigure", lambda _server, name, value: encode_config({name: value}))
    assert speed.set({"factor": 0}) == {"said": "speed: as fast as it can"} and board.get("speed") == 0.0
    for wrong in (-1, 1001, "2", None):
        with pytest.raises(ValueError, match=r"^speed = .*: must be a number from 0 to 1000$"):
            speed.set({"factor": wrong})
    assert decode_config(encode_config({"real_time_factor": 2.0}))["real_time_factor"] == 2.0


# ---- buttons, logs and diagnostics


class Simulator:
    node = "/drone_sim"

    def __init__(self):
        self.asked, self.parameters = [], {}

    def call(self, *service):
        self.asked.append(service)
        return service[0] != "step", f"{service[0]} said"

    def set_parameter(self, name, value):
        self.parameters[name] = value


class Commands:
    vehicle = ""

    def choose(self, vehicle):
        self.vehicle = vehicle

    def request(self, topic):
        return f"{topic} sent"


@pytest.fixture(name="told")
def _told():
    return []


@pytest.fixture(name="panel")
def _panel(tmp_path, told):
    panel = Panel(Simulator(), Commands(), SceneList(tmp_path), told.append)
    panel.offer(FoundTopics("", ("drone", "wing")), "")
    return panel


def test_buttons_call_services_and_return_their_messages(panel):
    ask = panel.answers
    assert ask["call"]({"call": "pause"}) == {"done": True, "said": "pause said"}
    assert ask["call"]({"call": "resume"})["done"] and ask["call"]({"call": "step"})["done"] is False
    assert panel._simulator.asked == [("pause", True), ("pause", False), ("step",)]
    assert ask["request"]({"request": "land"}) == {"said": "land sent"}
    assert ask["vehicle"]({"vehicle": "wing"}) == {"said": "the keys fly wing"}
    assert panel.board.get("vehicles") == {"all": ["drone", "wing"], "now": "wing"}
    assert ask["scene"]({"scene": "gates"})["done"]
    assert panel._simulator.parameters == {"scene_file": "package://drone_sim/config/scenes/gates.yaml"}
    assert panel.board.get("scenes")["now"] == "gates"


@pytest.mark.parametrize(
    "ask, message",
    [
        ("call", {"call": "shutdown"}),
        ("call", {}),
        ("request", {"request": ["land"]}),
        ("vehicle", {"vehicle": "/etc"}),
        ("scene", {"scene": "/etc/passwd"}),
        ("scene", {"scene": {}}),
    ],
)
def test_a_request_for_an_unknown_name_gets_one_line(panel, ask, message):
    with pytest.raises(ValueError, match=rf"^{ask} = [^\n]*: does not exist; "):
        panel.answers[ask](message)
    assert not panel._simulator.asked


def test_logs_and_diagnostics_of_the_simulation_are_shown_as_text(panel, told, monkeypatch):
    monkeypatch.setattr("rospy.Subscriber", lambda *_, **__: None)
    pulses = []
    monkeypatch.setattr(panel.pulse, "hear", lambda: pulses.append(True))
    panel.listen(True)
    panel._on_log(Log(name="/other", msg="not ours"))
    panel._on_log(Log(name="/drone_sim", msg=HOSTILE, level=Log.WARN))
    assert panel.board.whole({})["lines"] == [f"warning: {HOSTILE}"]
    panel._on_log(Log(name="/drone_sim", msg="[actuation] /a.py:3: ZeroDivisionError", level=Log.ERROR))
    assert told[-1]["failure"]["line"] == 3
    statuses = [
        DiagnosticStatus(0, "drone_sim: simulation", "flying", "", [KeyValue("real-time factor", "0.98")]),
        DiagnosticStatus(1, "drone_sim: vehicle drone", "upside down", "", []),
        DiagnosticStatus(2, "another: node", "broken", "", []),
    ]
    panel._on_diagnostics(DiagnosticArray(status=statuses))
    assert panel.board.get("pace") == "0.98"
    assert len(pulses) == 3, "messages of other nodes are no sign of life"
    assert panel.board.get("diagnosis") == [
        {"of": "vehicle drone", "said": "upside down", "wrong": True},
        {"of": "simulation", "said": "flying", "wrong": False},
    ]
