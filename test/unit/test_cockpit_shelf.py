"""The cockpit's scripts and texts without a browser: what may be read and written, and where a script flies."""

import json
import os
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from drone_sim.files.resources import package_path
from drone_sim.grading import plan as plans
from drone_sim.grading import tasks
from drone_sim.ros.cockpit import task_scenes
from drone_sim.ros.cockpit.editing import Editing
from drone_sim.ros.cockpit.lessons import Lessons
from drone_sim.ros.cockpit.script_files import LARGEST, ShelfError
from drone_sim.ros.cockpit.shelf import Shelf
from drone_sim.run import parameters
from drone_sim.run.simulation import Simulation

LESSONS = Lessons()
STAGES = [
    f"tutorial/{name}.py" for name in ("1_thrust", "2_elevation", "3_yaw", "4_pitch", "5_roll", "6_ros", "7_camera")
]


@pytest.fixture(name="own")
def _own(tmp_path):
    """The user's folder, which is not there yet."""
    return tmp_path / "mine"


@pytest.fixture(name="shelf")
def _shelf(tmp_path, own):
    pilot = tmp_path / "pilot.py"
    pilot.write_text("shipped", encoding="utf-8")
    return Shelf(own, {"built-in": lambda: {"pilot.py": pilot}})


class Node:
    """A simulator that remembers what it was asked, and fails as it is told."""

    def __init__(self):
        self.parameters, self.asked, self.fails = {"scene_file": "none", "script": "pilot"}, [], {}

    def call(self, service):
        self.asked.append(service)
        return service not in self.fails, self.fails.get(service, service)

    def parameter(self, name, default=None):
        return self.parameters.get(name, default)

    def set_parameter(self, name, value):
        self.parameters[name] = value


class Happenings:
    """Remembers whose timeline was sent."""

    def __init__(self):
        self.prepared = self.begun = None

    def prepare(self, plan):
        self.prepared, self.begun = plan, False

    def begin(self):
        self.begun = True

    def end(self):
        self.prepared = None


class Asked:
    """What a browser asks."""

    def __init__(self, shelf):
        self.node = Node()
        self.happenings = Happenings()
        self.answers = Editing(shelf, LESSONS, self.node, self.happenings).answers

    def __call__(self, ask, **message):
        return self.answers[ask](message)


@pytest.fixture(name="ask")
def _ask(own, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    return Asked(Shelf(own))


# ---- which files


def test_a_script_of_the_package_becomes_a_copy(shelf, own):
    pilot = shelf.find("built-in/pilot.py")
    copy, version = shelf.save(pilot, "changed", "")
    assert copy.name == "mine/pilot.py" and (own / "pilot.py").read_text() == "changed"
    assert shelf.read(pilot)[0] == "shipped"
    again, _ = shelf.save(copy, "changed again", version)
    assert again == copy and shelf.original(copy) == "shipped"
    assert shelf.save(pilot, "other", "")[0].name == "mine/pilot_2.py", "nothing is lost"


def test_what_another_has_changed_is_not_overwritten_and_both_texts_can_be_kept(shelf, own):
    book, version = shelf.save_as("x.py", "first")
    assert shelf.version("mine/x.py") == version
    (own / "x.py").write_text("theirs", encoding="utf-8")
    assert shelf.version("mine/x.py") != version
    assert shelf.save(book, "mine", version) is None and (own / "x.py").read_text() == "theirs"
    _, version, other = shelf.keep_both("mine/x.py", "mine", True)
    assert other == "mine/x_2.py" and (own / "x_2.py").read_text() == "theirs" and (own / "x.py").read_text() == "mine"
    assert shelf.save(book, "mine again", version)
    _, _, other = shelf.keep_both("mine/x.py", "third", False)
    assert (
        (own / "x.py").read_text() == "mine again"
        and (own / "x_3.py").read_text() == "third"
        and other == "mine/x_3.py"
    )


def test_a_file_that_is_gone_is_told_and_written_again(ask, own):
    saved = ask("save_as", name="x.py", text="a")
    digest = ask("look", script="mine/x.py")["shelf"]
    (own / "x.py").unlink()
    assert ask("look", script="mine/x.py")["version"] == "" and ask("look", script="mine/x.py")["shelf"] != digest
    assert ask("save", script="mine/x.py", text="b", version=saved["version"]) == {"changed": True}
    kept = ask("keep", script="mine/x.py", text="b", mine=False)
    assert kept["text"] == "b" and kept["other"] == "" and (own / "x.py").read_text() == "b"


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "mine/../../x.py", "built-in/../x", "tasks/hover/solution.py", "", None, 3, ["a"]]
)
def test_only_what_is_listed_is_read(ask, name):
    with pytest.raises(ShelfError, match="no such script"):
        ask("open", script=name)


@pytest.mark.parametrize(
    "name, words",
    [
        ("../x.py", "letters, digits"),
        ("a/b.py", "letters, digits"),
        (".x.py", "begins with neither"),
        ("a\nb.py", "letters, digits"),
        ("x.txt", "ends in .py or .lua"),
        ("", "1 to 100"),
        ("x" * 200 + ".py", "1 to 100"),
        (None, "1 to 100"),
    ],
)
def test_a_new_name_is_checked(shelf, own, name, words):
    with pytest.raises(ShelfError, match=words) as error:
        shelf.save_as(name, "text")
    assert "\n" not in str(error.value) and not own.exists()


def test_a_name_that_is_taken_stays_as_it_is(shelf, own):
    shelf.save_as("ü b.py", "first")
    with pytest.raises(ShelfError, match="is there already"):
        shelf.save_as("ü b.py", "second")
    assert (own / "ü b.py").read_text() == "first"


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda file: file.write_bytes(b"# fine\n\xff\xfe"), "line 2: is not UTF-8"),
        (lambda file: file.write_bytes(b"#" * (LARGEST + 1)), "larger than 1 MiB"),
        (os.mkfifo, "must be a regular file"),
        (lambda file: file.mkdir(), "must be a regular file"),
        (lambda file: file.symlink_to("/etc/hostname"), "a link that leads out of"),
        (lambda file: file.symlink_to("nowhere.py"), "No such file"),
    ],
)
def test_a_file_that_is_no_script_gets_one_line(ask, own, make, words):
    own.mkdir()
    make(own / "odd.py")
    with pytest.raises(ShelfError, match=words) as error:
        ask("open", script="mine/odd.py")
    assert "mine/odd.py" in str(error.value) and "\n" not in str(error.value)


def test_a_name_that_is_no_utf8_is_opened_but_not_flown(ask, own):
    own.mkdir()
    Path(os.fsdecode(os.fsencode(own) + b"/\xff.py")).write_text("text")
    name = ask("scripts")["groups"][-1]["scripts"][0]
    assert json.loads(json.dumps(ask("open", script=name)))["text"] == "text" and ask("look", script=name)["version"]
    with pytest.raises(ShelfError, match="save it as another one"):
        ask("run", script=name, lesson="")


def test_lines_end_as_they_did(shelf, own):
    own.mkdir()
    (own / "dos.py").write_bytes(b"a\r\nb\r\n")
    book = shelf.find("mine/dos.py")
    text, version = shelf.read(book)
    assert text == "a\nb\n"
    shelf.save(book, "a\nc\nb\n", version)
    assert (own / "dos.py").read_bytes() == b"a\r\nc\r\nb\r\n"


def test_what_cannot_be_written_is_told(shelf, own, monkeypatch):
    book, version = shelf.save_as("x.py", "kept")
    with pytest.raises(ShelfError, match="at most"):
        shelf.save(book, "x" * (LARGEST + 1), version)
    with pytest.raises(ShelfError, match="half of a character"):
        shelf.save(book, "\ud800", version)

    def full(*_):
        raise OSError(28, "No space left on device", str(own / "x.py"))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ShelfError, match=r"mine/x.py: .*No space left on device"):
        shelf.save(book, "lost?", version)
    assert (own / "x.py").read_text() == "kept" and len(list(own.iterdir())) == 1
    with pytest.raises(ShelfError, match=r"File exists|Not a directory"):
        Shelf(own / "x.py", {}).save_as("y.py", "text")


# ---- texts beside them


def test_every_stage_and_every_task_has_a_text_and_a_script(ask):
    lists = ask("scripts")
    groups = {one["name"]: one["scripts"] for one in lists["groups"]}
    assert list(groups) == ["built-in", "tutorial", "tasks", "mine"] and lists["flown"] == "built-in/pilot.py"
    assert groups["tutorial"] == STAGES and groups["tasks"] == [f"tasks/{name}.py" for name in tasks.names()]
    for script in (*STAGES, *groups["tasks"]):
        opened = ask("open", script=script)
        lesson = ask("lesson", lesson=opened["lesson"])
        assert lesson["script"] == script and lesson["text"].startswith("#") and len(lesson["text"]) > 500
        assert "solution" not in opened["file"] and "solution" not in opened["text"].lower()
    assert ask("open", script="built-in/pilot.py")["lesson"] == ""


def test_ones_own_script_belongs_to_a_text_by_its_name(ask):
    ask("save_as", name="2_elevation_of_mine.py", text="")
    ask("save_as", name="hoverfly.py", text="")
    assert ask("open", script="mine/2_elevation_of_mine.py")["lesson"] == "stage-2-elevation"
    assert ask("lesson", lesson="stage-2-elevation")["script"] == "mine/2_elevation_of_mine.py"
    assert ask("open", script="mine/hoverfly.py")["lesson"] == ""


def test_a_section_ends_where_the_next_begins_and_code_is_no_heading(tmp_path):
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "tutorial.md").write_text("# T\n## One\na\n```\n## no\n```\n## Two: b\n", encoding="utf-8")
    found = [one for one in Lessons(tmp_path).all() if not one.task]
    assert [(one.name, one.text) for one in found] == [("one", "## One\na\n```\n## no\n```"), ("two-b", "## Two: b")]


def test_only_the_pictures_of_the_texts_are_served():
    kind, content = LESSONS.picture("/docs/pictures/tutorial_loops.png")
    assert kind == "image/png" and content.startswith(b"\x89PNG") and LESSONS.picture("/tasks/hover/picture.png")
    for path in (
        "/docs/pictures/../../setup.py",
        "/tasks/hover/plan.yaml",
        "/tasks/../../x/a.png",
        "/docs/pictures/tutorial_no.png",
    ):
        assert LESSONS.picture(path) is None


# ---- where they fly


@pytest.mark.parametrize("name", tasks.names())
def test_a_tasks_scene_is_what_its_plan_says(name, tmp_path):
    plan = plans.read(tasks.find(name))
    wanted, file = plan.parameters(), task_scenes.scene_of(plan, tmp_path)
    found = parameters.load({"scene_file": file})
    assert found.model_dump(exclude={"vehicles", "scene_file"} | _carried(found)) == wanted.model_dump(
        exclude={"vehicles", "scene_file"} | _carried(found)
    )
    assert [one.model_dump() for one in found.fleet] == [one.model_dump() for one in wanted.fleet]
    assert plan.name in task_scenes.told(plan)


def _carried(found):
    """What the vehicles carry themselves; the keys at the top are of none then."""
    return set(type(found.fleet[0]).model_fields) & set(type(found).model_fields) if found.vehicles else set()


@pytest.mark.parametrize("name", tasks.names())
def test_what_a_task_begins_with_flies(name, tmp_path):
    plan = plans.read(tasks.find(name))
    start = Shelf(tmp_path).find(f"tasks/{name}.py")
    simulation = Simulation(plan.parameters(script=str(start.path)))
    for _ in range(3):
        simulation.step()
    simulation.close()


def test_a_task_brings_its_scene_and_leaving_it_brings_back_the_users(ask, tmp_path):
    node = ask.node
    node.parameters["scene_file"] = "mine.yaml"
    said = ask("run", script="tasks/hover.py", lesson="tasks/hover")
    assert said["done"] and said["said"] == "started in the scene of the task hover"
    assert "weather/wind = [2.5, 1, 0]" in ask("lesson", lesson="tasks/hover")["flies"]
    assert node.parameters == {
        "scene_file": str(tmp_path / ".ros/drone_sim/tasks/hover.yaml"),
        "script": _start("hover"),
    }
    ask("run", script="tutorial/4_pitch.py", lesson="stage-4-pitch")
    assert node.parameters["scene_file"] == str(package_path() / "config/scenes/empty.yaml")
    assert ask("lesson", lesson="stage-1-constant-thrust")["flies"] == "back in mine.yaml"
    said = ask("run", script="tutorial/1_thrust.py", lesson="stage-1-constant-thrust")["said"]
    assert said == "started back in mine.yaml"
    assert node.parameters["scene_file"] == "mine.yaml"
    node.asked.clear()
    assert ask("run", script="tutorial/2_elevation.py", lesson="")["said"] == "restart"
    assert node.asked == ["restart"] and ask.happenings.prepared is None


def test_a_scene_that_the_user_has_chosen_meanwhile_stays(ask):
    ask("run", script="tasks/gates.py", lesson="tasks/gates")
    ask.node.parameters["scene_file"] = "other.yaml"
    assert ask("run", script="tutorial/2_elevation.py", lesson="")["said"] == "restart"
    assert ask.node.parameters["scene_file"] == "other.yaml"


def test_a_script_that_fails_in_a_tasks_scene_is_shown_at_its_line_and_one_that_has_no_scene_leaves_all_as_it_was(ask):
    ask.node.fails = {"load_scene": f"[init] {_start('gates')}:7: NameError: x"}
    failed = ask("run", script="tasks/gates.py", lesson="tasks/gates")
    assert not failed["done"] and failed["line"] == 7 and "gates.yaml" in ask.node.parameters["scene_file"]
    ask.node.parameters["scene_file"] = "mine.yaml"
    ask.node.fails = {"load_scene": "gates.yaml: no such file"}
    assert ask("run", script="tasks/gates.py", lesson="tasks/gates")["said"] == "gates.yaml: no such file"
    assert ask.node.parameters["scene_file"] == "mine.yaml"


def test_a_master_that_has_gone_is_one_line(ask, monkeypatch):
    def gone(*_):
        raise rospy.ROSException("no master")

    monkeypatch.setattr(ask.node, "parameter", gone)
    with pytest.raises(ValueError, match="no master"):
        ask("scripts")


def _start(name):
    return str(Path(tasks.folder()) / name / "start.py")
