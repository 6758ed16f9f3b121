"""Signs: boards with a text, on a post."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from drone_sim.config.types import named_in
from drone_sim.editing.records import AddSign
from drone_sim.files import writing
from drone_sim.mechanics import frames
from drone_sim.run.simulation import Simulation
from drone_sim.scene.entry import placed
from drone_sim.scene.scene_parameters import entry_from

_ROWS, _MARGIN = 64, 12  # px
_HEIGHT, _FOOT, _THICKNESS = 0.4, 1.0, 0.02  # m: board height, lower edge above the floor, board thickness
_POST = {"shape": "cylinder", "size": [0.02, _FOOT], "color": [0.3, 0.3, 0.32, 1.0]}


def add(simulation: Simulation, op: AddSign) -> list[int]:
    """Add a board on a post, legible from negative x; write its texture beside the scene.

    Raises ValueError and OSError.
    """
    image = _draw(op.text)
    file = _write_texture(simulation.document.folder, op.text, image)
    width = _HEIGHT * image.shape[1] / image.shape[0]
    operations = simulation.operations
    name = operations.free_name("Sign")
    board = {"name": name, "model": True, "shape": "box", "size": [width, _THICKNESS, _HEIGHT], "texture": file}
    post = {"name": operations.free_name("SignPost"), "parent": name, **_POST}
    at = frames.from_rpy(op.position, (0.0, 0.0, op.yaw - np.pi / 2))
    above = frames.from_rpy((0.0, 0.0, _FOOT + _HEIGHT / 2), (0.0, 0.0, 0.0))
    below = [0.0, 0.0, -(_FOOT + _HEIGHT) / 2]
    return operations.add([placed(entry_from(board), "", frames.multiply(at, above)), {**post, "position": below}])


def _draw(text: str) -> np.ndarray:
    """Return an image (rows, columns, 3) of dark letters on white."""
    font, scale, thickness = cv2.FONT_HERSHEY_SIMPLEX, 1.4, 3
    (width, height), _ = cv2.getTextSize(text, font, scale, thickness)
    board = np.full((_ROWS, max(width + 2 * _MARGIN, _ROWS), 3), 255, np.uint8)
    place = (board.shape[1] - width) // 2, (_ROWS + height) // 2
    cv2.putText(board, text, place, font, scale, (40, 30, 30), thickness, cv2.LINE_AA)
    return board


def _write_texture(folder: Path, text: str, image: np.ndarray) -> str:
    """Write the texture unless the file has this content; return its name."""
    stem = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower() or "text"
    path = folder / f"sign_{stem}.png"
    content = cv2.imencode(".png", image)[1].tobytes()
    if not path.exists() or path.read_bytes() != content:
        folder.mkdir(parents=True, exist_ok=True)
        with writing.replacing(path, binary=True) as file:
            file.write(content)
    return named_in(folder, path.name)
