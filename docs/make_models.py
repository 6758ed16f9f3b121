"""Make what the models of config/models need, and their pictures for the cockpit.

PYTHONPATH=src .venv/bin/python docs/make_models.py
"""

import math
from pathlib import Path

import cv2
import numpy as np
from make_textures import marker
from take_task_pictures import looking

from drone_sim.editing.editor import SceneEditor
from drone_sim.render.intrinsics import Intrinsics
from drone_sim.ros.cockpit.editor.model_list import PICTURES, ModelList
from drone_sim.run.parameters import load
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "config/models"
TAG, CORNERS = 7, 24
WIDTH, HEIGHT, FOV = 96, 72, 0.7  # px, px, rad
SEEN_FROM = (-0.75, -0.55, 0.45)
SYMBOLS = {"dummy": 0.3, "joint": 0.3, "proximity_sensor": 0.3, "vision_sensor": 0.3, "camera": 0.3}  # m, of a cross


def main():
    """Write meshes, the tag, and every picture."""
    write_mesh("cone", *cone())
    write_mesh("ramp", *ramp())
    cv2.imwrite(str(MODELS / "tag_7.png"), marker(TAG), [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_BILEVEL, 1])
    for group in ModelList(Path("/nowhere")).groups():
        for one in group["models"]:
            path = ROOT / PICTURES / f"{one['model']}.png"
            cv2.imwrite(str(path), picture(one["op"])[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
            print(f"wrote {path.relative_to(ROOT)}, {path.stat().st_size} bytes")


def cone():
    """Return corners and faces (from 1) of a cone of 1 m across and 1 m high."""
    angles = [math.tau * number / CORNERS for number in range(CORNERS)]
    rim = [(0.5 * math.cos(angle), 0.5 * math.sin(angle), 0.0) for angle in angles]
    sides = [(2 + number, 2 + (number + 1) % CORNERS, 1) for number in range(CORNERS)]
    return [(0.0, 0.0, 1.0), *rim], [*sides, tuple(range(CORNERS + 1, 1, -1))]


def ramp():
    """Return corners and faces (from 1) of a wedge of 1 m along x, y and z, which rises along x."""
    corners = [(x, y, z) for x, z in ((-0.5, 0.0), (0.5, 0.0), (0.5, 1.0)) for y in (-0.5, 0.5)]
    return corners, [(1, 2, 4, 3), (3, 4, 6, 5), (1, 5, 6, 2), (1, 3, 5), (2, 6, 4)]


def write_mesh(name, corners, faces):
    """Write a Wavefront file."""
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in corners]
    lines += ["f " + " ".join(map(str, face)) for face in faces]
    (MODELS / f"{name}.obj").write_text("\n".join(lines) + "\n", encoding="utf-8")


def picture(operation):
    """Return the picture (HEIGHT, WIDTH, 3) uint8 of what an operation adds; what no camera sees, as a cross."""
    simulation = Simulation(load({"samples": 4}), started=False)
    editor = SceneEditor(Player(simulation, simulation.step, lambda state: None, False))
    editor.answer({"new": True})
    (first, *_) = editor.answer({"edit": [{**operation, "position": [0, 0, 0]}]})["handles"]
    kind = simulation.context.objects[first].kind
    if kind in SYMBOLS:
        editor.answer({"edit": [{"do": "add", "objects": cross(SYMBOLS[kind])}]})
    for vehicle in simulation.vehicles.values():
        vehicle.propulsion.blades.show()
    low, high = bounds(simulation)
    middle, reach = (low + high) / 2, np.linalg.norm(high - low) / 2
    eye = middle + 1.25 * reach / math.tan(FOV / 2) * np.array(SEEN_FROM) / np.linalg.norm(SEEN_FROM)
    drawn = simulation.vision.picture(
        "color", Intrinsics(WIDTH, HEIGHT, FOV * WIDTH / HEIGHT, 0.01, 50.0), looking(tuple(eye), tuple(middle))
    ).copy()
    simulation.close()
    return drawn


def cross(size):
    """Return three bars, along x, y and z in red, green and blue, for what has no shape."""
    bars = []
    for axis, name in enumerate("xyz"):
        sides, place, color = [size / 20] * 3, [0.0, 0.0, 0.02], [0.1, 0.1, 0.1]
        sides[axis], place[axis], color[axis] = size, place[axis] + size / 2, 0.9
        bars.append({"name": f"bar_{name}", "shape": "box", "size": sides, "position": place, "color": color})
    return bars


def bounds(simulation):
    """Return the lowest and the highest corner (m) of all that is there, the floor aside."""
    corners = []
    pictures = simulation.world.pictures
    for visual, pose in zip(pictures.visuals(), pictures.visual_poses()):
        if visual.floor or visual.ground:
            continue
        for part in visual.shape.triangles():
            corners.append(part.corners.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3])
    points = np.concatenate(corners)
    return points.min(axis=0), points.max(axis=0)


if __name__ == "__main__":
    main()
