"""The timeline of a node's runs: when its file is read, and how errors in it are reported."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.offline.timeline import TimelineError
from drone_sim.ros.node.run_timeline import RunTimeline
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

TIMELINE = "- {at: 0, twist: {linear: [1, 0, 0]}}\n"
SCRIPT = """
def sysCall_init():
    print("init")
"""


class Stage:
    """A player with a timeline, as the node has them."""

    def __init__(self, monkeypatch, folder, **settings):
        self.settings = {}  # private parameters
        monkeypatch.setattr(rospy, "has_param", self.settings.__contains__)
        monkeypatch.setattr(rospy, "get_param", lambda name, default=None: self.settings.get(name, default))
        script = folder / "script.py"
        script.write_text(SCRIPT)
        values = parameters.load(settings)
        self.simulation = Simulation(values, script=str(script), started=False)
        self.timeline = RunTimeline(values)
        self.player = Player(self.simulation, lambda _: None, True, self.timeline.read)

    def step(self):
        with self.player.stepping():
            self.timeline.apply(self.simulation)
            self.simulation.step()
        return self.player.end_step()


@pytest.fixture(name="stage")
def _stage(monkeypatch, tmp_path):
    stages = []

    def stage(**settings):
        stages.append(Stage(monkeypatch, tmp_path, **settings))
        return stages[-1]

    yield stage
    for each in stages:
        each.simulation.close()


def test_a_configs_timeline_file_is_relative_unless_the_parameter_is_set(stage, tmp_path):
    (tmp_path / "config.yaml").write_text("timeline_file: plan.yaml\nstep_count: 5\n")
    (tmp_path / "plan.yaml").write_text(TIMELINE)
    (tmp_path / "other.yaml").write_text(TIMELINE.replace("1, 0", "2, 0"))
    setup = stage(config=str(tmp_path / "config.yaml"))
    assert setup.simulation.parameters.step_count == 5
    summaries = []
    for file in (None, str(tmp_path / "other.yaml"), "", None):
        setup.settings.clear()
        setup.settings.update({} if file is None else {"~timeline_file": file})
        setup.player.restart()
        summaries.append(setup.timeline.summary)
    assert summaries[0] == summaries[3] and summaries[2] == "" and len(set(summaries)) == 3
    assert setup.step() and setup.simulation.drone.commands.now.linear.x == 1


def test_every_start_reads_the_timeline_file(stage, tmp_path):
    """This includes starts by a client of the remote API."""
    file = tmp_path / "plan.yaml"
    setup = stage()
    setup.settings["~timeline_file"] = str(file)
    file.write_text(TIMELINE)
    setup.player.start()
    before = setup.timeline.summary
    file.write_text(TIMELINE * 2)
    setup.player.start()
    assert before.startswith("; timeline ") and setup.timeline.summary != before


def test_without_a_master_a_start_rereads_the_same_file(stage, tmp_path, monkeypatch):
    file = tmp_path / "plan.yaml"
    file.write_text(TIMELINE)
    setup = stage()
    setup.settings["~timeline_file"] = str(file)
    setup.player.start()
    before = setup.timeline.summary

    def fail(*_):
        raise ConnectionRefusedError("nobody is there")

    monkeypatch.setattr(rospy, "get_param", fail)
    setup.player.start()
    assert setup.timeline.summary == before != ""


def test_an_invalid_timeline_is_refused_before_scripts_run(stage, tmp_path, caplog):
    file = tmp_path / "plan.yaml"
    file.write_text("- {at: 1, lnd: {}}\n")
    setup = stage()
    setup.settings["~timeline_file"] = str(file)
    with pytest.raises(TimelineError, match="line 1: entry 1: lnd: unknown key"):
        setup.player.start()
    assert setup.player.state == "stopped"
    assert "init" not in caplog.messages


def test_an_entry_that_cannot_be_executed_stops_the_run_with_one_line(stage, tmp_path, caplog):
    file = tmp_path / "plan.yaml"
    file.write_text("- {at: 0.05, object: {name: Nothing, position: [1, 2, 3]}}\n")
    setup = stage()
    setup.settings["~timeline_file"] = str(file)
    setup.player.start()
    assert setup.step()
    assert not setup.step()
    assert setup.player.state == "stopped"
    line = f"script error: [timeline] {file}: entry at 0.05 s: no object named 'Nothing'"
    assert setup.player.why_stopped.startswith(line)
    assert sum(message.startswith(line) for message in caplog.messages) == 1
    setup.settings["~timeline_file"] = ""
    setup.player.start()
    assert setup.step()
