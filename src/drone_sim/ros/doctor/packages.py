"""Whether what package.xml names can be imported, drawn with and flown."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree as Xml

from drone_sim.command_line import SEPARATE, installation_of
from drone_sim.files.resources import package_path, python_path
from drone_sim.ros.doctor import HINT, OK, WRONG, Line
from drone_sim.ros.doctor.probe import FLIGHT, RENDERER

TIMEOUT = 60.0  # s, for all of it; two are usual
_MODULES = {"python3-opencv": "cv2", "python3-pil": "PIL", "python3-pycollada-pip": "collada", "python3-tk": "tkinter"}
_NO_MODULES = {"rviz"}
_WITH_A_DISPLAY = {"tkinter"}  # `./dev.sh setup` leaves it out elsewhere
_WITHOUT = {  # what still works where a module is missing
    "tkinter": "`view` writes files instead of opening a window",
    "matplotlib": "plots cannot be drawn",
    "av": "videos cannot be made",
    "jinja2": "`grade --html` writes no report",
    "distributed": "`--scheduler` does not work",
    "scipy": "`sweep --optimize` does not work",
    "tqdm": "`fly` does not work",
}
_SLOW = "PyBullet's TinyRenderer draws pictures instead, at a few frames per second"
_VERSIONS = {"numpy": "numpy", "cv2": "OpenCV", "pybullet": "PyBullet", "pydantic": "pydantic", "lupa": "lupa"}


def modules() -> dict[str, str]:
    """Return the keys of package.xml by the modules that they bring."""
    keys = [str(one.text) for one in Xml.parse(package_path() / "package.xml").iter("exec_depend")]
    named = {_MODULES.get(key, key.removeprefix("python3-").removesuffix("-pip")): key for key in keys}
    return {module: key for module, key in named.items() if key not in _NO_MODULES}


def packages() -> Iterator[Line]:
    """Import them all, draw, and fly, in a process that may die."""
    keys = modules()
    tried = results([*sorted(keys), RENDERER, FLIGHT])
    failed = {name: text for name, (state, text) in tried.items() if state != "ok" and name in keys}
    for name, text in failed.items():
        yield _missing(name, keys[name], text)
    if not failed:
        versions = ", ".join(f"{told} {_version(name, tried[name][1])}" for name, told in _VERSIONS.items())
        yield Line(OK, "packages", f"all {len(keys)} of package.xml can be imported; {versions}")
    state, said = tried[RENDERER]
    cure = f"{_SLOW}; `apt install libegl1 libgl1-mesa-dri`, or a graphics driver with EGL, helps"
    yield Line(OK, "pictures", said) if state == "ok" else Line(HINT, "pictures", f"{said}; {cure}")
    state, said = tried[FLIGHT]
    yield Line(OK, "flight", said) if state == "ok" else Line(WRONG, "flight", f"the test flight failed: {said}")


def _missing(module: str, key: str, why: str) -> Line:
    here = (package_path() / "dev.sh").is_file() and module not in _WITH_A_DISPLAY
    debian = key if key.startswith("python3-") else f"python3-{key.replace('_', '-')}"
    cure = "`./dev.sh setup` installs it" if here else f"`apt install {debian}`, or reinstall drone_sim"
    if module in SEPARATE:
        cure = installation_of(module)
    if module in _WITHOUT:
        return Line(HINT, "packages", f"no {module} ({why}): {_WITHOUT[module]}; {cure}")
    return Line(WRONG, "packages", f"{module} cannot be imported ({why}): {cure}")


def _version(module: str, own: str) -> str:
    from importlib import metadata

    distribution = metadata.packages_distributions().get(module, [module])[0] if not own else module
    try:
        return own or metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "(unknown version)"


def results(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return what the probe says of each name: `ok` or `failed`, and a text. What kills it is named."""
    found: dict[str, tuple[str, str]] = {}
    while len(found) < len(names):
        left = [name for name in names if name not in found]
        output, ended = _probed(left)
        begun = ""
        for line in output.splitlines():
            name, state, text = (*line.split("\t"), "", "")[:3]
            if name in left and state == "begins":
                begun = name
            elif name in left and state in ("ok", "failed"):
                found[name], begun = (state, text), ""
        if len(found) < len(names):  # it died, in the one that it had begun with
            found[begun or next(name for name in names if name not in found)] = ("failed", ended)
    return found


def _probed(names: Sequence[str]) -> tuple[str, str]:
    """Return what the probe printed, and how it ended."""
    # Whatever a devel space has in this package's place.
    environment = {**os.environ, "PYTHONPATH": python_path(os.environ.get("PYTHONPATH", ""))}
    command = [sys.executable, "-m", "drone_sim.ros.doctor.probe", *names]
    try:
        done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired as late:
        return (late.stdout or b"").decode(errors="replace"), f"did not end within {TIMEOUT:g} s"
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
    return done.stdout.decode(errors="replace"), f"ended with {done.returncode}{': ' if last else ''}{''.join(last)}"
