"""Random edits of a scene: all representations of the scene agree, and nothing is left behind."""

import contextlib
import gc
import os
import random
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path

import moderngl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from living import KINDS, SCENE, assert_same, editor_of, sizes, state, text_of

from drone_sim.editing.changes import change_between

pytestmark = pytest.mark.long

EDITS = int(os.environ.get("DRONE_SIM_EDITS", "20"))  # in a row; 500 for a long manual run
OPENGL = (moderngl.Buffer, moderngl.Framebuffer, moderngl.Program, moderngl.Texture, moderngl.VertexArray)
MEMORY_LIMIT = 25 * 30_000  # bytes that 25 edits may add to the process


class RandomEdits:
    """A random sequence of edits that a user of the editor could make."""

    def __init__(self, editor, seed):
        self.editor, self.rng = editor, random.Random(seed)

    def step(self):
        """Make an edit, or undo or redo one; impossible edits are refused."""
        word = self.rng.choice(["edit"] * 7 + ["undo"] * 2 + ["redo"])
        try:
            self.editor.answer({"edit": [self.operation()]} if word == "edit" else {word: True})
        except ValueError:
            assert word != "undo" or not self.editor.history.undo_name, "every edit can be undone"

    def operation(self):
        choose, tree = self.rng.choice, self.editor.simulation.context.objects
        own = [one.name for one in self.editor.simulation.scene.entries.values()]
        one, other = choose(own or ["Drone"]), choose([*own, "Drone", "Quadricopter_base"])
        place = [round(self.rng.uniform(-4, 4), 1) for _ in range(2)] + [round(self.rng.uniform(0.5, 3), 2)]
        kind = choose([*KINDS.values()])
        operations = [
            {"do": "add", "objects": [{"name": choose(["A", "B"]), **kind}], "position": place},
            {
                "do": "move",
                "object": choose([one, "Drone"]),
                "position": place,
                "rpy": [0, 0, round(self.rng.uniform(-3, 3), 2)],
            },
            {"do": "move", "object": one, "position": place, "relative_to": "parent"},
            {"do": "rename", "object": one, "name": choose(["C", "D", "E"])},
            {"do": "reparent", "objects": [one], "parent": choose([other, -1]), "keep": choose(["pose", "relative"])},
            {
                "do": "set",
                "object": one,
                "values": choose([{"mass": 2}, {"color": [1, 0, 0]}, {"alias": "x"}, {"size": [0.3]}]),
            },
            {"do": "set", "object": "Floor", "values": {"size": self.rng.randint(8, 12)}},
            {"do": "copy", "objects": [one], "counts": [2, 1, 1], "steps": [0, 0.5, 0]},
            {"do": "scale", "objects": [one], "factors": [1.5, 1.5, 1.5]},
            {"do": "remove", "objects": [one]}
            if len(own) > 12 or self.rng.random() < 0.3
            else {"do": "detach_script", "object": one},
            {"do": "group", "objects": [one], "name": "Model"},
            self.vehicle_operation(place),
        ]
        return choose([entry for entry in operations if tree is not None])

    def vehicle_operation(self, place):
        choose = self.rng.choice
        others = [one.object_name for one in self.editor.simulation.vehicles.values()][1:]
        if not others:
            return {"do": "add_vehicle", "name": choose(["guest", "visitor"]), "position": place}
        one = choose(others)
        return choose(
            [
                {"do": "move", "object": one, "position": place, "rpy": [0, 0, 0.5]},
                {"do": "set", "object": one, "values": {"cameras": {"front": {"width": choose([160, 320])}}}},
                {"do": "rename", "object": one, "name": choose(["third", "fourth"])},
                {"do": "remove", "objects": [one]},
            ]
        )


def assert_agree(editor, folder):
    """Assert that the tree, the bodies and the saved file agree."""
    simulation = editor.simulation
    scene = simulation.scene
    simulation.context.carried.follow()
    assert {one.name for one in scene.entries.values()} == {one.name for one in scene.objects.values()}
    for index, one in scene.objects.items():
        entry = scene.records[index].present
        assert (one.parent.name if one.parent else "") == entry.parent
        number = getattr(one, "number", None)
        if number is not None and one.link == -1:
            assert np.allclose(simulation.world.state(number).matrix, one.matrix(), atol=1e-6), one.name
    file = folder / "saved.yaml"
    editor.answer({"save": str(file)})
    reloaded = editor_of({"scene_file": str(file)})
    difference = change_between(by_name(editor), by_name(reloaded))
    assert not difference.entries, difference.entries
    assert not difference.scripts
    assert sizes(simulation) == sizes(reloaded.simulation)  # removed objects leave nothing behind
    assert set(simulation.vehicles) == set(reloaded.simulation.vehicles)
    pictures = [seen_by_camera(one.simulation) for one in (editor, reloaded)]
    assert pictures[0] is None or np.abs(pictures[0].astype(int) - pictures[1]).mean() < 0.5
    reloaded.simulation.close()


def by_name(editor):
    content = editor.simulation.content()
    rounded = {one.name: rounded_entry(one) for one in content.entries.values()}
    return content._replace(entries=rounded, settings={})


def rounded_entry(entry):
    values = entry.model_dump(mode="json")
    for key in ("position", "rpy"):
        values[key] = [round(one, 5) + 0.0 for one in values[key]]
    return values


@contextlib.contextmanager
def rviz_check(simulation):
    """Yield a function that asserts that rviz shows the scene; without ROS it does nothing."""
    if find_spec("visualization_msgs") is None:
        yield lambda: None
        return
    from shown_markers import rviz_of

    with rviz_of(simulation) as (rviz, update):

        def look():
            simulation.context.carried.follow()  # as the node does before each update
            update()
            rviz.assert_agrees(simulation)

        yield look


def seen_by_camera(simulation):
    for vehicle in simulation.vehicles.values():
        for camera in vehicle.cameras.values():
            return camera.look()
    return None


@settings(max_examples=1)
@given(st.integers(0, 2**32))
def test_representations_agree_after_random_edits_in_flight_and_stop_undoes_them(tmp_path_factory, seed):
    folder = Path(tmp_path_factory.mktemp("edits"))
    editor = editor_of({"scene": SCENE, "drone": {"position": [0.0, 0.0, 2.0]}})
    simulation = editor.simulation
    initial_sizes, before, text = sizes(simulation), state(simulation), text_of(editor)
    edits = RandomEdits(editor, seed)
    simulation.start()
    for number in range(EDITS):
        edits.step()
        if number % 10 == 9:
            simulation.step()
            assert_agree(editor, folder)
    simulation.stop()
    editor.follow()
    assert_same(state(simulation), before)
    assert (sizes(simulation), text_of(editor)) == (initial_sizes, text)
    simulation.close()


@settings(max_examples=1)
@given(st.integers(0, 2**32))
def test_representations_agree_after_random_edits_and_undo_leaves_nothing(tmp_path_factory, seed):
    folder = Path(tmp_path_factory.mktemp("edits"))
    editor = editor_of({"scene": SCENE, "drone": {"position": [0.0, 0.0, 2.0]}})
    initial_sizes, before = sizes(editor.simulation), state(editor.simulation)
    edits = RandomEdits(editor, seed)
    with rviz_check(editor.simulation) as look:
        for number in range(EDITS):
            edits.step()
            look()
            if number % 10 == 9:
                assert_agree(editor, folder)
        while EDITS <= 100 and editor.history.undo_name:
            editor.answer({"undo": True})
            look()
    if EDITS <= 100:
        assert_same(state(editor.simulation), before)
        assert sizes(editor.simulation) == initial_sizes
    editor.simulation.close()


def used_resources():
    """Return resident memory (bytes), and the numbers of open files and of OpenGL's objects."""
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        resident = int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    opengl_objects = sum(isinstance(one, OPENGL) for one in gc.get_objects())
    return resident, len(os.listdir("/proc/self/fd")), opengl_objects


def test_undone_edits_leak_no_memory_files_or_opengl_objects():
    editor = editor_of({"scene": SCENE, "drone": {"position": [0.0, 0.0, 2.0]}})
    measured = []
    for _ in range(6):
        edits = RandomEdits(editor, 7)
        for _ in range(25):
            edits.step()
            seen_by_camera(editor.simulation)
        while editor.history.undo_name:
            editor.answer({"undo": True})
        seen_by_camera(editor.simulation)
        measured.append(used_resources())
    caches, *measured = measured  # the first round fills caches
    assert {opengl_objects for _, _, opengl_objects in measured} == {caches[2]}
    # A leak grows in every round; other memory, of earlier tests, may change once.
    assert min(after[0] - before[0] for before, after in pairwise(measured)) < MEMORY_LIMIT
    assert measured[-1][1] - caches[1] <= 1
    editor.simulation.close()
