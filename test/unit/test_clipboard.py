"""Objects are copied as YAML and pasted from YAML, also into another scene and from text written by hand."""

import re

import pytest
import yaml
from living import edit, editor_of, place

from drone_sim.files.resources import package_path

CRATE = {"name": "Crate", "shape": "box", "size": [0.2, 0.3, 0.4], "position": [1, 2, 0.2], "mass": 1.5}
LAMP = {"name": "Lamp", "kind": "dummy", "parent": "Crate", "position": [0, 0, 0.3]}


def editor_in(folder):
    editor_in_folder = editor_of()
    folder.mkdir()
    editor_in_folder.answer({"save": str(folder / "scene.yaml")})
    return editor_in_folder


@pytest.fixture(name="editor")
def _editor(tmp_path):
    editor_in_folder = editor_in(tmp_path / "one")
    yield editor_in_folder
    editor_in_folder.simulation.close()


@pytest.fixture(name="other")
def _other(tmp_path):
    editor_in_folder = editor_in(tmp_path / "other")
    yield editor_in_folder
    editor_in_folder.simulation.close()


def copy_text(editor, *objects):
    return editor.answer({"text_of": [*objects]})["text"]


def paste(editor, text):
    handles = edit(editor, {"do": "paste", "text": text})["handles"]
    return [editor.simulation.context.objects[pasted_handle].name for pasted_handle in handles]


def test_copied_objects_are_written_as_in_a_scene_file(editor):
    edit(editor, {"do": "add", "objects": [CRATE, LAMP]})
    assert copy_text(editor, "Crate") == (
        "objects:\n"
        "  - {name: Crate, shape: box, size: [0.2, 0.3, 0.4], position: [1, 2, 0.2], mass: 1.5}\n"
        "  - {name: Lamp, kind: dummy, parent: Crate, position: [0, 0, 0.3]}\n"
    )
    above = yaml.safe_load(copy_text(editor, "Lamp"))["objects"]
    assert above == [{"name": "Lamp", "kind": "dummy", "position": [1, 2, 0.5]}], "its parent is not copied"


def test_objects_are_pasted_into_another_scene_with_their_scripts_and_files(editor, other):
    (editor.simulation.document.folder / "lamp.lua").write_text(
        "function sysCall_init() end\nfunction sysCall_actuation() end\n"
    )
    (editor.simulation.document.folder / "tile.png").write_bytes((package_path() / "urdf/floor.png").read_bytes())
    script = {"object": "Lamp", "script": "lamp.lua", "parameters": {"power": 3}}
    edit(editor, {"do": "add", "objects": [{**CRATE, "texture": "tile.png"}, LAMP], "scripts": [script]})
    text = copy_text(editor, "Crate")
    assert paste(other, text) == ["Crate", "Lamp"]
    assert place(other, "Crate") == [1, 2, 0.2]
    assert other.simulation.context.objects[other.simulation.context.objects.handle("Lamp")].parent.name == "Crate"
    lamp_script = other.simulation.scene.scripts["Lamp"]
    assert lamp_script.script == str(editor.simulation.document.folder / "lamp.lua")
    assert lamp_script.parameters == {"power": 3}
    assert str(editor.simulation.document.folder / "tile.png") in other.answer({"text": True})["text"]
    assert paste(editor, text) == ["Crate0", "Lamp0"]
    assert place(editor, "Crate0") == [1.5, 2.5, 0.2], "moved next to the original"
    assert "tile.png" in editor.answer({"text": True})["text"]
    assert str(editor.simulation.document.folder) not in editor.answer({"text": True})["text"], (
        "the path is relative to the scene file"
    )
    other.answer({"undo": True})
    assert "Crate" not in other.simulation.context.objects


def test_each_pasted_object_is_moved_to_a_free_place(editor):
    text = yaml.safe_dump([CRATE])
    for expected in ([1, 2, 0.2], [1.5, 2.5, 0.2], [2, 3, 0.2]):
        (name,) = paste(editor, text)
        assert place(editor, name) == expected


def test_a_vehicle_is_pasted_with_its_changed_parameters(editor, other):
    edit(editor, {"do": "set", "object": "FrontVision", "values": {"width": 320}})
    edit(editor, {"do": "set", "object": "Drone", "values": {"script": "target", "position": [3, 0, 1]}})
    assert paste(other, copy_text(editor, "Drone")) == ["Drone#0"]
    vehicle = other.simulation.vehicles["drone2"].parameters
    assert (vehicle.script, vehicle.cameras["front"].width, vehicle.position) == ("target", 320, (3, 0, 1))
    paste(other, copy_text(other, "Drone#0"))
    assert yaml.safe_load(other.answer({"text": True})["text"])["vehicles"]["drone3"]["position"] == [3.5, 0.5, 1]


@pytest.mark.parametrize(
    "text",
    [
        "{name: Ball, shape: sphere, size: [0.1], position: [4, 0, 1]}",
        "name: Ball  # a ball\nshape: sphere\nsize: [0.1]\nposition: [4, 0, 1]",
        "- {name: Ball, shape: sphere, size: [0.1], position: [4, 0, 1]}",
        "  - {name: Ball, shape: sphere, size: [0.1], position: [4, 0, 1]}\n",
        "- {name: Ball, shape: sphere, size: [0.1], position: [4, 0, 1]}\n  # and no other\n",
        "- name: Ball\n    shape: sphere\n    size: [0.1]\n    position: [4, 0, 1]\n",
        "objects:\n  - {name: Ball, shape: sphere, size: [0.1], position: [4, 0, 1]}",
    ],
)
def test_yaml_of_any_layout_can_be_pasted(editor, text):
    assert paste(editor, text) == ["Ball"]
    assert place(editor, "Ball") == [4, 0, 1]
    editor.answer({"undo": True})
    assert "Ball" not in editor.simulation.context.objects


def test_a_pasted_object_keeps_a_parent_that_exists_in_the_scene(editor):
    paste(editor, "{name: Lamp, kind: dummy, parent: Quadricopter_base, position: [0, 0, 0.1]}")
    tree = editor.simulation.context.objects
    assert tree[tree.handle("Lamp")].parent.name == "Quadricopter_base"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "must be objects"),
        ("Dear John,\nhow are you?", "must be objects"),
        ("3.14", "must be objects"),
        ("TODO: buy milk", "unknown key 'TODO'; known are objects, scripts, vehicles"),
        ("objects: 3", "objects = 3: must be objects"),
        ("objects: [3]", "must be objects"),
        ("def f(x):\n    return {x: [1", "not YAML"),
        ("- {shape: bax}", "'bax': must be one of 'box'"),
        ("- {name: A, shape: box, size: [1, 1, 0], position: [0, 0, 0]}", "size"),
        ("- {name: A, kind: dummy, parent: Nobody, position: [0, 0, 0]}", "Nobody"),
        ("vehicles: {drone: {position: up}}", "position"),
        ("vehicles: {drone: {position: [0, 0, 1], wings: 2}}", "wings"),
        ("scripts: [{object: Nobody, script: none.lua}]", "must be objects"),
    ],
)
def test_an_invalid_text_gets_one_line_and_changes_nothing(editor, text, told):
    before = editor.answer({"text": True})
    with pytest.raises(ValueError, match=re.escape(told)) as refused:
        paste(editor, text)
    assert "\n" not in str(refused.value)
    assert editor.answer({"text": True}) == before


def test_a_part_of_a_vehicle_and_the_floor_cannot_be_copied(editor):
    for name, told in (("FrontVision", "is a part of a vehicle"), ("Floor", "is the floor")):
        with pytest.raises(ValueError, match=told):
            copy_text(editor, name)
