"""simVision, and scripts of vision sensors that process every image (sysCall_vision)."""

import math

import pytest
from pytest import approx

# A camera that looks down from 2 m at a red box, which is off the centre of the image.
OBJECTS = [
    {"name": "Eye", "kind": "vision_sensor", "position": [50, 0, 2], "rpy": [math.pi, 0, 0],
     "width": 256, "height": 256, "fov": math.pi / 2, "near": 0.1, "far": 4.0},
    {"name": "Red", "shape": "box", "size": [0.4, 0.2, 0.02], "position": [50.5, 0, 0], "color": [1, 0, 0],
     "static": True},
]  # fmt: skip
FILTER = """
{require}
function sysCall_vision(seen)
  assert(seen.handle == sim.getObject('.') and seen.resolution[1] == 256 and seen.perspectiveOperation)
  simVision.sensorImgToWorkImg(seen.handle)
  simVision.selectiveColorOnWorkImg(seen.handle, {{0, 1, 0.5}}, {{0.1, 0.9, 0.4}}, false, true, false)
  local trigger, packet = simVision.blobDetectionOnWorkImg(seen.handle, 0.1, 0.001, false)
  return {{trigger = true, packedPackets = {{packet}}}}
end
"""
PYTHON = """
def sysCall_vision(seen):
    simVision.sensorImgToWorkImg(seen["handle"])
    simVision.selectiveColorOnWorkImg(seen["handle"], [0, 1, 0.5], [0.1, 0.9, 0.4], False, True, False)
    trigger, packet = simVision.blobDetectionOnWorkImg(seen["handle"], 0.1, 0.001, False)
    return {"trigger": True, "packedPackets": [packet]}
"""
READ = """
function sysCall_sensing()
  local trigger, _, blobs = sim.readVisionSensor(sim.getObject('/Eye'))
  if blobs then sim.setStringSignal('blobs', sim.packTable({trigger, blobs})) end
end
"""


@pytest.fixture(name="simulate")
def _simulate(tmp_path, new_simulation):
    def simulate(text, steps=2):
        path, own = tmp_path / f"eye.{'py' if 'def ' in text else 'lua'}", tmp_path / "own.lua"
        path.write_text(text, encoding="utf-8")
        own.write_text(READ, encoding="utf-8")
        scene = {"objects": OBJECTS, "scripts": [{"object": "Eye", "script": str(path)}]}
        simulation = new_simulation({"scene": scene}, script=str(own))
        for _ in range(steps):
            simulation.step()
        return simulation

    return simulate


@pytest.mark.parametrize(
    "text",
    [FILTER.format(require=""), FILTER.format(require="simVision = require 'simVision'"), PYTHON],
    ids=["Lua", "required", "Python"],
)
def test_blob_detection_returns_position_and_size_of_a_blob(simulate, text):
    simulation = simulate(text)
    eye = simulation.context.objects[simulation.context.objects.handle("Eye")]
    trigger, (packet,) = eye.detected
    assert trigger
    count, size, share, turn, x, y, wide, high = memoryview(packet).cast("f")
    assert (count, size) == (1, 6)
    pixel = 1 / 256
    distance = 2.0 - 0.01  # m, to the upper side of the box; the image is 2 · distance wide there
    assert share == approx(0.08 / (2 * distance) ** 2, rel=0.06)
    assert turn == approx(0, abs=0.02)
    assert abs(x - 0.5) == approx(0.5 / (2 * distance), abs=pixel)
    assert y == approx(0.5, abs=pixel)
    assert (wide, high) == (approx(0.4 / (2 * distance), abs=2 * pixel), approx(0.2 / (2 * distance), abs=2 * pixel))
    assert simulation.context.signals.get(str, "blobs")


def test_depths_are_converted_to_points(simulate):
    text = """
function sysCall_vision(seen)
  simVision.sensorDepthMapToWorkImg(seen.handle)
  local _, packet = simVision.coordinatesFromWorkImg(seen.handle + sim.handleflag_abscoords, {3, 3}, true)
  return {trigger = false, packedPackets = {packet}}
end"""
    simulation = simulate(text)
    eye = simulation.context.objects[simulation.context.objects.handle("Eye")]
    columns, rows, *points = memoryview(eye.detected.packets[0]).cast("f")
    assert (columns, rows) == (3, 3)
    vectors = [points[index : index + 4] for index in range(0, 36, 4)]
    assert vectors[4] == approx([50, 0, 0, 2], abs=0.01)  # the middle point is straight below
    assert sorted(round(x - 50) for x, _, _, _ in vectors) == [-2, -2, -2, 0, 0, 0, 2, 2, 2]
    assert all(z == approx(0, abs=0.02) for _, _, z, _ in vectors)
    assert vectors[0][3] == approx(math.sqrt(12), rel=0.01)


def test_changed_pixels_compare_with_the_last_image_also_after_a_snapshot(simulate):
    text = """
function sysCall_vision(seen)
  local grey = n and n % 3 == 0 and 0.5 or 0.1
  n = (n or 0) + 1
  simVision.uniformImgToWorkImg(seen.handle, {grey, grey, grey})
  local changed = simVision.changedPixelsOnWorkImg(seen.handle, 0.2)
  return {trigger = changed}
end"""
    simulation = simulate(text, 4)
    eye = simulation.context.objects[simulation.context.objects.handle("Eye")]
    assert eye.detected.trigger
    snapshot = simulation.snapshot()
    for _ in range(2):
        seen = []
        for _ in range(4):
            simulation.step()
            seen.append(eye.detected.trigger)
        assert seen == [True, False, True, True]
        simulation.restore(snapshot)


def test_packets_are_restored_by_a_snapshot_and_an_error_is_logged_once(simulate, caplog):
    simulation = simulate("function sysCall_vision(seen) return {packedPackets = {sim.packFloatTable{7}, 3}} end")
    snapshot = simulation.snapshot()
    simulation.step()
    simulation.restore(snapshot)
    eye = simulation.context.objects[simulation.context.objects.handle("Eye")]
    assert [list(memoryview(one).cast("f")) for one in eye.detected.packets] == [[7.0]]
    simulate("function sysCall_vision(seen) simVision.workImgToBuffer1(seen.handle) end", 4)
    errors = [one for one in caplog.messages if "has no work image yet: call sensorImgToWorkImg first" in one]
    assert len(errors) == 1
