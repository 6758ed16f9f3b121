"""The scene's editor: edits as records, undo and redo, the scene's text, files, drafts."""

import os
import random
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from living import KINDS, SCENE, picture, sizes

from drone_sim.editing import records
from drone_sim.editing.changes import change_between
from drone_sim.editing.editor import SceneEditor
from drone_sim.files import yaml_files
from drone_sim.mechanics.state import Pose
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

EDITS = int(os.environ.get("DRONE_SIM_EDITS", "20"))  # in a row: 500 by hand
GATE = {"name": "Gate", "shape": "box", "size": [0.1, 2, 2]}
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


def editor_of(given=None, drafts=None):
    simulation = Simulation(parameters.load(given), started=False)
    return SceneEditor(Player(simulation, simulation.step, lambda state: None, False), drafts)


@pytest.fixture(name="editor")
def _editor():
    made = editor_of()
    yield made
    made.simulation.close()


@pytest.fixture(name="course")
def _course(tmp_path):
    file = tmp_path / "course.yaml"
    file.write_text(COURSE, encoding="utf-8")
    made = editor_of({"scene_file": str(file)})
    yield made
    made.simulation.close()


@pytest.fixture(name="shared", scope="module")
def _shared(tmp_path_factory):
    made = editor_of()
    made.scene.folder = tmp_path_factory.mktemp("shared")
    edit(made, {"do": "add", "objects": [GATE]})
    yield made
    made.simulation.close()


def edit(editor, *operations, **more):
    return editor.answer({"edit": list(operations), **more})


def text_of(editor):
    return editor.answer({"text": True})["text"]


def state(simulation):
    """Return what `picture` does, what is seen in any order."""
    objects, looks, poses, seen = picture(simulation)
    return (
        objects,
        np.round(poses, 6) + 0.0,
        sorted((str(look), (np.round(pose, 5) + 0.0).tolist()) for look, pose in zip(looks, seen)),
    )


def assert_same(one, other):
    assert one[0] == other[0]
    np.testing.assert_allclose(one[1], other[1], atol=2e-6)
    assert one[2] == other[2]


def place(editor, name):
    tree = editor.simulation.context.objects
    matrix = tree.matrix(tree.handle(name))
    return [round(matrix[index], 9) for index in (3, 7, 11)]


def changed_lines(before, after):
    """Return the lines that only one of two texts has."""
    first, second = before.splitlines(), after.splitlines()
    return [one for one in first if one not in second], [one for one in second if one not in first]


# ---- what an edit does


def test_an_edit_is_done_as_a_whole_or_not_at_all(editor):
    before = picture(editor.simulation)
    with pytest.raises(ValueError, match="no object named 'nobody'"):
        edit(editor, {"do": "add", "objects": [GATE]}, {"do": "remove", "objects": ["nobody"]})
    assert picture(editor.simulation) == before
    assert not editor.history.undo_name


def test_what_lands_stands_on_the_floor_under_a_free_name(editor):
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


def test_a_parent_takes_its_children_along_and_keeps_them_where_they_are(editor):
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


def test_stop_undoes_what_was_edited_in_flight(editor):
    edit(editor, {"do": "add", "objects": [GATE], "position": [3, 0, 0]}, name="Add")
    editor.simulation.start()
    answer = edit(editor, {"do": "move", "object": "Gate", "position": [3, 3, 1]}, name="Move")
    assert answer["until_stop"]
    editor.simulation.stop()
    editor.follow()
    assert place(editor, "Gate") == [3, 0, 1]
    assert editor.history.undo_name == "Add"


def test_no_more_than_a_hundred_steps_are_undone(editor):
    for number in range(103):
        edit(editor, {"do": "add", "objects": [{"name": f"Mark{number}", "kind": "dummy"}]})
    for _ in range(100):
        editor.answer({"undo": True})
    with pytest.raises(ValueError, match="nothing to undo"):
        editor.answer({"undo": True})
    assert "Mark2" in editor.simulation.context.objects


def test_vehicles_and_floor(editor):
    before = picture(editor.simulation)
    edit(editor, {"do": "set", "object": "Floor", "values": {"size": 10}})
    edit(editor, {"do": "add_vehicle", "name": "second", "position": [2, 0, 1]})
    edit(editor, {"do": "move", "object": "Drone#0", "position": [2, 2, 1], "rpy": [0, 0, 1]})
    edit(editor, {"do": "remove", "objects": ["TrackCam", "Quadricopter_floorCamera", "Track_base"]})
    edit(editor, {"do": "rename", "object": "DronePosition", "name": "Goal"})
    edit(editor, {"do": "rename", "object": "Drone", "name": "first"})
    said = yaml_files.parse(text_of(editor))
    assert said["floor"] == {"size": 10}
    assert said["vehicles"]["second"] == {"position": [2, 2, 1], "yaw": 1}
    assert said["vehicles"]["first"]["cameras"] == {"track": None}
    assert set(editor.simulation.vehicles) == {"first", "second"}
    assert "Goal" in editor.simulation.context.objects
    assert "TrackCam" not in editor.simulation.context.objects
    edit(editor, {"do": "copy", "objects": ["Drone#0"], "counts": [1, 2, 1], "steps": [0, 1, 0]})
    assert place(editor, "Drone#1") == [2, 3, 1]
    edit(editor, {"do": "remove", "objects": ["Drone"]})  # the other one's objects keep their names
    assert "Drone#0" in editor.simulation.context.objects
    while editor.history.undo_name:
        editor.answer({"undo": True})
    assert picture(editor.simulation) == before
    editor.simulation.start()
    with pytest.raises(ValueError, match="stop it first"):
        edit(editor, {"do": "set", "object": "Floor", "values": {"size": 12}})


def test_a_model_is_grouped_copied_into_a_row_and_removed_whole(editor):
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


def test_a_script_is_attached_and_taken_away(course):
    folder = course.document.file.parent
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
        ({"edit": [{"do": "remove", "objects": ["Quadricopter_base"]}]}, "does not fly without it"),
        ({"redo": True}, "nothing to redo"),
        ({"save": "/tmp/scene.txt"}, ".yaml file"),
        ({"write": "objects: ["}, "line"),
        ({"write": "objects:\n  - {name: A, shape: bax}\n"}, "line 2.*'bax'"),
        ({"write": "objects: []\n", "revision": 77}, "changed meanwhile"),
        ({"draft": "take"}, "no draft"),
    ],
)
def test_what_cannot_be_gets_one_line_and_changes_nothing(editor, request_, said):
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


@settings(max_examples=40)
@given(requests=st.lists(st.one_of(OPERATION.map(lambda one: {"edit": [one]}), JUNK), min_size=1, max_size=3))
def test_rubbish_is_refused(shared, requests):
    for one in requests:
        try:
            shared.answer(one)
        except ValueError as refused:
            assert "\n" not in str(refused)


# ---- texts and files


def test_a_text_keeps_what_its_author_wrote(course):
    assert text_of(course) == COURSE
    edit(course, {"do": "move", "object": "Right", "position": [3, -1.5, 1]})
    was, now = changed_lines(COURSE, text_of(course))
    assert now == [was[0].replace("[3, -1, 1]", "[3, -1.5, 1]")]
    edit(course, {"do": "remove", "objects": ["Left"]})
    text = text_of(course)
    assert "color: &red [0.9, 0.1, 0.1, 1]}  # the other post" in text  # what was an alias of what is gone
    assert all(one in text for one in ("# A course, by hand.", "# wide enough", "# red", "# and what is on them"))
    for _ in range(2):
        course.answer({"undo": True})
    assert text_of(course) == COURSE


def test_a_text_becomes_the_scene_and_is_kept_as_it_was_written(course):
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


def test_saved_as_another_file_it_is_that_scene(course, tmp_path):
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


def test_in_flight_it_is_saved_as_it_stands_and_stays_the_scene_that_it_was(course):
    course.simulation.start()
    course.simulation.drone.body.move(Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)))
    course.answer({"save": True})
    file = course.document.file
    was, now = changed_lines(COURSE, file.read_text(encoding="utf-8"))
    assert (was, now) == (["drone: {position: [0, 0, 1.50]}"], ["drone: {position: [1, 2, 3], yaw: 0}"])
    course.simulation.stop()
    course.follow()
    assert text_of(course) == COURSE


def test_a_start_reads_what_somebody_has_written_since_it_was_saved(course):
    edit(course, {"do": "move", "object": "Left", "position": [4, 1, 1]})
    course.answer({"save": True})
    file = course.document.file
    file.write_text(COURSE.replace("[3, 1, 1]", "[5, 1, 1]"), encoding="utf-8")
    os.utime(file, ns=(1, 1))
    course.follow()
    course.simulation.start()
    assert place(course, "Left") == [5, 1, 1]


def test_a_scene_of_the_package_is_copied(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    editor = editor_of({"scene_file": "package://drone_sim/config/scenes/gates.yaml"})
    shipped = editor.document.file
    before = shipped.read_text(encoding="utf-8")
    edit(editor, {"do": "remove", "objects": ["RedTop"]})
    assert editor.answer({"save": True})["file"] == str(tmp_path / ".ros/drone_sim/gates.yaml")
    assert shipped.read_text(encoding="utf-8") == before
    editor.answer({"new": True})
    assert not editor.simulation.vehicles
    editor.simulation.close()


def test_a_draft_outlives_the_node(tmp_path):
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
    second._drafts.wait()
    second.simulation.load_scene("")  # of somebody else's
    second.follow()
    assert second.described()["draft"]
    assert not second.is_modified
    second.simulation.close()


def test_models_of_the_package_are_written_for_any_machine(editor):
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


# ---- many


class RandomEdits:
    """Edits that a person could make, one after another."""

    def __init__(self, editor, seed):
        self.editor, self.dice = editor, random.Random(seed)

    def step(self):
        """Make an edit, or undo or redo some; what cannot be is refused."""
        word = self.dice.choice(["edit"] * 7 + ["undo"] * 2 + ["redo"])
        try:
            self.editor.answer({"edit": [self.operation()]} if word == "edit" else {word: True})
        except ValueError:
            assert word != "undo" or not self.editor.history.undo_name, "what was done can be undone"

    def operation(self):
        choose, tree = self.dice.choice, self.editor.simulation.context.objects
        own = [one.name for one in self.editor.simulation.scene.entries.values()]
        one, other = choose(own or ["Drone"]), choose([*own, "Drone", "Quadricopter_base"])
        place = [round(self.dice.uniform(-4, 4), 1) for _ in range(2)] + [round(self.dice.uniform(0.5, 3), 2)]
        kind = choose([*KINDS.values()])
        operations = [
            {"do": "add", "objects": [{"name": choose(["A", "B"]), **kind}], "position": place},
            {
                "do": "move",
                "object": choose([one, "Drone"]),
                "position": place,
                "rpy": [0, 0, round(self.dice.uniform(-3, 3), 2)],
            },
            {"do": "move", "object": one, "position": place, "relative_to": "parent"},
            {"do": "rename", "object": one, "name": choose(["C", "D", "E"])},
            {"do": "reparent", "objects": [one], "parent": choose([other, -1]), "keep": choose(["pose", "relative"])},
            {
                "do": "set",
                "object": one,
                "values": choose([{"mass": 2}, {"color": [1, 0, 0]}, {"alias": "x"}, {"size": [0.3]}]),
            },
            {"do": "set", "object": "Floor", "values": {"size": self.dice.randint(8, 12)}},
            {"do": "copy", "objects": [one], "counts": [2, 1, 1], "steps": [0, 0.5, 0]},
            {"do": "scale", "objects": [one], "factors": [1.5, 1.5, 1.5]},
            {"do": "remove", "objects": [one]}
            if len(own) > 12 or self.dice.random() < 0.3
            else {"do": "detach_script", "object": one},
            {"do": "group", "objects": [one], "name": "Model"},
        ]
        return choose([entry for entry in operations if tree is not None])


def assert_agree(editor, folder):
    """Let tree, bodies, rviz's markers and the saved file say the same."""
    simulation = editor.simulation
    scene = simulation.scene
    simulation.context.carried.follow()
    assert {one.name for one in scene.entries.values()} == {one.name for one in scene.objects.values()}
    for index, one in scene.objects.items():
        entry = scene.entry_now(index)
        assert (one.parent.name if one.parent else "") == entry.parent
        number = getattr(one, "number", None)
        if number is not None and one.link == -1:
            assert np.allclose(simulation.world.state(number).matrix, one.matrix(), atol=1e-6), one.name
    file = folder / "saved.yaml"
    editor.answer({"save": str(file)})
    again = editor_of({"scene_file": str(file)})
    difference = change_between(by_name(editor), by_name(again))
    assert not difference.entries, difference.entries
    assert not difference.scripts
    assert markers(simulation) == markers(again.simulation)
    assert sizes(simulation) == sizes(again.simulation)  # nothing is left of what has gone
    assert set(simulation.vehicles) == set(again.simulation.vehicles)
    seen = [seen_by_camera(one.simulation) for one in (editor, again)]
    assert seen[0] is None or np.abs(seen[0].astype(int) - seen[1]).mean() < 0.5
    again.simulation.close()


def by_name(editor):
    content = editor.scene.content()
    rounded = {one.name: rounded_entry(one) for one in content.entries.values()}
    return content._replace(entries=rounded, settings={})


def rounded_entry(entry):
    values = entry.model_dump(mode="json")
    for key in ("position", "rpy"):
        values[key] = [round(one, 5) + 0.0 for one in values[key]]
    return values


def markers(simulation):
    """Return what rviz is told of the scene's objects: names, looks and places."""
    visuals, poses = simulation.scene.visuals()
    told = sorted(
        (name, type(one.shape).__name__, np.round(one.rgba, 3).tolist(), np.round(pose, 4).tolist())
        for name, one, pose in zip(simulation.scene.visual_names(), visuals, poses + 0.0)
    )
    if find_spec("visualization_msgs") is None:
        return told
    from drone_sim.ros.rviz.scene_markers import bodiless_markers

    frames = sorted(
        (one.ns, one.type, round(one.scale.x, 4)) for one in bodiless_markers(simulation.scene.objects.values())
    )
    return told, frames


def seen_by_camera(simulation):
    for vehicle in simulation.vehicles.values():
        for camera in vehicle.cameras.values():
            return camera.look()
    return None


@settings(max_examples=1)
@given(st.integers(0, 2**32))
def test_random_edits_agree_everywhere_and_leave_nothing(tmp_path_factory, seed):
    folder = Path(tmp_path_factory.mktemp("edits"))
    editor = editor_of({"scene": SCENE, "drone": {"position": [0.0, 0.0, 2.0]}})
    began, before = sizes(editor.simulation), state(editor.simulation)
    edits = RandomEdits(editor, seed)
    for number in range(EDITS):
        edits.step()
        if number % 10 == 9:
            assert_agree(editor, folder)
    if EDITS <= 100:
        while editor.history.undo_name:
            editor.answer({"undo": True})
        assert_same(state(editor.simulation), before)
        assert sizes(editor.simulation) == began
    editor.simulation.close()
