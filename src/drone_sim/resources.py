"""Where the files of the package lie: in the source tree, or installed under share/."""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).resolve()


def package_path() -> Path:
    """Return the folder that holds config/, urdf/ and package.xml. Needs no ROS environment."""
    # src/drone_sim/resources.py, or lib/python3/dist-packages/drone_sim/resources.py when installed.
    for folder in (_HERE.parents[2], _HERE.parents[4] / "share" / "drone_sim"):
        if (folder / "package.xml").is_file():
            return folder
    raise FileNotFoundError(f"drone_sim: no config, urdf and package.xml near {_HERE.parent}")


def locate(name: str) -> Path:
    """Return the path behind `package://PACKAGE/...` or `~/...`; any other path as it is.

    Raises FileNotFoundError, in one line, where there is no such package.
    """
    return _in_package(name) if name.startswith("package://") else Path(name).expanduser()


def resolve(name: str) -> Path:
    """Return the absolute path of a file, given as for `locate`.

    Raises FileNotFoundError, in one line, where there is no such package or file.
    """
    path = locate(name)
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {name}")
    return path.resolve()


def _in_package(name: str) -> Path:
    package, _, rest = name[len("package://") :].partition("/")
    if package == "drone_sim":
        return package_path() / rest
    import rospkg  # only other packages need the ROS environment

    try:
        return Path(rospkg.RosPack().get_path(package)) / rest
    except rospkg.ResourceNotFound:
        raise FileNotFoundError(f"no ROS package {package} (in {name})") from None
