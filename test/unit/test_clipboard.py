"""Objects are copied as YAML, and pasted from it: in another scene, and from what somebody has written."""

import re

import pytest
import yaml
from living import edit, editor_of, place

from drone_sim.files.resources import package_path

CRATE = {"name": "Crate", "shape": "box", "size": [0.2, 0.3, 0.4], "position": [1, 2, 0.2], "mass": 1.5}
LAMP = {"name": "Lamp", "kind": "dummy", "parent": "Crate", "position": [0, 0, 0.3]}


def editor_in(folder):
    made = editor_of()
    folder.mkdir()
    made.answer({"save": str(folder / "scene.yaml")})
    return made


@pytest.fixture(name="editor")
def _editor(tmp_path):
    made = editor_in(tmp_path / "one")
    yield made
    made.simulation.close()


@pytest.fixture(name="other")
def _other(tmp_path):
    made = editor_in(tmp_path / "other")
    yield made
    made.simulation.close()


def copied(editor, *objects):
    return editor.answer({"text_of": [*objects]})["text"]


def paste(editor, text):
    handles = edit(editor, {"do": "paste", "text": text})["handles"]
    return [editor.simulation.context.objects[one].name for one in handles]


def test_what_is_copied_is_written_as_in_a_scene_file(editor):
    edit(editor, {"do": "add", "objects": [CRATE, LAMP]})
    assert copied(editor, "Crate") == (
        "objects:\n"
        "  - {name: Crate, shape: box, size: [0.2, 0.3, 0.4], position: [1, 2, 0.2], mass: 1.5}\n"
        "  - {name: Lamp, kind: dummy, parent: Crate, position: [0, 0, 0.3]}\n"
    )
    above = yaml.safe_load(copied(editor, "Lamp"))["objects"]
    assert above == [{"name": "Lamp", "kind": "dummy", "position": [1, 2, 0.5]}], "without what it hangs on"


def test_it_is_pasted_in_another_scene_as_it_was(editor, other):
    (editor.simulation.document.folder / "lamp.lua").write_text(
        "function sysCall_init() end\nfunction sysCall_actuation() end\n"
    )
    (editor.simulation.document.folder / "tile.png").write_bytes((package_path() / "urdf/floor.png").read_bytes())
    script = {"object": "Lamp", "script": "lamp.lua", "parameters": {"power": 3}}
    edit(editor, {"do": "add", "objects": [{**CRATE, "texture": "tile.png"}, LAMP], "scripts": [script]})
    text = copied(editor, "Crate")
    assert paste(other, text) == ["Crate", "Lamp"]
    assert place(other, "Crate") == [1, 2, 0.2]
    assert other.simulation.context.objects[other.simulation.context.objects.handle("Lamp")].parent.name == "Crate"
    now = other.simulation.scene.scripts["Lamp"]
    assert now.script == str(editor.simulation.document.folder / "lamp.lua")
    assert now.parameters == {"power": 3}
    assert str(editor.simulation.document.folder / "tile.png") in other.answer({"text": True})["text"]
    assert paste(editor, text) == ["Crate0", "Lamp0"]
    assert place(editor, "Crate0") == [1.5, 2.5, 0.2], "beside what stands there"
    assert "tile.png" in editor.answer({"text": True})["text"]
    assert str(editor.simulation.document.folder) not in editor.answer({"text": True})["text"], (
        "it lies beside the file"
    )
    other.answer({"undo": True})
    assert "Crate" not in other.simulation.context.objects


def test_it_is_put_where_nothing_stands_yet(editor):
    text = yaml.safe_dump([CRATE])
    for expected in ([1, 2, 0.2], [1.5, 2.5, 0.2], [2, 3, 0.2]):
        (name,) = paste(editor, text)
        assert place(editor, name) == expected


def test_a_vehicle_is_pasted_with_what_it_says(editor, other):
    edit(editor, {"do": "set", "object": "FrontVision", "values": {"width": 320}})
    edit(editor, {"do": "set", "object": "Drone", "values": {"script": "target", "position": [3, 0, 1]}})
    assert paste(other, copied(editor, "Drone")) == ["Drone#0"]
    vehicle = other.simulation.vehicles["drone2"].parameters
    assert (vehicle.script, vehicle.cameras["front"].width, vehicle.position) == ("target", 320, (3, 0, 1))
    paste(other, copied(other, "Drone#0"))
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
def test_a_text_of_any_editor_is_pasted(editor, text):
    assert paste(editor, text) == ["Ball"]
    assert place(editor, "Ball") == [4, 0, 1]
    editor.answer({"undo": True})
    assert "Ball" not in editor.simulation.context.objects


def test_what_names_an_object_of_the_scene_hangs_on_it(editor):
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
def test_nonsense_gets_one_line_and_changes_nothing(editor, text, told):
    before = editor.answer({"text": True})
    with pytest.raises(ValueError, match=re.escape(told)) as refused:
        paste(editor, text)
    assert "\n" not in str(refused.value)
    assert editor.answer({"text": True}) == before


def test_a_part_of_a_vehicle_and_the_floor_are_not_copied(editor):
    for name, told in (("FrontVision", "is a part of a vehicle"), ("Floor", "is the floor")):
        with pytest.raises(ValueError, match=told):
            copied(editor, name)
