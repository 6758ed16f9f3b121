"""What a camera saw, with the truth behind it, as files: PNG, NPZ, and annotations as COCO has them.

color/000000.png      the picture
instances/000000.png  16 bits: for each pixel the number of the object, 0 is nobody
truth/000000.npz      arrays: depth, normals, flow, flow_known, as docs/sensors.md has them
annotations.json      COCO's detection format: images, categories, and a box and a mask for each object in sight
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drone_sim.files import writing
from drone_sim.run.simulation import Simulation
from drone_sim.sensors.truth import described

_FOLDERS = ("color", "instances", "truth")
_ANNOTATIONS = "annotations.json"


class Dataset:
    """A folder of pictures with their truth; made by `writing_to`."""

    def __init__(self, folder: str, title: str):
        """Write into `folder`, which has the folders for it; `title` is for people."""
        self._folder, self._title = Path(folder), title
        self._images: list[dict[str, Any]] = []
        self._categories: dict[str, int] = {}
        self._annotations: list[dict[str, Any]] = []

    def add(
        self,
        time: float,
        picture: np.ndarray,
        mask: np.ndarray,
        objects: Sequence[Mapping[str, Any]],
        arrays: Mapping[str, np.ndarray],
    ) -> None:
        """Add a picture, BGR (height, width, 3), of a `time` (s), with what is true of it. Raises OSError.

        mask: (height, width) uint16, numbers of objects. objects: as sensors.truth.described has them.
        """
        number = len(self._images)
        height, width = mask.shape
        name = f"{number:06}"
        _write_png(self._folder / "color" / f"{name}.png", picture)
        _write_png(self._folder / "instances" / f"{name}.png", mask)
        path = self._folder / "truth" / f"{name}.npz"
        with writing.naming(path):
            np.savez_compressed(path, **arrays)  # type: ignore[arg-type]
        file = f"color/{name}.png"
        self._images.append({"id": number, "file_name": file, "width": width, "height": height, "time": round(time, 6)})
        for one in objects:
            self._annotations.append(self._annotation(number, mask, one))

    def _annotation(self, image: int, mask: np.ndarray, one: Mapping[str, Any]) -> dict[str, Any]:
        left, top, right, bottom = one["visible"]
        category = self._categories.setdefault(one["category"], len(self._categories) + 1)
        beside = ("number", "name", "full", "occlusion", "truncation", "position", "orientation", "size")
        return {
            "id": len(self._annotations) + 1, "image_id": image, "category_id": category, "iscrowd": 0,
            "bbox": [left + 0.5, top + 0.5, right - left, bottom - top],  # where the first pixel's border is 0
            "area": one["pixels"], "segmentation": run_lengths(mask == one["number"]),
            **{key: one[key] for key in beside},
        }  # fmt: skip

    def finish(self) -> None:
        """Write the annotations. Raises OSError."""
        content = {
            "info": {"description": self._title},
            "images": self._images,
            "categories": [{"id": number, "name": name} for name, number in self._categories.items()],
            "annotations": self._annotations,
        }
        writing.write(self._folder / _ANNOTATIONS, json.dumps(content))

    def __str__(self) -> str:
        """Return what it is, in words."""
        return f"{len(self._images)} pictures, {len(self._annotations)} annotations"


def run_lengths(mask: np.ndarray) -> dict[str, Any]:
    """Return a mask (height, width) bool as COCO has it: how many pixels are out, in, out ... down column by column."""
    pixels = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(pixels[1:] != pixels[:-1])
    counts = np.diff([0, *changes, mask.size])
    return {"size": list(mask.shape), "counts": counts.tolist()}


def check(folder: str) -> None:
    """Raise OSError, in one line, where `folder` cannot become a dataset: it must be empty, or not be there."""
    with writing.naming(folder):
        if os.path.lexists(folder):
            what = "is a file" if not os.path.isdir(folder) else "is not empty" if os.listdir(folder) else ""
            if what:
                raise OSError(0, f"{what}: a dataset must be written to a new or empty folder")
        elif not os.path.isdir(os.path.dirname(os.path.abspath(folder))):
            raise OSError(0, f"no such folder: {os.path.dirname(os.path.abspath(folder))}")


@contextlib.contextmanager
def writing_to(folder: str, title: str) -> Iterator[Dataset]:
    """Give a dataset to write; its annotations are written in any case, at the end. Raises OSError."""
    check(folder)
    with writing.naming(folder):
        for one in _FOLDERS:
            os.makedirs(os.path.join(folder, one))
    made = Dataset(folder, title)
    try:
        yield made
    finally:
        made.finish()


def _write_png(path: Path, picture: np.ndarray) -> None:
    with writing.naming(path):
        path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


# ---- of a flight without ROS


class TruthRecorder:
    """Adds a picture to a dataset whenever the camera has taken one."""

    def __init__(self, dataset: Dataset, simulation: Simulation, vehicle: str, camera: str):
        """Let a `camera` of a `vehicle` of a `simulation` take pictures, for a `dataset`."""
        self._dataset = dataset
        self._camera = simulation.vehicles[vehicle].cameras[camera]
        self._camera.viewers.add(lambda: True)
        self._depth_before: np.ndarray | None = None

    def add(self, simulation: Simulation) -> None:
        """Take what the camera has seen in the last step, if it was its turn. Raises OSError."""
        truth = self._camera.truth() if self._camera.image is not None else None
        if truth is None:
            return
        truth.want(["depth", "instance", "normal", "before"])
        depth = truth.output("depth")
        flow, known = truth.flow(depth if self._depth_before is None else self._depth_before)
        known &= self._depth_before is not None  # there is no picture before the first
        self._depth_before = depth
        arrays = {"depth": depth, "normals": truth.output("normal"), "flow": flow, "flow_known": known}
        picture = cv2.cvtColor(self._camera.look("color"), cv2.COLOR_RGB2BGR)
        self._dataset.add(simulation.time, picture, truth.output("instance"), described(truth.seen()), arrays)

    def __str__(self) -> str:
        """Return what it has become, in words."""
        return str(self._dataset)


@contextlib.contextmanager
def recording_to(folder: str, simulation: Simulation, vehicle: str, camera: str) -> Iterator[TruthRecorder]:
    """Give the dataset of a flight. Raises OSError."""
    with writing_to(folder, f"{vehicle}, {camera}") as made:
        yield TruthRecorder(made, simulation, vehicle, camera)
