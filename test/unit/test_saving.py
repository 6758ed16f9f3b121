"""Saved scenes: nothing is lost, and the file can be loaded."""

import os

import cv2
import numpy as np
import pytest
import trimesh
import yaml

from drone_sim.files.resources import package_path
from drone_sim.mechanics import frames
from drone_sim.mechanics.state import Pose
from drone_sim.run import parameters
from drone_sim.run.parameters import ParameterError

SCENE = """
floor: {size: 20, texture: pictures/tile.png}
drone: {position: [0, 0, 1], yaw: 0.5, urdf: package://drone_sim/urdf/drone.urdf}
objects:
  - {name: Å, shape: mesh, file: ball.stl, position: [3, 0, 1], texture: ABSOLUTE}
  - {shape: box, size: [1, 1, 1], position: [5, 0, 1], texture: package://drone_sim/urdf/floor.png}
"""


@pytest.fixture(name="scene")
def _scene(tmp_path):
    (tmp_path / "pictures").mkdir()
    cv2.imwrite(str(tmp_path / "pictures" / "tile.png"), np.zeros((2, 2, 3), np.uint8))
    trimesh.creation.icosphere(subdivisions=1).export(str(tmp_path / "ball.stl"))
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.replace("ABSOLUTE", str(tmp_path / "pictures" / "tile.png")), encoding="utf-8")
    return path


@pytest.fixture(name="simulation")
def _simulation(scene, new_simulation):
    return new_simulation({"scene_file": str(scene)})


def files(path):
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    first, second = content["objects"]
    return [content["floor"]["texture"], first["file"], first["texture"], second["texture"], content["drone"]["urdf"]]


def test_file_names_are_saved_as_written(simulation, scene):
    before = files(scene)
    simulation.save_scene(scene)
    assert files(scene) == before
    assert yaml.safe_load(scene.read_text(encoding="utf-8"))["objects"][0]["name"] == "Å"


def test_saving_keeps_the_authors_text_and_backs_up_another_file(simulation, scene):
    simulation.save_scene(scene)
    assert scene.read_text(encoding="utf-8") == SCENE.replace("ABSOLUTE", str(scene.parent / "pictures" / "tile.png"))
    other = scene.with_name("other.yaml")
    other.write_text("objects: []  # mine\n", encoding="utf-8")
    simulation.save_scene(other)
    assert (scene.parent / "other.yaml.bak").read_text(encoding="utf-8") == "objects: []  # mine\n"
    assert other.read_bytes() == scene.read_bytes()
    assert not scene.with_name("scene.yaml.bak").exists()


def test_a_removed_parent_and_a_zero_rotation_are_saved(tmp_path, new_simulation):
    above = {"name": "Above", "kind": "dummy", "position": [0, 0, 1]}
    below = {"name": "Below", "kind": "dummy", "position": [0, 0, 1], "rpy": [0, 0, 1], "parent": "Above"}
    simulation = new_simulation({"scene": {"objects": [above, below]}})
    one = simulation.scene.things()["Below"]
    one.parent = None
    one.put(frames.from_rpy((1, 2, 3), (0, 0, 0)))
    simulation.save_scene(tmp_path / "saved.yaml")
    reloaded = parameters.load({"scene_file": str(tmp_path / "saved.yaml")}).scene.objects[1]
    assert (reloaded.parent, reloaded.position, reloaded.rpy) == ("", (1, 2, 3), (0, 0, 0))


def test_a_scene_saved_in_another_folder_still_finds_its_files(simulation, scene, tmp_path):
    other_path = tmp_path / "there" / "scene.yaml"
    simulation.save_scene(other_path)
    texture, ball, *others = files(other_path)
    assert (texture, ball) == (str(tmp_path / "pictures" / "tile.png"), str(tmp_path / "ball.stl"))
    assert others == files(scene)[2:]
    assert parameters.load({"scene_file": str(other_path)}).scene == parameters.load({"scene_file": str(scene)}).scene


def test_file_names_given_without_a_scene_file_are_saved_absolute(tmp_path, monkeypatch, scene, new_simulation):
    monkeypatch.chdir(tmp_path)
    ball = {"shape": "mesh", "file": "ball.stl", "position": [3, 0, 1]}
    simulation = new_simulation({"scene": {"objects": [ball]}})
    simulation.save_scene(tmp_path / "there" / "scene.yaml")
    monkeypatch.chdir("/")
    (reloaded,) = parameters.load({"scene_file": str(tmp_path / "there" / "scene.yaml")}).scene.objects
    assert reloaded.file == str(tmp_path / "ball.stl")


@pytest.mark.parametrize("yaw", [0.0, 1.0, -3.0])
def test_the_heading_of_a_tilted_drone_is_saved_as_yaw(simulation, scene, yaw):
    leaning = frames.from_rpy((0, 0, 2), (0.7, -0.6, yaw))
    simulation.drone.body.move(Pose((0, 0, 2), frames.to_quaternion(leaning)))
    simulation.save_scene(scene)
    assert parameters.load({"scene_file": str(scene)}).drone.yaw == pytest.approx(yaw)


def test_a_scene_that_could_not_be_loaded_is_not_saved(simulation, scene):
    before = scene.read_text(encoding="utf-8")
    simulation.drone.body.move(Pose((0, 0, -0.5)))
    with pytest.raises(ParameterError, match=r"cannot be saved: .*drone/position/2 = -0\.5") as refused:
        simulation.save_scene(scene)
    assert "\n" not in str(refused.value)
    assert scene.read_text(encoding="utf-8") == before


def test_a_full_disk_leaves_the_previous_scene_unchanged(simulation, scene, monkeypatch):
    before = scene.read_text(encoding="utf-8")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"scene\.yaml(\.bak)?: No space left on device"):
        simulation.save_scene(scene)
    assert scene.read_text(encoding="utf-8") == before
    assert sorted(os.listdir(scene.parent)) == ["ball.stl", "pictures", "scene.yaml"]


@pytest.mark.parametrize(
    "path", sorted((package_path() / "config" / "scenes").glob("*.yaml")), ids=lambda one: one.stem
)
@pytest.mark.parametrize("started", [False, True])
def test_a_shipped_scene_is_saved_as_it_was_written(path, started, tmp_path, new_simulation):
    simulation = new_simulation({"scene_file": str(path)}, started=started)
    simulation.save_scene(tmp_path / path.name)
    assert (tmp_path / path.name).read_bytes() == path.read_bytes()
