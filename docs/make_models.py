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
from drone_sim.ros.cockpit.editor.lists import PICTURES, ModelList
from drone_sim.run.parameters import load
from drone_sim.run.player import Player
from drone_sim.run.simulation import Simulation

ROOT = Path(__file__).resolve().parents[1]
MODELS = ROOT / "config/models"
TAG, CORNERS = 7, 24
WIDTH, HEIGHT, FOV = 96, 72, 0.7  # px, px, rad
SEEN_FROM = (-0.75, -0.55, 0.45)
_DARK, _ORANGE = [0.2, 0.22, 0.25], [0.95, 0.55, 0.1]


def bar(axis, size=0.3):
    """Return a bar along x, y or z in red, green or blue."""
    sides, place, color = [size / 20] * 3, [0.0, 0.0, 0.02], [0.1, 0.1, 0.1]
    sides[axis], place[axis], color[axis] = size, place[axis] + size / 2, 0.9
    return {"shape": "box", "size": sides, "position": place, "color": color}


CAMERA = [
    {"shape": "box", "size": [0.2, 0.14, 0.14], "position": [0, 0, 0.1], "color": _DARK},
    {"shape": "cylinder", "size": [0.05, 0.1], "position": [-0.14, 0, 0.1], "rpy": [0, 1.5708, 0]},
]
SYMBOLS = {  # of what no camera sees
    "Dummy": [bar(0), bar(1), bar(2)],
    "Camera": CAMERA,
    "VisionSensor": [{**CAMERA[0], "color": [0.15, 0.35, 0.8]}, CAMERA[1]],
    "ProximitySensor": [
        {"shape": "mesh", "file": str(MODELS / "cone.obj"), "size": [0.3, 0.3, 0.4], "color": [*_ORANGE, 0.6]},
        {"shape": "sphere", "size": [0.04], "position": [0, 0, 0.4], "color": _DARK},
    ],
    "Joint": [
        {"shape": "cylinder", "size": [0.05, 0.2], "position": [0, 0, 0.1], "color": _ORANGE},
        {"shape": "box", "size": [0.3, 0.04, 0.04], "position": [-0.15, 0, 0.15], "color": _DARK},
    ],
}


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
    """Return the picture (HEIGHT, WIDTH, 3) uint8 of what an operation adds; what no camera sees, as a symbol."""
    simulation = Simulation(load({"samples": 4}), started=False)
    editor = SceneEditor(Player(simulation, lambda state: None, False))
    editor.answer({"new": True})
    (first, *_) = editor.answer({"edit": [{**operation, "position": [0, 0, 0]}]})["handles"]
    symbol = [{"name": "Part", **one} for one in SYMBOLS.get(simulation.context.objects[first].name, [])]
    for part in symbol:
        editor.answer({"edit": [{"do": "add", "objects": [part]}]})
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
