"""A scene's editor for tests, and what they look at."""

import numpy as np
from living import picture

from drone_sim.editing.editor import SceneEditor
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation


def editor_of(given=None, drafts=None):
    """Return the editor of a scene that is stopped."""
    simulation = Simulation(parameters.load(given), started=False)
    return SceneEditor(Player(simulation, simulation.step, lambda state: None, False), drafts)


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
