"""The timeline of a node's runs: when its file is read, and what a mistake in it does."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.offline.timeline import TimelineError
from drone_sim.ros.node.run_timeline import RunTimeline
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

FLIES = "- {at: 0, twist: {linear: [1, 0, 0]}}\n"
SCRIPT = """
def sysCall_init():
    print("init")
"""


class Stage:
    """A player with a timeline, as the node has them."""

    def __init__(self, monkeypatch, folder, **given):
        self.given = {}  # private parameters
        monkeypatch.setattr(rospy, "has_param", self.given.__contains__)
        monkeypatch.setattr(rospy, "get_param", lambda name, default=None: self.given.get(name, default))
        script = folder / "script.py"
        script.write_text(SCRIPT)
        values = parameters.load(given)
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

    def stage(**given):
        stages.append(Stage(monkeypatch, tmp_path, **given))
        return stages[-1]

    yield stage
    for each in stages:
        each.simulation.close()


def test_the_file_of_a_config_is_read_relative_to_it_unless_the_parameter_is_set(stage, tmp_path):
    (tmp_path / "config.yaml").write_text("timeline_file: plan.yaml\nstep_count: 5\n")
    (tmp_path / "plan.yaml").write_text(FLIES)
    (tmp_path / "other.yaml").write_text(FLIES.replace("1, 0", "2, 0"))
    one = stage(config=str(tmp_path / "config.yaml"))
    assert one.simulation.parameters.step_count == 5
    summaries = []
    for file in (None, str(tmp_path / "other.yaml"), "", None):
        one.given.clear()
        one.given.update({} if file is None else {"~timeline_file": file})
        one.player.restart()
        summaries.append(one.timeline.summary)
    assert summaries[0] == summaries[3] and summaries[2] == "" and len(set(summaries)) == 3
    assert one.step() and one.simulation.drone.commands.now.linear.x == 1


def test_every_start_reads_the_file(stage, tmp_path):
    """Also one that a client of the remote API asks for."""
    file = tmp_path / "plan.yaml"
    one = stage()
    one.given["~timeline_file"] = str(file)
    file.write_text(FLIES)
    one.player.start()
    before = one.timeline.summary
    file.write_text(FLIES * 2)
    one.player.start()
    assert before.startswith("; timeline ") and one.timeline.summary != before


def test_without_a_master_a_start_reads_the_same_file_again(stage, tmp_path, monkeypatch):
    file = tmp_path / "plan.yaml"
    file.write_text(FLIES)
    one = stage()
    one.given["~timeline_file"] = str(file)
    one.player.start()
    before = one.timeline.summary

    def fail(*_):
        raise ConnectionRefusedError("nobody is there")

    monkeypatch.setattr(rospy, "get_param", fail)
    one.player.start()
    assert one.timeline.summary == before != ""


def test_a_wrong_file_is_told_before_scripts_run(stage, tmp_path, caplog):
    file = tmp_path / "plan.yaml"
    file.write_text("- {at: 1, lnd: {}}\n")
    one = stage()
    one.given["~timeline_file"] = str(file)
    with pytest.raises(TimelineError, match="line 1: entry 1: lnd: unknown key"):
        one.player.start()
    assert one.player.state == "stopped"
    assert "init" not in caplog.messages


def test_an_entry_that_cannot_be_executed_stops_the_run_with_one_line(stage, tmp_path, caplog):
    file = tmp_path / "plan.yaml"
    file.write_text("- {at: 0.05, object: {name: Nothing, position: [1, 2, 3]}}\n")
    one = stage()
    one.given["~timeline_file"] = str(file)
    one.player.start()
    assert one.step()
    assert not one.step()
    assert one.player.state == "stopped"
    line = f"script error: [timeline] {file}: entry at 0.05 s: no object named 'Nothing'"
    assert one.player.why_stopped.startswith(line)
    assert sum(message.startswith(line) for message in caplog.messages) == 1
    one.given["~timeline_file"] = ""
    one.player.start()
    assert one.step()
