"""The scene in which the cockpit runs a script, the timeline of a task, and grading, without a browser."""

import shutil
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from cockpit_asked import LESSONS, Asked
from nav_msgs.msg import Odometry
from std_msgs.msg import Header, String

from drone_sim.files.resources import package_path
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.ros.cockpit.editor import lesson_scenes, task_flights
from drone_sim.ros.cockpit.editor.script_store import ScriptStore, ScriptStoreError
from drone_sim.ros.cockpit.editor.task_flights import TimelinePlayer
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation


@pytest.fixture(name="ask")
def _ask(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    return Asked(ScriptStore(tmp_path / "mine"))


# ---- the scene of a run


@pytest.mark.parametrize("name", tasks.names())
def test_the_scene_of_a_task_has_the_parameters_of_its_plan(name, tmp_path):
    plan = plans.read(tasks.find(name))
    expected, file = plan.parameters(), lesson_scenes.scene_of(plan, tmp_path)
    settings = parameters.load({"scene_file": file})
    assert settings.model_dump(exclude={"vehicles", "scene_file"} | keys_of_vehicles(settings)) == expected.model_dump(
        exclude={"vehicles", "scene_file"} | keys_of_vehicles(settings)
    )
    assert [one.model_dump() for one in settings.fleet] == [one.model_dump() for one in expected.fleet]
    reply = lesson_scenes.describe_scene_of(plan)
    assert "/" not in reply.replace("m/s", "") and ("The wind blows" in reply) == any(expected.weather.wind)
    assert plan.name in reply and not any(one.startswith("=") for one in reply.split(", "))


def keys_of_vehicles(settings):
    """Return the keys that each vehicle has itself; the same keys at the top level then apply to no vehicle."""
    return set(type(settings.fleet[0]).model_fields) & set(type(settings).model_fields) if settings.vehicles else set()


@pytest.mark.parametrize("name", tasks.names())
def test_the_start_script_of_every_task_flies(name, tmp_path):
    plan = plans.read(tasks.find(name))
    start = ScriptStore(tmp_path).find(f"tasks/{name}.py")
    simulation = Simulation(plan.parameters(changes={"script": str(start.path)}))
    for _ in range(3):
        simulation.step()
    simulation.close()


def test_run_stops_and_sets_the_script_of_a_scene_that_has_a_script(ask):
    assert ask("scripts")["flown"] == "built-in/pilot.py"
    ask.scene.own_script = "target"
    assert ask("scripts")["flown"] == "built-in/target.py"
    assert ask("run", script="tutorial/2_elevation.py")["done"]
    assert ask.node.asked == ["stop", "restart"]
    assert ask("scripts")["flown"] == "tutorial/2_elevation.py"
    ask.scene.own_script, ask.scene.has_no_vehicle = "", True
    assert ask("scripts")["flown"] == "", "the scene has no vehicle"


def test_a_task_loads_its_scene_and_leaving_the_task_restores_the_users(ask, tmp_path):
    node = ask.node
    node.parameters["scene_file"] = "mine.yaml"
    reply = ask("run", script="tasks/hover.py", lesson="tasks/hover")
    assert reply["done"] and reply["said"] == "started in the scene of the task hover"
    assert "The wind blows with 2.7 m/s" in ask("lesson", lesson="tasks/hover")["flies"]
    assert node.parameters == {
        "scene_file": str(tmp_path / ".ros/drone_sim/tasks/hover.yaml"),
        "script": _start("hover"),
    }
    ask("run", script="tutorial/4_pitch.py", lesson="stage-4-pitch")
    assert node.parameters["scene_file"] == str(package_path() / "config/scenes/empty.yaml")
    assert ask("lesson", lesson="stage-1-constant-thrust")["flies"] == "again in mine.yaml"
    reply = ask("run", script="tutorial/1_thrust.py", lesson="stage-1-constant-thrust")["said"]
    assert reply == "started again in mine.yaml"
    assert node.parameters["scene_file"] == "mine.yaml"
    node.asked.clear()
    assert ask("run", script="tutorial/2_elevation.py", lesson="")["said"] == "restart"
    assert node.asked == ["restart"] and ask.player.prepared is None


@pytest.mark.parametrize(("file", "is_modified"), [("", True), ("mine.yaml", True), ("mine.yaml", False)])
def test_run_restores_the_users_scene_with_unsaved_changes_and_its_script(ask, file, is_modified):
    node, scene = ask.node, ask.scene
    node.parameters["scene_file"] = file
    scene.own_script, scene.is_modified = "pilot", is_modified
    ask("run", script="tasks/hover.py", lesson="tasks/hover")
    scene.own_script, scene.is_modified = "", False  # those of the task's scene
    flies = ask("lesson", lesson="stage-1-constant-thrust")["flies"]
    assert ("changes that are not saved" in flies) == is_modified and (file or "your new scene") in flies
    ask("run", script="tasks/gates.py", lesson="tasks/gates")
    node.asked.clear()
    scene.on_reopened = lambda: node.set_parameter("scene_file", file)
    assert ask("run", script="tutorial/1_thrust.py", lesson="")["done"]
    assert scene.opened == (file or "none", is_modified)
    assert scene.own_script.endswith("1_thrust.py") and node.parameters["script"] == scene.own_script
    assert node.asked == ["stop", "stop", "restart"]


def test_run_asks_for_confirmation_before_it_leaves_the_users_scene(ask):
    assert ask("run", script="tutorial/4_pitch.py", lesson="stage-4-pitch", may_ask=True)["done"]
    ask.node.parameters["scene_file"], ask.scene.is_own = "mine.yaml", True
    assert ask("run", script="tutorial/1_thrust.py", lesson="stage-1-constant-thrust", may_ask=True)["done"]
    ask.node.asked.clear()
    asked = ask("run", script="tutorial/4_pitch.py", lesson="stage-4-pitch", may_ask=True)
    assert asked == {"leaves": "empty.yaml"} and ask.node.asked == []
    assert ask("run", script="tasks/hover.py", lesson="tasks/hover", may_ask=True) == {
        "leaves": "the scene of the task hover"
    }
    assert ask("run", script="tasks/hover.py", lesson="tasks/hover", may_ask=False)["done"]
    assert ask("run", script="tasks/hover.py", lesson="tasks/hover", may_ask=True)["done"], "this scene is loaded"


def test_a_scene_chosen_by_the_user_during_a_task_stays(ask):
    ask("run", script="tasks/gates.py", lesson="tasks/gates")
    ask.node.parameters["scene_file"] = "other.yaml"
    assert ask("run", script="tutorial/2_elevation.py", lesson="")["said"] == "restart"
    assert ask.node.parameters["scene_file"] == "other.yaml"


def test_run_shows_a_script_error_and_keeps_the_scene_if_loading_fails(ask):
    ask.node.fails = {"load_scene": f"[init] {_start('gates')}:7: NameError: x"}
    failed = ask("run", script="tasks/gates.py", lesson="tasks/gates")
    assert not failed["done"] and failed["failure"]["line"] == 7 and "gates.yaml" in ask.node.parameters["scene_file"]
    ask.node.parameters["scene_file"] = "mine.yaml"
    ask.node.fails = {"load_scene": "gates.yaml: no such file"}
    assert ask("run", script="tasks/gates.py", lesson="tasks/gates")["said"] == "gates.yaml: no such file"
    assert ask.node.parameters["scene_file"] == "mine.yaml"


def test_the_easiest_task_is_first_and_every_task_has_a_difficulty(ask):
    lessons = [lesson for lesson in ask("scripts")["lessons"] if lesson["task"]]
    assert {lesson["task"] for lesson in lessons} == set(tasks.names()) and lessons[0]["task"] == "hover"
    hardness = [("easy", "medium", "hard").index(lesson["difficulty"]) for lesson in lessons]
    assert hardness[0] == 0 and all(lesson["summary"] and lesson["time"].endswith(("min", "h")) for lesson in lessons)


def test_a_task_of_the_course_is_listed_with_its_text_script_and_picture(ask, tmp_path, monkeypatch):
    monkeypatch.setenv("DRONE_SIM_TASKS", str(tmp_path))
    shutil.copytree(tasks.folder() / "hover", tmp_path / "waltz")
    (tmp_path / "waltz" / "README.md").write_text("# Waltz\n\n![a picture](picture.png)\n")
    lessons = {lesson["task"]: lesson["title"] for lesson in ask("scripts")["lessons"]}
    assert lessons["waltz"] == "Waltz"
    lesson = ask("lesson", lesson="tasks/waltz")
    assert lesson["script"] == "tasks/waltz.py" and lesson["flies"]
    assert ask("open", script="tasks/waltz.py")["text"] == Path(_start("hover")).read_text()
    assert LESSONS.picture("/tasks/waltz/picture.png")[1] == (tmp_path / "waltz" / "picture.png").read_bytes()


def test_a_task_is_handed_in_if_the_course_has_a_folder_for_it(ask, tmp_path, monkeypatch):
    monkeypatch.setenv("DRONE_SIM_HAND_IN", str(tmp_path))
    (tmp_path / "hover").mkdir()
    assert [lesson["task"] for lesson in ask("scripts")["lessons"] if lesson["hands_in"]] == ["hover"]
    reply = ask("hand in", script="tasks/hover.py", lesson="tasks/hover")
    (copy,) = (tmp_path / "hover").iterdir()
    assert copy.read_text() == Path(_start("hover")).read_text() and reply["digest"] in copy.name
    for lesson, words in (("tasks/gates", "cannot be handed in now"), ("stage-2-elevation", "needs a task")):
        with pytest.raises(ValueError, match=words):
            ask("hand in", script="tasks/hover.py", lesson=lesson)


def test_a_script_is_graded_while_the_page_polls_for_the_result(ask):
    started = ask("grade", script="tasks/hover.py", lesson="tasks/hover")
    with pytest.raises(ScriptStoreError, match="another script is being graded"):
        ask("grade", script="tasks/hover.py", lesson="tasks/hover")
    while "problem" not in (result := ask("graded", number=started["number"])):
        assert result["seeds"] == 3 and 0 <= result["flights"] <= 3
        time.sleep(0.02)
    assert (result["problem"], result["points"], result["of"]) == ("", 3.0, 6.0)
    assert [(one["seed"], one["passed"]) for one in result["flights"]] == [(0, False), (1, False), (2, False)]
    assert all("Not passed" in card and "at most 0.6 m" in card and "<circle" in card for card in result["cards"])
    kind, page = ask.grader.report_file(f"/{result['page']}")
    assert kind.startswith("text/html") and b"replay.js" in page
    assert ask.grader.report_file("/graded/../result.json") is None and ask.grader.report_file("/elsewhere") is None
    for message, words in (({"lesson": "stage-3-yaw"}, "needs a task"), ({"lesson": None}, "needs a task")):
        with pytest.raises(ScriptStoreError, match=words):
            ask("grade", script="tasks/hover.py", **message)
    with pytest.raises(ScriptStoreError, match="graded in the meantime"):
        ask("graded", number=-1)


def test_a_grading_that_exceeds_the_timeout_is_ended(monkeypatch, tmp_path):
    monkeypatch.setattr(task_flights, "_TIMEOUT", 0.0)
    one = task_flights.Grader()
    number = one.start("hover", tmp_path / "x.py")
    while "problem" not in (result := one.result(number)):
        time.sleep(0.01)
    assert result == {"problem": "it took more than 0 s"}


def test_a_master_that_is_down_is_reported_as_an_error(ask, monkeypatch):
    def refuse(*_):
        raise rospy.ROSException("no master")

    monkeypatch.setattr(ask.node, "parameter", refuse)
    with pytest.raises(ValueError, match="no master"):
        ask("scripts")


def _start(name):
    return str(Path(tasks.folder()) / name / "start.py")


# ---- the timeline of a task


class Topics:
    """The subscribers and publishers that were created, and the published messages."""

    def __init__(self):
        self.hears, self.sent = {}, []
        self.latched = {}

    def subscriber(self, name, _kind, callback, **_):
        self.hears[name] = callback
        if name in self.latched:
            callback(self.latched[name])  # as rospy does, before its constructor returns
        return Topic(lambda: self.hears.pop(name, None))

    def publisher(self, name, *_, **__):
        return Topic(lambda: None, lambda message: self.sent.append((name, message.linear.x)))


class Topic:
    def __init__(self, unregister, publish=None):
        self.unregister, self.publish = unregister, publish


@pytest.fixture(name="topics")
def _topics(monkeypatch):
    topics = Topics()
    monkeypatch.setattr(rospy, "Subscriber", topics.subscriber)
    monkeypatch.setattr(rospy, "Publisher", topics.publisher)
    return topics


def test_the_timeline_of_a_task_is_sent_at_its_steps(topics):
    player = TimelinePlayer("/drone_sim")
    player.prepare(plans.read(tasks.find("steps")))
    assert not topics.hears, "no topic is subscribed before the flight"
    player.begin()
    stamps = [100 + 0.06 * step for step in range(25) for _ in range(2)]  # each stamp comes twice, as after a pause
    for stamp in stamps:
        topics.hears["/drone/odom"](Odometry(header=Header(stamp=rospy.Time.from_sec(stamp))))
        if len(topics.sent) == 1:
            break
    assert topics.sent == [("/drone/cmd_vel", 1.0)] and stamp == 100 + 0.06 * 19, "after 20 steps of 0.05 s"
    topics.hears["/drone_sim/state"](String("stopped"))
    assert not topics.hears
    starter = Path(tasks.folder() / "hover/start.py").read_text()
    for script, hears in ((starter, False), ("from pilot import *", True), ("sim.subscribe('home')", True)):
        player.prepare(plans.read(tasks.find("hover")), script)
        player.begin()
        assert bool(topics.hears) == hears, "a request that the script cannot hear would log a warning"
        player.end()
    player.prepare(plans.read(tasks.find("gates")))
    player.begin()
    assert not topics.hears, "this task has no timeline"


def test_a_latched_state_from_before_the_flight_does_not_end_the_timeline(topics):
    topics.latched["/drone_sim/state"] = String("stopped")
    player = TimelinePlayer("/drone_sim")
    player.prepare(plans.read(tasks.find("steps")))
    beginning = threading.Thread(target=player.begin, daemon=True)  # `begin` could deadlock
    beginning.start()
    beginning.join(10)
    assert not beginning.is_alive() and set(topics.hears) == {"/drone/odom", "/drone_sim/state"}
