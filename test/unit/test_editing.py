"""Scene editor: edits, undo and redo, the text of the scene, files and drafts."""

import errno
import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from living import assert_same, edit, editor_of, picture, place, state, text_of

from drone_sim.editing import drafts, records
from drone_sim.files import yaml_files
from drone_sim.mechanics.state import Pose
from drone_sim.scripting.errors import ScriptError

GATE = {"name": "Gate", "shape": "box", "size": [0.1, 2, 2]}
TWO_IN_A_CIRCLE = [{"name": one, "kind": "dummy", "parent": other} for one, other in ("AB", "BA")]
COURSE = """\
# A course, by hand.
floor: {size: 20.0}   # wide enough
drone: {position: [0, 0, 1.50]}
objects:
  # red
  - {name: Left, shape: box, size: [0.1, 0.1, 2.0], position: [3, 1, 1], rpy: [0, 0, 0],
     color: &red [0.9, 0.1, 0.1, 1]}
  - {name: Right, shape: box, size: [0.1, 0.1, 2.0], position: [3, -1, 1], color: *red}  # the other post
  # and what is on them
  - name: Lamp
    kind: dummy
    parent: Left     # goes with it
    position: [0, 0, 1]
"""


@pytest.fixture(name="editor")
def _editor():
    new_editor = editor_of()
    yield new_editor
    new_editor.simulation.close()


@pytest.fixture(name="course")
def _course(tmp_path):
    file = tmp_path / "course.yaml"
    file.write_text(COURSE, encoding="utf-8")
    new_editor = editor_of({"scene_file": str(file)})
    yield new_editor
    new_editor.simulation.close()


@pytest.fixture(name="shared", scope="module")
def _shared(tmp_path_factory):
    new_editor = editor_of()
    new_editor.simulation.document.folder = tmp_path_factory.mktemp("shared")
    edit(new_editor, {"do": "add", "objects": [GATE]})
    yield new_editor
    new_editor.simulation.close()


def changed_lines(before, after):
    """Return the lines that only `before` has, and the lines that only `after` has."""
    first, second = before.splitlines(), after.splitlines()
    return [one for one in first if one not in second], [one for one in second if one not in first]


# ---- edits


def test_an_edit_is_done_completely_or_not_at_all(editor):
    before = picture(editor.simulation)
    with pytest.raises(ValueError, match="no object named 'nobody'"):
        edit(editor, {"do": "add", "objects": [GATE]}, {"do": "remove", "objects": ["nobody"]})
    assert picture(editor.simulation) == before
    assert not editor.history.undo_name


def test_added_objects_stand_on_the_floor_and_get_a_free_name(editor):
    first = edit(editor, {"do": "add", "objects": [GATE], "position": [3, 1, 0]})["handles"]
    second = edit(editor, {"do": "add", "objects": [GATE], "position": [3, 2, 0], "yaw": 0.5})["handles"]
    tree = editor.simulation.context.objects
    assert [tree[one].name for one in (*first, *second)] == ["Gate", "Gate0"]
    assert place(editor, "Gate") == [3, 1, 1]
    assert place(editor, "Gate0") == [3, 2, 1]


def test_a_drag_is_one_step_of_undo(editor):
    edit(editor, {"do": "add", "objects": [GATE], "position": [3, 0, 0]})
    for number in range(5):
        edit(editor, {"do": "move", "object": "Gate", "position": [3, number, 1]}, merge="drag 1")
    editor.answer({"undo": True})
    assert place(editor, "Gate") == [3, 0, 1]
    editor.answer({"redo": True})
    assert place(editor, "Gate") == [3, 4, 1]


def test_undoing_a_drag_keeps_edits_of_other_clients_made_meanwhile(editor):
    edit(editor, {"do": "add", "objects": [GATE, {**GATE, "name": "Other"}], "position": [3, 0, 0]})
    edit(editor, {"do": "move", "object": "Gate", "position": [3, 4, 1]}, merge="mine 1")
    edit(editor, {"do": "move", "object": "Drone", "position": [1, 0, 1]}, merge="mine 2")
    edit(editor, {"do": "move", "object": "Other", "position": [5, 5, 1]})
    edit(editor, {"do": "set", "object": "Floor", "values": {"size": 9}})
    editor.answer({"undo": True, "merge": "mine 1"})
    editor.answer({"undo": True, "merge": "mine 2"})
    assert (place(editor, "Gate"), place(editor, "Other")) == ([3, 0, 1], [5, 5, 1])
    assert place(editor, "Drone") == [0, 0, 0.8]
    assert yaml_files.parse(text_of(editor))["floor"] == {"size": 9}
    edit(editor, {"do": "move", "object": "Gate", "position": [3, 7, 1]}, merge="mine 3")
    editor.answer({"undo": True, "merge": "mine 3"})
    assert editor.history.redo_name == "Move"
    with pytest.raises(ValueError, match="nothing to undo"):
        editor.answer({"undo": True, "merge": "nobody's"})


def test_reparented_objects_keep_their_pose_and_move_with_the_parent(editor):
    edit(editor, {"do": "add", "objects": [GATE], "position": [3, 0, 0]})
    edit(editor, {"do": "add", "objects": [{"name": "Mark", "kind": "dummy"}], "position": [1, 0, 0]})
    edit(editor, {"do": "reparent", "objects": ["Mark"], "parent": "Gate"})
    assert place(editor, "Mark") == [1, 0, 0]
    edit(editor, {"do": "move", "object": "Gate", "position": [4, 0, 1]})
    assert place(editor, "Mark") == [2, 0, 0]
    edit(editor, {"do": "move", "object": "Mark", "position": [0, 0, 0], "relative_to": "parent"})
    assert place(editor, "Mark") == [4, 0, 1]
    edit(editor, {"do": "reparent", "objects": ["Mark"], "parent": -1, "keep": "relative"})
    assert place(editor, "Mark") == [0, 0, 0]


def test_handles_stay_through_undo_redo_start_and_stop(editor):
    (handle,) = edit(editor, {"do": "add", "objects": [GATE]})["handles"]
    edit(editor, {"do": "remove", "objects": [handle]})
    editor.answer({"undo": True})
    simulation = editor.simulation
    assert simulation.context.objects.handle("Gate") == handle
    simulation.start()
    assert simulation.context.objects.handle("Gate") == handle
    simulation.stop()
    assert simulation.context.objects.handle("Gate") == handle


def test_stop_reverts_edits_made_in_flight(editor):
    edit(editor, {"do": "add", "objects": [GATE], "position": [3, 0, 0]}, name="Add")
    editor.simulation.start()
    answer = edit(editor, {"do": "move", "object": "Gate", "position": [3, 3, 1]}, name="Move")
    assert answer["until_stop"]
    editor.simulation.stop()
    editor.follow()
    assert place(editor, "Gate") == [3, 0, 1]
    assert editor.history.undo_name == "Add"


def test_undo_is_limited_to_a_hundred_steps(editor):
    for number in range(103):
        edit(editor, {"do": "add", "objects": [{"name": f"Mark{number}", "kind": "dummy"}]})
    for _ in range(100):
        editor.answer({"undo": True})
    with pytest.raises(ValueError, match="nothing to undo"):
        editor.answer({"undo": True})
    assert "Mark2" in editor.simulation.context.objects


def test_edits_of_vehicles_and_floor_can_be_undone(editor):
    before = picture(editor.simulation)
    edit(editor, {"do": "set", "object": "Floor", "values": {"size": 10}})
    edit(editor, {"do": "add_vehicle", "name": "second", "position": [2, 0, 1]})
    edit(editor, {"do": "move", "object": "Drone#0", "position": [2, 2, 1], "rpy": [0, 0, 1]})
    edit(editor, {"do": "remove", "objects": ["TrackCam", "Quadricopter_floorCamera", "Track_base"]})
    edit(editor, {"do": "rename", "object": "DronePosition", "name": "Goal"})
    edit(editor, {"do": "rename", "object": "Drone", "name": "first"})
    said = yaml_files.parse(text_of(editor))
    assert said["floor"] == {"size": 10}
    assert said["vehicles"]["second"] == {"position": [2, 2, 1], "yaw": 1, "script": "pilot"}
    assert said["vehicles"]["first"]["cameras"] == {"track": None}
    assert set(editor.simulation.vehicles) == {"first", "second"}
    assert "Goal" in editor.simulation.context.objects
    assert "TrackCam" not in editor.simulation.context.objects
    edit(editor, {"do": "copy", "objects": ["Drone#0"], "counts": [1, 2, 1], "steps": [0, 1, 0]})
    assert place(editor, "Drone#1") == [2, 3, 1]
    edit(editor, {"do": "remove", "objects": ["Drone"]})  # the objects of the other vehicle keep their names
    assert "Drone#0" in editor.simulation.context.objects
    while editor.history.undo_name:
        editor.answer({"undo": True})
    assert picture(editor.simulation) == before


def test_added_drones_fly_the_scripts_named_in_the_scene(editor, tmp_path):
    editor.answer({"new": True})
    assert editor.described()["new"]
    (drone,) = edit(editor, {"do": "add_vehicle", "position": [0, 0, 0]})["handles"]
    assert "script" not in yaml_files.parse(text_of(editor))["vehicles"]["quadricopter"], "the run's script flies it"
    edit(editor, {"do": "add_vehicle", "position": [1, 0, 0]})
    assert yaml_files.parse(text_of(editor))["vehicles"]["quadricopter2"]["script"] == "pilot"
    (tmp_path / "mine.py").write_text("def sysCall_actuation():\n    pass\n")
    edit(editor, {"do": "set", "object": drone, "values": {"script": str(tmp_path / "mine.py")}})
    editor.answer({"save": str(tmp_path / "scene.yaml")})
    assert not editor.described()["new"]
    editor.answer({"open": str(tmp_path / "scene.yaml")})
    editor.simulation.script = "target"  # the script that a client has chosen
    editor.simulation.start()
    assert editor.simulation.child_scripts["quadricopter"].path == str(tmp_path / "mine.py")
    assert editor.simulation.child_scripts["quadricopter2"].path.endswith("/pilot.py")


def test_the_error_for_a_taken_name_shows_the_path_of_the_other_object(editor):
    edit(editor, {"do": "add", "objects": [GATE, {"name": "Camera", "kind": "vision_sensor", "parent": "Gate"}]})
    with pytest.raises(ValueError, match=r"'TrackCam' already exists: \S+/TrackCam, a part of the vehicle 'drone'$"):
        edit(editor, {"do": "rename", "object": "Gate", "name": "TrackCam"})
    with pytest.raises(ValueError, match=r"'Camera' already exists: /Gate/Camera$"):
        edit(editor, {"do": "rename", "object": "DronePosition", "name": "Camera"})


WRONG_MODELS = {
    "": "there is no object|no object named",
    "Floor": "is the floor",
    "Drone": "part of a vehicle",
    "Quadricopter_base": "part of a vehicle",
    "TrackCam": "part of a vehicle",
}


@pytest.mark.parametrize("name", WRONG_MODELS)
def test_saving_a_non_model_as_model_raises_a_one_line_error(shared, name, tmp_path):
    edit(shared, {"do": "add", "objects": [{"name": "Lamp", "kind": "dummy", "parent": "Quadricopter_base"}]})
    with pytest.raises(ValueError, match=WRONG_MODELS[name]):
        shared.answer({"save_model": name, "file": str(tmp_path / "model.yaml")})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("file", ["", "gate", "gate.txt", "gate\0.yaml", "gate\n.yaml", "x" * 300 + ".yaml"])
def test_a_model_needs_the_name_of_a_yaml_file(shared, file):
    with pytest.raises(ValueError, match=r"file = .*: the name of a scene or model must end in \.yaml"):
        shared.answer({"save_model": "Gate", "file": file})


def vehicle_state(editor, name="drone"):
    return editor.simulation.vehicles[name].body.state


def test_vehicles_floor_and_weather_are_edited_in_flight_until_stop(editor):
    simulation = editor.simulation
    before, text = state(simulation), text_of(editor)
    edit(editor, {"do": "add", "objects": [{"name": "Mark", "kind": "dummy", "parent": "Drone"}]})
    edit(editor, {"do": "move", "object": "Mark", "position": [0, 0, 0.3], "relative_to": "parent"})
    simulation.start()
    for _ in range(5):
        simulation.step()
    handle, drone = simulation.context.objects.handle("Drone"), simulation.drone
    edit(editor, {"do": "set", "object": "Floor", "values": {"size": 12}})
    assert simulation.drone is drone
    assert next(one for one in simulation.world.pictures.visuals() if one.floor).shape.size == 12
    edit(editor, {"do": "move", "object": "Drone", "position": [1, 2, 2], "rpy": [0, 0, 1]})
    assert simulation.drone is drone, "a move does not rebuild the vehicle"
    simulation.step()
    assert place(editor, "Drone") == pytest.approx([1, 2, 2], abs=0.1)
    edit(editor, {"do": "set", "object": "Drone", "values": {"cameras": {"front": {"width": 320}}}})
    assert simulation.drone is not drone
    assert place(editor, "Drone") == pytest.approx([1, 2, 2], abs=0.1)
    assert simulation.context.objects.handle("Drone") == handle
    assert editor.simulation.tree.matrix(editor.simulation.tree.handle("Mark"), handle)[11] == pytest.approx(0.3)
    (new,) = edit(editor, {"do": "add_vehicle", "name": "second", "position": [-2, 0, 1]})["handles"]
    edit(editor, {"do": "rename", "object": new, "name": "guest"})
    simulation.step()
    assert list(simulation.vehicles) == ["drone", "guest"]
    editor.answer({"write": text_of(editor) + "weather: {wind: [2, 0, 0]}\n"})
    assert simulation.context.weather.now.wind == (2, 0, 0)
    simulation.step()
    for _ in range(7):
        editor.answer({"undo": True})
    assert list(simulation.vehicles) == ["drone"]
    assert simulation.context.weather.now.wind == (0, 0, 0)
    editor.answer({"redo": True})
    simulation.stop()
    editor.follow()
    editor.answer({"undo": True})
    editor.answer({"undo": True})
    assert_same(state(simulation), before)
    assert text_of(editor) == text


@pytest.mark.parametrize(
    "said",
    [
        "datum: {latitude: 1}",
        "magnetic_field: [0, 0, 1.0e-5]",
        "gravity: -3",
        "physics: {gyroscopic: false}",
        "sub_step: 0.01",
        "collections: [{name: all, items: [{what: all}]}]",
    ],
)
def test_keys_that_cannot_change_in_flight_are_refused_until_stop(editor, said):
    editor.simulation.start()
    key = said.partition(":")[0]
    with pytest.raises(ValueError, match=f"{key}: can only be changed while"):
        editor.answer({"write": f"{text_of(editor)}{said}\n"})
    editor.simulation.stop()
    editor.follow()
    editor.answer({"write": f"{text_of(editor)}{said}\n"})


def test_a_vehicle_whose_script_fails_in_init_changes_nothing(editor, tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text("def sysCall_init():\n    raise ValueError('not today')\n", encoding="utf-8")
    editor.simulation.start()
    before = text_of(editor)
    for operation in (
        {"do": "add_vehicle", "name": "second", "position": [2, 0, 1], "values": {"script": str(wrong)}},
        {"do": "set", "object": "Drone", "values": {"script": str(wrong)}},
    ):
        with pytest.raises(ScriptError, match="not today"):
            edit(editor, operation)
        assert list(editor.simulation.vehicles) == ["drone"]
        assert text_of(editor) == before
        editor.simulation.step()
    edit(editor, {"do": "remove", "objects": ["Drone"]})
    editor.simulation.step()
    assert not editor.simulation.vehicles
    editor.simulation.stop()
    assert list(editor.simulation.vehicles) == ["drone"]


def test_a_model_can_be_grouped_copied_into_a_row_removed_and_ungrouped(editor):
    edit(editor, {"do": "add", "objects": [GATE, {**GATE, "name": "Post"}], "position": [3, 0, 0]})
    (base,) = edit(editor, {"do": "group", "objects": ["Gate", "Post"], "name": "Arena"})["handles"]
    copies = edit(editor, {"do": "copy", "objects": [base], "counts": [3, 1, 1], "steps": [2, 0, 0]})["handles"]
    tree = editor.simulation.context.objects
    assert [tree[one].alias for one in copies] == ["Arena", "Arena"]
    assert place(editor, "Gate#1")[0] == place(editor, "Gate")[0] + 4
    edit(editor, {"do": "remove", "objects": copies})
    assert "Gate#1" not in tree
    edit(editor, {"do": "ungroup", "object": "Arena"})
    assert "Arena" not in tree
    assert "Gate" in tree


def test_a_script_can_be_attached_and_detached(course):
    folder = course.simulation.document.file.parent
    edit(course, {"do": "attach_script", "object": "Lamp"})
    assert "sysCall_actuation" in (folder / "lamp.lua").read_text(encoding="utf-8")
    edit(course, {"do": "set", "object": "Lamp", "values": {"script_parameters": {"speed": 2}}})
    assert text_of(course).endswith("scripts:\n  - {object: Lamp, script: lamp.lua, parameters: {speed: 2}}\n")
    course.simulation.start()
    course.simulation.stop()
    edit(course, {"do": "detach_script", "object": "Lamp"})
    course.answer({"undo": True})
    assert "speed" in text_of(course)


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({}, "must be a mapping with one of edit, undo"),
        ({"edit": [{"do": "fly"}]}, "must be one of 'add'"),
        ({"edit": [{"do": "move", "object": True}]}, "handle or name"),
        ({"edit": [{"do": "move", "object": "Drone", "quaternion": [0, 0, 0, 0]}]}, "must be about 1"),
        ({"edit": [{"do": "set", "object": "Drone", "values": {"cameras": {"front": {"width": 0}}}}]}, "width"),
        ({"edit": [{"do": "add_model", "model": "gat"}]}, "no model named 'gat'"),
        ({"edit": [{"do": "remove", "objects": ["Quadricopter_base"]}]}, "cannot fly without it"),
        ({"edit": [{"do": "add", "objects": [{"name": "A", "kind": "dummy", "parent": "A"}]}]}, "its own ancestor"),
        ({"edit": [{"do": "add", "objects": TWO_IN_A_CIRCLE}]}, "'A' would be its own ancestor"),
        (
            {
                "edit": [
                    {"do": "set", "object": "Drone", "values": {"objects": {"Track_base": {"parent": "Track_base"}}}}
                ]
            },
            "no object is named 'Track_base', the parent of 'Track_base'",
        ),
        (
            {"edit": [{"do": "add", "objects": [GATE]}, {"do": "set", "object": "Gate", "values": {"color": 5}}]},
            "color = 5: must be 3 or 4 numbers",
        ),
        (
            {"edit": [{"do": "add", "objects": [GATE]}, {"do": "set", "object": "Gate", "values": {"color": "red"}}]},
            "color = 'red'",
        ),
        ({"redo": True}, "nothing to redo"),
        ({"save": "/tmp/scene.txt"}, "must end in .yaml"),
        ({"write": "objects: ["}, "line"),
        ({"write": "objects:\n  - {name: A, shape: bax}\n"}, "line 2.*'bax'"),
        ({"write": "objects: []\n", "revision": 77}, "has changed since"),
        ({"draft": "take"}, "no draft"),
    ],
)
def test_an_invalid_request_raises_a_one_line_error_and_changes_nothing(editor, request_, said):
    before = picture(editor.simulation)
    with pytest.raises(ValueError, match=said) as raised:
        editor.answer(request_)
    assert "\n" not in str(raised.value)
    assert picture(editor.simulation) == before


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 40) | st.floats() | st.text(max_size=4) | st.just("Gate"),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)
KEYS = sorted({key for one in records.OPERATIONS for key in one.model_fields} - {"do"} | {"as"})
OPERATION = st.fixed_dictionaries(
    {"do": st.sampled_from([one.model_fields["do"].annotation.__args__[0] for one in records.OPERATIONS])},
    optional={key: JUNK for key in KEYS},
)


@settings(max_examples=20)
@given(requests=st.lists(st.one_of(OPERATION.map(lambda one: {"edit": [one]}), JUNK), min_size=1, max_size=3))
def test_random_requests_raise_at_most_one_line_errors(shared, requests):
    for one in requests:
        try:
            shared.answer(one)
        except ValueError as refused:
            assert "\n" not in str(refused)


# ---- texts and files


def test_edits_keep_comments_and_formatting_of_the_scene_file(course):
    assert text_of(course) == COURSE
    edit(course, {"do": "move", "object": "Right", "position": [3, -1.5, 1]})
    was, now = changed_lines(COURSE, text_of(course))
    assert now == [was[0].replace("[3, -1, 1]", "[3, -1.5, 1]")]
    edit(course, {"do": "remove", "objects": ["Left"]})
    text = text_of(course)
    assert "color: &red [0.9, 0.1, 0.1, 1]}  # the other post" in text  # was an alias of a removed anchor
    assert all(one in text for one in ("# A course, by hand.", "# wide enough", "# red", "# and what is on them"))
    for _ in range(2):
        course.answer({"undo": True})
    assert text_of(course) == COURSE


def test_a_written_text_becomes_the_scene_and_stays_verbatim(course):
    handle = course.simulation.context.objects.handle("Left")
    written = (
        COURSE.replace("[3, 1, 1]", "[3, 2, 1]")
        .replace("size: 20.0", "size: 12")
        .replace("kind: dummy", "kind: dummy\n    size: 0.2")
    )
    course.answer({"write": written})
    assert text_of(course) == written
    assert place(course, "Left") == [3, 2, 1]
    assert course.simulation.context.objects.handle("Left") == handle
    course.answer({"undo": True})
    assert place(course, "Left") == [3, 1, 1]
    assert text_of(course) == written.replace("[3, 2, 1]", "[3, 1, 1]").replace("size: 12", "size: 20").replace(
        "\n    size: 0.2", ""
    )


def test_saving_under_another_name_switches_to_that_file(course, tmp_path):
    edit(course, {"do": "add", "objects": [GATE], "position": [5, 0, 0]})
    other = tmp_path / "other" / "mine.yaml"
    course.answer({"save": str(other)})
    assert not course.is_modified
    assert (tmp_path / "course.yaml").read_text(encoding="utf-8") == COURSE
    assert other.read_text(encoding="utf-8") == COURSE + (
        "  - {name: Gate, shape: box, size: [0.1, 2, 2], position: [5, 0, 1]}\n"
    )
    course.simulation.start()
    assert course.simulation.parameters.scene_file == str(other)
    course.simulation.stop()


def test_saving_in_flight_writes_the_current_poses_until_stop_restores_the_scene(course):
    course.simulation.start()
    course.simulation.drone.body.move(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)))
    said = course.answer({"save": True})["said"]
    file = course.simulation.document.file
    assert "in flight" in said and said.endswith(str(file))
    was, now = changed_lines(COURSE, file.read_text(encoding="utf-8"))
    assert (was, now) == (["drone: {position: [0, 0, 1.50]}"], ["drone: {position: [1, 2, 3]}"])
    course.simulation.stop()
    course.follow()
    assert text_of(course) == COURSE


def test_saving_under_another_name_in_flight_writes_a_copy_and_reports_it(course, tmp_path):
    course.simulation.start()
    other = tmp_path / "other.yaml"
    said = course.answer({"save": str(other)})["said"]
    assert str(other) in said and "This is a copy" in said
    assert course.simulation.document.file == tmp_path / "course.yaml"


def test_start_reloads_a_scene_file_changed_since_it_was_saved(course):
    edit(course, {"do": "move", "object": "Left", "position": [4, 1, 1]})
    course.answer({"save": True})
    file = course.simulation.document.file
    file.write_text(COURSE.replace("[3, 1, 1]", "[5, 1, 1]"), encoding="utf-8")
    os.utime(file, ns=(1, 1))
    course.follow()
    course.simulation.start()
    assert place(course, "Left") == [5, 1, 1]


def test_saving_a_scene_of_the_package_writes_a_copy_in_the_home_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    editor = editor_of({"scene_file": "package://drone_sim/config/scenes/gates.yaml"})
    shipped = editor.simulation.document.file
    before = shipped.read_text(encoding="utf-8")
    edit(editor, {"do": "remove", "objects": ["Red"]})
    assert editor.answer({"save": True})["file"] == str(tmp_path / ".ros/drone_sim/gates.yaml")
    assert shipped.read_text(encoding="utf-8") == before
    editor.answer({"new": True})
    assert not editor.simulation.vehicles
    editor.simulation.close()


@pytest.mark.parametrize("name", ["1e3", "true", "~", "2026-01-01", "1:30", "010", ".inf", "a: b", "- a", "<<"])
def test_objects_with_names_special_in_yaml_can_be_saved_and_loaded(course, tmp_path, name):
    edit(course, {"do": "add", "objects": [{"name": name, "kind": "dummy", "model": True}]})
    course.answer({"save": str(tmp_path / "named.yaml")})
    course.answer({"save_model": name, "file": str(tmp_path / "model.yaml")})
    edit(course, {"do": "remove", "objects": [name]})
    edit(course, {"do": "add_model", "model": str(tmp_path / "model.yaml"), "position": [0, 0, 0]})
    course.answer({"open": str(tmp_path / "named.yaml")})
    assert name in course.simulation.context.objects


@pytest.mark.parametrize("values", [{"script_parameters": 5}, {"mass": "x"}])
def test_an_edit_that_fails_halfway_changes_nothing(course, values):
    edit(course, {"do": "attach_script", "object": "Lamp"})
    before, revision = text_of(course), course.revision
    with pytest.raises(ValueError) as raised:
        edit(
            course,
            {"do": "move", "object": "Lamp", "position": [1, 1, 1]},
            {"do": "set", "object": "Lamp", "values": values},
        )
    assert "\n" not in str(raised.value)
    assert (text_of(course), course.revision) == (before, revision)


def test_a_draft_is_offered_after_the_node_restarts(tmp_path):
    first = editor_of(drafts=tmp_path)
    edit(first, {"do": "add", "objects": [GATE], "position": [5, 0, 0]})
    first.keep_draft()
    first._drafts.wait()
    first.simulation.close()  # without saving
    second = editor_of(drafts=tmp_path)
    assert second.described()["draft"]["file"] == ""
    second.answer({"draft": "take"})
    assert place(second, "Gate") == [5, 0, 1]
    assert second.is_modified
    assert second.described()["draft"] is None
    second.keep_draft()
    edit(second, {"do": "move", "object": "Gate", "position": [6, 0, 1]})
    second.keep_draft()  # writes nothing so soon after the last one
    second.simulation.load_scene("")  # as by another client
    second.follow()
    assert not second.is_modified
    second.answer({"draft": "take"})
    assert place(second, "Gate") == [6, 0, 1]
    second.simulation.close()


def test_edits_in_flight_reverted_by_loading_a_scene_leave_no_draft(tmp_path):
    editor = editor_of(drafts=tmp_path)
    editor.simulation.start()
    editor.follow()
    edit(editor, {"do": "add", "objects": [GATE], "position": [5, 0, 0]})
    editor.simulation.load_scene("")
    editor.follow()
    assert editor.described()["draft"] is None
    assert not editor.is_modified
    editor.simulation.close()


def test_a_failure_to_write_drafts_is_reported_once(tmp_path, monkeypatch, caplog):
    def full(path, _text):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    kept = drafts.Drafts(tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(drafts.writing, "write", full)
        for text in ("first", "second"):
            kept.keep("", text)
            kept.wait()
    assert [one.levelname for one in caplog.records] == ["WARNING"]
    assert os.strerror(errno.ENOSPC) in caplog.text
    assert ": no effect: " in caplog.text, "the cockpit shows log lines with this text as notices"
    kept.keep("", "third")
    kept.wait()
    assert drafts.Drafts(tmp_path).offered.text == "third" and len(caplog.records) == 1


def test_undo_and_redo_back_to_the_saved_state_clear_the_modified_flag(editor, tmp_path):
    edit(editor, {"do": "add", "objects": [GATE], "position": [5, 0, 0]})
    editor.answer({"save": str(tmp_path / "gate.yaml")})
    edit(editor, {"do": "move", "object": "Gate", "position": [6, 0, 1]})
    undo_or_redo = [({"undo": True}, False), ({"undo": True}, True), ({"redo": True}, False), ({"redo": True}, True)]
    for request, is_modified in undo_or_redo:
        editor.answer(request)
        assert editor.is_modified == is_modified, request


def test_a_scene_loaded_in_flight_is_not_modified(editor):
    edit(editor, {"do": "add", "objects": [GATE], "position": [5, 0, 0]})
    editor.simulation.start()
    editor.follow()
    editor.simulation.load_scene("")
    editor.follow()
    assert not editor.is_modified


def test_models_of_the_package_are_written_with_package_urls(editor):
    pads = {"do": "add_model", "model": "landing_pad", "position": [1, 0, 0]}
    edit(editor, pads, {"do": "add_model", "model": "pole", "position": [2, 0, 0]})
    assert text_of(editor).splitlines()[-9:] == [
        "objects:",
        "  - {name: LandingPad, shape: box, size: [0.6, 0.6, 0.004], position: [1, 0, 0.002], respondable: false,",
        "     texture: 'package://drone_sim/config/models/tag_7.png'}",
        "  - name: Pole",
        "    shape: compound",
        "    position: [2, 0, 0]",
        "    parts:",
        "      - {shape: cylinder, size: [0.15, 0.04], position: [0, 0, 0.02], color: [0.25, 0.25, 0.27, 1]}",
        "      - {shape: cylinder, size: [0.03, 2], position: [0, 0, 1.04], color: [0.95, 0.8, 0.1, 1]}",
    ]


def test_a_vehicle_cannot_be_saved_as_a_model(editor, tmp_path):
    vehicle = editor.simulation.object_handles["Drone"]
    with pytest.raises(ValueError, match="'Drone' is part of a vehicle"):
        editor.answer({"save_model": vehicle, "file": str(tmp_path / "model.yaml")})


def test_a_pace_set_after_an_edit_in_flight_stays(editor):
    simulation = editor.simulation
    simulation.start()
    edit(editor, {"do": "set", "object": "Floor", "values": {"size": 7}})
    simulation.set_pace(2.5)
    simulation.stop()
    assert simulation.parameters.real_time_factor == 2.5
    assert simulation.parameters.scene.floor.size != 7
