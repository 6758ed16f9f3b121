"""Boards with a text on them."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np

from drone_sim.config.types import named_in
from drone_sim.editing.records import AddSign
from drone_sim.editing.scene_access import SceneAccess
from drone_sim.files import writing
from drone_sim.mechanics import frames
from drone_sim.scene.entry import placed
from drone_sim.scene.scene_parameters import entry_from

_ROWS, _MARGIN = 64, 12  # px
_HEIGHT, _FOOT, _THIN = 0.4, 1.0, 0.02  # m: of the board, and of its lower edge above the floor
_POST = {"shape": "cylinder", "size": [0.02, _FOOT], "color": [0.3, 0.3, 0.32, 1.0]}


def add(scene: SceneAccess, said: AddSign) -> list[int]:
    """Add a board that stands on a post, seen from where x is negative; its texture is written beside the scene.

    Raises ValueError and OSError.
    """
    drawn = _drawn(said.text)
    file = _written(scene.folder, said.text, drawn)
    width = _HEIGHT * drawn.shape[1] / drawn.shape[0]
    operations = scene.operations
    name = operations.free_name("Sign")
    board = {"name": name, "model": True, "shape": "box", "size": [width, _THIN, _HEIGHT], "texture": file}
    post = {"name": operations.free_name("SignPost"), "parent": name, **_POST}
    at = frames.from_rpy(said.position, (0.0, 0.0, said.yaw - np.pi / 2))
    above = frames.from_rpy((0.0, 0.0, _FOOT + _HEIGHT / 2), (0.0, 0.0, 0.0))
    below = [0.0, 0.0, -(_FOOT + _HEIGHT) / 2]
    return operations.add([placed(entry_from(board), "", frames.multiply(at, above)), {**post, "position": below}])


def _drawn(text: str) -> np.ndarray:
    """Return dark letters on white, (rows, columns, 3)."""
    font, scale, thick = cv2.FONT_HERSHEY_SIMPLEX, 1.4, 3
    (width, height), _ = cv2.getTextSize(text, font, scale, thick)
    board = np.full((_ROWS, max(width + 2 * _MARGIN, _ROWS), 3), 255, np.uint8)
    place = (board.shape[1] - width) // 2, (_ROWS + height) // 2
    cv2.putText(board, text, place, font, scale, (40, 30, 30), thick, cv2.LINE_AA)
    return board


def _written(folder: Path, text: str, drawn: np.ndarray) -> str:
    """Write the texture, unless it is there; return its name."""
    stem = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_").lower() or "text"
    path = folder / f"sign_{stem}.png"
    content = cv2.imencode(".png", drawn)[1].tobytes()
    if not path.exists() or path.read_bytes() != content:
        folder.mkdir(parents=True, exist_ok=True)
        with writing.replacing(path, binary=True) as file:
            file.write(content)
    return named_in(folder, path.name)
