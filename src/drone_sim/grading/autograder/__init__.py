"""The autograder for Gradescope: a zip with this package, a plan, and the scripts in `files` that run them."""

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
_PACKAGE_FOLDERS = ("config", "urdf")  # beside the source
_REQUIREMENTS = "requirements.txt"
_EXECUTABLE = 0o100755 << 16
_DATE = (2000, 1, 1, 0, 0, 0)  # constant, so that equal contents give equal zips


def write(plan: Plan, seeds: int, path: str | Path) -> None:
    """Write the zip, which grades with the seeds 0 to `seeds` - 1 of a plan. It contains no solution.

    Raises OSError, and ValueError for a plan with files outside its folder.
    """
    members = {
        **{name: (_FILES / name).read_bytes() for name in ("setup.sh", "run_autograder")},
        "seeds": f"{seeds}\n".encode(),
        **{name: path.read_bytes() for name, path in (*_package_files(), *_plan_files(plan))},
    }
    with writing.replacing(path, binary=True) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            info = zipfile.ZipInfo(name, _DATE)
            info.external_attr = _EXECUTABLE
            archive.writestr(info, content, zipfile.ZIP_DEFLATED)


def _package_files() -> Iterator[tuple[str, Path]]:
    """Yield the files that a flight without ROS needs, each with its name in the zip."""
    root = package_path()
    if not (root / _REQUIREMENTS).is_file():
        raise ValueError(f"--autograder: needs a checkout of drone_sim; {root} has no {_REQUIREMENTS}")
    yield _REQUIREMENTS, root / _REQUIREMENTS
    yield "drone_sim/package.xml", root / "package.xml"
    for path in (*_SOURCE.rglob("*"), *(path for name in _PACKAGE_FOLDERS for path in (root / name).rglob("*"))):
        if path.is_file() and "__pycache__" not in path.parts:
            yield f"drone_sim/{path.relative_to(root)}", path


def _plan_files(plan: Plan) -> Iterator[tuple[str, Path]]:
    """Yield the files of a plan outside the package, with names below plan/ in the zip."""
    packed_folders = (_SOURCE, *(package_path() / name for name in _PACKAGE_FOLDERS))
    for path in files.of_plan(plan, {}):
        if path == plan.path:
            yield "plan/plan.yaml", path
        elif path.is_relative_to(plan.folder):
            yield f"plan/{path.relative_to(plan.folder)}", path
        elif not any(path.is_relative_to(folder) for folder in packed_folders):
            raise ValueError(f"--autograder: {path}: the plan needs it, but it is not in the plan's folder")
