"""`rosrun drone_sim grade PLAN --autograder OUT.zip`: make the zip."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

from drone_sim.files import writing
from drone_sim.files.resources import package_path
from drone_sim.grading.jobs import files
from drone_sim.grading.plan import Plan

_FILES = Path(__file__).parent / "files"
_SOURCE = Path(__file__).resolve().parents[2]
_OF_PACKAGE = ("config", "urdf")  # beside the source
_REQUIREMENTS = "requirements.txt"
_EXECUTABLE = 0o100755 << 16
_DATE = (2000, 1, 1, 0, 0, 0)  # the same zip for the same contents


def write(plan: Plan, seeds: int, path: str | Path) -> None:
    """Write the zip, which flies so many seeds of a plan. No solution is in it.

    Raises ValueError for a plan with files elsewhere, and OSError.
    """
    members = {
        **{name: (_FILES / name).read_bytes() for name in ("setup.sh", "run_autograder")},
        "seeds": f"{seeds}\n".encode(),
        **{name: one.read_bytes() for name, one in (*_package(), *_plan(plan))},
    }
    with writing.replacing(path, binary=True) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name, _DATE)
            info.external_attr = _EXECUTABLE
            archive.writestr(info, content, zipfile.ZIP_DEFLATED)


def _package() -> Iterator[tuple[str, Path]]:
    """Give the files that a flight without ROS needs, by their names in the zip."""
    root = package_path()
    if not (root / _REQUIREMENTS).is_file():
        raise ValueError(f"--autograder: is made from a checkout of drone_sim; {root} has no {_REQUIREMENTS}")
    yield _REQUIREMENTS, root / _REQUIREMENTS
    yield "drone_sim/package.xml", root / "package.xml"
    for path in (*_SOURCE.rglob("*"), *(one for name in _OF_PACKAGE for one in (root / name).rglob("*"))):
        if path.is_file() and "__pycache__" not in path.parts:
            yield f"drone_sim/{path.relative_to(root)}", path


def _plan(plan: Plan) -> Iterator[tuple[str, Path]]:
    """Give the files of a plan, as plan/plan.yaml and beside it; what lies in the package comes with that."""
    for path in files.of_plan(plan, {}):
        if path == plan.path:
            yield "plan/plan.yaml", path
        elif path.is_relative_to(plan.folder):
            yield f"plan/{path.relative_to(plan.folder)}", path
        elif not any(path.is_relative_to(one) for one in (_SOURCE, *(package_path() / name for name in _OF_PACKAGE))):
            raise ValueError(f"--autograder: {path}: the plan needs it, but it is not in the plan's folder")
