"""Cameras and sensors of a vehicle in the scene editor: their keys and values, and the scene text after a change."""

import pytest
import yaml
from living import edit, editor_of, text_of

from drone_sim.editing.properties import properties
from drone_sim.editing.rows import SceneRows

SENSORS = "package://drone_sim/config/sensors.yaml"
FRONT, IMU = "FrontVision", "imu"


@pytest.fixture(name="editor")
def _editor():
    scene_editor = editor_of({"config": SENSORS})
    yield scene_editor
    scene_editor.simulation.close()


def row(editor, name):
    rows, _ = SceneRows(editor.simulation).follow()
    return next(entry for entry in rows if entry["name"] == name)


def change(editor, name, **values):
    return edit(editor, {"do": "set", "object": name, "values": values})


def parsed_text(editor):
    return yaml.safe_load(text_of(editor))


def keys(editor, name):
    return {entry["key"]: entry for entry in properties()[row(editor, name)["type"]]}


def test_camera_has_keys_with_limits_and_current_values(editor):
    known, now = keys(editor, FRONT), row(editor, FRONT)["values"]
    width = {key: known["width"][key] for key in ("kind", "whole", "least", "most", "unit")}
    assert width == {"kind": "number", "whole": True, "least": 1, "most": 4096, "unit": "px"}
    assert known["kind"]["choices"] == ["color", "depth"]
    assert known["lens.coefficients"]["kind"] == "list"
    assert {"horizontal_fov", "near", "far", "noise.read", "exposure.time", "lens.model", "mount"} <= {*known}
    assert (now["width"], now["height"], now["noise.read"]) == (640, 480, 0)


def test_sensors_have_keys_with_units_and_current_values(editor):
    for name in editor.simulation.drone.parameters.sensors:
        known, now = keys(editor, name), row(editor, name)["values"]
        assert known["rate"]["unit"] == "Hz"
        assert {*known} <= {*now}, "every key has a value"
        assert "object" not in known, "the object is the name of the row"


def test_floor_and_vehicle_show_their_default_values(editor):
    floor, drone = row(editor, "Floor")["values"], row(editor, "Drone")["values"]
    assert floor == {"size": 10, "texture": "package://drone_sim/urdf/floor.png", "edge": False}
    assert (drone["type"], drone["start"]) == ("quadricopter", "flying")
    assert drone["urdf"] == "package://drone_sim/urdf/drone.urdf"
    change(editor, "Floor", size=12)
    assert row(editor, "Floor")["values"]["size"] == 12


def test_change_is_one_undo_step_and_only_changed_keys_are_written(editor):
    before = text_of(editor)
    change(editor, FRONT, width=320, far=100.0)
    camera = editor.simulation.drone.parameters.cameras["front"]
    assert (camera.width, camera.height, camera.far) == (320, 480, 100)
    assert parsed_text(editor)["vehicles"]["drone"]["cameras"] == {"front": {"width": 320}}
    assert editor.simulation.drone.parameters.is_alone, "the names of its frames are unchanged"
    assert row(editor, FRONT)["values"]["width"] == 320
    change(editor, FRONT, width=640)
    assert "cameras" not in parsed_text(editor)["vehicles"]["drone"], "a default value is not written"
    editor.answer({"undo": True})
    editor.answer({"undo": True})
    assert text_of(editor) == before
    editor.answer({"redo": True})
    assert editor.simulation.drone.parameters.cameras["front"].width == 320


def test_nested_keys_are_written_as_nested_mappings(editor):
    change(editor, IMU, rate=100, **{"noise.angular_velocity.density": 0.001})
    change(editor, FRONT, noise={"full_well": 5000})
    drone = parsed_text(editor)["vehicles"]["drone"]
    assert drone["sensors"] == {IMU: {"rate": 100, "noise": {"angular_velocity": {"density": 0.001}}}}
    assert drone["cameras"] == {"front": {"noise": {"full_well": 5000}}}
    change(editor, IMU, **{"noise.angular_velocity.density": None})
    assert parsed_text(editor)["vehicles"]["drone"]["sensors"] == {IMU: {"rate": 100}}


def test_removing_the_lens_model_removes_the_lens(editor):
    change(editor, FRONT, **{"lens.model": "plumb_bob", "lens.coefficients": [-0.1, 0.01, 0, 0, 0]})
    assert editor.simulation.drone.parameters.cameras["front"].lens.coefficients == (-0.1, 0.01, 0, 0, 0)
    change(editor, FRONT, **{"lens.model": None})
    assert editor.simulation.drone.parameters.cameras["front"].lens is None
    assert "cameras" not in parsed_text(editor)["vehicles"]["drone"]


def test_camera_defined_only_in_the_scene_keeps_its_required_keys(editor):
    rear = {"object": "Rear", "topic": "rear/image", "kind": "color", "frame": "rear_optical", "every": 1}
    view = {"width": 64, "height": 48, "horizontal_fov": 1.0, "near": 0.1, "far": 10.0}
    mount = {"position": [-0.1, 0, 0], "rpy": [0, 0, 3.14]}
    change(editor, "Drone", cameras={"rear": {**rear, **view, "mount": mount}})
    change(editor, "Rear", width=32)
    assert parsed_text(editor)["vehicles"]["drone"]["cameras"]["rear"] == {**rear, **view, "width": 32, "mount": mount}
    with pytest.raises(ValueError, match="far"):
        change(editor, "Rear", far=None)


def test_renaming_a_camera_changes_its_object_name(editor):
    (handle,) = edit(editor, {"do": "rename", "object": FRONT, "name": "Eye"})["handles"]
    assert editor.simulation.context.objects[handle].name == "Eye"
    assert parsed_text(editor)["vehicles"]["drone"]["cameras"] == {"front": {"object": "Eye"}}


@pytest.mark.parametrize(
    ("name", "values", "named"),
    [
        (FRONT, {"width": 0}, "cameras/front/width = 0: .*1"),
        (FRONT, {"near": 200}, "cameras/front/near = 200.*far = 100"),
        (FRONT, {"wide": 3}, "cameras/front/wide: unknown key"),
        (FRONT, {"lens.coefficients": [1.0]}, "lens/model"),
        (IMU, {"rate": 300}, "sensors/imu/rate = 300.*whole multiple of sub_step"),
        (IMU, {"noise.orientation.density": -1}, "noise/orientation/density = -1"),
    ],
)
def test_invalid_value_is_refused_in_one_line_and_changes_nothing(editor, name, values, named):
    before = text_of(editor)
    with pytest.raises(ValueError, match=named) as caught:
        change(editor, name, **values)
    assert "\n" not in str(caught.value)
    assert text_of(editor) == before


@pytest.mark.parametrize("name", [FRONT, IMU])
def test_mounted_part_cannot_be_moved_in_the_editor(editor, name):
    with pytest.raises(ValueError, match="mount"):
        edit(editor, {"do": "move", "object": name, "position": [0, 0, 1]})
