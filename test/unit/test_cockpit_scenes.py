"""The names under which the cockpit offers scenes."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from drone_sim.files.resources import package_path
from drone_sim.ros.cockpit.editor.lists import NEW_SCENE, SceneList

GATES = "package://drone_sim/config/scenes/gates.yaml"


@pytest.mark.parametrize("flown", [GATES, str(package_path() / "config/scenes/gates.yaml")])
def test_a_shipped_scene_has_its_short_name_however_it_was_named(tmp_path, flown):
    scenes = SceneList(tmp_path)
    names, name = scenes.names(flown)
    assert name == "gates" and {"none", "empty", "gates", "room"} <= set(names)
    assert scenes.file("gates") == GATES


@pytest.mark.parametrize("flown", ["", "none"])
def test_no_scene_is_offered_first(tmp_path, flown):
    names, name = SceneList(tmp_path).names(flown)
    assert names[0] == name == SceneList(tmp_path).file(name) == "none"


def test_a_scene_without_a_file_has_a_name_of_its_own(tmp_path):
    names, name = SceneList(tmp_path).names(NEW_SCENE)
    assert names[-1] == name == NEW_SCENE and names[0] == "none"


def test_scenes_of_the_folder_are_offered_as_ones_own_and_nothing_else_of_it(tmp_path):
    for file in ("yard.yaml", "Old.TTT", "pilot.py"):
        (tmp_path / file).touch()
    (tmp_path / "folder.yaml").mkdir()
    scenes = SceneList(tmp_path)
    names, name = scenes.names(str(tmp_path / "yard.yaml"))
    assert name == "mine/yard.yaml" and [one for one in names if "/" in one] == ["mine/Old.TTT", "mine/yard.yaml"]
    assert scenes.file("mine/Old.TTT") == str(tmp_path / "Old.TTT")


@pytest.mark.parametrize("flown", ["/elsewhere/hall.yaml", "\0", "package://nobody/x.yaml"])
def test_a_scene_from_elsewhere_is_called_as_it_is(tmp_path, flown):
    scenes = SceneList(tmp_path / "not there")
    names, name = scenes.names(flown)
    assert names[-1] == name == flown == scenes.file(name)
