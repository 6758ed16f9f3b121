"""Helpers for tests that edit a scene in memory: editors, comparisons of scenes, and counts of all objects."""

import numpy as np
import pybullet

from drone_sim.editing.editor import SceneEditor
from drone_sim.run import parameters
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation


def editor_of(parameter_values=None, drafts=None):
    """Return the editor of a stopped scene."""
    simulation = Simulation(parameters.load(parameter_values), started=False)
    return SceneEditor(Player(simulation, lambda state: None, False), drafts)


def edit(editor, *operations, **more):
    return editor.answer({"edit": list(operations), **more})


def text_of(editor):
    return editor.answer({"text": True})["text"]


def state(simulation):
    """Return the same as `picture`, rounded, with the visuals in an order that does not depend on their creation."""
    objects, looks, poses, visual_poses = picture(simulation)
    return (
        objects,
        np.round(poses, 6) + 0.0,
        sorted((str(look), (np.round(pose, 5) + 0.0).tolist()) for look, pose in zip(looks, visual_poses)),
    )


def assert_same(one, other):
    assert one[0] == other[0]
    np.testing.assert_allclose(one[1], other[1], atol=2e-6)
    assert one[2] == other[2]


def place(editor, name):
    tree = editor.simulation.context.objects
    matrix = tree.matrix(tree.handle(name))
    return [round(matrix[index], 9) for index in (3, 7, 11)]


SCENE = {
    "objects": [
        {"name": "Post", "shape": "box", "size": [0.2, 0.2, 2], "position": [3, 0, 1]},
        {"name": "Hinge", "kind": "joint", "type": "revolute", "parent": "Post", "position": [0, -0.2, 0.9],
         "rpy": [0, 1.5708, 0], "mode": "passive", "value": 0.3},
        {"name": "Rod", "shape": "box", "size": [1, 0.05, 0.05], "parent": "Hinge", "position": [0.5, 0, 0],
         "mass": 0.5},
        {"name": "Ball", "shape": "sphere", "size": [0.2], "position": [5, 0, 2], "mass": 1},
        {"name": "Sign", "shape": "box", "size": [0.1, 0.5, 0.5], "parent": "Ball", "position": [0, 0, 0.5]},
        {"name": "Mark", "kind": "dummy", "parent": "Quadricopter_base", "position": [0, 0, 1]},
        {"shape": "box", "size": [1, 1, 1], "position": [-5, 0, 0.5]},
    ]
}  # fmt: skip
PART = {"shape": "box", "size": [0.1, 0.1, 0.1]}
KINDS = {
    "static": {"shape": "box", "size": [0.2, 0.3, 0.4]},
    "free": {"shape": "cylinder", "size": [0.1, 0.3], "mass": 1.0},
    "compound": {"shape": "compound", "parts": [PART, {**PART, "position": [0.2, 0, 0]}], "mass": 1.0},
    "joint": {"kind": "joint", "type": "revolute", "mode": "passive"},
    "dummy": {"kind": "dummy"},
    "path": {"kind": "path", "points": [[0, 0, 0], [1, 0, 0]]},
    "proximity sensor": {"kind": "proximity_sensor", "type": "ray", "range": 1.0},
    "vision sensor": {"kind": "vision_sensor"},
    "force sensor": {"kind": "force_sensor"},
}


def sizes(simulation):
    """Return the sizes of all collections that must not grow when objects are added and removed again."""
    world, scene, tree = simulation.world, simulation.scene, simulation.context.objects
    counted = (tree, list(tree.names), scene.entries, scene.objects, scene.visuals()[0], simulation.context.names)
    inside = (scene._built, scene._holders, scene.records, scene._carried_bases, world._inertial_frames)
    shared = (simulation.context.carried.shapes, simulation.context.link_names)
    known = (world.joints._inertial, world.collision_filter._frozen, world.collision_filter._permeable)
    return pybullet.getNumBodies(world._client), *(len(list(one)) for one in (*counted, *inside, *shared, *known))


def picture(simulation):
    """Return names, parents and masses of the objects, looks of the visuals, and the poses of both."""
    tree, scene = simulation.context.objects, simulation.scene
    objects = {
        handle: (one.names, one.alias, one.kind, getattr(one.parent, "name", ""), getattr(one, "mass", 0.0))
        for handle, one in ((handle, tree[handle]) for handle in tree)
    }
    visuals, poses = scene.visuals()
    looks = [(visual.shape, visual.rgba) for visual in visuals]
    return objects, looks, np.round([tree[handle].matrix() for handle in tree], 9).tolist(), np.round(poses, 6).tolist()
