"""SceneBackend, which passes the scene editor's messages between node and browsers, without either of them."""

import base64
import json

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from std_msgs.msg import String
from test_cockpit_inspection import Topic

from drone_sim.files.resources import package_path
from drone_sim.ros.cockpit.editor import scene_backend
from drone_sim.ros.cockpit.editor.lists import NEW_SCENE, SceneList
from drone_sim.ros.cockpit.editor.scene_backend import SceneBackend
from drone_sim.scripting.python.helpers import BUILT_IN

ROW = {"handle": 3, "name": "Gate"}


class Answer:
    def __init__(self, success, message):
        self.success, self.message = success, message


@pytest.fixture(name="asked")
def _asked(monkeypatch):
    """The requests that the node receives; it accepts all of them except the text 'wrong'."""
    asked = []

    def ask(text):
        asked.append(json.loads(text))
        if asked[-1].get("write") == "wrong":
            return Answer(False, "line 3: objects/0/shape = 'bax': must be one of 'box'")
        return Answer(True, json.dumps({"revision": len(asked), "file": asked[-1].get("save", "")}))

    monkeypatch.setattr(Topic, "there", {})
    monkeypatch.setattr(scene_backend.rospy, "Subscriber", Topic)
    monkeypatch.setattr(scene_backend.rospy, "ServiceProxy", lambda name, kind: ask)
    return asked


@pytest.fixture(name="told")
def _told():
    return []


@pytest.fixture(name="editing")
def _editing(asked, told, tmp_path):
    backend = SceneBackend("/sim", tmp_path, told.append)
    backend.subscribe(True)
    return backend


def publish_objects(version, since, objects=(), gone=(), **more):
    payload = {"version": version, "since": since, "revision": version, "objects": [*objects], "gone": [*gone], **more}
    Topic.there["/sim/scene_objects"].callback(String(json.dumps(payload)))


def tree(editing):
    return editing.answers["tree"]({})["tree"]


def test_a_new_browser_gets_the_whole_tree(editing, told):
    publish_objects(1, None, [ROW, {"handle": 4, "name": "Post"}])
    publish_objects(2, 1, [{**ROW, "name": "Door"}], gone=[4])
    assert tree(editing)["objects"] == [{**ROW, "name": "Door"}]
    assert tree(editing)["version"] == 2
    assert [one["tree"]["version"] for one in told] == [1, 2]


def test_browsers_get_only_the_changed_keys_of_a_row(editing, told):
    publish_objects(1, None, [{**ROW, "pose": [0], "root": True, "vehicle": "drone"}])
    assert editing.scene[-1] == {"drone"}
    publish_objects(2, 1, [{**ROW, "pose": [1], "root": True, "vehicle": "drone"}])
    publish_objects(3, 2, [{**ROW, "pose": [1], "vehicle": ""}, {"handle": 4, "name": "Post"}])
    assert [one["tree"]["objects"] for one in told[1:]] == [
        [{"handle": 3, "pose": [1]}],
        [{"handle": 3, "root": None, "vehicle": ""}, {"handle": 4, "name": "Post"}],
    ]
    assert tree(editing)["objects"][0] == {**ROW, "pose": [1], "vehicle": ""} and editing.scene[-1] == set()


def test_after_a_lost_message_the_whole_tree_is_requested_again(editing, told):
    publish_objects(1, None, [ROW])
    before = Topic.there["/sim/scene_objects"]
    publish_objects(3, 2, [], gone=[3])
    editing.subscribe(True)
    assert Topic.there["/sim/scene_objects"] is not before
    publish_objects(4, None, [ROW])
    assert tree(editing)["version"] == 4
    assert [one["tree"]["version"] for one in told] == [1, 4]


def test_edits_are_sent_to_the_node_and_errors_are_returned_with_their_line(editing, asked):
    operation = {"do": "remove", "objects": [3]}
    assert editing.answers["edit"]({"edit": [operation], "name": "Remove", "id": 5})["revision"] == 1
    assert asked == [{"edit": [operation], "name": "Remove"}]
    editing.answers["objects_text"]({"objects": [3]})
    assert asked[-1] == {"text_of": [3]}
    answer = editing.answers["write_scene_text"]({"text": "wrong", "revision": 1})
    assert answer["line"] == 3
    with pytest.raises(ValueError, match="file: must be the name"):
        editing.answers["open_scene"]({"file": 3})


def test_a_scene_overwrites_a_file_only_on_request(editing, asked, tmp_path):
    (tmp_path / "mine.yaml").write_text("objects: []\n")
    with pytest.raises(ValueError, match=r"mine is there already"):
        editing.answers["save_scene"]({"file": "mine"})
    editing.answers["save_scene"]({"file": "mine", "over": True})
    assert asked == [{"save": str(tmp_path / "mine.yaml")}]
    assert editing.answers["scene_files"]({})["recent"] == [str(tmp_path / "mine.yaml")]


DRONE = {"handle": 5, "name": "Drone", "root": True, "vehicle": "drone", "own_script": ""}


def test_run_sets_the_script_of_a_scene_that_has_a_script(editing, asked):
    assert not editing.has_no_vehicle and editing.own_script == ""
    publish_objects(1, None, [ROW])
    assert editing.has_no_vehicle
    publish_objects(2, 1, [{**DRONE, "own_script": "pilot"}])
    assert not editing.has_no_vehicle and editing.own_script == "pilot"
    editing.set_script(str(BUILT_IN / "pilot.py"))
    assert asked == [], "the scene has this script already"
    editing.set_script(str(package_path() / "docs/tutorial/2_elevation.py"))
    values = {"script": "package://drone_sim/docs/tutorial/2_elevation.py"}
    assert asked == [{"edit": [{"do": "set", "object": 5, "values": values}], "name": "Fly 2_elevation.py"}]


def test_saving_a_stopped_scene_stores_the_script_that_was_run(editing, asked, monkeypatch, tmp_path):
    monkeypatch.setattr(scene_backend.rospy, "get_param", lambda name, default: str(tmp_path / "mine.py"))
    publish_objects(1, None, [DRONE], state="stopped")
    editing.answers["save_scene"]({"file": "scene"})
    assert [next(iter(one)) for one in asked] == ["edit", "save"]
    assert asked[0]["edit"][0]["values"] == {"script": str(tmp_path / "mine.py")}
    publish_objects(2, 1, [], state="flying")
    editing.answers["save_scene"]({"file": "scene", "over": True})
    assert [next(iter(one)) for one in asked] == ["edit", "save", "save"], "stop would undo the edit"


def test_models_have_pictures_and_a_model_can_be_uploaded(editing, tmp_path):
    groups = {one["name"]: one["models"] for one in editing.answers["models"]({})["groups"]}
    for one in [model for name in ("Shapes", "Arena", "Vehicles", "Sensors") for model in groups[name]]:
        kind, content = editing.models.picture(f"/{one['picture']}")
        assert (kind, content[:4]) == ("image/png", b"\x89PNG"), one
        assert len(content) < 8000
    content = base64.b64encode(b"solid").decode()
    payload = editing.answers["upload_model"]({"name": "chair.stl", "content": content})["model"]
    assert payload == {"do": "add_model", "model": str(tmp_path / "models/chair.stl")}
    assert [one["op"] for one in editing.answers["models"]({})["groups"][-1]["models"]] == [payload]
    for name in ("../chair.stl", "chair.exe", "chair.stl"):
        with pytest.raises(ValueError, match=r"name: must|already"):
            editing.answers["upload_model"]({"name": name, "content": content})
    assert editing.models.picture("/models/../gate.yaml") is None


# ---- names of scenes


GATES = "package://drone_sim/config/scenes/gates.yaml"


@pytest.mark.parametrize("flown", [GATES, str(package_path() / "config/scenes/gates.yaml")])
def test_a_shipped_scene_is_listed_under_its_short_name(tmp_path, flown):
    scenes = SceneList(tmp_path)
    names, name = scenes.names(flown)
    assert name == "gates" and {"none", "empty", "gates", "room"} <= set(names)
    assert scenes.file("gates") == GATES


@pytest.mark.parametrize("flown", ["", "none"])
def test_the_first_entry_of_the_scene_list_is_none(tmp_path, flown):
    names, name = SceneList(tmp_path).names(flown)
    assert names[0] == name == SceneList(tmp_path).file(name) == "none"


def test_a_new_scene_without_a_file_is_the_last_entry(tmp_path):
    names, name = SceneList(tmp_path).names(NEW_SCENE)
    assert names[-1] == name == NEW_SCENE and names[0] == "none"


def test_only_scene_files_of_the_users_folder_are_listed(tmp_path):
    for file in ("yard.yaml", "Old.TTT", "pilot.py"):
        (tmp_path / file).touch()
    (tmp_path / "folder.yaml").mkdir()
    scenes = SceneList(tmp_path)
    names, name = scenes.names(str(tmp_path / "yard.yaml"))
    assert name == "mine/yard.yaml" and [one for one in names if "/" in one] == ["mine/Old.TTT", "mine/yard.yaml"]
    assert scenes.file("mine/Old.TTT") == str(tmp_path / "Old.TTT")


@pytest.mark.parametrize("flown", ["/elsewhere/hall.yaml", "\0", "package://nobody/x.yaml"])
def test_a_scene_outside_the_known_folders_is_listed_under_its_path(tmp_path, flown):
    scenes = SceneList(tmp_path / "not there")
    names, name = scenes.names(flown)
    assert names[-1] == name == flown == scenes.file(name)
