"""Dataset of a camera's images with ground truth: PNG, NPZ, and annotations in COCO's format.

color/000000.png      the image
instances/000000.png  16 bits: for each pixel the number of the object, 0 for the background
truth/000000.npz      arrays: depth, normals, flow, flow_known, as in docs/sensors.md
annotations.json      COCO's detection format: images, categories, and a box and a mask for each visible object
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
_COPIED = ("number", "name", "full", "occlusion", "truncation", "position", "orientation", "size")  # keys of an object


class Dataset:
    """A folder of images with ground truth; created by `writing_to`."""

    def __init__(self, folder: str, title: str):
        """Write into `folder`, which must have the subfolders; `title` is a description for people."""
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
        """Add an image, BGR (height, width, 3), taken at `time` (s), with its ground truth. Raises OSError.

        mask: (height, width) uint16, numbers of objects. objects: as returned by sensors.truth.described.
        """
        number = len(self._images)
        height, width = mask.shape
        name = f"{number:06}"
        _write_png(self._folder / "color" / f"{name}.png", picture)
        _write_png(self._folder / "instances" / f"{name}.png", mask)
        path = self._folder / "truth" / f"{name}.npz"
        with writing.name_in_errors(path):
            np.savez_compressed(path, **arrays)  # type: ignore[arg-type]
        file = f"color/{name}.png"
        self._images.append({"id": number, "file_name": file, "width": width, "height": height, "time": round(time, 6)})
        for detection in objects:
            left, top, right, bottom = detection["visible"]
            category = self._categories.setdefault(detection["category"], len(self._categories) + 1)
            self._annotations.append({
                "id": len(self._annotations) + 1, "image_id": number, "category_id": category, "iscrowd": 0,
                "bbox": [left + 0.5, top + 0.5, right - left, bottom - top],  # 0 is the first pixel's border
                "area": detection["pixels"], "segmentation": run_lengths(mask == detection["number"]),
                **{key: detection[key] for key in _COPIED},
            })  # fmt: skip

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
        return f"{len(self._images)} pictures, {len(self._annotations)} annotations"


def run_lengths(mask: np.ndarray) -> dict[str, Any]:
    """Return a mask (height, width) bool as COCO's run lengths: pixels outside, inside, outside ..., by column."""
    pixels = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(pixels[1:] != pixels[:-1])
    counts = np.diff([0, *changes, mask.size])
    return {"size": list(mask.shape), "counts": counts.tolist()}


def check(folder: str) -> None:
    """Raise OSError, in one line, if `folder` cannot be created or is not empty."""
    with writing.name_in_errors(folder):
        if os.path.lexists(folder):
            problem = "is a file" if not os.path.isdir(folder) else "is not empty" if os.listdir(folder) else ""
            if problem:
                raise OSError(0, f"{problem}: a dataset must be written to a new or empty folder")
        elif not os.path.isdir(os.path.dirname(os.path.abspath(folder))):
            raise OSError(0, f"no such folder: {os.path.dirname(os.path.abspath(folder))}")


@contextlib.contextmanager
def writing_to(folder: str, title: str) -> Iterator[Dataset]:
    """Yield a dataset to write; the annotations are written at the end, even after an error. Raises OSError."""
    check(folder)
    with writing.name_in_errors(folder):
        for name in _FOLDERS:
            os.makedirs(os.path.join(folder, name))
    dataset = Dataset(folder, title)
    try:
        yield dataset
    finally:
        dataset.finish()


def _write_png(path: Path, picture: np.ndarray) -> None:
    with writing.name_in_errors(path):
        path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


# ---- recording of a flight without ROS


class TruthRecorder:
    """Adds each new image of a camera to a dataset."""

    def __init__(self, dataset: Dataset, simulation: Simulation, vehicle: str, camera: str):
        """Enable a camera of a vehicle, and record its images in `dataset`."""
        self._dataset = dataset
        self._camera = simulation.vehicles[vehicle].cameras[camera]
        self._camera.viewers.add(lambda: True)
        self._depth_before: np.ndarray | None = None

    def add(self, simulation: Simulation) -> None:
        """Add the camera's image of the last step, if it took one. Raises OSError."""
        truth = self._camera.truth() if self._camera.image is not None else None
        if truth is None:
            return
        truth.want(["depth", "instance", "normal", "before"])
        depth = truth.output("depth")
        flow, known = truth.flow(depth if self._depth_before is None else self._depth_before)
        known &= self._depth_before is not None  # the first image has no flow
        self._depth_before = depth
        arrays = {"depth": depth, "normals": truth.output("normal"), "flow": flow, "flow_known": known}
        picture = cv2.cvtColor(self._camera.look("color"), cv2.COLOR_RGB2BGR)
        self._dataset.add(simulation.time, picture, truth.output("instance"), described(truth.seen()), arrays)

    def __str__(self) -> str:
        return str(self._dataset)


@contextlib.contextmanager
def recording_to(folder: str, simulation: Simulation, vehicle: str, camera: str) -> Iterator[TruthRecorder]:
    """Yield the recorder of a flight. Raises OSError."""
    with writing_to(folder, f"{vehicle}, {camera}") as dataset:
        yield TruthRecorder(dataset, simulation, vehicle, camera)
